"""The optimiser beside SciPy's other solvers on the same problem, and beside the paper."""

from __future__ import annotations

import contextlib
import time
import warnings
from collections import Counter
from collections.abc import Callable, Iterator
from typing import Any, NamedTuple

import msgspec
import numpy as np
from scipy import optimize

from benchmarks.table import Row, seconds, times
from explorer.errors import DesignError
from explorer.numerics.arrays import BoolArray, FloatArray
from explorer.numerics.compiled import warm
from explorer.optimise.defaults import make_problem
from explorer.optimise.paper import (
    CLEARANCE,
    PAPER_VOLUME,
    paper_problem,
    reach_problem,
)
from explorer.optimise.problem import Problem
from explorer.optimise.search.model import Evaluation, Model
from explorer.optimise.search.starts import more_starts
from explorer.optimise.solver import optimise_design
from explorer.reproduce.search import STARTS

ROUNDS = 5
# The other solvers end once they have what ours has, or after this many evaluations.
ENOUGH, MOST_EVALUATIONS = 1e-9, 1000
# Where no demand is missed by more than this.
MET = 1e-6
RANDOM_STARTS, CONVERGED = 100, 1e-6
POINTS, STEP = 50, 1e-6
# Problems without and with a clearance, by the words of the table.
CASES = (("off", None), (f"on ({CLEARANCE:g})", CLEARANCE))


class Solved(NamedTuple):
    """Result of another solver."""

    iterations: int
    evaluations: int
    objective: float
    duration: float

    @property
    def words(self) -> str:
        """Result in words."""
        return (
            f"F = {self.objective:.1e} after {self.iterations} iterations, "
            f"{self.evaluations} evaluations, {seconds(self.duration)}"
        )


def run() -> Iterator[Row]:
    """Yield the rows."""
    warm()
    yield from _to_the_volume()
    yield from _random_starts()
    yield from _smallest_reach()
    yield _gradients()


def _to_the_volume() -> Iterator[Row]:
    for name, clearance in CASES:
        problem = paper_problem(clearance)
        outcome = min((optimise_design(problem) for _ in range(ROUNDS)), key=lambda o: o.seconds)
        others = {"trust-constr": _trust_constr(problem), "COBYQA": _cobyqa(problem)}
        beside = "; ".join(
            f"{solver}: {other.words}; {times(other.duration / outcome.seconds)}"
            for solver, other in others.items()
        )
        yield Row(
            f"paper-initial to volume {PAPER_VOLUME:g}, interference {name}",
            f"F = {outcome.best.objective:.1e} after {outcome.iterations} iterations, "
            f"{outcome.evaluations} evaluations, {seconds(outcome.seconds)}"
            + ("" if clearance is None else " with the clearance looked for everywhere"),
            "F ≤ 1e-9, 15 iterations, 0.5 s",
            f"the paper: F = 1e-3 after 220 iterations; {beside}",
        )


class _Watched:
    """A model that another solver works on; it ends as soon as the volume is matched.

    Unlike ours it does not look for legs that meet between the positions of the problem.
    """

    def __init__(self, problem: Problem) -> None:
        self.model = Model(problem, problem.start_values)
        self.best = np.inf
        self.last: Evaluation = self.model.at(self.model.start)

    def at(self, u: FloatArray) -> Evaluation:
        try:
            self.last = self.model.at(np.asarray(u, dtype=np.float64))
        except DesignError:
            return self.last
        if self.model.worst(self.last)[0] >= -MET:
            self.best = min(self.best, self.model.reported(self.last))
        if self.best <= ENOUGH or self.model.evaluations >= MOST_EVALUATIONS:
            raise StopIteration
        return self.last

    def demands(self, which: BoolArray, high: float, **options: Any) -> Any:
        """Return the demands from zero to an end, as SciPy's other solvers take them."""

        def values(u: FloatArray) -> FloatArray:
            return self.at(u).values[which]

        def gradients(u: FloatArray) -> FloatArray:
            return self.at(u).gradients[which]

        constraint: Any = optimize.NonlinearConstraint
        return constraint(values, 0.0, high, jac=gradients, **options)


def _constant(value: Any) -> Callable[[FloatArray], Any]:
    def function(_: FloatArray) -> Any:
        return value

    return function


def _trust_constr(problem: Problem) -> Solved:
    """Solve it as ours does: no objective, the volume as an equality, exact gradients."""
    watched = _Watched(problem)
    n, equal = len(watched.model.start), watched.model.equalities
    return _solved(
        watched,
        _constant(0.0),
        "trust-constr",
        constraints=[
            watched.demands(equal, 0.0, hess=optimize.BFGS()),
            watched.demands(~equal, np.inf, hess=optimize.BFGS()),
        ],
        jac=_constant(np.zeros(n)),
        hess=_constant(np.zeros((n, n))),
        options={"maxiter": MOST_EVALUATIONS, "gtol": 1e-12, "xtol": 1e-14},
    )


def _cobyqa(problem: Problem) -> Solved:
    """Solve it without gradients: the square of what the volume misses is minimised."""
    watched = _Watched(problem)
    equal = watched.model.equalities
    return _solved(
        watched,
        lambda u: float(watched.at(u).values[equal][0] ** 2),
        "COBYQA",
        constraints=[watched.demands(~equal, np.inf)],
        options={
            "maxiter": MOST_EVALUATIONS,
            "maxfev": MOST_EVALUATIONS,
            "initial_tr_radius": 0.1,
            "final_tr_radius": 1e-12,
        },
    )


def _solved(
    watched: _Watched, objective: Callable[[FloatArray], float], method: str, **arguments: Any
) -> Solved:
    minimize: Any = optimize.minimize
    model, iterations = watched.model, 0

    def count(*_: Any, **__: Any) -> None:
        nonlocal iterations
        iterations += 1

    began = time.perf_counter()
    # The solvers may wrap what ends them; what they say of linear demands matters to nobody.
    with contextlib.suppress(StopIteration, RuntimeError), warnings.catch_warnings():
        warnings.simplefilter("ignore")
        minimize(
            objective,
            model.start,
            method=method,
            bounds=optimize.Bounds(*model.bounds.T),
            callback=count,
            **arguments,
        )
    return Solved(iterations, model.evaluations, watched.best, time.perf_counter() - began)


def _random_starts() -> Iterator[Row]:
    for name, clearance in CASES:
        problem = paper_problem(clearance)
        found = [
            optimise_design(msgspec.structs.replace(problem, start=problem.design_at(values)))
            for values in more_starts(problem, RANDOM_STARTS, seed=1)
        ]
        good = sum(each.converged and each.best.value <= CONVERGED for each in found)
        at_once = sum(each.converged and each.run.attempts == 1 for each in found)
        steps = np.median([each.iterations for each in found])
        yield Row(
            f"{RANDOM_STARTS} random starts on it, interference {name}",
            f"{good} converge to F ≤ {CONVERGED:g}, {at_once} without going on elsewhere; median "
            f"{steps:.0f} iterations, {seconds(float(np.median([e.seconds for e in found])))}",
            f"97 to F ≤ {CONVERGED:g}",
        )


def _smallest_reach() -> Iterator[Row]:
    for name, clearance in CASES:
        outcomes = [optimise_design(reach_problem(clearance), starts=STARTS) for _ in range(ROUNDS)]
        outcome, median = outcomes[0], float(np.median([each.seconds for each in outcomes]))
        ends = Counter(f"{run.best.objective:.2f} ({run.status})" for run in outcome.runs)
        spread = ", ".join(f"{many} at {end}" for end, many in sorted(ends.items()))
        yield Row(
            f"smallest reach for the volume of the paper's optimum, interference {name}",
            f"{outcome.best.objective:.4f} ({outcome.status}); of {STARTS} starts {spread}; "
            f"{seconds(median)}",
            "17.90" if clearance is None else "17.90, 4 s",
            "the paper: 20.42",
        )


def _gradients() -> Row:
    """Compare every gradient with central differences, over the larger of its size and one."""
    problem = make_problem(
        paper_problem().start,
        "largest-margin",
        volume=7000.0,
        reach=20.0,
        clearance=CLEARANCE,
        stroke_ratio=6.0,
        required_box=((8.0, 4.0, 6.0), (12.0, 8.0, 10.0)),
        free=["yaw", "shift-x", "shift-y", "shift-z"],
    )
    model, random, worst = Model(problem, problem.start_values), np.random.default_rng(0), 0.0
    done = 0
    while done < POINTS:
        u = model.start + 0.06 * random.normal(size=len(model.start))
        try:
            at = model.at(u)
        except DesignError:
            continue
        rows = np.column_stack(
            [
                (model.at(u + STEP * unit).values - model.at(u - STEP * unit).values) / (2.0 * STEP)
                for unit in np.eye(len(u))
            ]
        )
        size = np.maximum(1.0, np.abs(rows).max(axis=1, keepdims=True))
        worst = max(worst, float((np.abs(at.gradients - rows) / size).max()))
        done += 1
    return Row(
        f"largest error of {len(model.names)} gradients at {POINTS} random points",
        f"{worst:.1e}",
        "1e-5 of central differences",
    )
