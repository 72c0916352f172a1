"""Steps to an optimum: SciPy's SLSQP with the record of its iterates, and the test of its end.

SLSQP evaluates gradients only at iterates that it accepts, which distinguishes them from the trial
points of its line searches. Its own verdict only says that its steps became small. At an optimum
the slope of the objective is a sum of the gradients of the demands and bounds that are just met,
those of inequalities with a factor of at least zero (Karush, Kuhn and Tucker).

Volumes have kinks where two limits become the same surface, and optima like to lie there:
the workspace is largest for its reach where the balls of legs 1 and 4 are one. There the
gradients all around take part, each as if it were one more demand (J. V. Burke, A. S.
Lewis, M. L. Overton, "A robust gradient sampling algorithm", 2005).

A solver that lowers an objective ends where rounding keeps it from lowering both that and the
misses, which are then larger than the tolerance of limits. From there each step is the shortest
that meets the demands to first order, found by least distance programming (C. L. Lawson, R. J.
Hanson, "Solving Least Squares Problems", 1974, chapter 23).
"""

from __future__ import annotations

import contextlib
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import partial
from typing import Any, NamedTuple

import numpy as np

from explorer.errors import DesignError
from explorer.numerics.arrays import BoolArray, FloatArray
from explorer.optimise.outcome import Iterate, Phase
from explorer.optimise.problem import Problem
from explorer.optimise.search.demands import MET
from explorer.optimise.search.model import MISSED, Evaluation, SearchModel, reported_objective
from explorer.optimise.search.state import SearchState

# SLSQP stops by itself once the objective changes by less than this.
PRECISION = 1e-14

Point = tuple[float, FloatArray, FloatArray, FloatArray]
"""An objective with its slope (n,), and the values (m,) and gradients (m, n) of demands."""


class Stop(Exception):  # noqa: N818 - a signal, not an error
    """Raised by a callback to end the solver where it is."""


def slsqp(
    evaluate: Callable[[FloatArray], Point],
    see: Callable[[FloatArray], None],
    start: FloatArray,
    bounds: FloatArray,
    equal: BoolArray,
    *,
    most: int,
    precision: float,
) -> FloatArray:
    """Return the variables at which SLSQP ends, within lows and highs (n, 2), shape (n,).

    Each accepted iterate is seen. The values of the demands are to be zero where they are to be
    equal (m,), and else at least zero. Where there is no design, all are missed by far.
    """
    from scipy import optimize

    last: list[tuple[FloatArray, Point]] = []

    def at(x: FloatArray) -> Point:
        if not (last and np.array_equal(last[0][0], x)):
            no_demand = np.full(len(equal), -MISSED), np.zeros((len(equal), len(x)))
            point = MISSED, np.zeros(len(x)), *no_demand
            with contextlib.suppress(DesignError):
                point = evaluate(x)
            last[:] = [(x.copy(), point)]
        return last[0][1]

    def objective(x: FloatArray) -> float:
        return at(x)[0]

    def slope(x: FloatArray) -> FloatArray:
        found = at(x)[1]
        see(x)
        return found

    def demand(which: BoolArray, part: int, x: FloatArray) -> FloatArray:
        return at(x)[2:][part][which]

    minimize: Any = optimize.minimize
    lows, highs = bounds.T
    result = minimize(
        objective,
        np.clip(start, lows, highs),
        jac=slope,
        method="SLSQP",
        bounds=bounds,
        constraints=[
            {"type": kind, "fun": partial(demand, which, 0), "jac": partial(demand, which, 1)}
            for kind, which in (("eq", equal), ("ineq", ~equal))
            if which.any()
        ],
        options={"maxiter": most, "ftol": precision},
    )
    return np.clip(np.asarray(result.x, dtype=np.float64), lows, highs)


def solve(
    model: SearchModel, start: FloatArray, *, see: Callable[[Evaluation], None], most: int
) -> tuple[Evaluation, int]:
    """Run SLSQP on a model from scaled variables, to the end or until `Stop` is raised.

    Each iterate is seen, the start among them. Return the last one and the number of steps.
    """
    accepted: list[Evaluation] = []

    def evaluate(u: FloatArray) -> Point:
        at = model.at(u)
        return at.objective, at.slope, at.values, at.gradients

    def accept(u: FloatArray) -> None:
        try:
            at = model.at(u)
        except DesignError:
            return
        if not (accepted and np.array_equal(accepted[-1].u, at.u)):
            accepted.append(at)
            see(at)

    bounds, equal = model.bounds, model.equalities
    with contextlib.suppress(Stop):
        u = slsqp(evaluate, accept, start, bounds, equal, most=most, precision=PRECISION)
        accept(u)
    return accepted[-1], len(accepted) - 1


@dataclass
class Trail:
    """Every iterate of an optimisation; `watch` is called with each.

    What `stop` returns before an evaluation says whether it ends the search.
    """

    problem: Problem
    watch: Callable[[Iterate], None] | None = None
    stop: Callable[[], bool] | None = None
    run: int = 0
    history: list[Iterate] = field(default_factory=list[Iterate])
    is_cancelled: bool = False
    _best: Iterate | None = None

    def before_each(self) -> None:
        """Raise `Stop` before an evaluation if the search is to end."""
        if self.is_cancelled or (self.stop is not None and self.stop()):
            self.is_cancelled = True
            raise Stop

    def begin(self) -> None:
        """Forget the best iterate: only iterates that follow count."""
        self._best = None

    @property
    def best(self) -> Iterate:
        """Best iterate since `begin`; the last one of all if there is none."""
        return self._best or self.history[-1]

    def last_at(self, state: SearchState) -> Iterate:
        """Return the last iterate at a place that has been recorded."""
        values = tuple(state.values.tolist())
        return next(iterate for iterate in reversed(self.history) if iterate.values == values)

    def see(self, model: SearchModel, at: Evaluation, phase: Phase) -> None:
        """Record an iterate of the solver."""
        spare, worst = model.worst_of_all(at)
        self.add(at.state, phase, worst, spare)

    def add(self, state: SearchState, phase: Phase, worst: str, spare: float) -> None:
        """Record an iterate with its worst demand, and what that has to spare."""
        iterate = Iterate(
            number=len(self.history),
            run=self.run,
            phase=phase,
            design=state.design,
            values=tuple(state.values.tolist()),
            objective=reported_objective(self.problem, state),
            volume=state.volume,
            worst=worst,
            spare=spare,
        )
        if self._best is None or self.rank(iterate) <= self.rank(self._best):
            self._best = iterate
        self.history.append(iterate)
        if self.watch is not None:
            self.watch(iterate)

    def rank(self, iterate: Iterate) -> tuple[bool, float, float]:
        """Return the key that sorts iterates, the best first.

        Those without a workspace come last; the demand missed most decides, then the objective.
        """
        problem = self.problem
        missed = max(0.0, -iterate.spare)
        if problem.objective != "match-volume" and problem.demands.volume is not None:
            short = 1.0 - iterate.volume / problem.demands.volume
            missed = max(missed, short) if short > MET else missed
        sign = -1.0 if problem.objective == "largest-volume" else 1.0
        return iterate.volume <= 0.0, missed, sign * iterate.objective


# A demand or bound with less than this to spare takes part.
ACTIVE = 1e-6
# An optimum's conditions hold if their residual is below this.
OPTIMAL = 1e-5
# Distance at which gradients about a possible kink are sampled, and how many for each variable.
AROUND = 1e-5
SAMPLES = 6


class Optimality(NamedTuple):
    """How nearly the conditions hold.

    The residual is the remainder of the slope that no such sum makes up, as a share of the slope;
    `holding` is the demand or bound with the largest factor, "" if none has one.
    """

    residual: float
    holding: str

    @property
    def is_optimal(self) -> bool:
        """Whether the conditions hold."""
        return self.residual <= OPTIMAL


def optimality(model: SearchModel, at: Evaluation, *, kinks: bool = True) -> Optimality:
    """Return how nearly a place that meets all demands is an optimum.

    To see an optimum in a kink takes many evaluations.
    """
    smooth = _conditions(model, at, [at])
    if smooth.is_optimal or not kinks or model.problem.objective == "match-volume":
        return smooth
    return min(smooth, _conditions(model, at, [at, *_sample_nearby(model, at)]))


def _sample_nearby(model: SearchModel, at: Evaluation) -> list[Evaluation]:
    """Return the problem at places close by, within the bounds."""
    lows, highs = model.bounds.T
    random = np.random.default_rng(0)
    nearby: list[Evaluation] = []
    for _ in range(SAMPLES * len(at.u)):
        step = random.normal(size=len(at.u))
        step *= AROUND / float(np.linalg.norm(step))
        try:
            nearby.append(model.at(np.clip(at.u + step, lows, highs)))
        except DesignError:
            continue
    return nearby


def _conditions(model: SearchModel, at: Evaluation, around: list[Evaluation]) -> Optimality:
    """Return how nearly the conditions hold with the gradients at some places."""
    from scipy.optimize import nnls

    active: list[tuple[str, FloatArray]] = []
    for index, (value, name) in enumerate(zip(at.values.tolist(), model.names, strict=True)):
        if model.equalities[index] or value <= ACTIVE:
            # An equality may pull either way.
            signs = (1.0, -1.0) if model.equalities[index] else (1.0,)
            active += [(name, s * place.gradients[index]) for place in around for s in signs]
    ends = zip(model.problem.names, np.eye(len(at.u)), at.u, *model.bounds.T, strict=True)
    for variable, unit, here, low, high in ends:
        if here <= low + ACTIVE:
            active.append((f"lower bound of {variable}", unit))
        if here >= high - ACTIVE:
            active.append((f"upper bound of {variable}", -unit))
    steepness = float(np.linalg.norm(at.slope))
    if steepness == 0.0:
        return Optimality(0.0, "")
    slopes = np.array([place.slope for place in around]).T
    # Some mean of the slopes less some sum of the gradients is to be nothing; the last row
    # makes it a mean.
    demands = np.array([row for _, row in active]).reshape(-1, len(at.u)).T
    last_row = np.hstack([np.ones(slopes.shape[1]), np.zeros(len(active))])
    columns = np.vstack([np.hstack([slopes, -demands]) / steepness, last_row])
    goal = np.zeros(len(at.u) + 1)
    goal[-1] = 1.0
    factors, residual = nnls(columns, goal)
    pulls = factors[len(around) :] * np.linalg.norm(demands, axis=0)
    has_pull = pulls.max(initial=0.0) > 0.0
    return Optimality(float(residual), active[int(pulls.argmax())][0] if has_pull else "")


# Demands that are missed by more than this, dimensionless, are not missed by little.
NEARLY = 1e-6
# Each step squares the misses.
MOST_STEPS = 4
# Below this residual no step meets the demands to first order.
CONTRADICTION = 1e-9
# Cap on what a demand has to spare, over the worst miss.
FAR = 1e3


def nearest_feasible(model: SearchModel, at: Evaluation) -> Evaluation | None:
    """Return the nearest evaluation that meets all demands; None if no step leads to one."""
    lows, highs = model.bounds.T
    for _ in range(MOST_STEPS):
        spare = model.worst(at)[0]
        if spare >= 0.0:
            break
        missed = np.abs(at.values[model.equalities]).max(initial=-spare)
        step = _shortest(model, at) if missed <= NEARLY else None
        if step is None:
            return None
        try:
            at = model.at(np.clip(at.u + step, lows, highs))
        except DesignError:
            return None
    return at if model.worst(at)[0] >= 0.0 else None


def _shortest(model: SearchModel, at: Evaluation) -> FloatArray | None:
    """Return the shortest step that meets all demands and bounds to first order."""
    from scipy.optimize import nnls

    lows, highs = model.bounds.T
    equal, identity = model.equalities, np.eye(len(at.u))
    low, high = np.isfinite(lows), np.isfinite(highs)
    # The step is to make rows · step at least what is missing.
    rows = np.vstack([at.gradients, -at.gradients[equal], identity[low], -identity[high]])
    to_bounds = (lows - at.u)[low], (at.u - highs)[high]
    missing = np.concatenate([-at.values, at.values[equal], *to_bounds])
    # The step is proportional to the misses, so these may be in units of the worst one.
    unit = missing.max()
    goal = np.zeros(len(at.u) + 1)
    goal[-1] = 1.0
    matrix = np.vstack([rows.T, np.maximum(missing / unit, -FAR)])
    factors, norm = nnls(matrix, goal)
    if norm <= CONTRADICTION:
        return None
    residual = matrix @ factors - goal
    return -unit * residual[:-1] / residual[-1]
