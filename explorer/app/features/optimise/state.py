"""The optimiser's part of the state: what the user requests, the last run and its result.

The state before a run is kept while the page shows the iterates, so that it can be restored
exactly. The user fills in an `OptimisationRequest`; a `Problem` is made of it when the run begins.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Annotated, Literal, Self

import msgspec

from explorer.app.state.parts import LENGTHS, TRANSIENT, VOLUME, FeaturePart
from explorer.app.state.state import State
from explorer.errors import InputError
from explorer.measures.catalogue import Measurements
from explorer.mechanism.design import VARIABLES
from explorer.optimise import problem as problems
from explorer.optimise.outcome import Iterate, Record, Status
from explorer.optimise.search.starts import check_starts

Count = Annotated[int, msgspec.Meta(ge=0)]


@dataclass(frozen=True)
class OptimisationRequest:
    """The user's request; lengths in design units.

    Attributes:
        volume: Volume to match, or the least one; None for one that suits the design.
        reach: Largest reach; None for that of the design.
        clearance: As in `Demands`; 0 for no demand.
        free: Names of what may change, out of `VARIABLES` and `YAW`.

    Raises:
        InputError: A volume or reach that is not positive, a clearance below zero, too few or too
            many starts, or an unknown name in `free`.
    """

    objective: problems.ObjectiveName = "match-volume"
    volume: float | None = field(default=None, metadata=VOLUME)
    reach: float | None = field(default=None, metadata=LENGTHS)
    clearance: float = field(default=0.0, metadata=LENGTHS)
    free: tuple[str, ...] = VARIABLES
    starts: int = 1

    def __post_init__(self) -> None:
        unknown = {*self.free} - {*VARIABLES, problems.YAW}
        if unknown:
            raise InputError(f"nothing named {min(unknown)!r} can be free in an optimisation")
        check_starts(self.starts)
        problems.Demands(volume=self.volume, reach=self.reach, clearance=self.clearance or None)

    @property
    def needs_volume(self) -> bool:
        """Whether the objective takes a volume, by default the present one, rather than a reach."""
        return self.objective != "largest-volume"


REACHED = "{objective}"
"""The place of the objective in the message of a search, which is shown in the unit of the page."""


@dataclass(frozen=True)
class SearchResult:
    """How a run ended.

    Attributes:
        status: That of the outcome; "failed" if there is none.
        message: One line for people, in which `REACHED` stands for the objective with its name.
        record: Record from which to repeat the run; None if it was killed or failed.
    """

    status: Status | Literal["failed"]
    message: str
    best: Iterate | None = None
    starts: int = 0
    converged: int = 0
    seconds: float | None = None
    record: Record | None = None


@dataclass(frozen=True)
class SearchRun:
    """A run of the optimiser.

    Attributes:
        number: Number of the run, from 1.
        own: The state before the run, to which cancelling returns.
        phase: Whether it is running, was told to end, or has ended.
        iterates: The iterates shown so far; the last one is drawn.
        verdict: How it ended; None until then.
        comparison: Measures of the own and the optimised design; None until they are known.

    Raises:
        InputError: A run within the state before it, or one that has ended without a verdict.
    """

    number: Count
    problem: problems.Problem
    starts: Count
    own: State
    phase: Literal["running", "cancelling", "ended"] = "running"
    iterates: tuple[Iterate, ...] = ()
    verdict: SearchResult | None = None
    comparison: tuple[Measurements, Measurements] | None = field(default=None, metadata=TRANSIENT)
    accepted: bool = False

    def __post_init__(self) -> None:
        if Optimisation.of(self.own).run is not None:
            raise InputError("the state before a run has none itself")
        if self.phase == "ended" and self.verdict is None:
            raise InputError(f"run {self.number} has ended without a verdict")

    def for_file(self) -> SearchRun:
        """Return the run as a file holds it: only with the iterates of the best start."""
        best = self.best
        iterates = () if best is None else tuple(i for i in self.iterates if i.run == best.run)
        return replace(self, iterates=iterates)

    @property
    def has_converged(self) -> bool:
        """Whether its result is an optimum that keeps all demands."""
        return self.verdict is not None and self.verdict.status == "converged"

    @property
    def best(self) -> Iterate | None:
        """The best iterate; None until the run has ended, or if there is none."""
        return None if self.verdict is None else self.verdict.best


@dataclass(frozen=True)
class Optimisation(FeaturePart, name="optimisation"):
    """The request for an optimisation, its last run, and the number of runs so far."""

    request: OptimisationRequest = field(default_factory=OptimisationRequest, metadata=LENGTHS)
    run: SearchRun | None = None
    count: Count = 0

    @property
    def is_on(self) -> bool:
        """Whether a run has not ended yet."""
        return self.run is not None and self.run.phase != "ended"

    @property
    def undecided(self) -> SearchRun | None:
        """The run whose result was neither accepted nor given up; None if there is none."""
        run = self.run
        return run if run is not None and run.best is not None and not run.accepted else None

    @property
    def busy(self) -> str:
        """Why the design cannot be changed now, as a clause; "" if it can."""
        return "the design is being optimised" if self.is_on else ""

    def on_open(self) -> Self:
        """Return the part for another design: the request and the count of runs."""
        return replace(self, run=None)

    def continue_from(self, present: Self) -> Self:
        """Return this part whose next run has a number above those of the present one, too."""
        return replace(self, count=max(self.count, present.count))

    @property
    def record(self) -> Record | None:
        """The record of the search that ended last; None where there is none to repeat."""
        verdict = None if self.run is None else self.run.verdict
        return None if verdict is None else verdict.record
