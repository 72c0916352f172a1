"""A problem as the functions that an SQP solver needs, over scaled variables.

One more variable is appended where the worst of several values is raised: it stays below
all of them, which keeps the functions smooth.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from explorer.errors import DesignError
from explorer.measures.box import box_margins
from explorer.numerics.arrays import BoolArray, FloatArray
from explorer.optimise.problem import OF_THE_MACHINE, OVER_BOX, Problem
from explorer.optimise.search import demands, grid_demands
from explorer.optimise.search.state import NOWHERE, UNBOUNDED, SearchState, bounds_of, scales
from explorer.proofs.proof import Proof

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
        self.demands: list[demands.SearchDemand] = [*_demands(problem, here)]
        # The last one, see `_demands`.
        self._raised = self.demands[-1] if problem.objective in OVER_BOX else None
        if self._raised is not None:
            least = float(self._raised.measure(here).values.min())
            u = np.append(u, least if math.isfinite(least) else -MISSED)
        self._left_out: grid_demands.ClearanceDemand | None = None
        clearance = problem.demands.clearance
        if clearance is not None:
            positions = grid_demands.first_positions(problem, here.design)
            demand = grid_demands.ClearanceDemand(clearance, positions)
            if is_relaxed:
                self._left_out = demand
            else:
                self.demands.append(demand)
        self.start: FloatArray = u
        self._volume = problem.demands.volume or here.volume or problem.size**3
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

    @cached_property
    def bounds(self) -> FloatArray:
        """Lows and highs of the scaled variables, shape (n, 2)."""
        bounds = bounds_of(self.problem)
        return bounds if self._raised is None else np.vstack([bounds, UNBOUNDED])

    def look_at_unproven(self, at: Evaluation) -> list[Proof]:
        """Look from now on at the poses of what is not proven at a place too, and return it."""
        found: list[Proof] = []
        for demand in self.demands:
            self._before_each()
            found += demand.look_at_unproven(at.state)
        self._last = None
        return found

    def unproven_clearance(self, at: Evaluation) -> list[Proof]:
        """Return the unproven pairs of the clearance that a relaxed problem leaves out."""
        return self._left_out.look_at_unproven(at.state) if self._left_out else []

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
        places = np.vstack([demand.places for demand in self.demands] or [NOWHERE])
        state = SearchState(self.problem, u[: len(self.problem.names)], places)
        if not np.isfinite(u).all():
            raise DesignError("the solver tried a design that is not finite")
        # A problem may demand nothing.
        values, gradients = [np.zeros(0)], [np.zeros((0, len(u)))]
        for demand in self.demands:
            value, gradient = demand.measure(state)
            if self._raised is not None:
                by_last = -1.0 if demand is self._raised else 0.0
                value = value + by_last * u[-1]
                gradient = np.hstack([gradient, np.full((len(value), 1), by_last)])
            values.append(value)
            gradients.append(gradient)
        objective, slope = self._objective(state, u)
        every, rows = np.concatenate(values), np.vstack(gradients)
        return Evaluation(
            u,
            state,
            objective if math.isfinite(objective) else MISSED,
            np.where(np.isfinite(slope), slope, 0.0),
            np.where(np.isfinite(every), every, -MISSED),
            np.where(np.isfinite(rows), rows, 0.0),
        )

    def _objective(self, state: SearchState, u: FloatArray) -> tuple[float, FloatArray]:
        match self.problem.objective:
            case "match-volume":
                # Each step is the smallest that meets the volume demand to first order.
                return 0.0, np.zeros(len(u))
            case "smallest-reach":
                value, gradient = state.longest_leg
                return value / self.problem.size, gradient / self.problem.size
            case "largest-volume":
                root, gradient = state.volume_root(self._volume)
                return -root, -gradient
            case "largest-margin" | "smallest-load" | "smallest-error" | "smallest-deflection":
                slope = np.zeros(len(u))
                slope[-1] = -1.0
                return -float(u[-1]), slope

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
        if self._left_out is None:
            return spare, name
        least, pair = self._left_out.worst(at.state)
        return (spare, name) if spare <= max(least, -demands.MET) else (least, pair)


def reported_objective(problem: Problem, state: SearchState) -> float:
    """Return the value that the objective of a problem is about, in its own unit.

    Loads, errors and deflections over a box on or across a singular plane are infinite.
    """
    match problem.objective:
        case "match-volume":
            return abs(1.0 - state.volume / (problem.demands.volume or math.nan))
        case "smallest-reach":
            return state.longest_leg[0]
        case "largest-volume":
            return state.volume
        case "largest-margin":
            return float(box_margins(state.box, state.rotation).min())
        case "smallest-load":
            values = state.statics.node_utilisations
        case "smallest-error":
            values = state.statics.errors.displacement
        case "smallest-deflection":
            values = state.statics.deflections
    return state.statics.worst(values)


def _demands(problem: Problem, start: SearchState) -> Iterator[demands.SearchDemand]:
    """Yield the demands of a problem; what the objective raises comes last."""
    wanted, objective = problem.demands, problem.objective
    if wanted.volume is not None:
        yield demands.VolumeDemand(wanted.volume, is_equality=objective == "match-volume")
    if wanted.reach is not None:
        yield demands.ReachDemand(wanted.reach)
    if wanted.least > 0.0:
        yield demands.DegenerateDemand(wanted.least, start)
    if start.design.limits.gap > 0.0:
        yield demands.GapDemand(start)
    if wanted.required_box is not None:
        yield demands.BoxDemand(start, wanted.tilt)
    if wanted.held:
        yield grid_demands.LoadDemand(start, 1.0)
    if wanted.error is not None:
        yield grid_demands.DisplacementDemand(start, "error", wanted.error)
    if wanted.deflection is not None:
        yield grid_demands.DisplacementDemand(start, "deflection", wanted.deflection)
    if wanted.acceleration is not None:
        yield grid_demands.AccelerationDemand(start, wanted.acceleration)
    of_machine = wanted.held, wanted.error, wanted.deflection, wanted.acceleration
    if any(of_machine) or objective in OF_THE_MACHINE:
        yield demands.MarginDemand(start, is_open=True)
    match objective:
        case "largest-margin":
            yield demands.MarginDemand(start)
        case "smallest-load":
            yield grid_demands.LoadDemand(start)
        case "smallest-error":
            yield grid_demands.DisplacementDemand(start, "error")
        case "smallest-deflection":
            yield grid_demands.DisplacementDemand(start, "deflection")
        case _:
            pass
