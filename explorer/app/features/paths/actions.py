"""Actions on paths, which make and play one, and the task of the planner's own process."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np

from explorer.app.features.loads.load import weights_of_parts
from explorer.app.features.paths.state import End, Journey, Paths, journey_of
from explorer.app.state.actions import Action, Set
from explorer.app.state.moves import move_to
from explorer.app.state.parts import with_value
from explorer.app.state.state import Joints, State, joints_of
from explorer.app.state.view import Weighed
from explorer.errors import InputError
from explorer.legs.moves import StraightMoves
from explorer.mechanism.design import Design
from explorer.mechanism.kinematics import forward
from explorer.mechanism.machine import Six
from explorer.mechanism.pose import Pose, Triple
from explorer.numerics.number_text import format_number
from explorer.paths.planning import PlannedPath, plan_path
from explorer.statics.loaded import LoadedPose

# Leg lengths that differ by less, over the reach, are the same.
SAME = 1e-9


@dataclass(frozen=True)
class Go(Action):
    """Play the straight path between the chosen ends, or request one without a singularity."""

    def apply(self, state: State) -> State:
        """Return the next state: at the start of the path and playing, or planning it.

        Raises:
            InputError: Both ends are the same pose, or an end is a mode that the present leg
                lengths do not have.
        """
        paths, ends = Paths.of(state), ends_of(state)
        if not StraightMoves.along(ends).have_length(state.design.reach).any():
            raise InputError(
                "the start and the goal are the same pose: choose another goal, or press Play to "
                "see the last path again"
            )
        # A goal that follows the present mode would be another one as soon as the platform moves.
        chosen = goal_of(state)
        if paths.kind == "planned":
            after = _with(state, goal=chosen, problem=None, journey=None)
            return _with(after, request=paths.request + 1, planning=ends)
        title = f"{_end_words(paths.start).capitalize()} to {_end_words(chosen)}"
        path = Journey("straight", title, state.design, ends, is_playing=True, tool=state.tool)
        after = _with(state, goal=chosen, problem=None, planning=None, journey=path)
        after = move_to(after, ends[0])
        return replace(after, mode=paths.start) if isinstance(paths.start, int) else after

    def describe(self, after: State) -> str:
        """Return which path was played or requested."""
        journey = journey_of(after)
        return "Plan a path" if journey is None else journey.title


@dataclass(frozen=True)
class SetEnd(Set):
    """Set an end of the next path; all numbers that are typed for one end are one step."""

    repeats: ClassVar[bool] = True


def goal_of(state: State) -> Pose | int:
    """Return the goal of the next path; where none is chosen, the mode beyond δ1 = 0."""
    goal = Paths.of(state).goal
    return state.mode ^ 4 if goal is None else goal


def ends_of(state: State) -> tuple[Pose, Pose]:
    """Return the poses between which the next path leads; errors are those of `pose_of_end`."""
    return pose_of_end(state, Paths.of(state).start), pose_of_end(state, goal_of(state))


def pose_of_end(state: State, end: End) -> Pose:
    """Return the pose of an end: itself, a mode of the present leg lengths, or the present pose.

    Raises:
        InputError: The present leg lengths do not close in other modes, to rounding.
    """
    if end is None:
        return state.pose
    if isinstance(end, Pose):
        return end
    solution = forward(state.design, _legs(state))
    if not solution.feasible:
        raise InputError(
            "the present leg lengths lie at the edge of what closes, where all modes are one; "
            "move the platform away from the singular pose"
        )
    return Pose.of(solution.position[end], solution.rotation[end])


def _legs(state: State) -> Joints:
    """Return the leg lengths whose modes are the ends of a path.

    During a straight path between two modes of equal leg lengths, they are those lengths.
    """
    journey = journey_of(state)
    if journey is not None and journey.kind == "straight" and journey.pose == state.pose:
        first, last = (joints_of(state.design, pose) for pose in journey.poses)
        if np.abs(np.subtract(first, last)).max() <= SAME * state.design.reach:
            return first
    return joints_of(state.design, state.pose)


def _end_words(end: End) -> str:
    if end is None:
        return "present pose"
    if isinstance(end, Pose):
        return "typed pose"
    return f"mode {end}"


@dataclass(frozen=True)
class SetPathTime(Action):
    """Go to a time on the path, in seconds."""

    seconds: float

    def apply(self, state: State) -> State:
        """Return the next state; refuse without a path, or a time that is not finite."""
        journey = _journey(state)
        if not math.isfinite(self.seconds):
            raise InputError(f"the time must be finite; got {self.seconds}")
        at = min(max(self.seconds, 0.0), journey.trajectory.duration)
        return _go_along(state, replace(journey, at=at))

    def words(self) -> str:
        """Return the words for the action."""
        return f"Path at {format_number(self.seconds, 3)} s"


@dataclass(frozen=True)
class Play(Action):
    """Play the path, from its start if it is at its end; or pause it."""

    continues: ClassVar[bool] = True

    on: bool

    def apply(self, state: State) -> State:
        """Return the next state; refuse without a path."""
        journey = _journey(state)
        if not self.on:
            return _with(state, journey=replace(journey, is_playing=False))
        at = journey.at if journey.at < journey.trajectory.duration else 0.0
        return _go_along(state, replace(journey, at=at, is_playing=True))


@dataclass(frozen=True)
class AdvanceJourney(Action):
    """Advance a path that is playing by some seconds, until its end."""

    continues: ClassVar[bool] = True

    seconds: float

    def apply(self, state: State) -> State:
        """Return the next state."""
        journey = journey_of(state)
        if journey is None or not journey.is_playing:
            return state
        at = min(journey.at + self.seconds, journey.trajectory.duration)
        after = replace(journey, at=at, is_playing=at < journey.trajectory.duration)
        return _go_along(state, after)


@dataclass(frozen=True)
class TakePlan(Action):
    """Accept the path of a request, or why there is none, unless a newer one has replaced it."""

    continues: ClassVar[bool] = True

    request: int
    journey: Journey | None
    problem: str | None

    def apply(self, state: State) -> State:
        """Return the next state, at the start of the path."""
        paths = Paths.of(state)
        if self.request != paths.request or not paths.is_planning:
            return state
        problem = self.problem
        if self.journey is not None and self.journey.design != state.design:
            problem = "the design has changed meanwhile; press Go again"
        after = _with(state, planning=None, problem=problem, journey=self.journey)
        journey = journey_of(after)
        return after if journey is None else move_to(after, journey.pose)


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
    ends: tuple[Pose, Pose],
    seconds: float,
    tool: Triple | None,
    load: Six | None,
    weighed: Weighed,
    density: float,
) -> PlannedPath:
    """Return a path between two poses, as `explorer.paths.planning.plan_path` finds it.

    If there is a load to hold, the weights of bodies act besides; the density of the parts is in
    kg/m³.
    """
    weights = own = None
    if load is not None:
        if weighed == "payload and legs":
            own = weights_of_parts((design, density))
        weights = LoadedPose(design, ends[0], load, own, weighed != "none").weights
    return plan_path(design, *ends, seconds=seconds, tool=tool, load=load, weights=weights)
