"""What is to be optimised and how far that has got: a part of the state, frozen as all of it.

The user's own state is kept aside while the page shows the iterates, so that it comes back
exactly. What people ask for is a `Wish`; a `Problem` is made of it when they press the button.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from functools import lru_cache
from typing import TYPE_CHECKING, Literal

import msgspec
import numpy as np

from explorer.constraints import Never, constraints
from explorer.design import VARIABLES, Design
from explorer.errors import ExplorerError
from explorer.home import home_pose
from explorer.optimise.defaults import make_problem
from explorer.optimise.facts import Facts
from explorer.optimise.outcome import Iterate, Outcome, Status
from explorer.optimise.problem import (
    SHIFTS,
    YAW,
    Box,
    Demands,
    ObjectiveName,
    Problem,
    longest_length,
)
from explorer.optimise.record import Record, Settings, record_of
from explorer.optimise.refutation import Refutation, paper_box, refutations
from explorer.optimise.starts import check_starts
from explorer.optimise.trail import Trail
from explorer.workspace import workspace_volume

if TYPE_CHECKING:
    from explorer.app.state import State

PLACE = "place"
"""Stands for the three shifts of the required box."""

# The volume to match, unless one is given: more than the design has, by this factor or so.
MORE = 1.1
# Of the largest box about home in the workspace: the edge of the one that is suggested.
SHARE_OF_BOX = 0.5
# Positions on each edge of a box at which it is tried, and halvings of its edge.
TRIED, HALVINGS = 5, 30


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
class Verdict:
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

    before: Facts
    after: Facts


@dataclass(frozen=True)
class Run:
    """A run of the optimiser.

    Attributes:
        number: Of the run, from 1.
        problem: That is solved.
        starts: From how many designs.
        own: The state before it, to which to return.
        phase: Whether it goes on, has been asked to end, or has ended.
        iterates: Those that have been shown; the last one is what is drawn.
        verdict: How it ended, once it has.
        comparison: Of own and found design, once it is there.
        accepted: Whether the result was accepted.
    """

    number: int
    problem: Problem
    starts: int
    own: State
    phase: Literal["running", "cancelling", "ended"] = "running"
    iterates: tuple[Iterate, ...] = ()
    verdict: Verdict | None = None
    comparison: Comparison | None = None
    accepted: bool = False

    @property
    def is_undecided(self) -> bool:
        """Whether there is a result that was neither accepted nor given up."""
        return self.best is not None and not self.accepted

    @property
    def best(self) -> Iterate | None:
        """What was found, once it has ended."""
        return None if self.verdict is None else self.verdict.best


@dataclass(frozen=True)
class Optimisation:
    """All that the state knows of it.

    Attributes:
        wish: What is asked for.
        run: The last run, or the one that goes on; None if there is none of this design.
        count: Of all runs so far.
        refusal: Why the last one was not begun, if it was not.
    """

    wish: Wish = field(default_factory=Wish)
    run: Run | None = None
    count: int = 0
    refusal: str | None = None

    @property
    def is_on(self) -> bool:
        """Whether a run goes on."""
        return self.run is not None and self.run.phase != "ended"

    @property
    def record(self) -> Record | None:
        """Of the search that ended last; None where there is none to repeat."""
        verdict = None if self.run is None else self.run.verdict
        return None if verdict is None else verdict.record


def wished_volume(state: State) -> float:
    """Return the volume that is asked for."""
    return _wished_volume(state.base, state.optimisation.wish)


def wished_reach(state: State) -> float:
    """Return the largest reach that is asked for."""
    return _wished_reach(state.base, state.optimisation.wish)


def wished_box(state: State) -> Box:
    """Return the box that is required."""
    return _wished_box(state.base, state.optimisation.wish)


def _wished_volume(base: Design, wish: Wish) -> float:
    if wish.volume is not None:
        return wish.volume
    return _volume(base, same=wish.objective == "smallest-reach")


def _wished_reach(base: Design, wish: Wish) -> float:
    return longest_length(base) if wish.reach is None else wish.reach


def _wished_box(base: Design, wish: Wish) -> Box:
    return wish.box or box_within(base)


def problem_of(state: State) -> Problem:
    """Return the problem that is asked for, from the present design.

    Raises:
        ExplorerError: it cannot be asked like that.
    """
    return _problem(state.design, state.base, state.optimisation.wish)


def _problem(design: Design, base: Design, wish: Wish) -> Problem:
    free = [name for name in wish.free if name in (*VARIABLES, YAW)]
    if wish.needs_box and PLACE in wish.free:
        free += SHIFTS
    problem = make_problem(
        design,
        wish.objective,
        volume=_wished_volume(base, wish) if wish.needs_volume else None,
        reach=_wished_reach(base, wish) if wish.needs_reach else None,
        clearance=None if wish.clearance == 0.0 else wish.clearance,
        required_box=_wished_box(base, wish) if wish.needs_box else None,
        free=[name for name in free if name not in VARIABLES],
    )
    variables = tuple(each for each in problem.variables if each.name in free)
    return msgspec.structs.replace(problem, variables=variables)


def refuted(state: State) -> tuple[Refutation, ...]:
    """Return what the limits cannot give of what is asked for.

    Empty if a search may give it, and where no problem can be made of it: that is told when
    the search is asked for.
    """
    return _refuted(state.design, state.base, state.optimisation.wish)


@lru_cache(maxsize=8)
def _refuted(design: Design, base: Design, wish: Wish) -> tuple[Refutation, ...]:
    problem = _problem_or_none(design, base, wish)
    return () if problem is None else refutations(problem)


def box_on_offer(state: State) -> Box | None:
    """Return the box of the paper's optimum where that holds what is asked for."""
    return _box_on_offer(state.design, state.base, state.optimisation.wish)


@lru_cache(maxsize=8)
def _box_on_offer(design: Design, base: Design, wish: Wish) -> Box | None:
    problem = _problem_or_none(design, base, wish)
    return None if problem is None else paper_box(problem)


def _problem_or_none(design: Design, base: Design, wish: Wish) -> Problem | None:
    try:
        return _problem(design, base, wish)
    except ExplorerError:
        return None


def verdict_of(outcome: Outcome, starts: int) -> Verdict:
    """Return how a search from so many starts ended."""
    run = outcome.run
    return Verdict(
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


def cut_short(problem: Problem, iterates: tuple[Iterate, ...]) -> Verdict:
    """Return how a run ended whose process had to be ended to end it."""
    if not iterates:
        return Verdict("cancelled", "cancelled before the first iterate")
    best = min(iterates, key=Trail(problem, None, None).rank)
    return Verdict(
        "cancelled",
        f"cancelled: {best.objective:.6g} is the best of {len(iterates)} iterates",
        best,
        starts=iterates[-1].run + 1,
        iterations=sum(each.run == best.run for each in iterates) - 1,
    )


@lru_cache(maxsize=8)
def box_within(design: Design) -> Box:
    """Return a box in the workspace about the home position, or where that is not, a small one."""
    home = home_pose(design)
    limits = constraints(design, home.rotation)
    middle = np.array(home.position)
    grid = np.indices((TRIED,) * 3).reshape(3, -1).T / (TRIED - 1.0) - 0.5

    def is_within(edge: float) -> bool:
        at = middle + edge * grid
        return all(
            not isinstance(limit, Never) and bool((limit.slack(at) >= 0.0).all())
            for limit in limits
        )

    low, high = 0.0, 2.0 * design.reach
    for _ in range(HALVINGS):
        half = 0.5 * (low + high)
        low, high = (half, high) if is_within(half) else (low, half)
    edge = SHARE_OF_BOX * low or 0.1 * design.reach
    # Round numbers read better, and the box need not be just this one.
    unit = 10.0 ** math.floor(math.log10(edge) - 1.0)
    digits = max(0, -round(math.log10(unit)))
    lows, highs = (
        [round(float(value), digits) for value in middle + side * 0.5 * edge]
        for side in (-1.0, 1.0)
    )
    return (lows[0], lows[1], lows[2]), (highs[0], highs[1], highs[2])


@lru_cache(maxsize=8)
def _volume(design: Design, *, same: bool) -> float:
    """Return the volume of a design to six digits, or the next round one that is larger."""
    volume = workspace_volume(design).volume or design.reach**3
    if same:
        return float(f"{volume:.6g}")
    power = 10.0 ** math.floor(math.log10(MORE * volume))
    return math.ceil(MORE * volume / power) * power
