"""A path that is played on the page: between assembly modes, or planned; and what is stored for it.

A path belongs to the design that it was made for; with another design there is none.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import Literal

import numpy as np

from explorer.legs.moves import poses_between
from explorer.mechanism.design import Design
from explorer.mechanism.pose import Pose
from explorer.paths.crossings import PathMargins, path_margins
from explorer.paths.planning import DEFAULT_SECONDS
from explorer.paths.trajectory import DEFAULT_SPEED, Trajectory, trajectory

# Paths whose margins and times are kept: the one that is played, and the one before.
KEPT = 2
# The legs end where they began, and go a short way between: they go it in this time.
MODES_SECONDS = 8.0


@dataclass(frozen=True)
class Journey:
    """A path and how far along it the platform is.

    Attributes:
        kind: Between two modes of the same joints, or planned.
        title: What it is, for people.
        design: For which it was made.
        poses: Its corners.
        at: How far it has been played, in seconds.
        is_playing: Whether time goes on.
    """

    kind: Literal["modes", "plan"]
    title: str
    design: Design
    poses: tuple[Pose, ...]
    at: float = 0.0
    is_playing: bool = False

    @property
    def trajectory(self) -> Trajectory:
        """The path over time; between modes slow enough to watch."""
        return _trajectory(self.design, self.poses, MODES_SECONDS if self.kind == "modes" else None)

    @property
    def margins(self) -> PathMargins:
        """The margins over the path, and its crossings."""
        return _margins(self.poses)

    @property
    def pose(self) -> Pose:
        """Where the platform is on it."""
        return self.pose_at(self.at)

    def pose_at(self, seconds: float) -> Pose:
        """Return the pose at a time, exactly on the path; its corners to the last bit."""
        timed = self.trajectory
        at = float(np.interp(seconds, timed.time, timed.at))
        move = min(int(at), len(self.poses) - 2)
        if at - move in (0.0, 1.0):
            return self.poses[move + int(at - move)]
        return Pose.of(*poses_between(self.poses[move], self.poses[move + 1], at - move))


@dataclass(frozen=True)
class Paths:
    """What is stored for paths.

    Attributes:
        modes: From which assembly mode to which to go; None for the present one, and for
            the one beyond δ1 = 0 from the first.
        start, goal: Of the path to plan; None until they are stored.
        seconds: For planning.
        request: The number of the last request to plan; 0 before the first.
        is_planning: Whether it is being worked on.
        problem: Why it came to nothing.
        journey: The path at hand.
    """

    modes: tuple[int | None, int | None] = (None, None)
    start: Pose | None = None
    goal: Pose | None = None
    seconds: float = DEFAULT_SECONDS
    request: int = 0
    is_planning: bool = False
    problem: str | None = None
    journey: Journey | None = None


@lru_cache(maxsize=KEPT)
def _trajectory(design: Design, poses: tuple[Pose, ...], seconds: float | None) -> Trajectory:
    timed = trajectory(design, poses)
    if seconds is None or timed.duration == 0.0:
        return timed
    return trajectory(design, poses, speed=DEFAULT_SPEED * design.reach * timed.duration / seconds)


@lru_cache(maxsize=KEPT)
def _margins(poses: tuple[Pose, ...]) -> PathMargins:
    return path_margins(poses)
