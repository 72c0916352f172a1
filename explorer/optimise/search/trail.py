"""The record of the iterates of a search, and the best of them."""

from __future__ import annotations

import math
from collections.abc import Callable

from explorer.optimise.outcome import Iterate, Phase
from explorer.optimise.problem import Problem
from explorer.optimise.search.demands.geometry import MET
from explorer.optimise.search.model import Evaluation, Model, reported_objective
from explorer.optimise.search.sqp import Stop
from explorer.optimise.search.state import State

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
