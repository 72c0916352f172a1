"""A problem as the functions that an SQP solver needs, over scaled variables.

One more variable is appended where the worst of several values is raised: it stays below
all of them, which keeps the functions smooth.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
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
        self.demands: list[demands.SearchDemand] = _demands(problem, here)
        clearance = problem.demands.clearance
        self._clearance: grid_demands.ClearanceDemand | None = None
        if clearance is not None:
            positions = grid_demands.first_positions(problem, here.design)
            self._clearance = grid_demands.ClearanceDemand(clearance, positions)
        # The last one, see `_demands`.
        self._raised = self.demands[-1] if problem.objective in OVER_BOX else None
        if self._raised is not None:
            least = float(self._raised.measure(here).values.min())
            u = np.append(u, least if math.isfinite(least) else -MISSED)
        if self._clearance is not None and not is_relaxed:
            self.demands.append(self._clearance)
        self.start: FloatArray = u
        self._volume = problem.demands.volume or here.volume or problem.size**3
        self._last: Evaluation | None = None
        self.evaluations = 0

    @cached_property
    def names(self) -> tuple[str, ...]:
        """The names of all demands, m of them."""
        return tuple(name for demand in self.demands for name in demand.names)

    @cached_property
    def equalities(self) -> BoolArray:
        """Which demands are equalities, shape (m,), boolean."""
        return np.array([each.is_equality for each in self.demands for _ in each.names], dtype=bool)

    @cached_property
    def limits(self) -> BoolArray:
        """Which demands are limits of the design, shape (m,), boolean."""
        return np.array([each.is_limit for each in self.demands for _ in each.names], dtype=bool)

    @cached_property
    def bounds(self) -> FloatArray:
        """Lows and highs of the scaled variables, shape (n, 2)."""
        bounds = bounds_of(self.problem)
        return bounds if self._raised is None else np.vstack([bounds, UNBOUNDED])

    def find_unproven(self, at: Evaluation) -> list[Proof]:
        """Return what is not proven at a place, and look at its poses too from now on."""
        found: list[Proof] = []
        for demand in self.demands:
            self._before_each()
            found += demand.find_unproven(at.state)
        for name in ("names", "equalities", "limits"):
            self.__dict__.pop(name, None)
        self._last = None
        return found

    def unproven_clearance(self, at: Evaluation) -> list[Proof]:
        """Return what is not proven of the clearance that a relaxed problem leaves out."""
        left_out = self._clearance if self.is_relaxed else None
        return left_out.find_unproven(at.state) if left_out else []

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

        The value is below zero only where the inequality is missed by more than its tolerance:
        that of all limits for the limits of the design, `MET` for the other demands.
        """
        if self.equalities.all():
            return 0.0, ""
        allowed = np.where(self.limits, at.state.design.tolerance / self.problem.size, demands.MET)
        spare = np.where(self.equalities, np.inf, at.values + allowed)
        index = int(spare.argmin())
        value = float(at.values[index])
        return value if spare[index] < 0.0 else max(0.0, value), self.names[index]

    def worst_of_all(self, at: Evaluation) -> tuple[float, str]:
        """Return what `worst` does with the clearance too, at its positions, if it is left out."""
        spare, name = self.worst(at)
        if self._clearance is None or not self.is_relaxed:
            return spare, name
        least, pair = self._clearance.worst(at.state)
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


def _demands(problem: Problem, start: SearchState) -> list[demands.SearchDemand]:
    wanted = problem.demands
    listed: list[demands.SearchDemand] = []
    if wanted.volume is not None:
        exact = problem.objective == "match-volume"
        listed.append(demands.VolumeDemand(wanted.volume, is_equality=exact))
    if wanted.reach is not None:
        listed.append(demands.ReachDemand(wanted.reach))
    if wanted.least > 0.0:
        listed.append(demands.DegenerateDemand(wanted.least, start))
    if start.design.limits.gap > 0.0:
        listed.append(demands.GapDemand(start))
    if wanted.required_box is not None:
        listed.append(demands.BoxDemand(start, wanted.tilt))
    machine: list[demands.SearchDemand] = []
    if wanted.held:
        machine.append(grid_demands.LoadDemand(start, 1.0))
    if wanted.error is not None:
        machine.append(grid_demands.DisplacementDemand(start, "error", wanted.error))
    if wanted.deflection is not None:
        machine.append(grid_demands.DisplacementDemand(start, "deflection", wanted.deflection))
    if wanted.acceleration is not None:
        machine.append(grid_demands.AccelerationDemand(start, wanted.acceleration))
    listed += machine
    if machine or problem.objective in OF_THE_MACHINE:
        listed.append(demands.MarginDemand(start, is_open=True))
    # What an objective raises comes last.
    if problem.objective == "largest-margin":
        listed.append(demands.MarginDemand(start))
    elif problem.objective == "smallest-load":
        listed.append(grid_demands.LoadDemand(start))
    elif problem.objective == "smallest-error":
        listed.append(grid_demands.DisplacementDemand(start, "error"))
    elif problem.objective == "smallest-deflection":
        listed.append(grid_demands.DisplacementDemand(start, "deflection"))
    return listed
