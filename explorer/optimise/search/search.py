"""One run of the optimiser, from one start to an optimum or to a message that says why not.

The solver's own verdict does not count: a volume must be matched, the conditions of an optimum
must hold, and the clearance must be proven between the solver's positions too. Where it is not,
the worst position joins them, and the search goes on. A design is read from its file to the last
bit.

Clearances divide the designs into regions: on the border between two of them legs cross, which
no solver that follows slopes passes. Where a region holds no solution, the search continues in
another. Without the clearance the search is ten times as short and passes those borders, so that
it comes first: its optimum often keeps the clearance, or is outdone by another start already.
"""

from __future__ import annotations

import contextlib
import itertools
import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import msgspec
import numpy as np

from explorer.numerics.arrays import FloatArray
from explorer.numerics.number_text import format_apart, format_number
from explorer.optimise.outcome import Iterate, Phase, Run, Status, reached_text
from explorer.optimise.problem import Problem
from explorer.optimise.search.clearance_demand import UnprovenClearance
from explorer.optimise.search.demands import MET
from explorer.optimise.search.model import Evaluation, SearchModel, reported_objective
from explorer.optimise.search.sqp import Stop, Trail, nearest_feasible, optimality, solve
from explorer.optimise.search.starts import promising_starts
from explorer.optimise.search.state import SearchState, scales
from explorer.workspace.slices.volume import unexplained_volume, volume_of

# Largest F = |1 − V/V′| of a matched volume.
MATCHED = 1e-10
# Number of times that an attempt continues, with more positions at which the clearance is demanded
# or once the volume is reached.
ROUNDS = 30
# An objective that changes by no more than this share within so many steps has settled.
STILL_STEPS, STILL = 4, 1e-9
# Attempts of a search with all its demands, and steps of an attempt to match a volume, for which
# Newton's method needs a dozen or fails.
ATTEMPTS = 8
STEPS_TO_MATCH = 40
# Steps of the attempt without the clearance, for which an optimum takes a dozen or two.
STEPS_WITHOUT_CLEARANCE = 60
# Statuses after which a run makes no other attempt.
ENDED = ("converged", "outdone", "cancelled")
# Objectives that differ by less than this share are the same.
SAME = 1e-6


class Attempt(NamedTuple):
    """The result of one attempt, and why it found no optimum if the status does not say it."""

    status: Status
    holding: str
    reason: str
    best: Iterate


@dataclass
class Search:
    """A run of the optimiser from values of the variables to start from.

    It takes at most the steps left. The iterate to beat is the best of the runs that converged.
    """

    problem: Problem
    start: tuple[float, ...]
    steps_left: int
    trail: Trail
    to_beat: Iterate | None = None
    steps: int = 0
    evaluations: int = 0
    largest_volume: float = 0.0

    def run(self) -> Run:
        """Search, and return the run."""
        attempts: list[Attempt] = []
        # `promising_starts` evaluates designs too.
        with contextlib.suppress(Stop):
            for attempt in self._attempts():
                attempts.append(attempt)
                if attempt.status in ENDED or self.steps_left <= 0:
                    break
        chosen = min(attempts, key=lambda a: (a.status != "converged", self.trail.rank(a.best)))
        if self.trail.is_cancelled:
            chosen = chosen._replace(status="cancelled", holding="", reason="")
        reason, demanded = chosen.reason, self.problem.demands.volume or 0.0
        if chosen.status == "infeasible" and 0.0 < self.largest_volume < demanded:
            asked, found = format_apart((demanded, self.largest_volume), 6, format_number)
            reason = (
                f"no design within the bounds was found with a volume of {asked} units³; the "
                f"largest found is {found} units³"
            )
        run = Run(
            start=self.start,
            status=chosen.status,
            best=chosen.best.number,
            iterations=self.steps,
            evaluations=self.evaluations,
            attempts=len(attempts),
            holding=chosen.holding,
            reason=reason,
        )
        message = run.words(reached_text(self.problem, chosen.best))
        return msgspec.structs.replace(run, message=message)

    def _attempts(self) -> Iterator[Attempt]:
        """Yield one attempt after another, from the start and then from elsewhere."""
        demands = self.problem.demands
        if demands.clearance is not None and self.problem.objective != "match-volume":
            yield self._attempt(self.start, is_relaxed=True)
        yield self._attempt(self.start)
        places = promising_starts(self.problem, self.trail.run, self.trail.before_each)
        for values in itertools.islice(places, ATTEMPTS - 1):
            yield self._attempt(values)

    def _attempt(self, values: Sequence[float], *, is_relaxed: bool = False) -> Attempt:
        """Search from some values; if it is relaxed, the clearance is only looked at in the end."""
        problem, trail = self.problem, self.trail
        trail.begin()
        here = SearchState(problem, np.array(values) / scales(problem))
        try:
            trail.before_each()
            if here.volume <= 0.0:
                because = volume_of(here.workspace).empty_because
                trail.add(here, "solving", because[0] if because else "", -1.0)
                words = (
                    f"the workspace is empty because of {', '.join(because)}: start from a design "
                    "that has one"
                )
                return Attempt("infeasible", trail.best.worst, words, trail.best)
            return self._solve(
                SearchModel(problem, values, trail.before_each, is_relaxed=is_relaxed)
            )
        except Stop:
            if not trail.history:
                trail.add(here, "solving", "", 0.0 if here.volume > 0.0 else -1.0)
            return Attempt("cancelled", "", "", trail.best)

    def _solve(self, model: SearchModel) -> Attempt:
        at, has_grown, is_done = model.at(model.start), False, False
        missed: list[UnprovenClearance] = []
        for _ in range(ROUNDS):
            before = self.steps
            at = self._feasible(model, self._sqp(model, at.u, "solving", self._may_end))
            is_done = self._is_kept(model, at) and (
                self.problem.objective == "match-volume" or optimality(model, at).is_optimal
            )
            if is_done:
                holding = optimality(model, at).holding
                missed = model.look_at_unproven(at)
                last = self.trail.last_at(at.state)
                if missed and model.is_relaxed and self._is_outdone(last):
                    return Attempt("outdone", holding, "", last)
                if model.is_relaxed or not missed:
                    break
                at = model.at(at.u)
                if all(pair.missed <= 0.0 for pair in missed):
                    break
                # Earlier iterates may miss what they were not asked for.
                self.trail.begin()
            elif self.steps_left <= 0:
                break
            elif self._is_short(at.state) and not has_grown:
                has_grown, larger = True, self._grow(model, at)
                if larger is None:
                    break
                is_relaxed = model.is_relaxed
                model = SearchModel(
                    self.problem, larger, self.trail.before_each, is_relaxed=is_relaxed
                )
                at = model.at(model.start)
            elif self.problem.objective == "match-volume" or self.steps == before:
                break
        return self._verdict(model, at, missed, is_done=is_done)

    def _is_outdone(self, optimum: Iterate) -> bool:
        """Whether an optimum without the clearance is no better than what is known with it."""
        if self.to_beat is None:
            return False
        value, least = (self.trail.rank(iterate)[-1] for iterate in (optimum, self.to_beat))
        return value >= least - SAME * abs(least)

    def _may_end(self, model: SearchModel, at: Evaluation) -> bool:
        """Whether the solver may end here: volume matched, or optimum that steps no longer change.

        The solver would wander on among designs that share the best objective.
        """
        if self.problem.objective == "match-volume":
            return self._is_kept(model, at)
        recent = self.trail.history[-STILL_STEPS:]
        last = [each.objective for each in recent]
        if len(last) < STILL_STEPS or max(last) - min(last) > STILL * abs(last[-1]):
            return False
        near = nearest_feasible(model, at)
        return (
            near is not None
            and self._is_kept(model, near)
            and optimality(model, near, kinks=False).is_optimal
        )

    def _is_kept(self, model: SearchModel, at: Evaluation) -> bool:
        """Whether all demands are met."""
        most = MATCHED if self.problem.objective == "match-volume" else math.inf
        if not reported_objective(self.problem, at.state) < most or model.worst(at)[0] < 0.0:
            return False
        return at.state.volume > unexplained_volume(at.state.workspace).error

    def _is_short(self, state: SearchState) -> bool:
        """Whether the volume is smaller than demanded."""
        return state.volume < (self.problem.demands.volume or 0.0) * (1.0 - MET)

    def _grow(self, model: SearchModel, at: Evaluation) -> list[float] | None:
        """Return values with the demanded volume; None if it is out of reach."""
        demands = msgspec.structs.replace(self.problem.demands, volume=None)
        growing = msgspec.structs.replace(self.problem, objective="largest-volume", demands=demands)
        demanded = self.problem.demands.volume or 0.0
        values, is_relaxed = at.state.values.tolist(), model.is_relaxed
        model = SearchModel(growing, values, self.trail.before_each, is_relaxed=is_relaxed)

        def is_enough(model: SearchModel, now: Evaluation) -> bool:
            return now.state.volume >= demanded and model.worst(now)[0] >= 0.0

        end = self._sqp(model, model.start, "growing", is_enough)
        if model.worst(end)[0] >= 0.0:
            self.largest_volume = max(self.largest_volume, end.state.volume)
        return end.state.values.tolist() if is_enough(model, end) else None

    def _feasible(self, model: SearchModel, at: Evaluation) -> Evaluation:
        """Return the nearest place that meets all demands if this one misses some by little."""
        before = model.evaluations
        near = nearest_feasible(model, at)
        self.evaluations += model.evaluations - before
        if near is None or near is at:
            return at
        self.steps += 1
        self.trail.see(model, near, "solving")
        return near

    def _sqp(
        self,
        model: SearchModel,
        u: FloatArray,
        phase: Phase,
        is_enough: Callable[[SearchModel, Evaluation], bool],
    ) -> Evaluation:
        def see(at: Evaluation) -> None:
            self.trail.see(model, at, phase)
            if is_enough(model, at):
                raise Stop

        before, most = model.evaluations, self.steps_left
        if self.problem.objective == "match-volume":
            most = min(most, STEPS_TO_MATCH)
        if model.is_relaxed:
            most = min(most, STEPS_WITHOUT_CLEARANCE - self.steps)
        last, steps = solve(model, u, see=see, most=max(1, most))
        self.evaluations += model.evaluations - before
        self.steps += steps
        self.steps_left -= steps
        if self.trail.is_cancelled:
            raise Stop
        return last

    def _verdict(
        self,
        model: SearchModel,
        at: Evaluation,
        missed: list[UnprovenClearance],
        *,
        is_done: bool,
    ) -> Attempt:
        """Return the result of an attempt from its last place, and what it misses if it is done."""
        spare, worst = model.worst(at)
        holding, best = optimality(model, at).holding, self.trail.best
        if is_done and missed:
            return Attempt("not converged", missed[0].name, _missed_words(missed[0]), best)
        if is_done:
            return Attempt("converged", holding, "", self.trail.last_at(at.state))
        if self.steps_left <= 0 or spare < 0.0 or self._is_short(at.state):
            status = "not converged" if self.steps_left <= 0 else "infeasible"
            return Attempt(status, worst if spare < 0.0 else holding, "", best)
        if at.state.volume <= 0.0:
            because = ", ".join(volume_of(at.state.workspace).empty_because)
            words = f"the workspace of the best design found is empty because of {because}"
            return Attempt("infeasible", because, words, best)
        return Attempt("stalled", holding, "", best)


def _missed_words(pair: UnprovenClearance) -> str:
    place = f"({', '.join(map(format_number, pair.position.tolist()))}) units"
    if pair.missed > 0.0:
        return f"not converged: {pair.name} is not kept everywhere, such as at {place}"
    words = f"not converged: {pair.name} is kept wherever it was computed, but not proven"
    return f"{words} at {place}" if np.isfinite(pair.position).all() else f"{words} everywhere"
