"""A problem as the functions that an SQP solver needs, over scaled variables."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from explorer.errors import DesignError
from explorer.numerics.arrays import BoolArray, FloatArray
from explorer.optimise.problem import Problem
from explorer.optimise.search import clearance_demand, demands
from explorer.optimise.search.state import SearchState, bounds_of, scales

MISSED = 1e3
"""Value of an objective that is not finite or of no design; with a minus, of such a demand."""


@dataclass(frozen=True)
class Evaluation:
    """A problem evaluated at scaled variables u (n,), with its state there.

    The objective to minimise is about of unit size and has a slope (n,); the values of all demands
    (m,) have gradients (m, n).
    """

    u: FloatArray
    state: SearchState
    objective: float
    slope: FloatArray
    values: FloatArray
    gradients: FloatArray


class SearchModel:
    """A problem from values of its variables to start from, ready for a solver.

    What is called before each evaluation may raise, to end the search. A relaxed problem leaves out
    the clearance, by far the most expensive demand.
    """

    def __init__(
        self,
        problem: Problem,
        start: Sequence[float],
        before_each: Callable[[], None] = lambda: None,
        *,
        is_relaxed: bool = False,
    ) -> None:
        self.problem = problem
        self.is_relaxed = is_relaxed
        self._before_each = before_each
        u = np.array(start) / scales(problem)
        here = SearchState(problem, u)
        wanted, is_matched = problem.demands, problem.objective == "match-volume"
        self.demands: list[demands.SearchDemand] = []
        if wanted.volume is not None:
            self.demands.append(demands.volume_demand(wanted.volume, is_equality=is_matched))
        if wanted.reach is not None:
            self.demands.append(demands.reach_demand(wanted.reach))
        self.demands += demands.side_demands(here)
        self._clearance: clearance_demand.ClearanceDemand | None = None
        if wanted.clearance is not None:
            positions = clearance_demand.first_positions(problem, here.design)
            self._clearance = clearance_demand.ClearanceDemand(wanted.clearance, positions)
            if not is_relaxed:
                names = clearance_demand.NAMES
                self.demands.append(demands.SearchDemand(names, self._clearance.measure))
        self.start: FloatArray = u
        self.bounds = bounds_of(problem)
        """Lows and highs of the scaled variables, shape (n, 2)."""
        self._volume = wanted.volume or here.volume or problem.size**3
        self._last: Evaluation | None = None
        self.evaluations = 0

    @property
    def names(self) -> tuple[str, ...]:
        """The names of all demands, m of them."""
        return tuple(name for demand in self.demands for name in demand.names)

    @property
    def equalities(self) -> BoolArray:
        """Which demands are equalities, shape (m,), boolean."""
        return np.array([each.is_equality for each in self.demands for _ in each.names], dtype=bool)

    @property
    def limits(self) -> BoolArray:
        """Which demands are limits of the design, shape (m,), boolean."""
        return np.array([each.is_limit for each in self.demands for _ in each.names], dtype=bool)

    def look_at_unproven(self, at: Evaluation) -> list[clearance_demand.UnprovenClearance]:
        """Return the pairs that are not proven apart at a place, even if the problem is relaxed.

        The clearance is demanded from now on where these come nearest too.
        """
        if self._clearance is None:
            return []
        self._before_each()
        self._last = None
        return self._clearance.look_at_unproven(at.state)

    def at(self, u: FloatArray) -> Evaluation:
        """Return the evaluation at scaled variables; the last one is remembered.

        Raises:
            DesignError: A degenerate design.
        """
        if self._last is None or not np.array_equal(self._last.u, u):
            self.evaluations += 1
            self._last = self._evaluate(np.array(u, dtype=np.float64))
        return self._last

    def _evaluate(self, u: FloatArray) -> Evaluation:
        self._before_each()
        state = SearchState(self.problem, u)
        if not np.isfinite(u).all():
            raise DesignError("the solver tried a design that is not finite")
        # A problem may demand nothing.
        values, gradients = [np.zeros(0)], [np.zeros((0, len(u)))]
        for demand in self.demands:
            value, gradient = demand.measure(state)
            values.append(value)
            gradients.append(gradient)
        objective, slope = self._objective(state)
        every, rows = np.concatenate(values), np.vstack(gradients)
        return Evaluation(
            u,
            state,
            objective,
            np.where(np.isfinite(slope), slope, 0.0),
            np.where(np.isfinite(every), every, -MISSED),
            np.where(np.isfinite(rows), rows, 0.0),
        )

    def _objective(self, state: SearchState) -> tuple[float, FloatArray]:
        match self.problem.objective:
            case "match-volume":
                # Each step is the smallest that meets the volume demand to first order.
                return 0.0, np.zeros(len(state.u))
            case "smallest-reach":
                value, gradient = state.longest_leg
                return value / self.problem.size, gradient / self.problem.size
            case "largest-volume":
                root, gradient = state.volume_root(self._volume)
                return -root, -gradient

    def worst(self, at: Evaluation) -> tuple[float, str]:
        """Return value and name of the inequality that is missed most or has the least to spare.

        The value is below zero only if it is missed by more than the tolerance of limits, or `MET`.
        """
        if self.equalities.all():
            return 0.0, ""
        allowed = np.where(self.limits, at.state.design.tolerance / self.problem.size, demands.MET)
        spare = np.where(self.equalities, np.inf, at.values + allowed)
        index = int(spare.argmin())
        value = float(at.values[index])
        return value if spare[index] < 0.0 else max(0.0, value), self.names[index]

    def worst_of_all(self, at: Evaluation) -> tuple[float, str]:
        """Return the worst demand, the clearance included even while the search omits it."""
        spare, name = self.worst(at)
        if self._clearance is None or not self.is_relaxed:
            return spare, name
        least, pair = self._clearance.worst(at.state)
        return (spare, name) if spare <= max(least, -demands.MET) else (least, pair)


def reported_objective(problem: Problem, state: SearchState) -> float:
    """Return the value that the objective of a problem is about, in its own unit."""
    match problem.objective:
        case "match-volume":
            return abs(1.0 - state.volume / (problem.demands.volume or math.nan))
        case "smallest-reach":
            return state.longest_leg[0]
        case "largest-volume":
            return state.volume
