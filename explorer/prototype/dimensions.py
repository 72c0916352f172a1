"""The dimensions of a leg and of the guide, in millimetres, derived from one radius each.

The radius of a leg is that of its cylinder; its joints scale with it. The clearance and the
thinnest wall do not.
"""

from __future__ import annotations

import math
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


class LegSizes:
    """The dimensions of a leg from its base joint to its ball.

    Args:
        radius: Radius of its cylinder.
        floor: Distance from the base joint to the bottom of the bore.

    Attributes:
        wall: Thickness of walls.
        bore: Radius of the bore.
        rod: Radius of the rod.
        eye: Radius of the eyes of the universal joint.
        pin: Radius of the pins of the universal joint.
        inner: Distance from the centre of the universal joint to the inner face of its eyes.
        plate: Thickness of eyes and of the cylinder's bottom.
        outer: Distance from the centre of the universal joint to the outer face of its eyes.
        swing: Radius of a ball about the universal joint that holds its parts, without the leg.
        bottom: Distance from the universal joint to the cylinder's bottom.
        ball: Radius of the ball.
        neck: Radius of the neck that carries the ball.
        rim: Distance from the ball's centre back to the rim of the cup.
        cup: Radius of the cup about the ball.
        end: Distance from the ball's centre back to the end of the cup.
        dead: Dead length: the excess of twice the shortest length over the longest one.
    """

    def __init__(self, radius: float, floor: float) -> None:
        self.radius, self.floor = radius, floor
        self.wall = max(_WALL * radius, THINNEST)
        self.bore = radius - self.wall
        self.rod = self.bore - CLEARANCE
        self.eye = _EYE * radius
        self.pin = _PIN * radius
        self.inner = self.eye + 2.0 * CLEARANCE
        self.plate = max(0.5 * radius, 1.2 * THINNEST)
        self.outer = self.inner + self.plate
        self.swing = math.hypot(self.outer, self.eye)
        self.bottom = _SWING * radius + CLEARANCE
        self.ball = radius
        self.neck = _NECK * radius
        self.rim = _RIM * radius
        self.cup = math.sqrt((radius + CLEARANCE) ** 2 - self.rim**2) + self.wall
        self.end = radius + CLEARANCE + 2.0 * self.wall
        self.dead = floor + self.end + _OVERLAP * radius + 2.0 * CLEARANCE

    def sweep(self, height: float) -> float:
        """Return the distance from its joint within which a leaning leg is below a height."""
        return height * math.tan(FIRST_SWING) + self.outer / math.cos(FIRST_SWING)

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


class GuideSizes:
    """The dimensions of the guide, given the larger radius of its legs.

    Attributes:
        shaft: Half the side of the square shaft, on which carriages cannot turn.
        sleeve: Radius of a carriage's sleeve, on which a leg turns.
        flange: Radius of a carriage's flanges, which keep the leg on it.
        eye: Outer radius of the eye of a leg.
        pillar: Thickness of the pillars along the guide.
    """

    def __init__(self, radius: float) -> None:
        self.radius = radius
        wall = max(_WALL * radius, THINNEST)
        self.shaft = _SHAFT * radius
        self.sleeve = math.sqrt(2.0) * (self.shaft + CLEARANCE) + wall
        self.flange = self.sleeve + CLEARANCE + 0.5 * wall
        self.eye = self.sleeve + CLEARANCE + wall
        self.pillar = max(0.8 * radius, 2.0 * THINNEST)
