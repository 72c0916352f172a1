"""Six motions that move exactly one margin each, and how far each goes (design.md, section 5).

A flag keeps its point, its line and its plane in three of them: along the axis x the point
moves on its line, about x the plane turns about the line, about z the line turns in the plane.
So each moves what only one incidence is about. In a translation the margin changes linearly;
in a rotation by an angle θ it is κ cos θ + κ' sin θ, which vanishes every half turn.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

import numpy as np
from scipy.spatial.transform import Rotation

from explorer.errors import InputError
from explorer.mechanism.margins import margins
from explorer.mechanism.pose import Pose
from explorer.numerics.arrays import FloatArray

# A margin that changes by less than this share of a translation changes by rounding alone.
NO_RATE = 1e-12
# Of the distance of b4 from a1: a singular pose that is farther away is never reached.
FARTHEST = 1e6


@dataclass(frozen=True)
class Travel:
    """How far a motion goes to the singularity, either side; in units or in radians.

    Attributes:
        low: Backwards, not above zero; −inf for never.
        high: Forwards, not below zero; inf for never.
    """

    low: float
    high: float


@dataclass(frozen=True)
class UncoupledMotion:
    """A motion on an axis of one of the frames that moves one margin and no other.

    Attributes:
        frame: Whose axis it is on: the platform's go through b4, the base's through a1.
        kind: Along the axis or about it.
        axis: Of the frame.
        incidence: 1, 2 or 3: of which margin.
    """

    frame: Literal["platform", "base"]
    kind: Literal["translation", "rotation"]
    axis: Literal["x", "z"]
    incidence: int

    @property
    def name(self) -> str:
        """Such as "along the platform's x"."""
        return (
            f"{'along' if self.kind == 'translation' else 'about'} the {self.frame}'s {self.axis}"
        )

    def line(self, pose: Pose) -> tuple[FloatArray, FloatArray]:
        """Return a point of the axis and its unit direction, (3,) each, in the base frame."""
        unit = np.eye(3)["xyz".index(self.axis)]
        if self.frame == "base":
            return np.zeros(3), unit
        return np.array(pose.position), pose.rotation @ unit

    def moved(self, pose: Pose, amount: float) -> Pose:
        """Return the pose after the motion.

        Args:
            pose: Before it.
            amount: In design units of a translation, in radians of a rotation.

        Raises:
            InputError: an amount that is not finite.
        """
        if not math.isfinite(amount):
            raise InputError(f"a motion {self.name} needs a finite amount; got {amount}")
        if self.kind == "translation":
            direction = self.line(pose)[1]
            x, y, z = (np.array(pose.position) + amount * direction).tolist()
            return Pose((x, y, z), pose.quaternion)
        return Pose.of(*_turned(self, pose, amount))

    def rate(self, pose: Pose) -> float:
        """Return how fast the margin changes with the amount, in units per unit or radian."""
        ((_, rate),) = _margins_and_rates(pose, (self,))
        return rate

    def travel(self, pose: Pose) -> Travel:
        """Return how far the motion goes until the margin is zero, forwards and backwards.

        On the singular set both are zero. A rotation's are half a turn apart.
        """
        return _travels(pose, (self,))[0]


UNCOUPLED = (
    UncoupledMotion("platform", "rotation", "x", 1),
    UncoupledMotion("platform", "rotation", "z", 2),
    UncoupledMotion("platform", "translation", "x", 3),
    UncoupledMotion("base", "translation", "x", 1),
    UncoupledMotion("base", "rotation", "z", 2),
    UncoupledMotion("base", "rotation", "x", 3),
)
"""The six motions: three of each frame, in the order of the margins that they move."""


def travels(pose: Pose) -> tuple[Travel, ...]:
    """Return the travel of each of the six motions from a pose, in the order of `UNCOUPLED`."""
    return _travels(pose, UNCOUPLED)


def _travels(pose: Pose, motions: tuple[UncoupledMotion, ...]) -> tuple[Travel, ...]:
    found = _margins_and_rates(pose, motions)
    farthest = FARTHEST * math.hypot(*pose.position)
    return tuple(
        _travel(motion.kind, margin, rate, farthest)
        for motion, (margin, rate) in zip(motions, found, strict=True)
    )


def _travel(
    kind: Literal["translation", "rotation"], margin: float, rate: float, farthest: float
) -> Travel:
    if margin == 0.0:
        return Travel(0.0, 0.0)
    if kind == "rotation":
        high = math.atan2(-margin, rate) % math.pi
        return Travel(high - math.pi, high)
    if abs(rate) <= NO_RATE or abs(margin) > farthest * abs(rate):
        return Travel(-math.inf, math.inf)
    way = -margin / rate
    return Travel(way, math.inf) if way < 0.0 else Travel(-math.inf, way)


def _margins_and_rates(
    pose: Pose, motions: tuple[UncoupledMotion, ...]
) -> list[tuple[float, float]]:
    """Return of each motion the margin that it moves and how fast; all of them in one go."""
    placed = [_place_of_rate(motion, pose) for motion in motions]
    positions = [np.array(pose.position), *(position for position, _ in placed)]
    rotations = [pose.rotation, *(rotation for _, rotation in placed)]
    here, *rates = margins(np.stack(positions), np.stack(rotations)).tolist()
    return [
        (here[motion.incidence - 1], rate[motion.incidence - 1])
        for motion, rate in zip(motions, rates, strict=True)
    ]


def _place_of_rate(motion: UncoupledMotion, pose: Pose) -> tuple[FloatArray, FloatArray]:
    """Return the position and rotation whose margin is the rate at a pose."""
    # Along the axis all changes are linear; about it a quarter turn later κ is κ'.
    if motion.kind == "rotation":
        return _turned(motion, pose, 0.5 * math.pi)
    return motion.line(pose)[1], pose.rotation


def _turned(motion: UncoupledMotion, pose: Pose, angle: float) -> tuple[FloatArray, FloatArray]:
    """Return position and rotation after a turn about the axis."""
    point, direction = motion.line(pose)
    turn = Rotation.from_rotvec(angle * direction).as_matrix()
    return point + turn @ (np.array(pose.position) - point), turn @ pose.rotation
