"""The uncoupled motions by hand: each starts where it was first used and is exact from there.

A motion that is used again goes on from the same start, so its control tells how far it is
and leads back to where it began. Anything else that moves the platform ends it.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from explorer.errors import InputError
from explorer.mechanism.pose import Pose
from explorer.singularity.uncoupled import UNCOUPLED


@dataclass(frozen=True)
class Jog:
    """How far one of the six motions has gone.

    Attributes:
        motion: Its index in `UNCOUPLED`.
        start: The pose in which it began.
        amount: In design units of a translation, in degrees of a rotation.
        pose: Where that is; the platform is elsewhere once something else has moved it.
    """

    motion: int
    start: Pose
    amount: float
    pose: Pose


def jogged(motion: int, start: Pose, amount: float) -> Jog:
    """Return a motion that has gone so far from its start.

    Args:
        motion: Its index in `UNCOUPLED`.
        start: The pose in which it began.
        amount: In design units of a translation, in degrees of a rotation.

    Raises:
        InputError: no such motion, or an amount that is not finite.
    """
    if not 0 <= motion < len(UNCOUPLED):
        raise InputError(f"the uncoupled motions are 0 to {len(UNCOUPLED) - 1}; got {motion}")
    moving = UNCOUPLED[motion]
    if amount == 0.0:
        # Back where it began, to the last bit.
        return Jog(motion, start, 0.0, start)
    way = math.radians(amount) if moving.kind == "rotation" else amount
    return Jog(motion, start, amount, moving.moved(start, way))
