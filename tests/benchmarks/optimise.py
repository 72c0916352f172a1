"""The optimiser beside SciPy's `trust-constr` on the same problem, and beside the paper."""

from __future__ import annotations

import contextlib
import time
import warnings
from collections import Counter
from collections.abc import Callable, Iterator
from typing import Any

import msgspec
import numpy as np
from scipy import optimize

from benchmarks.table import Row, seconds, times
from explorer.errors import DesignError
from explorer.numerics.arrays import BoolArray, FloatArray
from explorer.numerics.compiled import warm
from explorer.optimise.defaults import CLEARANCE, PAPER_VOLUME, paper_problem, reach_problem
from explorer.optimise.problem import Problem
from explorer.optimise.search.model import Evaluation, SearchModel, reported_objective
from explorer.optimise.search.starts import more_starts
from explorer.optimise.solver import optimise_design
from explorer.reproduce.optima import STARTS

ROUNDS = 5
# The other solver ends once it has what ours has, or after this many evaluations.
ENOUGH, MOST_EVALUATIONS = 1e-9, 1000
# Where no demand is missed by more than this.
MET = 1e-6
RANDOM_STARTS, CONVERGED = 100, 1e-6
SHORT = {"ROUNDS": 1, "MOST_EVALUATIONS": 20, "RANDOM_STARTS": 2, "STARTS": 1}
# Problems without and with a clearance, by the words of the table.
CASES = (("off", None), (f"on ({CLEARANCE:g})", CLEARANCE))


def run() -> Iterator[Row]:
    """Yield the rows."""
    warm()
    for name, clearance in CASES:
        yield _to_the_volume(name, clearance)
        yield _random_starts(name, clearance)
        yield _smallest_reach(name, clearance)


def _to_the_volume(name: str, clearance: float | None) -> Row:
    problem = paper_problem(clearance)
    outcome = min((optimise_design(problem) for _ in range(ROUNDS)), key=lambda o: o.seconds)
    best, evaluations, duration = _by_trust_constr(problem)
    return Row(
        f"paper-initial to volume {PAPER_VOLUME:g}, interference {name}",
        f"F = {outcome.best.objective:.1e} after {outcome.iterations} iterations, "
        f"{outcome.evaluations} evaluations, {seconds(outcome.seconds)}",
        "F ≤ 1e-9, 15 iterations, 0.5 s",
        f"the paper: F = 1e-3 after 220 iterations; trust-constr: F = {best:.1e} after "
        f"{evaluations} evaluations, {seconds(duration)}; {times(duration / outcome.seconds)}",
    )


class _Watched:
    """A model that another solver works on; it ends as soon as the volume is matched.

    Unlike ours it does not look for legs that meet between the positions of the problem.
    """

    def __init__(self, problem: Problem) -> None:
        self.model = SearchModel(problem, problem.start_values)
        self.best = np.inf
        self.last: Evaluation = self.model.at(self.model.start)

    def at(self, u: FloatArray) -> Evaluation:
        try:
            self.last = self.model.at(np.asarray(u, dtype=np.float64))
        except DesignError:
            return self.last
        if self.model.worst(self.last)[0] >= -MET:
            self.best = min(self.best, reported_objective(self.model.problem, self.last.state))
        if self.best <= ENOUGH or self.model.evaluations >= MOST_EVALUATIONS:
            raise StopIteration
        return self.last

    def demands(self, which: BoolArray, high: float) -> Any:
        """Return the demands from zero to an end, as SciPy's solver takes them."""

        def values(u: FloatArray) -> FloatArray:
            return self.at(u).values[which]

        def gradients(u: FloatArray) -> FloatArray:
            return self.at(u).gradients[which]

        constraint: Any = optimize.NonlinearConstraint
        return constraint(values, 0.0, high, jac=gradients, hess=optimize.BFGS())


def _by_trust_constr(problem: Problem) -> tuple[float, int, float]:
    """Solve it as ours does: no objective, the volume as an equality, exact gradients.

    Returns:
        The best F, the number of evaluations and the seconds.
    """
    watched = _Watched(problem)
    minimize: Any = optimize.minimize
    model, equal = watched.model, watched.model.equalities
    zeros = np.zeros(len(model.start))

    def constant(value: Any) -> Callable[[FloatArray], Any]:
        return lambda _: value

    began = time.perf_counter()
    # The solver may wrap what ends it; what it says of linear demands matters to nobody.
    with contextlib.suppress(StopIteration, RuntimeError), warnings.catch_warnings():
        warnings.simplefilter("ignore")
        minimize(
            constant(0.0),
            model.start,
            method="trust-constr",
            bounds=optimize.Bounds(*model.bounds.T),
            constraints=[watched.demands(equal, 0.0), watched.demands(~equal, np.inf)],
            jac=constant(zeros),
            hess=constant(np.outer(zeros, zeros)),
            options={"maxiter": MOST_EVALUATIONS, "gtol": 1e-12, "xtol": 1e-14},
        )
    return watched.best, model.evaluations, time.perf_counter() - began


def _random_starts(name: str, clearance: float | None) -> Row:
    problem = paper_problem(clearance)
    found = [
        optimise_design(msgspec.structs.replace(problem, start=problem.design_at(values)))
        for values in more_starts(problem, RANDOM_STARTS, seed=1)
    ]
    good = sum(each.converged and each.best.objective <= CONVERGED for each in found)
    steps = np.median([each.iterations for each in found])
    duration = float(np.median([each.seconds for each in found]))
    return Row(
        f"{RANDOM_STARTS} random starts on it, interference {name}",
        f"{good} converge to F ≤ {CONVERGED:g}; median {steps:.0f} iterations, {seconds(duration)}",
        f"97 to F ≤ {CONVERGED:g}",
    )


def _smallest_reach(name: str, clearance: float | None) -> Row:
    outcomes = [optimise_design(reach_problem(clearance), starts=STARTS) for _ in range(ROUNDS)]
    outcome, median = outcomes[0], float(np.median([each.seconds for each in outcomes]))
    ends = Counter(
        f"{outcome.history[run.best].objective:.2f} ({run.status})" for run in outcome.runs
    )
    spread = ", ".join(f"{many} at {end}" for end, many in sorted(ends.items()))
    return Row(
        f"smallest reach for the volume of the paper's optimum, interference {name}",
        f"{outcome.best.objective:.4f} ({outcome.status}); of {STARTS} starts {spread}; "
        f"{seconds(median)}",
        "17.90" if clearance is None else "17.90, 4 s",
        "the paper: 20.42",
    )
