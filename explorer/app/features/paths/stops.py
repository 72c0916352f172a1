"""The poses of the next path as a list, and the actions that change it.

The first pose follows the platform until another is added to the list; alone it is followed by the
mode beyond δ1 = 0. Assembly modes are those of the present leg lengths.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np

from explorer.app.features.paths.state import MOST_STOPS, Paths, Stop, StopAt, journey_of
from explorer.app.state.actions import Act, action
from explorer.app.state.parts import with_value
from explorer.app.state.state import Joints, State, joints_of
from explorer.errors import InputError
from explorer.export.pose_tables import parse_table, read_corners
from explorer.mechanism.kinematics import forward
from explorer.mechanism.pose import Pose

# Leg lengths that differ by less, over the reach, are the same.
SAME = 1e-9


def _stops_words(_: State, __: object, ___: object, text: str) -> str:
    return text


@action(_stops_words)
def set_stops(state: State, stops: tuple[Stop, ...], chosen: int | None, text: str) -> State:
    """Set the poses of the next path, and which of them is edited."""
    del text
    paths = replace(Paths.of(state), stops=stops, chosen=chosen, problem=None)
    return with_value(state, "paths", paths)


@action("", continues=True)
def choose_stop(state: State, index: int) -> State:
    """Choose the pose of the list that is edited; if it is that one, none is any more."""
    return with_value(state, "paths.chosen", None if chosen_of(state) == index else index)


def stops_of(state: State) -> tuple[Stop, ...]:
    """Return the poses of the next path; after the present one alone the mode beyond δ1 = 0."""
    stops = Paths.of(state).stops
    is_alone = [stop.at for stop in stops] == [None]
    return (*stops, Stop(state.mode ^ 4)) if is_alone else stops


def chosen_of(state: State) -> int | None:
    """Return the index of the pose that is edited; None if none is."""
    chosen = Paths.of(state).chosen
    return chosen if chosen is not None and chosen < len(stops_of(state)) else None


def poses_of(state: State) -> tuple[Pose, ...]:
    """Return the poses between which the next path leads; errors are those of `pose_of`."""
    return tuple(pose_of(state, stop.at) for stop in stops_of(state))


def pose_of(state: State, at: StopAt) -> Pose:
    """Return the pose of a stop: itself, a mode of the present leg lengths, or the present pose.

    Raises:
        InputError: The present leg lengths do not close in other modes, to rounding.
    """
    if at is None:
        return state.pose
    if isinstance(at, Pose):
        return at
    solution = forward(state.design, _legs(state))
    if not solution.feasible:
        raise InputError(
            "the present leg lengths lie at the edge of what closes, where all modes are one; "
            "move the platform away from the singular pose"
        )
    return Pose.of(solution.position[at], solution.rotation[at])


def _legs(state: State) -> Joints:
    """Return the leg lengths whose modes are poses of a path.

    During a straight path between modes of equal leg lengths, they are those lengths.
    """
    journey = journey_of(state)
    if journey is not None and journey.kind == "straight" and journey.pose == state.pose:
        joints = [joints_of(state.design, pose) for pose in journey.poses]
        if np.ptp(joints, axis=0).max() <= SAME * state.design.reach:
            return joints[0]
    return joints_of(state.design, state.pose)


def pinned_stops(state: State) -> tuple[Stop, ...]:
    """Return the poses of the list, with the present one as numbers."""
    stops = Paths.of(state).stops
    return tuple(replace(s, at=state.pose) if s.at is None else s for s in stops)


def add_present(state: State) -> Act:
    """Return the action that adds the present pose after the edited one, or as the last."""
    stops, chosen = pinned_stops(state), chosen_of(state)
    if Paths.of(state).stops == (Stop(),):
        return set_stops(stops, None, "Pose 1 of the path: present pose")
    at = len(stops) if chosen is None else min(chosen + 1, len(stops))
    # None is edited, so that the handle in the scene is that of the platform.
    return _insert(stops, at, Stop(state.pose), "present pose", is_edited=False)


def copy_stop(state: State, index: int) -> Act:
    """Return the action that adds a pose of the list as numbers behind it, to be changed."""
    at = stops_of(state)[index].at
    stops = pinned_stops(state) if index < len(Paths.of(state).stops) else stops_of(state)
    return _insert(stops, index + 1, Stop(pose_of(state, at)), f"as pose {index + 1}")


def close_path(state: State) -> Act | None:
    """Return the action that ends the path in its first pose; None for a single pose."""
    stops = pinned_stops(state)
    if len(stops) < 2 or stops[-1].at == stops[0].at:
        return None
    return _insert(stops, len(stops), Stop(stops[0].at), "as pose 1")


def _insert(
    stops: tuple[Stop, ...], at: int, stop: Stop, words: str, *, is_edited: bool = True
) -> Act:
    text, chosen = f"Pose {at + 1} of the path: {words}", at if is_edited else None
    return set_stops((*stops[:at], stop, *stops[at:]), chosen, text)


def remove_stop(state: State, index: int) -> Act:
    """Return the action that removes a pose; without one the path starts in the present pose."""
    stops = Paths.of(state).stops
    rest = (*stops[:index], *stops[index + 1 :]) or (Stop(),)
    return set_stops(rest, None, f"Pose {index + 1} removed from the path")


def lift_stop(state: State, index: int) -> Act | None:
    """Return the action that moves a pose one place towards the start; None for the first."""
    stops = pinned_stops(state)
    if not 0 < index < len(stops):
        return None
    swapped = (*stops[: index - 1], stops[index], stops[index - 1], *stops[index + 1 :])
    return set_stops(swapped, index - 1, f"Pose {index + 1} of the path before pose {index}")


def set_stop(state: State, text: str, **changes: object) -> Act | None:
    """Return the action that changes the edited pose or its pause; None if none is edited."""
    chosen = chosen_of(state)
    if chosen is None:
        return None
    stops = [*stops_of(state)]
    stops[chosen] = replace(stops[chosen], **changes)  # pyright: ignore[reportArgumentType]
    text = f"Pose {chosen + 1} of the path: {text}"
    # All numbers that are set of it are one step.
    return replace(set_stops(tuple(stops), chosen, text), repeats=True)


def stops_in_table(state: State, data: bytes, name: str) -> Act:
    """Return the action that takes the poses and pauses of a table; it is one of corners.

    Positions are those of the tool where the table has columns of it. The words of the action name
    the columns that are not read.

    Raises:
        InputError: The table has none, or too many.
    """
    table = parse_table(Path(name).name, data, state.design.unit_mm)
    at = "tool" if "tool_x" in table.columns else "b4"
    poses, pauses = read_corners(table, state.design, state.pose.rotation, at)
    if len(table.rows) > MOST_STOPS:
        raise InputError(
            f"{name} has {len(table.rows)} poses, and a path on the page at most {MOST_STOPS}: "
            "explorer drives takes longer ones"
        )
    stops = tuple(map(Stop, poses, pauses))
    left_out = f", without its columns {', '.join(table.skipped)}" if table.skipped else ""
    return set_stops(stops, None, f"Poses of the path from {name}: {len(stops)}{left_out}")
