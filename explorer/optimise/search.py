"""One run of the optimiser, from one start to an optimum or to a plain word on why not.

Nothing is called converged on the solver's own word: a volume is matched when it is, an
optimum is one when the conditions of an optimum hold, and a clearance is kept when it has
been looked for over the whole workspace, between the solver's positions too.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import msgspec
import numpy as np

from explorer.arrays import FloatArray
from explorer.optimise.least_clearance import least_clearance
from explorer.optimise.model import Evaluation, Model, reported
from explorer.optimise.opening import opened
from explorer.optimise.optimality import optimality
from explorer.optimise.outcome import Iterate, Phase, Run, Status
from explorer.optimise.problem import Problem
from explorer.optimise.sqp import Stop, solve
from explorer.optimise.starts import first_positions
from explorer.optimise.state import State, scales

# F = |1 − V/V′| from which on a volume is matched.
MATCHED = 1e-10
# Demands are met if none is missed by more than this, dimensionless.
MET = 1e-8
# An optimum's conditions hold if their residual is below this.
OPTIMAL = 1e-5
# Below this share of the volume wanted a workspace is opened first.
OPEN = 0.01
# How often a run is taken up again: after new positions to keep clear, or a stall.
ROUNDS = 8


class Search:
    """One run from one start."""

    def __init__(
        self,
        problem: Problem,
        number: int,
        start: Sequence[float],
        most: int,
        history: Sequence[Iterate],
        record: Callable[[Iterate], None],
        stop: Callable[[], bool] | None,
    ) -> None:
        self.problem = problem
        self.number = number
        self.start = tuple(start)
        self.left = most
        self.history = history
        self.record = record
        self.stop = stop
        self.steps = 0
        self.evaluations = 0
        self.best: Iterate | None = None
        self.is_cancelled = False
        self.largest = 0.0

    def run(self) -> Run:
        """Search, and say how it ended."""
        u = np.array(self.start) / scales(self.problem)
        try:
            self._before_each()
            values = self.start
            if self._is_closed(u):
                found = opened(self.problem, u, see=self._see_opening)
                if found is None:
                    because = State(self.problem, u).measured.empty_because
                    return self._end(
                        "infeasible",
                        because[0] if because else "",
                        f"the workspace is empty because of {', '.join(because)}, and no "
                        "design nearby opens it",
                    )
                values = tuple((found * scales(self.problem)).tolist())
            return self._solve(Model(self.problem, values, first_positions(self.problem)))
        except Stop:
            return self._end("cancelled", "", "cancelled")

    def _is_closed(self, u: FloatArray) -> bool:
        if self.problem.objective == "largest-margin" and self.problem.demands.volume is None:
            return False
        wanted = self.problem.demands.volume or self.problem.size**3
        return State(self.problem, u).volume < OPEN * wanted

    def _solve(self, model: Model) -> Run:
        at = model.at(model.start)
        has_grown = False
        for _ in range(ROUNDS):
            at = self._sqp(model, at.u, "solving", self._is_matched)
            if self._is_done(model, at):
                crossings = self._crossings(at.state)
                if not len(crossings):
                    break
                model.add_positions(crossings)
                # What seemed best did not keep clear there.
                self.best = None
            elif self.left <= 0:
                break
            elif self._is_short(at.state) and not has_grown:
                has_grown = True
                grown = self._grown(at)
                if grown is None:
                    break
                model = Model(self.problem, grown, model.positions)
                at = model.at(model.start)
        return self._end(*self._verdict(model, at))

    def _is_done(self, model: Model, at: Evaluation) -> bool:
        """Whether a place is what is wanted, but for clearances between positions."""
        if self.problem.objective == "match-volume":
            return self._is_matched(model, at)
        return model.worst(at)[0] >= -MET and optimality(model, at).residual <= OPTIMAL

    def _is_short(self, state: State) -> bool:
        """Whether the volume that is wanted has not been reached."""
        wanted = self.problem.demands.volume
        return wanted is not None and state.volume < wanted * (1.0 - MET)

    def _grown(self, at: Evaluation) -> list[float] | None:
        """Return values of the variables with the wanted volume, or None if out of reach."""
        demands = msgspec.structs.replace(self.problem.demands, volume=None)
        growing = msgspec.structs.replace(self.problem, objective="largest-volume", demands=demands)
        wanted = self.problem.wanted_volume
        model = Model(growing, at.state.values.tolist(), first_positions(self.problem))

        def is_enough(model: Model, now: Evaluation) -> bool:
            return now.state.volume >= wanted and model.worst(now)[0] >= -MET

        end = self._sqp(model, model.start, "growing", is_enough)
        self.largest = max(self.largest, end.state.volume)
        return end.state.values.tolist() if is_enough(model, end) else None

    def _sqp(
        self,
        model: Model,
        u: FloatArray,
        phase: Phase,
        is_enough: Callable[[Model, Evaluation], bool],
    ) -> Evaluation:
        def see(at: Evaluation) -> None:
            self._see(model, at, phase)
            if is_enough(model, at):
                raise Stop

        before = model.evaluations
        ended = solve(model, u, see=see, before_each=self._before_each, most=max(1, self.left))
        self.evaluations += model.evaluations - before
        self.steps += ended.steps
        self.left -= ended.steps
        if self.is_cancelled:
            raise Stop
        return ended.last

    def _is_matched(self, model: Model, at: Evaluation) -> bool:
        return (
            self.problem.objective == "match-volume"
            and model.reported(at) <= MATCHED
            and model.worst(at)[0] >= -MET
        )

    def _crossings(self, state: State) -> FloatArray:
        """Return positions at which a clearance is not kept after all, shape (k, 3)."""
        demands = self.problem.demands
        if demands.clearance is None:
            return np.zeros((0, 3))
        self._before_each()
        found = least_clearance(
            state.design,
            state.rotation,
            margin=demands.clearance_margin,
            enough=demands.clearance,
            tolerance=0.05 * demands.clearance,
        )
        return found.positions[found.clearance < demands.clearance]

    def _before_each(self) -> None:
        if self.stop is not None and self.stop():
            self.is_cancelled = True
            raise Stop

    def _see_opening(self, state: State) -> None:
        self._before_each()
        self.steps += 1
        self.evaluations += 1
        because = state.measured.empty_because
        self.record(
            Iterate(
                len(self.history),
                self.number,
                "opening",
                state.design,
                tuple(state.values.tolist()),
                reported(self.problem, state),
                state.volume,
                because[0] if because else "",
                -1.0 if because else 0.0,
            )
        )

    def _see(self, model: Model, at: Evaluation, phase: Phase) -> None:
        spare, worst = model.worst(at)
        iterate = Iterate(
            len(self.history),
            self.number,
            phase,
            at.state.design,
            tuple(at.state.values.tolist()),
            reported(self.problem, at.state),
            at.state.volume,
            worst,
            spare,
        )
        if self.best is None or self._rank(iterate) <= self._rank(self.best):
            self.best = iterate
        self.record(iterate)

    def _rank(self, iterate: Iterate) -> tuple[float, float]:
        larger = self.problem.objective in ("largest-volume", "largest-margin")
        missed = -iterate.spare
        wanted = self.problem.demands.volume
        if self.problem.objective != "match-volume" and wanted is not None:
            missed = max(missed, 1.0 - iterate.volume / wanted)
        objective = -iterate.objective if larger else iterate.objective
        return (missed if missed > MET else 0.0), objective

    def _verdict(self, model: Model, at: Evaluation) -> tuple[Status, str, str]:
        """Return how a run ended by its last place, what holds it, and words if special."""
        spare, worst = model.worst(at)
        holding = optimality(model, at).holding
        is_done = self._is_done(model, at)
        crossings = self._crossings(at.state) if is_done else np.zeros((0, 3))
        if len(crossings):
            words = (
                f"a clearance of {self.problem.demands.clearance:g} is not kept everywhere, "
                f"such as at {_shown(crossings[0])}"
            )
            return "not converged", "clearance", words
        if is_done:
            return "converged", holding, ""
        if self.left <= 0:
            return "not converged", worst if spare < -MET else holding, ""
        if self._is_short(at.state) and 0.0 < self.largest < self.problem.wanted_volume:
            words = (
                f"no design within the bounds was found with a volume of "
                f"{self.problem.wanted_volume:g}; the largest found is {self.largest:.6g}"
            )
            return "infeasible", holding, words
        return ("infeasible", worst, "") if spare < -MET else ("stalled", holding, "")

    def _end(self, status: Status, holding: str, message: str) -> Run:
        best = self._best_so_far()
        words = message or _words(self.problem, status, best, self.steps, holding)
        return Run(self.start, status, best, self.steps, self.evaluations, holding, words)

    def _best_so_far(self) -> Iterate:
        """Return the best iterate, the start itself if the run ended before any."""
        if self.best is None:
            model = Model(self.problem, self.start, first_positions(self.problem))
            self._see(model, model.at(model.start), "solving")
        return self.best or self.history[-1]


def _words(problem: Problem, status: Status, best: Iterate, steps: int, holding: str) -> str:
    """Return one line on how a run ended."""
    name = {
        "match-volume": "F",
        "smallest-reach": "reach",
        "largest-volume": "volume",
        "largest-margin": "worst margin",
    }[problem.objective]
    found = f"{name} = {best.objective:.6g} after {steps} iterations"
    held = f", held by {holding}" if holding else ""
    match status:
        case "converged":
            return f"converged: {found}{held}"
        case "infeasible":
            return f"no design found that meets all demands: {holding} is missed ({found})"
        case "not converged":
            return f"not converged: {found}{held}; allow more iterations or start elsewhere"
        case "stalled":
            return f"stalled: {found}{held}; try several starts"
        case "cancelled":
            return f"cancelled: {found}"


def _shown(p: FloatArray) -> str:
    return f"({', '.join(f'{value:.4g}' for value in p.tolist())})"
