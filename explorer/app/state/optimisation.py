"""The request for an optimisation and its result: a part of the state.

The state before a run is kept while the page shows the iterates, so that it can be restored
exactly. The user fills in an `OptimisationRequest`; a `Problem` is made of it when the run begins.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from explorer.errors import InputError
from explorer.measures.measurements import Measurements
from explorer.mechanism.design import VARIABLES
from explorer.numerics.number_text import format_number
from explorer.optimise.demands import Box, Demands
from explorer.optimise.outcome import Iterate, Outcome, Status
from explorer.optimise.problem import OF_THE_MACHINE, OVER_BOX, YAW, ObjectiveName, Problem
from explorer.optimise.record import Record, Settings, record_of
from explorer.optimise.search.sqp import Trail
from explorer.optimise.search.starts import check_starts

PLACE = "place"
"""Name in `OptimisationRequest.free` for the three shifts of the required box."""


@dataclass(frozen=True)
class OptimisationRequest:
    """What the user requests; lengths in design units.

    Attributes:
        objective: Name of the objective.
        volume: Volume to match, or the least one; None for one that suits the design.
        reach: Largest reach; None for that of the design.
        clearance: Least clearance of every two legs; 0 for no demand.
        free: Names of what may change, out of `VARIABLES`, `YAW` and `PLACE`.
        starts: Number of designs to start from.
        with_box: Whether a box must lie within the workspace, whatever the objective.
        box: The required box; None for one that suits the design.
        held: Whether the design's load must be held over the required box.
        error: Worst error of the tool over the required box; 0 for no demand.
        deflection: Largest deflection under the load over the required box; 0 for no demand.
        tilt: Tilt in every azimuth that the required box must allow, in degrees; 0 for no demand.

    Raises:
        InputError: A volume or reach that is not positive, a clearance below zero, too few or too
            many starts, or an unknown name in `free`.
    """

    objective: ObjectiveName = "match-volume"
    volume: float | None = None
    reach: float | None = None
    clearance: float = 0.0
    free: tuple[str, ...] = VARIABLES
    starts: int = 1
    with_box: bool = False
    box: Box | None = None
    held: bool = False
    error: float = 0.0
    deflection: float = 0.0
    tilt: float = 0.0

    def __post_init__(self) -> None:
        unknown = {*self.free} - {*VARIABLES, YAW, PLACE}
        if unknown:
            raise InputError(f"nothing named {min(unknown)!r} can be free in an optimisation")
        check_starts(self.starts)
        Demands(
            volume=self.volume,
            reach=self.reach,
            clearance=self.clearance or None,
            error=self.error or None,
            deflection=self.deflection or None,
            tilt=self.tilt or None,
        )

    @property
    def needs_volume(self) -> bool:
        """Whether the objective takes a volume, by default the present one."""
        return self.objective in ("match-volume", "smallest-reach", *OF_THE_MACHINE)

    @property
    def needs_reach(self) -> bool:
        """Whether the objective takes a reach."""
        return self.objective in ("largest-volume", *OF_THE_MACHINE)

    @property
    def needs_box(self) -> bool:
        """Whether a box is required."""
        demands = self.held or max(self.error, self.deflection, self.tilt) > 0.0
        return self.with_box or demands or self.objective in OVER_BOX


@dataclass(frozen=True)
class SearchResult:
    """How a run ended.

    Attributes:
        status: That of the outcome; "failed" if there is none.
        message: One line for people.
        best: The best iterate; None if there is none.
        starts: Number of starts that were tried.
        converged: Number of starts that converged.
        iterations: Number of iterations from the best start.
        seconds: Duration in seconds.
        record: Record from which to repeat the run; None if it was killed or failed.
        holding: The limit, demand or bound that kept it from a better value; "" if unknown.
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
    """The measures of the user's design and of the optimised one."""

    before: Measurements
    after: Measurements


def result_of(outcome: Outcome, starts: int) -> SearchResult:
    """Return the result of a search that was to try a number of starts."""
    run = outcome.run
    return SearchResult(
        status=run.status,
        message=run.message,
        best=run.best,
        starts=len(outcome.runs),
        converged=sum(tried.status == "converged" for tried in outcome.runs),
        iterations=run.iterations,
        seconds=outcome.seconds,
        record=record_of(outcome, Settings(starts=starts)),
        holding=run.holding,
    )


def killed_result(problem: Problem, iterates: tuple[Iterate, ...]) -> SearchResult:
    """Return the result of a run that ended because its process was killed."""
    if not iterates:
        return SearchResult("cancelled", "cancelled before the first iterate")
    best = min(iterates, key=Trail(problem, None, None).rank)
    return SearchResult(
        "cancelled",
        f"cancelled: {format_number(best.value, 6)} is the best of {len(iterates)} iterates",
        best,
        starts=iterates[-1].run + 1,
        iterations=sum(iterate.run == best.run for iterate in iterates) - 1,
    )
