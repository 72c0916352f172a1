"""Jogging by uncoupled motions: each starts where it was first used and is exact from there.

A motion that is used again goes on from the same start, so its control shows how far it
has gone and leads back to where it began. Anything else that moves the platform ends it.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

from explorer.errors import InputError
from explorer.mechanism.pose import Pose
from explorer.singularity.uncoupled import UNCOUPLED


@dataclass(frozen=True)
class Jog:
    """How far one of the six motions has gone.

    Attributes:
        motion: Index of the motion in `UNCOUPLED`.
        start: The pose in which it began.
        amount: Distance in design units for a translation, angle in degrees for a rotation.
        pose: The pose to which it led; anything else may have moved the platform since.

    Raises:
        InputError: no such motion.
    """

    motion: int
    start: Pose
    amount: float
    pose: Pose

    def __post_init__(self) -> None:
        if not 0 <= self.motion < len(UNCOUPLED):
            raise InputError(
                f"the uncoupled motions are 0 to {len(UNCOUPLED) - 1}; got {self.motion}"
            )


def make_jog(motion: int, start: Pose, amount: float) -> Jog:
    """Return a motion that has gone so far from its start.

    Args:
        motion: Index of the motion in `UNCOUPLED`.
        start: The pose in which it began.
        amount: Distance in design units for a translation, angle in degrees for a rotation.

    Raises:
        InputError: no such motion, or an amount that is not finite.
    """
    unmoved = Jog(motion, start, 0.0, start)
    if amount == 0.0:
        # The start is kept to the last bit.
        return unmoved
    uncoupled = UNCOUPLED[motion]
    travel = math.radians(amount) if uncoupled.kind == "rotation" else amount
    return replace(unmoved, amount=amount, pose=uncoupled.moved(start, travel))
