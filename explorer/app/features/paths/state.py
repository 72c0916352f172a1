"""The path that is played on the page, and the settings of the next one.

A path is the straight move between two poses, which may be singular on the way, or was planned
without a singularity; b4 or the tool point goes along lines. It belongs to the design that it was
made for; with another design there is none.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from functools import lru_cache
from typing import Literal, Self, TypeAlias

import msgspec
import numpy as np

from explorer.app.state.parts import LENGTHS, TRANSIENT, FeaturePart
from explorer.app.state.state import Mode, State
from explorer.errors import InputError
from explorer.legs.moves import StraightMoves, poses_between
from explorer.mechanism.design import Design
from explorer.mechanism.pose import Pose, Triple
from explorer.numerics.number_text import format_number
from explorer.paths.crossings import PathMargins, path_margins
from explorer.paths.planning import DEFAULT_SECONDS
from explorer.paths.time_law import law_at_speed
from explorer.paths.trajectory import DEFAULT_SPEED, Trajectory, trajectory

PathKind = Literal["straight", "planned"]
"""The straight move between two poses, or a path without a singular pose."""

PathDrives = Literal["off", "shortest", "duration"]
"""Whether speeds and forces along the path are computed, and in which time."""

End: TypeAlias = Pose | Mode | None
"""An end of a path: a fixed pose, or an assembly mode of the present leg lengths.

As the start None is the present pose, as the goal the mode beyond δ1 = 0 from the present one.
"""

# Number of paths whose margins and times are cached: the present one and the one before.
MOST_CACHED = 2
# Duration of a straight path: between modes the legs move too little for a speed to give one.
STRAIGHT_SECONDS = 8.0


@dataclass(frozen=True)
class Journey:
    """A path by its corners, and the time in seconds up to which it has been played.

    Its moves are straight for the tool point in the platform frame, or for b4 if there is none.

    Raises:
        InputError: Fewer than two corners, or all of them are the same pose.
    """

    kind: PathKind
    title: str
    design: Design
    poses: tuple[Pose, ...]
    at: float = 0.0
    is_playing: bool = field(default=False, metadata=TRANSIENT)
    tool: Triple | None = None

    def __post_init__(self) -> None:
        if len(self.poses) < 2:
            raise InputError(f"a path has at least two corners; got {len(self.poses)}")
        moves = StraightMoves.along(self.poses, self.tool)
        if not moves.have_length(self.design.reach).any():
            raise InputError("the path has no length: it needs two poses that differ")

    @property
    def trajectory(self) -> Trajectory:
        """The path over time; a straight one is slow enough to watch."""
        seconds = STRAIGHT_SECONDS if self.kind == "straight" else None
        return _trajectory(self.design, self.poses, seconds, self.tool)

    @property
    def margins(self) -> PathMargins:
        """The margins over the path, and its crossings."""
        return _margins(self.poses, self.tool)

    @property
    def pose(self) -> Pose:
        """The pose up to which it has been played."""
        return self.pose_at(self.at)

    def pose_at(self, seconds: float) -> Pose:
        """Return the pose at a time in seconds; each corner is kept to the last bit."""
        timed = self.trajectory
        at = float(np.interp(seconds, timed.time, timed.at))
        move = min(int(at), len(self.poses) - 2)
        if at - move in (0.0, 1.0):
            return self.poses[move + int(at - move)]
        ends = self.poses[move], self.poses[move + 1]
        return Pose.of(*poses_between(*ends, at - move, self.tool))


@dataclass(frozen=True)
class Paths(FeaturePart, name="paths"):
    """The path of the page, and the settings of the next one.

    Attributes:
        seconds: Longest time of planning, in seconds.
        drives: Time law for which speeds and forces of the actuators are computed, or off.
        duration: The given time of the path, in seconds.
        request: Number of the last request to plan; 0 before the first.
        planning: Start and goal of the path that is being planned; None if none is.
        problem: Why planning failed; None if it did not.

    Raises:
        InputError: A time for planning or for the path that is not above zero.
    """

    start: End = field(default=None, metadata=LENGTHS)
    goal: End = field(default=None, metadata=LENGTHS)
    kind: PathKind = "straight"
    seconds: float = DEFAULT_SECONDS
    holds_load: bool = False
    drives: PathDrives = "off"
    duration: float = 1.0
    request: int = field(default=0, metadata=TRANSIENT)
    planning: tuple[Pose, Pose] | None = field(default=None, metadata=TRANSIENT)
    problem: str | None = field(default=None, metadata=TRANSIENT)
    journey: Journey | None = None

    def __post_init__(self) -> None:
        for what, seconds in (("planning", self.seconds), ("a path", self.duration)):
            if not (math.isfinite(seconds) and seconds > 0.0):
                raise InputError(
                    f"{what} needs a time above zero; got {format_number(seconds)} seconds"
                )

    def on_open(self) -> Self:
        """Return the part for another design: the settings of the next path."""
        return replace(self, planning=None, problem=None, journey=None)

    def for_step(self) -> Self:
        """Return the part as the history keeps it: without planning and playing."""
        journey = None if self.journey is None else replace(self.journey, is_playing=False)
        return replace(self, planning=None, journey=journey)

    def continue_from(self, present: Self) -> Self:
        """Return this part with the number of the present request, if it is above its own."""
        return replace(self, request=max(self.request, present.request))

    @property
    def is_planning(self) -> bool:
        """Whether a path is being planned."""
        return self.planning is not None


def journey_of(state: State) -> Journey | None:
    """Return the present path; None where there is none, or one made for another design.

    It stays while a payload and actuators are chosen for it.
    """
    journey, new = Paths.of(state).journey, state.design
    if journey is None or journey.design == new:
        return journey
    carrying = {"payload": new.payload, "actuators": new.actuators}
    is_for_it = msgspec.structs.replace(journey.design, **carrying) == new
    return replace(journey, design=new) if is_for_it else None


def is_playing(state: State) -> bool:
    """Whether a path is being played."""
    journey = journey_of(state)
    return journey is not None and journey.is_playing


@lru_cache(maxsize=MOST_CACHED)
def _trajectory(
    design: Design, poses: tuple[Pose, ...], seconds: float | None, tool: Triple | None
) -> Trajectory:
    law = law_at_speed(design, StraightMoves.along(poses, tool), DEFAULT_SPEED * design.reach)
    law = law if seconds is None else law.lasting(seconds)
    return trajectory(design, poses, law=law, tool=tool)


@lru_cache(maxsize=MOST_CACHED)
def _margins(poses: tuple[Pose, ...], tool: Triple | None) -> PathMargins:
    return path_margins(poses, tool=tool)
