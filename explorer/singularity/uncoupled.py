"""The six motions that change exactly one margin.

On the axes of each of the two frames there are three: the translation along x moves the flag's
point on its line, the rotation about x turns its plane about the line, and the rotation about z
turns its line in the plane. Every motion leaves the other two elements of the flag where they
are, so it changes the margin of one incidence alone.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

import numpy as np

from explorer.errors import InputError
from explorer.mechanism.pose import Pose
from explorer.numerics.arrays import FloatArray


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
            amount: Distance in design units (translation) or angle in radians (rotation).

        Raises:
            InputError: The amount is not finite.
        """
        if not math.isfinite(amount):
            raise InputError(f"a motion {self.name} needs a finite amount; got {amount}")
        point, direction = self.line(pose)
        if self.kind == "translation":
            x, y, z = (np.array(pose.position) + amount * direction).tolist()
            return Pose((x, y, z), pose.quaternion)
        return pose.turn(point, amount * direction)


UNCOUPLED = (
    UncoupledMotion("platform", "rotation", "x", 1),
    UncoupledMotion("platform", "rotation", "z", 2),
    UncoupledMotion("platform", "translation", "x", 3),
    UncoupledMotion("base", "translation", "x", 1),
    UncoupledMotion("base", "rotation", "z", 2),
    UncoupledMotion("base", "rotation", "x", 3),
)
"""The six motions: three of each frame, in the order of the margins that they change."""
