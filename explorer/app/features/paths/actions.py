"""Actions on paths, which make and play one, and the tasks on paths of other processes."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from itertools import pairwise

from explorer.app.features.loads.load import weights_of_parts
from explorer.app.features.paths.state import Journey, Paths, StopAt, journey_of
from explorer.app.features.paths.stops import poses_of, stops_of
from explorer.app.session.feed import FeedOf
from explorer.app.state.actions import Set, action
from explorer.app.state.moves import move_to
from explorer.app.state.parts import with_value
from explorer.app.state.state import State
from explorer.app.state.view import Weighed
from explorer.errors import ExplorerError, InputError
from explorer.export.drawings.drives import force_speed_chart, time_charts
from explorer.export.drawings.markup import as_html
from explorer.legs.moves import StraightMoves
from explorer.measures.blocks.block import Block
from explorer.mechanism.design import Design
from explorer.mechanism.machine import Six
from explorer.mechanism.pose import Pose, Triple
from explorer.numerics.number_text import format_number
from explorer.paths.drives import TimedPath, drive_blocks, drives_along
from explorer.paths.planning import plan_path
from explorer.statics.loaded import LoadedPose


def _go_words(after: State) -> str:
    journey = journey_of(after)
    return "Plan a path" if journey is None else journey.title


@action(_go_words)
def go(state: State) -> State:
    """Play the straight path along the poses of the list, or request one without a singularity.

    Raises:
        InputError: All poses are the same, or one is a mode that the present leg lengths do not
            have.
    """
    # A mode that follows the present one would be another one once the platform moves.
    stops, poses = stops_of(state), poses_of(state)
    if not StraightMoves.along(poses).have_length(state.design.reach).any():
        again = "" if journey_of(state) is None else ", or press Play to see the last path again"
        raise InputError(f"a path needs two poses that differ: add one to the list{again}")
    cleared = _with(state, stops=stops, chosen=None, problem=None, planning=None, journey=None)
    if Paths.of(state).kind == "planned":
        return _with(cleared, request=Paths.of(state).request + 1, planning=poses)
    pauses, start = tuple(stop.pause for stop in stops), stops[0].at
    ends = f"{_words(start).capitalize()} to {_words(stops[-1].at)}"
    title = ends if len(stops) == 2 else f"Path of {len(stops)} poses"
    path = Journey(
        *("straight", title, state.design, poses), is_playing=True, tool=state.tool, pauses=pauses
    )
    after = move_to(_with(cleared, journey=path), poses[0])
    return replace(after, mode=start) if isinstance(start, int) else after


@dataclass(frozen=True)
class SetLaw(Set):
    """Set what the time of the path depends on; the platform stays where it is on it."""

    def apply(self, state: State) -> State:
        """Return the next state."""
        before, after = journey_of(state), super().apply(state)
        journey = journey_of(after)
        if before is None or journey is None:
            return after
        at = journey.time_at(before.place_at(before.at))
        return _with(after, journey=replace(journey, at=at))


def _words(at: StopAt) -> str:
    if at is None:
        return "present pose"
    return "typed pose" if isinstance(at, Pose) else f"mode {at}"


def _time_words(_: State, seconds: float) -> str:
    return f"Path at {format_number(seconds, 3)} s"


@action(_time_words)
def set_path_time(state: State, seconds: float) -> State:
    """Go to a time on the path, in seconds; refuse without a path, or a time that is not finite."""
    journey = _journey(state)
    if not math.isfinite(seconds):
        raise InputError(f"the time must be finite; got {seconds}")
    at = min(max(seconds, 0.0), journey.trajectory.duration)
    return _go_along(state, replace(journey, at=at))


@action("", continues=True)
def play(state: State, on: bool) -> State:
    """Play the path, from its start if it is at its end, or pause it; refuse without a path."""
    journey = _journey(state)
    if not on:
        return _with(state, journey=replace(journey, is_playing=False))
    at = journey.at if journey.at < journey.trajectory.duration else 0.0
    return _go_along(state, replace(journey, at=at, is_playing=True))


@action("", continues=True)
def advance_journey(state: State, seconds: float) -> State:
    """Advance a path that is playing by some seconds of playback, until its end."""
    journey = journey_of(state)
    if journey is None or not journey.is_playing:
        return state
    end = journey.trajectory.duration
    at = min(journey.at + seconds / Paths.of(state).slower, end)
    return _go_along(state, replace(journey, at=at, is_playing=at < end))


@action("", continues=True)
def take_plan(state: State, request: int, journey: Journey | None, problem: str | None) -> State:
    """Accept the path of a request, or why there is none, unless a newer one has replaced it.

    The platform goes to the start of the path.
    """
    paths = Paths.of(state)
    if request != paths.request or not paths.is_planning:
        return state
    if journey is not None and journey.design != state.design:
        problem = "the design has changed meanwhile; press Go again"
    after = _with(state, planning=None, problem=problem, journey=journey)
    own = journey_of(after)
    return after if own is None else move_to(after, own.pose)


def _journey(state: State) -> Journey:
    journey = journey_of(state)
    if journey is None:
        raise InputError("there is no path for this design; press Go to make one")
    return journey


def _go_along(state: State, journey: Journey) -> State:
    """Return the state at the present place of a path."""
    return move_to(_with(state, journey=journey), journey.pose)


def _with(state: State, **changes: object) -> State:
    paths: Paths = replace(Paths.of(state), **changes)  # pyright: ignore[reportArgumentType]
    return with_value(state, "paths", paths)


def plan(
    design: Design,
    poses: tuple[Pose, ...],
    seconds: float,
    tool: Triple | None,
    load: Six | None,
    weighed: Weighed,
    density: float,
) -> tuple[tuple[Pose, ...], tuple[int, ...]]:
    """Return the corners of a path along poses, and the index of each of these among them.

    Between two poses `explorer.paths.planning.plan_path` finds it. If there is a load to hold, the
    weights of bodies act besides; the density of the parts is in kg/m³.
    """
    weights = own = None
    if load is not None:
        if weighed == "payload and legs":
            own = weights_of_parts((design, density))
        weights = LoadedPose(design, poses[0], load, own, weighed != "none").weights
    corners, places = [poses[0]], [0]
    for ends in pairwise(poses):
        if ends[0] != ends[1]:
            path = plan_path(design, *ends, seconds=seconds, tool=tool, load=load, weights=weights)
            corners += path.poses[1:]
        places.append(len(corners) - 1)
    return tuple(corners), tuple(places)


@dataclass(frozen=True, eq=False)
class DrivesDrawing:
    """The actuators' speeds, forces and powers along a path, and the charts as SVG."""

    blocks: tuple[Block, ...]
    charts: str


def request_for(state: State) -> tuple[Design, TimedPath] | None:
    """Return the design and the path of a state in its time; None without a path."""
    journey = journey_of(state)
    return None if journey is None else (journey.design, journey.path)


def draw_drives(request: tuple[Design, TimedPath]) -> DrivesDrawing | ExplorerError:
    """Return the actuators' speeds, forces and powers along a path, or why there are none."""
    try:
        found = drives_along(*request)
    except ExplorerError as error:
        return error
    charts = "".join(as_html(chart) for chart in (time_charts(found), force_speed_chart(found)))
    return DrivesDrawing(tuple(drive_blocks(found)), charts)


DRIVES_FEED = FeedOf(draw_drives, lambda frame: request_for(frame.state))
