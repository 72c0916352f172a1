"""What is to be optimised and how far that has got: a part of the state, frozen as all of it.

The user's own state is kept aside while the page shows the iterates, so that it comes back
exactly. What people ask for is a `Wish`; a `Problem` is made of it when they press the button.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from explorer.measures.measurements import Measurements
from explorer.mechanism.design import VARIABLES
from explorer.optimise.outcome import Iterate, Outcome, Status
from explorer.optimise.problem import (
    Box,
    Demands,
    ObjectiveName,
    Problem,
)
from explorer.optimise.record import Record, Settings, record_of
from explorer.optimise.search.starts import check_starts
from explorer.optimise.search.trail import Trail

PLACE = "place"
"""Stands for the three shifts of the required box."""


@dataclass(frozen=True)
class Wish:
    """What people ask for; lengths in design units.

    Attributes:
        objective: What is wanted.
        volume: To match, or at least; None for one that suits the design.
        reach: The largest allowed; None for that of the design.
        clearance: Every two legs are to keep; 0 for no demand.
        free: What may change: of `VARIABLES`, `YAW` and `PLACE`.
        starts: From how many designs to start.
        with_box: Whether a box must lie within the workspace, whatever is wanted.
        box: Which; None for one that suits the design.
    """

    objective: ObjectiveName = "match-volume"
    volume: float | None = None
    reach: float | None = None
    clearance: float = 0.0
    free: tuple[str, ...] = VARIABLES
    starts: int = 1
    with_box: bool = False
    box: Box | None = None

    def check(self) -> None:
        """Refuse numbers that nothing can be asked with, whatever the design.

        Raises:
            InputError: a volume or reach that is not positive, a clearance below zero, or too
                few or too many starts.
        """
        check_starts(self.starts)
        Demands(volume=self.volume, reach=self.reach, clearance=self.clearance or None)

    @property
    def needs_volume(self) -> bool:
        """Whether a volume is asked for."""
        return self.objective in ("match-volume", "smallest-reach")

    @property
    def needs_reach(self) -> bool:
        """Whether a reach is asked for."""
        return self.objective == "largest-volume"

    @property
    def needs_box(self) -> bool:
        """Whether a box is asked for."""
        return self.with_box or self.objective == "largest-margin"


@dataclass(frozen=True)
class SearchResult:
    """How a run ended.

    Attributes:
        status: That of the outcome; "failed" if there is none.
        message: One line for people.
        best: The best iterate; None if there is none.
        starts: That were tried.
        converged: How many of them converged.
        iterations: Of the best.
        seconds: It took.
        record: By which it can be repeated; None if it had to be ended or failed.
        holding: The limit, demand or bound that kept it from more, "" if none is known.
    """

    status: Status | Literal["failed"]
    message: str
    best: Iterate | None = None
    starts: int = 0
    converged: int = 0
    iterations: int = 0
    seconds: float | None = None
    record: Record | None = None
    holding: str = ""


@dataclass(frozen=True)
class Comparison:
    """The measures of the user's own design and of the one found."""

    before: Measurements
    after: Measurements


def verdict_of(outcome: Outcome, starts: int) -> SearchResult:
    """Return how a search from so many starts ended."""
    run = outcome.run
    return SearchResult(
        status=run.status,
        message=run.message,
        best=run.best,
        starts=len(outcome.runs),
        converged=sum(each.status == "converged" for each in outcome.runs),
        iterations=run.iterations,
        seconds=outcome.seconds,
        record=record_of(outcome, Settings(starts=starts)),
        holding=run.holding,
    )


def cut_short(problem: Problem, iterates: tuple[Iterate, ...]) -> SearchResult:
    """Return how a run ended whose process had to be ended to end it."""
    if not iterates:
        return SearchResult("cancelled", "cancelled before the first iterate")
    best = min(iterates, key=Trail(problem, None, None).rank)
    return SearchResult(
        "cancelled",
        f"cancelled: {best.objective:.6g} is the best of {len(iterates)} iterates",
        best,
        starts=iterates[-1].run + 1,
        iterations=sum(each.run == best.run for each in iterates) - 1,
    )
