"""The six motions that change exactly one margin, and their travel to the singularity.

On the axes of each of the two frames there are three: the translation along x moves the flag's
point on its line, the rotation about x turns its plane about the line, and the rotation about z
turns its line in the plane. Every motion leaves the other two elements of the flag where they
are, so it changes the margin of one incidence alone. Along a translation the margin is linear;
in a rotation by an angle θ it is δ cos θ + δ' sin θ, which vanishes every half turn.
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

# Change of a margin per unit of translation up to which it is rounding.
NO_RATE = 1e-12
# Longest travel over the distance of b4 from a1; a longer one counts as infinite.
FARTHEST = 1e6


@dataclass(frozen=True)
class Travel:
    """The travel of a motion to the singularity on either side, in design units or radians.

    Attributes:
        low: Travel backwards, at most zero; −inf if there is no singularity.
        high: Travel forwards, at least zero; inf if there is no singularity.
    """

    low: float
    high: float


@dataclass(frozen=True)
class UncoupledMotion:
    """A motion along or about an axis of a frame that changes one margin and no other.

    Attributes:
        frame: Frame of the axis, which passes through b4 (platform) or a1 (base).
        kind: Translation along the axis or rotation about it.
        axis: Axis of the frame.
        incidence: Index 1, 2 or 3 of the margin that changes.
    """

    frame: Literal["platform", "base"]
    kind: Literal["translation", "rotation"]
    axis: Literal["x", "z"]
    incidence: int

    @property
    def name(self) -> str:
        """The motion's name, such as "along the platform's x"."""
        return (
            f"{'along' if self.kind == 'translation' else 'about'} the {self.frame}'s {self.axis}"
        )

    def line(self, pose: Pose) -> tuple[FloatArray, FloatArray]:
        """Return a point on the axis and its unit direction, shape (3,) each, in the base frame."""
        unit = np.eye(3)["xyz".index(self.axis)]
        if self.frame == "base":
            return np.zeros(3), unit
        return np.array(pose.position), pose.rotation @ unit

    def moved(self, pose: Pose, amount: float) -> Pose:
        """Return the pose after the motion.

        Args:
            pose: Pose before the motion.
            amount: Travel in design units (translation) or radians (rotation).

        Raises:
            InputError: The amount is not finite.
        """
        if not math.isfinite(amount):
            raise InputError(f"a motion {self.name} needs a finite amount; got {amount}")
        if self.kind == "translation":
            direction = self.line(pose)[1]
            x, y, z = (np.array(pose.position) + amount * direction).tolist()
            return Pose((x, y, z), pose.quaternion)
        return Pose.of(*_turned(self, pose, amount))

    def travel(self, pose: Pose) -> Travel:
        """Return the travel until the margin is zero, backwards and forwards.

        Both are zero if the margin is. The two of a rotation differ by half a turn.
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
"""The six motions: three of each frame, in the order of the margins that they change."""


def travels(pose: Pose) -> tuple[Travel, ...]:
    """Return the travel of each of the six motions from a pose, in the order of `UNCOUPLED`."""
    return _travels(pose, UNCOUPLED)


def _travels(pose: Pose, motions: tuple[UncoupledMotion, ...]) -> tuple[Travel, ...]:
    poses = [_pose_of_rate(motion, pose) for motion in motions]
    positions = [np.array(pose.position), *(position for position, _ in poses)]
    rotations = [pose.rotation, *(rotation for _, rotation in poses)]
    here, *rates = margins(np.stack(positions), np.stack(rotations)).tolist()
    farthest = FARTHEST * math.hypot(*pose.position)
    return tuple(
        _travel(motion.kind, here[motion.incidence - 1], rate[motion.incidence - 1], farthest)
        for motion, rate in zip(motions, rates, strict=True)
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
    end = -margin / rate
    return Travel(end, math.inf) if end < 0.0 else Travel(-math.inf, end)


def _pose_of_rate(motion: UncoupledMotion, pose: Pose) -> tuple[FloatArray, FloatArray]:
    """Return a position and rotation at which the margin equals its derivative at a pose."""
    # Along the axis every change is linear; a quarter turn about it makes δ equal to δ'.
    if motion.kind == "rotation":
        return _turned(motion, pose, 0.5 * math.pi)
    return motion.line(pose)[1], pose.rotation


def _turned(motion: UncoupledMotion, pose: Pose, angle: float) -> tuple[FloatArray, FloatArray]:
    """Return the position and rotation after a turn about the axis by an angle in radians."""
    point, direction = motion.line(pose)
    turn = Rotation.from_rotvec(angle * direction).as_matrix()
    return point + turn @ (np.array(pose.position) - point), turn @ pose.rotation
