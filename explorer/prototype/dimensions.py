"""How large a leg and the guide are: all from their radii, with clearances in millimetres.

A leg's radius is that of its cylinder; joints are as large as it asks for. The clearance and
the thinnest wall do not scale with it. Everything here is in millimetres.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

CLEARANCE = 0.2
"""Between parts that move against each other."""

THINNEST = 0.5
"""Of walls and of rods' radii."""

FIRST_SWING, SECOND_SWING = math.radians(60.0), math.radians(50.0)
"""How far universal joints lean about their two axes, from the normal of the base plane."""

# Over the radius of a leg.
_WALL, _SWING, _EYE, _PIN, _NECK, _OVERLAP, _SHAFT = 0.3, 2.6, 1.1, 0.45, 0.45, 3.0, 0.7
# The rim of a cup lies below the ball's centre by this share of its radius, so that the neck
# swings to a right angle. A magnet holds the ball.
_RIM = 0.5


class Stroke(NamedTuple):
    """The lengths between which an actuator moves."""

    shortest: float
    longest: float


@dataclass(frozen=True)
class LegSizes:
    """A leg from its base joint to its ball.

    Attributes:
        radius: Of its cylinder.
        floor: From the base joint to the bottom of the bore.
    """

    radius: float
    floor: float

    @property
    def wall(self) -> float:
        """How thick walls are."""
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
        """From the centre of the universal joint to where its eyes begin."""
        return self.eye + 2.0 * CLEARANCE

    @property
    def plate(self) -> float:
        """How thick eyes and the cylinder's bottom are."""
        return max(0.5 * self.radius, 1.2 * THINNEST)

    @property
    def outer(self) -> float:
        """From the centre of the universal joint to where its eyes end."""
        return self.inner + self.plate

    @property
    def swing(self) -> float:
        """The radius about the universal joint within which its parts but the leg stay."""
        return math.hypot(self.outer, self.eye)

    def sweep(self, height: float) -> float:
        """Return how far from its joint a leaning leg is lower than a height."""
        return height * math.tan(FIRST_SWING) + self.outer / math.cos(FIRST_SWING)

    @property
    def bottom(self) -> float:
        """From the universal joint to the cylinder's bottom."""
        return _SWING * self.radius + CLEARANCE

    @property
    def ball(self) -> float:
        """The radius of the ball."""
        return self.radius

    @property
    def neck(self) -> float:
        """The radius of what carries the ball."""
        return _NECK * self.radius

    @property
    def rim(self) -> float:
        """From the ball's centre back to the rim of the cup."""
        return _RIM * self.ball

    @property
    def cup(self) -> float:
        """The radius of the cup about the ball."""
        return math.sqrt((self.ball + CLEARANCE) ** 2 - self.rim**2) + self.wall

    @property
    def end(self) -> float:
        """From the ball's centre back to the end of the cup."""
        return self.ball + CLEARANCE + 2.0 * self.wall

    @property
    def dead(self) -> float:
        """By how much twice the shortest length exceeds the longest one."""
        return self.floor + self.end + _OVERLAP * self.radius + 2.0 * CLEARANCE

    def stroke(self, asked: Stroke, at_home: float) -> Stroke:
        """Return the stroke that is asked for, or what a single rod has of it.

        A rod no longer than its cylinder at most doubles a leg. If more is asked for, home
        is midway, or nearer to an end of what is asked for.
        """
        shortest = max(
            asked.shortest,
            min((2.0 * at_home + self.dead) / 3.0, 0.5 * (asked.longest + self.dead)),
        )
        return Stroke(shortest, min(asked.longest, 2.0 * shortest - self.dead))


@dataclass(frozen=True)
class GuideSizes:
    """The shaft of the guide, and the sleeves and eyes about it."""

    radius: float

    @property
    def wall(self) -> float:
        """How thick walls are."""
        return max(_WALL * self.radius, THINNEST)

    @property
    def shaft(self) -> float:
        """Half the side of the square shaft, on which carriages cannot turn."""
        return _SHAFT * self.radius

    @property
    def sleeve(self) -> float:
        """The radius of a carriage's sleeve, which legs turn on."""
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
        """How thick the pillars are along the guide."""
        return max(0.8 * self.radius, 2.0 * THINNEST)
