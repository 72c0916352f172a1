"""One run of the optimiser, from one start to an optimum or to a plain word on why not.

Nothing is called converged on the solver's own word: a volume is matched when it is, an
optimum is one when the conditions of an optimum hold, and a clearance is kept when it has
been looked for over the whole workspace, between the solver's positions too. All of this is
asked of the design as its file will be read.

Clearances divide the designs into chambers: in the wall between two of them legs cross, and
no solver that goes down a slope passes it. Where a chamber holds no answer, the search goes
on in another.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import NamedTuple

import msgspec
import numpy as np

from explorer.numerics.arrays import FloatArray
from explorer.optimise.curves import CALLED
from explorer.optimise.outcome import Iterate, Phase, Run, Status
from explorer.optimise.problem import Problem
from explorer.optimise.refutation.binding import BindingLimit, find_binding_limit
from explorer.optimise.search.crossings import crossings
from explorer.optimise.search.demands import MET
from explorer.optimise.search.elsewhere import promising
from explorer.optimise.search.feasible import nearest_feasible
from explorer.optimise.search.model import Evaluation, Model
from explorer.optimise.search.opening import opened
from explorer.optimise.search.optimality import optimality
from explorer.optimise.search.sqp import Stop, solve
from explorer.optimise.search.state import State, scales
from explorer.optimise.search.trail import Trail
from explorer.workspace.slices.volume import find_emptying_limits

# F = |1 − V/V′| from which on a volume is matched.
MATCHED = 1e-10
# Below this share of the volume wanted a workspace is opened first.
OPEN = 0.01
# How often an attempt is taken up again: after new positions to keep clear, or a stall.
ROUNDS = 8
# How often a search goes on elsewhere, and the steps of an attempt at a volume: Newton's
# method on it is done in a dozen or not at all.
ATTEMPTS = 8
STEPS_TO_MATCH = 40


class Attempt(NamedTuple):
    """How one attempt ended."""

    status: Status
    holding: str
    message: str
    best: Iterate


class Search:
    """One run.

    Args:
        problem: The problem.
        start: Values of its variables to start from.
        most: The most steps.
        trail: Takes every iterate.
    """

    def __init__(self, problem: Problem, start: Sequence[float], most: int, trail: Trail) -> None:
        self.problem = problem
        self.start = tuple(start)
        self.left = most
        self.trail = trail
        self.steps = 0
        self.evaluations = 0
        self.largest = 0.0

    def run(self) -> Run:
        """Search, and say how it ended."""
        attempts = [self._attempt(self.start)]
        elsewhere = None
        while (
            attempts[-1].status not in ("converged", "cancelled")
            and self.left > 0
            and len(attempts) < ATTEMPTS
        ):
            if elsewhere is None:
                elsewhere = promising(self.problem, self.trail.run, self.trail.before_each)
            try:
                values = next(elsewhere, None)
            except Stop:
                break
            if values is None:
                break
            attempts.append(self._attempt(values))
        chosen = min(attempts, key=self._rank)
        if self.trail.is_cancelled:
            chosen = chosen._replace(status="cancelled", holding="", message="")
        limit = self._binding_limit(chosen)
        return Run(
            start=self.start,
            status=chosen.status,
            best=chosen.best,
            iterations=self.steps,
            evaluations=self.evaluations,
            attempts=len(attempts),
            holding=chosen.holding if limit is None else limit.limit,
            message=self._message(chosen, limit),
        )

    def _rank(self, attempt: Attempt) -> tuple[bool, tuple[float, float]]:
        return attempt.status != "converged", self.trail.rank(attempt.best)

    def _binding_limit(self, chosen: Attempt) -> BindingLimit | None:
        """Return the limit that keeps a search from the volume that is wanted."""
        wanted = self.problem.demands.volume
        if chosen.status == "infeasible" and wanted is not None and 0.0 < self.largest < wanted:
            return find_binding_limit(chosen.best.design, wanted)
        return None

    def _message(self, chosen: Attempt, limit: BindingLimit | None) -> str:
        wanted = self.problem.demands.volume
        if chosen.status == "infeasible" and wanted is not None and 0.0 < self.largest < wanted:
            without = ""
            if limit is not None:
                without = f" (the best so far has {limit.volume:.6g} without its {limit.limit})"
            return (
                f"no design within the bounds was found with a volume of {wanted:g}{without}; the "
                f"largest found is {self.largest:.6g}"
            )
        return chosen.message or _words(self.problem, chosen, self.steps)

    def _attempt(self, values: Sequence[float]) -> Attempt:
        """Look for an answer from some values of the variables."""
        problem, trail = self.problem, self.trail
        trail.begin()
        try:
            trail.before_each()
            u = np.array(values) / scales(problem)
            if self._is_closed(u):
                found = opened(problem, u, see=self._see_opening)
                if found is None:
                    because = find_emptying_limits(State(problem, u).limits)
                    words = (
                        f"the workspace is empty because of {', '.join(because)}, and no "
                        "design nearby opens it"
                    )
                    return Attempt("infeasible", because[0] if because else "", words, trail.best)
                values = (found * scales(problem)).tolist()
            return self._solved(Model(problem, values, trail.before_each))
        except Stop:
            if not trail.history:
                trail.see_opening(State(problem, np.array(values) / scales(problem)), "")
            return Attempt("cancelled", "", "", trail.best)

    def _is_closed(self, u: FloatArray) -> bool:
        """Whether the workspace has to be opened first."""
        if self.problem.objective == "largest-margin" and self.problem.demands.volume is None:
            return False
        wanted = self.problem.demands.volume or self.problem.size**3
        return State(self.problem, u).volume < OPEN * wanted

    def _see_opening(self, state: State, worst: str) -> None:
        self.trail.before_each()
        self.steps += 1
        self.evaluations += 1
        self.left -= 1
        self.trail.see_opening(state, worst)

    def _solved(self, model: Model) -> Attempt:
        at, missed, has_grown = model.at(model.start), np.zeros((0, 3)), False
        is_done = False
        for _ in range(ROUNDS):
            at = self._feasible(model, self._sqp(model, at.u, "solving", self._is_matched))
            is_done = self._is_done(model, at)
            if is_done:
                missed = self._crossings(at.state.read_back())
                if not len(missed):
                    break
                model.add_positions(missed)
                # What seemed best did not keep clear there.
                self.trail.begin()
            elif self.left <= 0:
                break
            elif self._is_short(at.state) and not has_grown:
                has_grown = True
                grown = self._grown(at)
                if grown is None:
                    break
                model = Model(self.problem, grown, self.trail.before_each)
                at = model.at(model.start)
            elif self.problem.objective == "match-volume":
                break
        return self._verdict(model, at, missed, is_done=is_done)

    def _is_done(self, model: Model, at: Evaluation) -> bool:
        """Whether a place is what is wanted, but for clearances between positions."""
        if self.problem.objective == "match-volume":
            return self._is_matched(model, at)
        return self._is_kept(model, at) and optimality(model, at).is_optimal

    def _is_matched(self, model: Model, at: Evaluation) -> bool:
        return self.problem.objective == "match-volume" and self._is_kept(model, at)

    def _is_kept(self, model: Model, at: Evaluation) -> bool:
        """Whether all demands are met, here and by the design as its file will be read."""
        return self._meets(model, at) and self._meets(model, model.read_back(at))

    def _meets(self, model: Model, at: Evaluation) -> bool:
        if self.problem.objective == "match-volume" and model.reported(at) > MATCHED:
            return False
        return model.worst(at)[0] >= 0.0 and at.state.volume > at.state.measured.error

    def _is_short(self, state: State) -> bool:
        """Whether the volume that is wanted has not been reached."""
        wanted = self.problem.demands.volume
        return wanted is not None and state.volume < wanted * (1.0 - MET)

    def _grown(self, at: Evaluation) -> list[float] | None:
        """Return values of the variables with the wanted volume, or None if out of reach."""
        demands = msgspec.structs.replace(self.problem.demands, volume=None)
        growing = msgspec.structs.replace(self.problem, objective="largest-volume", demands=demands)
        wanted = self.problem.wanted_volume
        model = Model(growing, at.state.values.tolist(), self.trail.before_each)

        def is_enough(model: Model, now: Evaluation) -> bool:
            return now.state.volume >= wanted and model.worst(now)[0] >= 0.0

        end = self._sqp(model, model.start, "growing", is_enough)
        if model.worst(end)[0] >= 0.0:
            self.largest = max(self.largest, end.state.volume)
        return end.state.values.tolist() if is_enough(model, end) else None

    def _feasible(self, model: Model, at: Evaluation) -> Evaluation:
        """Return the place nearby that meets all demands, where one misses some by little."""
        before = model.evaluations
        found = nearest_feasible(model, at)
        self.evaluations += model.evaluations - before
        if found is None or found is at:
            return at
        self.steps += 1
        self.trail.see(model, found, "solving")
        return found

    def _sqp(
        self,
        model: Model,
        u: FloatArray,
        phase: Phase,
        is_enough: Callable[[Model, Evaluation], bool],
    ) -> Evaluation:
        def see(at: Evaluation) -> None:
            self.trail.see(model, at, phase)
            if is_enough(model, at):
                raise Stop

        before = model.evaluations
        most = max(1, self.left)
        if self.problem.objective == "match-volume":
            most = min(most, STEPS_TO_MATCH)
        ended = solve(model, u, see=see, most=most)
        self.evaluations += model.evaluations - before
        self.steps += ended.steps
        self.left -= ended.steps
        if self.trail.is_cancelled:
            raise Stop
        return ended.last

    def _crossings(self, state: State) -> FloatArray:
        """Return positions at which the clearance is not kept after all, shape (k, 3)."""
        demands = self.problem.demands
        if demands.clearance is None:
            return np.zeros((0, 3))
        return crossings(
            state.design,
            state.rotation,
            demands.clearance,
            demands.clearance_margin,
            self.trail.before_each,
        )

    def _verdict(
        self, model: Model, at: Evaluation, missed: FloatArray, *, is_done: bool
    ) -> Attempt:
        """Say how an attempt ended.

        Args:
            model: The problem.
            at: The last place.
            missed: Positions where legs are too near there, shape (k, 3).
            is_done: Whether the place was what is wanted before these positions were demanded.
        """
        spare, worst = model.worst(at)
        holding, best = optimality(model, at).holding, self.trail.best
        if is_done and len(missed):
            words = (
                f"a clearance of {self.problem.demands.clearance:g} is not kept everywhere, "
                f"such as at {_shown(missed[0])}"
            )
            return Attempt("not converged", "clearance", words, best)
        if is_done:
            return Attempt("converged", holding, "", self.trail.last_at(at.state))
        if self.left <= 0:
            return Attempt("not converged", worst if spare < 0.0 else holding, "", best)
        if spare < 0.0 or self._is_short(at.state):
            return Attempt("infeasible", worst if spare < 0.0 else holding, "", best)
        if at.state.volume <= 0.0:
            because = ", ".join(find_emptying_limits(at.state.limits))
            words = f"the workspace of the best design found is empty because of {because}"
            return Attempt("infeasible", because, words, best)
        return Attempt("stalled", holding, "", best)


def _words(problem: Problem, attempt: Attempt, steps: int) -> str:
    """Return one line on how a run ended."""
    name = CALLED[problem.objective]
    found = f"{name} = {attempt.best.objective:.6g} after {steps} iterations"
    held = f", held by {attempt.holding}" if attempt.holding else ""
    match attempt.status:
        case "converged":
            return f"converged: {found}{held}"
        case "infeasible":
            return f"no design was found that meets all demands: {found}{held}"
        case "not converged":
            return f"not converged: {found}{held}; allow more iterations or start elsewhere"
        case "stalled":
            return f"stalled: {found}{held}; try several starts"
        case "cancelled":
            return f"cancelled: {found}"


def _shown(p: FloatArray) -> str:
    return f"({', '.join(f'{value:.4g}' for value in p.tolist())})"
