"""SciPy's SLSQP, with a call for every accepted iterate, and the record of a search's iterates.

SLSQP evaluates gradients only at iterates that it accepts, which distinguishes them from the trial
points of its line searches.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from explorer.errors import DesignError
from explorer.numerics.arrays import BoolArray, FloatArray
from explorer.optimise.outcome import Iterate, Phase
from explorer.optimise.problem import Problem
from explorer.optimise.search.demands.geometry import MET
from explorer.optimise.search.model import MISSED, Evaluation, Model, reported_objective
from explorer.optimise.search.state import State

# SLSQP stops by itself once the objective changes by less than this.
PRECISION = 1e-14

Values = Callable[[FloatArray], FloatArray]


class Stop(Exception):  # noqa: N818 - a signal, not an error
    """Raised by a callback to end the solver where it is."""


class Ended(NamedTuple):
    """End of a solver: the last evaluation and the number of steps."""

    last: Evaluation
    steps: int


def slsqp(
    objective: Callable[[FloatArray], float],
    slope: Values,
    start: FloatArray,
    bounds: FloatArray,
    demands: list[tuple[str, Values, Values]],
    *,
    most: int,
    precision: float,
) -> FloatArray:
    """Return the variables at which SLSQP ends, within the bounds, shape (n,).

    The demands are ("eq" or "ineq", values (m,), gradients (m, n)): zero, or at least zero. The
    bounds are lows and highs, shape (n, 2), infinite for none.
    """
    from scipy import optimize

    minimize: Any = optimize.minimize
    lows, highs = bounds.T
    result = minimize(
        objective,
        np.clip(start, lows, highs),
        jac=slope,
        method="SLSQP",
        bounds=bounds,
        constraints=[{"type": kind, "fun": f, "jac": jac} for kind, f, jac in demands],
        options={"maxiter": most, "ftol": precision},
    )
    return np.clip(np.asarray(result.x, dtype=np.float64), lows, highs)


def solve(
    model: Model, start: FloatArray, *, see: Callable[[Evaluation], None], most: int
) -> Ended:
    """Run SLSQP on a model from scaled variables, to the end or until `Stop` is raised.

    Each accepted iterate is seen, the start among them.
    """
    seen: list[Evaluation] = []

    def at(u: FloatArray) -> Evaluation | None:
        try:
            return model.at(u)
        except DesignError:
            return None

    def objective(u: FloatArray) -> float:
        evaluation = at(u)
        return evaluation.objective if evaluation else MISSED

    def slope(u: FloatArray) -> FloatArray:
        evaluation = at(u)
        if evaluation is None:
            return np.zeros(len(u))
        if not (seen and np.array_equal(seen[-1].u, evaluation.u)):
            seen.append(evaluation)
            see(evaluation)
        return evaluation.slope

    def demands_of(kind: str, which: BoolArray) -> tuple[str, Values, Values]:
        count = int(which.sum())

        def values(u: FloatArray) -> FloatArray:
            evaluation = at(u)
            return evaluation.values[which] if evaluation else np.full(count, -MISSED)

        def gradients(u: FloatArray) -> FloatArray:
            evaluation = at(u)
            return evaluation.gradients[which] if evaluation else np.zeros((count, len(u)))

        return kind, values, gradients

    equal = model.equalities
    kinds = (("eq", equal), ("ineq", ~equal))
    demands = [demands_of(kind, which) for kind, which in kinds if which.any()]
    try:
        u = slsqp(objective, slope, start, model.bounds, demands, most=most, precision=PRECISION)
        last = at(u)
        if last is not None and not np.array_equal(seen[-1].u, last.u):
            seen.append(last)
            see(last)
    except Stop:
        pass
    return Ended(seen[-1], len(seen) - 1)


Watch = Callable[[Iterate], None]


class Trail:
    """Every iterate of an optimisation.

    Args:
        problem: The problem.
        watch: Called with every iterate.
        stop: Called before each evaluation; True ends the search.
    """

    def __init__(
        self, problem: Problem, watch: Watch | None, stop: Callable[[], bool] | None
    ) -> None:
        self.problem = problem
        self.history: list[Iterate] = []
        self.is_cancelled = False
        self.run = 0
        self._watch = watch
        self._stop = stop
        self._best: Iterate | None = None

    def before_each(self) -> None:
        """Raise `Stop` before an evaluation if the search is to end.

        Raises:
            Stop: the search is to end here.
        """
        if self.is_cancelled or (self._stop is not None and self._stop()):
            self.is_cancelled = True
            raise Stop

    def begin(self) -> None:
        """Forget the best iterate: only iterates that follow count."""
        self._best = None

    @property
    def best(self) -> Iterate:
        """Best iterate since `begin`; the last one of all if there is none."""
        return self._best or self.history[-1]

    def last_at(self, state: State) -> Iterate:
        """Return the last iterate at a place that has been recorded."""
        values = tuple(state.values.tolist())
        return next(iterate for iterate in reversed(self.history) if iterate.values == values)

    def see(self, model: Model, at: Evaluation, phase: Phase) -> None:
        """Record an iterate of the solver."""
        spare, worst = model.worst_of_all(at)
        self._add(at.state, phase, worst, spare)

    def see_opening(self, state: State, worst: str) -> None:
        """Record an iterate on the way to a workspace that is not empty."""
        self._add(state, "opening", worst, 0.0 if state.volume > 0.0 else -1.0)

    def _add(self, state: State, phase: Phase, worst: str, spare: float) -> None:
        objective = reported_objective(self.problem, state)
        iterate = Iterate(
            number=len(self.history),
            run=self.run,
            phase=phase,
            design=state.design,
            values=tuple(state.values.tolist()),
            objective=objective if math.isfinite(objective) else None,
            volume=state.volume,
            worst=worst,
            spare=spare,
        )
        if self._best is None or self.rank(iterate) <= self.rank(self._best):
            self._best = iterate
        self.history.append(iterate)
        if self._watch is not None:
            self._watch(iterate)

    def rank(self, iterate: Iterate) -> tuple[bool, float, float]:
        """Return the key that sorts iterates, the best first.

        Those without a workspace come last; the demand missed most decides, then the objective.
        """
        problem = self.problem
        missed = max(0.0, -iterate.spare)
        if problem.objective != "match-volume" and problem.demands.volume is not None:
            short = 1.0 - iterate.volume / problem.demands.volume
            missed = max(missed, short) if short > MET else missed
        larger = problem.objective in ("largest-volume", "largest-margin")
        return iterate.volume <= 0.0, missed, -iterate.value if larger else iterate.value
