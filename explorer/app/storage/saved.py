"""A state as it is kept in a file: all of it that is a document.

Left out is what goes on by itself: the gesture of a hand, a request to plan, whether a path
plays. A run of the optimiser is kept as if it had been cancelled at that moment, so that its
best and the user's own design are both there. Every number is kept to the last bit.
"""

from __future__ import annotations

from typing import Annotated, Literal

import msgspec

from explorer.app.features.optimise.actions import EndRun
from explorer.app.state.actions import SetJoint
from explorer.app.state.compared import Compared
from explorer.app.state.jog import Jog
from explorer.app.state.optimisation import PLACE, SearchResult, Wish, cut_short
from explorer.app.state.paths import Journey, Paths
from explorer.app.state.state import Hold, Joints, Optimisation, Run, State
from explorer.app.state.studies import Studies
from explorer.app.state.view import View
from explorer.errors import InputError
from explorer.mechanism.design import VARIABLES, Design
from explorer.mechanism.pose import Pose, Triple
from explorer.optimise.problem import YAW, Problem
from explorer.optimise.record import Step, iterate_of, step_of
from explorer.singularity.uncoupled import UNCOUPLED

Mode = Annotated[int, msgspec.Meta(ge=0, le=7)]
Joint = Annotated[int, msgspec.Meta(ge=0, le=5)]
Count = Annotated[int, msgspec.Meta(ge=0)]


class SavedJourney(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """A path without how far it has been played; see `Journey`."""

    kind: Literal["modes", "plan"]
    title: str
    design: Design
    poses: Annotated[tuple[Pose, ...], msgspec.Meta(min_length=2)]


class SavedRun(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """A run of the optimiser that has ended; see `Run`.

    Its comparison is left out, since that is made anew where a run without one is opened.

    Attributes:
        own: The state before it.
        iterates: Those of the start that the best belongs to; their designs follow from the
            values.
    """

    number: Count
    problem: Problem
    starts: Count
    own: SavedSession
    iterates: tuple[Step, ...]
    verdict: SearchResult
    accepted: bool


class SavedSession(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """What of a `State` is a document, by the same names.

    Attributes:
        asked: The joint whose value does not close, if one does not.
        path_modes, path_start, path_goal, path_seconds: Of `Paths`.
        journey_at: How far the path has been played, in seconds.
        runs: How many runs of the optimiser there have been.
    """

    design: Design
    base: Design
    pose: Pose
    yaw_pitch_roll: Triple
    joints: Joints
    mode: Mode
    asked: Joint | None = None
    hold: Hold = "pose"
    view: View = View()
    jog: Jog | None = None
    path_modes: tuple[Mode | None, Mode | None] = (None, None)
    path_start: Pose | None = None
    path_goal: Pose | None = None
    path_seconds: Annotated[float, msgspec.Meta(gt=0.0)] = Paths.seconds
    journey: SavedJourney | None = None
    journey_at: float = 0.0
    wish: Wish = Wish()
    runs: Count = 0
    run: SavedRun | None = None
    compared: Compared = Compared()
    studies: Studies = Studies()


def saved(state: State) -> SavedSession:
    """Return what of a state is a document."""
    state = _with_ended_run(state)
    paths, found, journey = state.paths, state.optimisation, state.paths.journey
    return SavedSession(
        design=state.design,
        base=state.base,
        pose=state.pose,
        yaw_pitch_roll=state.yaw_pitch_roll,
        joints=state.joints,
        mode=state.mode,
        asked=None if state.unclosed is None else state.unclosed.joint,
        hold=state.hold,
        view=state.view,
        jog=state.jog,
        path_modes=paths.modes,
        path_start=paths.start,
        path_goal=paths.goal,
        path_seconds=paths.seconds,
        journey=None if journey is None else _saved_journey(journey),
        journey_at=0.0 if journey is None else journey.at,
        wish=found.wish,
        runs=found.count,
        run=None if found.run is None else _saved_run(found.run),
        compared=state.compared,
        studies=state.studies,
    )


def restored(session: SavedSession) -> State:
    """Return the state that was kept, with what follows from it computed again.

    Raises:
        InputError: values that no state has.
    """
    _check(session)
    journey = session.journey
    state = State(
        design=session.design,
        base=session.base,
        pose=session.pose,
        yaw_pitch_roll=session.yaw_pitch_roll,
        joints=session.joints,
        mode=session.mode,
        hold=session.hold,
        view=session.view,
        jog=session.jog,
        paths=Paths(
            modes=session.path_modes,
            start=session.path_start,
            goal=session.path_goal,
            seconds=session.path_seconds,
            journey=None if journey is None else _journey(journey, session.journey_at),
        ),
        optimisation=Optimisation(
            wish=session.wish,
            run=None if session.run is None else _run(session.run),
            count=session.runs,
        ),
        compared=session.compared,
        studies=session.studies,
    )
    if session.asked is None:
        return state
    return SetJoint(session.asked, session.joints[session.asked]).apply(state)


def _with_ended_run(state: State) -> State:
    run = state.optimisation.run
    if run is None or run.phase == "ended":
        return state
    return EndRun(run.number, cut_short(run.problem, run.iterates)).apply(state)


def _saved_journey(journey: Journey) -> SavedJourney:
    return SavedJourney(
        kind=journey.kind, title=journey.title, design=journey.design, poses=journey.poses
    )


def _journey(saved: SavedJourney, at: float) -> Journey:
    return Journey(saved.kind, saved.title, saved.design, saved.poses, at)


def _saved_run(run: Run) -> SavedRun:
    verdict = run.verdict
    if verdict is None:
        raise InputError(f"run {run.number} has ended without a verdict")
    shown = None if verdict.best is None else verdict.best.run
    return SavedRun(
        number=run.number,
        problem=run.problem,
        starts=run.starts,
        own=saved(run.own),
        iterates=tuple(step_of(each) for each in run.iterates if each.run == shown),
        verdict=verdict,
        accepted=run.accepted,
    )


def _run(saved: SavedRun) -> Run:
    return Run(
        number=saved.number,
        problem=saved.problem,
        starts=saved.starts,
        own=restored(saved.own),
        phase="ended",
        iterates=tuple(iterate_of(saved.problem, each) for each in saved.iterates),
        verdict=saved.verdict,
        accepted=saved.accepted,
    )


def _check(session: SavedSession) -> None:
    """Refuse what the types allow and no state has.

    Raises:
        InputError: there is such a value.
    """
    wish, jog = session.wish, session.jog
    if jog is not None and not 0 <= jog.motion < len(UNCOUPLED):
        raise InputError(f"there is no uncoupled motion {jog.motion}")
    strange = {*wish.free} - {*VARIABLES, YAW, PLACE}
    if strange:
        raise InputError(f"nothing named {min(strange)!r} can be free in an optimisation")
    if wish.starts < 1 or wish.clearance < 0.0:
        raise InputError("an optimisation has a start, and a clearance not below zero")
    if session.run is not None and session.run.own.run is not None:
        raise InputError("the state before a run has none itself")
