"""Actions on paths: to make, play and plan one, and to store its ends."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import ClassVar, Literal

from explorer.app.state.action import Action
from explorer.app.state.actions import moved
from explorer.app.state.paths import Journey, Paths
from explorer.app.state.state import State, joints_of
from explorer.errors import InputError
from explorer.mechanism.kinematics import forward
from explorer.mechanism.margins import mode_name
from explorer.mechanism.pose import Pose


@dataclass(frozen=True)
class ChooseModes(Action):
    """Choose the assembly modes in which a path begins and ends."""

    template: ClassVar[str] = "Path from mode {action.first} to {action.last}"

    first: int
    last: int

    def apply(self, state: State) -> State:
        """Return the next state."""
        return _with(state, modes=(self.first, self.last))


@dataclass(frozen=True)
class WatchModes(Action):
    """Play the straight path between the chosen assembly modes of the present joints."""

    template: ClassVar[str] = "Watch the path between modes"

    def apply(self, state: State) -> State:
        """Return the next state, at the start of the path, playing.

        Raises:
            InputError: the path begins and ends in the same mode.
        """
        first, last = chosen_modes(state)
        if first == last:
            raise InputError(
                f"a path between modes needs two of them; both are mode {last} ({mode_name(last)})"
            )
        journey = state.journey
        pose = state.pose
        if journey is not None and journey.kind == "modes" and journey.pose == state.pose:
            # The pose is on such a path: the joints are those of its ends.
            pose = journey.poses[0]
        solution = forward(state.design, joints_of(state.design, pose))
        start, end = (
            Pose.of(solution.position[mode], solution.rotation[mode]) for mode in (first, last)
        )
        title = f"Mode {first} ({mode_name(first)}) to mode {last} ({mode_name(last)})"
        path = Journey("modes", title, state.design, (start, end), is_playing=True)
        after = _with(state, journey=path, modes=(first, last))
        return replace(moved(after, start), mode=first)


def chosen_modes(state: State) -> tuple[int, int]:
    """Return the assembly modes in which a path begins and ends."""
    first, last = state.paths.modes
    begin = state.mode if first is None else first
    return begin, begin ^ 4 if last is None else last


@dataclass(frozen=True)
class SetPathTime(Action):
    """Go to a time on the path, in seconds."""

    template: ClassVar[str] = "Path at {action.seconds:.3g} s"

    seconds: float

    def apply(self, state: State) -> State:
        """Return the next state.

        Raises:
            InputError: there is no path, or the time is not finite.
        """
        journey = _journey(state)
        if not math.isfinite(self.seconds):
            raise InputError(f"the time must be finite; got {self.seconds}")
        at = min(max(self.seconds, 0.0), journey.trajectory.duration)
        after = replace(journey, at=at)
        return moved(_with(state, journey=after), after.pose)


@dataclass(frozen=True)
class Play(Action):
    """Play the path, from its start if it is at its end; or pause it."""

    continues: ClassVar[bool] = True

    on: bool

    def apply(self, state: State) -> State:
        """Return the next state.

        Raises:
            InputError: there is no path.
        """
        journey = _journey(state)
        if not self.on:
            return _with(state, journey=replace(journey, is_playing=False))
        at = journey.at if journey.at < journey.trajectory.duration else 0.0
        after = replace(journey, at=at, is_playing=True)
        return moved(_with(state, journey=after), after.pose)


@dataclass(frozen=True)
class Advance(Action):
    """Advance a path that is playing by some seconds, until its end."""

    continues: ClassVar[bool] = True

    seconds: float

    def apply(self, state: State) -> State:
        """Return the next state."""
        journey = state.journey
        if journey is None or not journey.is_playing:
            return state
        at = min(journey.at + self.seconds, journey.trajectory.duration)
        after = replace(journey, at=at, is_playing=at < journey.trajectory.duration)
        return moved(_with(state, journey=after), after.pose)


@dataclass(frozen=True)
class StoreEnd(Action):
    """Store the present pose as the start or the goal of a path to plan."""

    template: ClassVar[str] = "Store the {action.end} of a path"

    end: Literal["start", "goal"]

    def apply(self, state: State) -> State:
        """Return the next state."""
        if self.end == "start":
            return _with(state, start=state.pose)
        return _with(state, goal=state.pose)


@dataclass(frozen=True)
class Plan(Action):
    """Request a path from the stored start to the stored goal."""

    template: ClassVar[str] = "Plan a path"

    def apply(self, state: State) -> State:
        """Return the next state.

        Raises:
            InputError: no start or no goal has been stored.
        """
        missing = [name for name in ("start", "goal") if getattr(state.paths, name) is None]
        if missing:
            raise InputError(
                f"store a {' and a '.join(missing)} first: move the platform there and press its "
                "button"
            )
        return _with(
            state, request=state.paths.request + 1, is_planning=True, problem=None, journey=None
        )


@dataclass(frozen=True)
class CancelPlan(Action):
    """Stop planning."""

    template: ClassVar[str] = "Stop planning"

    def apply(self, state: State) -> State:
        """Return the next state."""
        return _with(state, is_planning=False)


@dataclass(frozen=True)
class TakePlan(Action):
    """Accept the result of planning, unless a newer request has replaced its own.

    Attributes:
        request: Number of the request.
        journey: The path; None if none was found.
        problem: Reason why there is no path; None if there is one.
    """

    continues: ClassVar[bool] = True

    request: int
    journey: Journey | None
    problem: str | None

    def apply(self, state: State) -> State:
        """Return the next state, at the start of the path."""
        paths = state.paths
        if self.request != paths.request or not paths.is_planning:
            return state
        problem = self.problem
        if self.journey is not None and self.journey.design != state.design:
            problem = "the design has changed meanwhile; plan again"
        after = _with(state, is_planning=False, problem=problem, journey=self.journey)
        if after.journey is None:
            return after
        return moved(after, after.journey.pose)


def _journey(state: State) -> Journey:
    journey = state.journey
    if journey is None:
        raise InputError("there is no path for this design; watch one between modes, or plan one")
    return journey


def _with(state: State, **changes: object) -> State:
    paths: Paths = replace(state.paths, **changes)  # pyright: ignore[reportArgumentType]
    return replace(state, paths=paths)
