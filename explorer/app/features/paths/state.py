"""The path that is played on the page, the poses of the next one, and the one law of its time.

A path is a list of poses, with straight moves from each to the next, which may be singular on the
way, or planned without a singularity; b4 or the tool point goes along lines. It rests at every
pose, for a pause if one is given. It belongs to the design that it was made for; with another
design there is none.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import lru_cache
from typing import Literal, NamedTuple, Self, TypeAlias

import msgspec
import numpy as np

from explorer.app.state.parts import LENGTHS, TRANSIENT, FeaturePart
from explorer.app.state.state import Mode, State
from explorer.errors import ExplorerError, InputError
from explorer.legs.moves import StraightMoves, poses_between
from explorer.mechanism.design import Design
from explorer.mechanism.pose import Pose, Triple
from explorer.motion.masses import DENSITY
from explorer.numerics.checks import LEAST, MOST
from explorer.paths.crossings import PathMargins, path_margins
from explorer.paths.drives import TimedPath, law_of_path
from explorer.paths.planning import DEFAULT_SECONDS
from explorer.paths.time_law import TimeLaw
from explorer.paths.trajectory import DEFAULT_SAMPLES, Trajectory, trajectory

PathKind = Literal["straight", "planned"]
"""The straight moves between the poses, or a path without a singular pose."""

PathLaw = Literal["watchable", "duration", "shortest"]
"""The time of a path: slow enough to watch, a given one, or the shortest within the limits."""

StopAt: TypeAlias = Pose | Mode | None
"""Where a path stops: in a fixed pose, an assembly mode of the present leg lengths, or, as the
first, in the present pose for None."""

# Number of paths whose margins and times are cached: the present one and the one before.
MOST_CACHED = 2
# Duration of a path that is slow enough to watch, and the least time of each of its moves.
WATCH_SECONDS, MOVE_SECONDS = 8.0, 1.0
# Samples of each move, and the most poses in the list.
MOVE_SAMPLES, MOST_STOPS = 50, 50


@dataclass(frozen=True)
class Stop:
    """A pose of the next path, and the pause in it in seconds.

    Raises:
        InputError: The pause is below zero or longer than `MOST` seconds.
    """

    at: StopAt = field(default=None, metadata=LENGTHS)
    pause: float = 0.0

    def __post_init__(self) -> None:
        if not 0.0 <= self.pause <= MOST:
            raise InputError(
                f"a pause must not be below zero or above {MOST:,.0f} s; got {self.pause:g} s"
            )


class Course(NamedTuple):
    """A path in time, and why it takes another time than it was asked to; None if it does not."""

    law: TimeLaw
    timed: Trajectory
    problem: str | None


@dataclass(frozen=True)
class Journey:
    """A path by its corners, and the time in seconds up to which it has been played.

    Its moves are straight for the tool point in the platform frame, or for b4 if there is none.

    Attributes:
        pauses: Pauses at the corners in seconds, one for each.
        seconds: Duration that it is asked to take, pauses included; None for the shortest.
        density: Density of the parts in kg/m³, for the forces of which the shortest time depends.

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
    pauses: tuple[float, ...] = ()
    seconds: float | None = WATCH_SECONDS
    density: float = DENSITY

    def __post_init__(self) -> None:
        if len(self.poses) < 2:
            raise InputError(f"a path has at least two corners; got {len(self.poses)}")
        moves = StraightMoves.along(self.poses, self.tool)
        if not moves.have_length(self.design.reach).any():
            raise InputError("the path has no length: it needs two poses that differ")

    @property
    def path(self) -> TimedPath:
        """The path with its time, as playback, charts, files and motors take it."""
        return TimedPath(self.poses, self.seconds, self.tool, self.density, pauses=self.pauses)

    @property
    def trajectory(self) -> Trajectory:
        """The path over time."""
        return self._course.timed

    @property
    def problem(self) -> str | None:
        """Why it has no law of the time that it is asked to take; None if it has one."""
        return self._course.problem

    @property
    def is_closed(self) -> bool:
        """Whether it ends in the pose in which it begins, to rounding."""
        ends = StraightMoves.along((self.poses[0], self.poses[-1]), self.tool)
        return not ends.have_length(self.design.reach).any()

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
        at = self.place_at(seconds)
        move = min(int(at), len(self.poses) - 2)
        if at - move in (0.0, 1.0):
            return self.poses[move + int(at - move)]
        ends = self.poses[move], self.poses[move + 1]
        return Pose.of(*poses_between(*ends, at - move, self.tool))

    def place_at(self, seconds: float) -> float:
        """Return the place at a time: the number of the move plus the share of it."""
        law = self._course.law
        # Moves without a length at either end take no time.
        if seconds <= 0.0:
            return 0.0
        if seconds >= law.duration:
            return len(self.poses) - 1.0
        return float(law.places_at(np.array([seconds]))[0])

    def time_at(self, place: float) -> float:
        """Return the time in seconds at a place."""
        return float(self._course.law.times_at(np.array([place]))[0])

    @property
    def _course(self) -> Course:
        return _course_of(self.design, self.path)


@dataclass(frozen=True)
class Paths(FeaturePart, name="paths"):
    """The path of the page, and the settings of the next one.

    Attributes:
        stops: Poses of the next path; after the present one alone the mode beyond δ1 = 0.
        chosen: Index of the pose that is edited; None if none is.
        seconds: Longest time of planning, in seconds.
        law: Which time the path takes.
        duration: The given time of the path, in seconds.
        slower: Seconds that playback takes for each second of the path.
        request: Number of the last request to plan; 0 before the first.
        planning: Poses of the path that is being planned; None if none is.
        problem: Why planning failed; None if it did not.

    Raises:
        InputError: A time for planning or for the path is below `LEAST` or above `MOST` seconds, no
            pose or too many, one after the first that follows the present one, or an index below
            zero.
    """

    stops: tuple[Stop, ...] = field(default=(Stop(),), metadata=LENGTHS)
    chosen: int | None = None
    kind: PathKind = "straight"
    seconds: float = DEFAULT_SECONDS
    holds_load: bool = False
    law: PathLaw = "watchable"
    duration: float = 1.0
    slower: float = 1.0
    request: int = field(default=0, metadata=TRANSIENT)
    planning: tuple[Pose, ...] | None = field(default=None, metadata=TRANSIENT)
    problem: str | None = field(default=None, metadata=TRANSIENT)
    journey: Journey | None = None

    def __post_init__(self) -> None:
        for what, seconds in (("planning", self.seconds), ("a path", self.duration)):
            if not LEAST <= seconds <= MOST:
                raise InputError(
                    f"{what} needs a time above zero, {LEAST:g} to {MOST:,.0f} s; got {seconds:g} s"
                )
        if not 1 <= len(self.stops) <= MOST_STOPS:
            raise InputError(
                f"a path on the page has 1 to {MOST_STOPS} poses; got {len(self.stops)}: "
                "explorer drives takes longer ones"
            )
        if self.chosen is not None and self.chosen < 0:
            raise InputError(f"poses of a path have numbers from 0; got {self.chosen}")
        if None in [stop.at for stop in self.stops[1:]]:
            raise InputError("only the first pose of a path can be the present one")

    @property
    def edited_pose(self) -> Pose | None:
        """The pose of the list that is edited, if it is a fixed one."""
        edited = self.stops[self.chosen : self.chosen + 1] if self.chosen is not None else ()
        return next((stop.at for stop in edited if isinstance(stop.at, Pose)), None)

    @property
    def handled(self) -> str:
        """Path of the pose that is edited, if it is a fixed one, which has the handle."""
        return "" if self.edited_pose is None else f"stops.{self.chosen}.at"

    def on_open(self) -> Self:
        """Return the part for another design: the settings of the next path; no pose is edited."""
        return replace(self, chosen=None, planning=None, problem=None, journey=None)

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
    """Return the present path in its time; None without one, or if made for another design.

    It stays while a payload and actuators are chosen for it.
    """
    paths, new = Paths.of(state), state.design
    journey = paths.journey
    if journey is None:
        return None
    if journey.design != new:
        carrying = {"payload": new.payload, "actuators": new.actuators}
        if msgspec.structs.replace(journey.design, **carrying) != new:
            return None
    watched = watchable_seconds(journey.poses, journey.pauses)
    seconds = {"watchable": watched, "duration": paths.duration, "shortest": None}[paths.law]
    density = state.view.prototype.density
    if (journey.design, journey.seconds, journey.density) == (new, seconds, density):
        return journey
    return replace(journey, design=new, seconds=seconds, density=density)


def watchable_seconds(poses: Sequence[Pose], pauses: Sequence[float]) -> float:
    """Return the time of a path that is slow enough to watch, with its pauses."""
    return max(WATCH_SECONDS, MOVE_SECONDS * (len(poses) - 1)) + sum(pauses)


def is_playing(state: State) -> bool:
    """Whether a path is being played."""
    journey = journey_of(state)
    return journey is not None and journey.is_playing


@lru_cache(maxsize=MOST_CACHED)
def _course_of(design: Design, path: TimedPath) -> Course:
    """Return a path in its time; one that has no law for it takes a time to watch."""
    problem, moves = None, len(path.poses) - 1
    try:
        law = law_of_path(design, path)
    except ExplorerError as error:
        problem = str(error)
        watched = path._replace(duration=watchable_seconds(path.poses, path.pauses))
        law = law_of_path(design, watched)
    times = law.sample_times(max(DEFAULT_SAMPLES // moves, MOVE_SAMPLES))
    timed = trajectory(design, path.poses, law=law, times=times, tool=path.tool)
    return Course(law, timed, problem)


@lru_cache(maxsize=MOST_CACHED)
def _margins(poses: tuple[Pose, ...], tool: Triple | None) -> PathMargins:
    return path_margins(poses, tool=tool)
