"""The dimensions of a leg and of the guide, in millimetres, derived from one radius each.

The radius of a leg is that of its cylinder; its joints scale with it. The clearance and the
thinnest wall do not.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

CLEARANCE = 0.2
"""Clearance between parts that move against each other."""

THINNEST = 0.5
"""Thinnest wall, and smallest radius of a rod."""

FIRST_SWING, SECOND_SWING = math.radians(60.0), math.radians(50.0)
"""Largest angles of a universal joint about its two axes, from the normal of the base plane."""

# Dimensions over the radius of a leg.
_WALL, _SWING, _EYE, _PIN, _NECK, _OVERLAP, _SHAFT = 0.3, 2.6, 1.1, 0.45, 0.45, 3.0, 0.7
# Depth of a cup's rim below the ball's centre, over the ball's radius. The rim is so low that the
# neck can swing to a right angle; a magnet holds the ball.
_RIM = 0.5


class Stroke(NamedTuple):
    """The shortest and the longest length of an actuator."""

    shortest: float
    longest: float


@dataclass(frozen=True)
class LegSizes:
    """The dimensions of a leg from its base joint to its ball.

    Attributes:
        radius: Radius of its cylinder.
        floor: Distance from the base joint to the bottom of the bore.
    """

    radius: float
    floor: float

    @property
    def wall(self) -> float:
        """The thickness of walls."""
        return max(_WALL * self.radius, THINNEST)

    @property
    def bore(self) -> float:
        """The radius of the bore."""
        return self.radius - self.wall

    @property
    def rod(self) -> float:
        """The radius of the rod."""
        return self.bore - CLEARANCE

    @property
    def eye(self) -> float:
        """The radius of the eyes of the universal joint."""
        return _EYE * self.radius

    @property
    def pin(self) -> float:
        """The radius of the pins of the universal joint."""
        return _PIN * self.radius

    @property
    def inner(self) -> float:
        """The distance from the centre of the universal joint to the inner face of its eyes."""
        return self.eye + 2.0 * CLEARANCE

    @property
    def plate(self) -> float:
        """The thickness of eyes and of the cylinder's bottom."""
        return max(0.5 * self.radius, 1.2 * THINNEST)

    @property
    def outer(self) -> float:
        """The distance from the centre of the universal joint to the outer face of its eyes."""
        return self.inner + self.plate

    @property
    def swing(self) -> float:
        """The radius of a ball about the universal joint that holds its parts, the leg excluded."""
        return math.hypot(self.outer, self.eye)

    def sweep(self, height: float) -> float:
        """Return the distance from its joint within which a leaning leg is below a height."""
        return height * math.tan(FIRST_SWING) + self.outer / math.cos(FIRST_SWING)

    @property
    def bottom(self) -> float:
        """The distance from the universal joint to the cylinder's bottom."""
        return _SWING * self.radius + CLEARANCE

    @property
    def ball(self) -> float:
        """The radius of the ball."""
        return self.radius

    @property
    def neck(self) -> float:
        """The radius of the neck that carries the ball."""
        return _NECK * self.radius

    @property
    def rim(self) -> float:
        """The distance from the ball's centre back to the rim of the cup."""
        return _RIM * self.ball

    @property
    def cup(self) -> float:
        """The radius of the cup about the ball."""
        return math.sqrt((self.ball + CLEARANCE) ** 2 - self.rim**2) + self.wall

    @property
    def end(self) -> float:
        """The distance from the ball's centre back to the end of the cup."""
        return self.ball + CLEARANCE + 2.0 * self.wall

    @property
    def dead(self) -> float:
        """The dead length: the excess of twice the shortest length over the longest one."""
        return self.floor + self.end + _OVERLAP * self.radius + 2.0 * CLEARANCE

    def stroke(self, required: Stroke, home_length: float) -> Stroke:
        """Return the required stroke, or the part of it that a single rod covers.

        A rod no longer than its cylinder can at most double the length of a leg. Of a longer
        stroke it covers a part about the home length, shifted where that part would pass an end.

        Args:
            required: The required stroke.
            home_length: The length of the leg at home.
        """
        shortest = max(
            required.shortest,
            min((2.0 * home_length + self.dead) / 3.0, 0.5 * (required.longest + self.dead)),
        )
        return Stroke(shortest, min(required.longest, 2.0 * shortest - self.dead))


@dataclass(frozen=True)
class GuideSizes:
    """The dimensions of the guide's shaft, and of the sleeves and eyes about it."""

    radius: float

    @property
    def wall(self) -> float:
        """The thickness of walls."""
        return max(_WALL * self.radius, THINNEST)

    @property
    def shaft(self) -> float:
        """Half the side of the square shaft, on which carriages cannot turn."""
        return _SHAFT * self.radius

    @property
    def sleeve(self) -> float:
        """The radius of a carriage's sleeve, on which a leg turns."""
        return math.sqrt(2.0) * (self.shaft + CLEARANCE) + self.wall

    @property
    def flange(self) -> float:
        """The radius of a carriage's flanges, which keep the leg on it."""
        return self.sleeve + CLEARANCE + 0.5 * self.wall

    @property
    def eye(self) -> float:
        """The outer radius of the eye of a leg."""
        return self.sleeve + CLEARANCE + self.wall

    @property
    def pillar(self) -> float:
        """The thickness of the pillars along the guide."""
        return max(0.8 * self.radius, 2.0 * THINNEST)
