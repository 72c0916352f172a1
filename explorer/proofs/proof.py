"""A demand over many poses that is proven, or the pose that misses it most."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import NamedTuple

from explorer.numerics.arrays import FloatArray
from explorer.numerics.cells import CellValues


class Proof(NamedTuple):
    """The verdict on one demand over a whole set of poses.

    Amounts are dimensionless: above zero where the demand is missed, below where it has to spare.

    Attributes:
        name: Name of the demand, such as "l1 maximum" or "load of actuator l1".
        missed: Amount of the worst pose that was found.
        bound: Upper bound of the amounts of all poses, less the tolerance of the proof.
        place: Place of the worst pose: azimuth and tilt in degrees, or the position of b4.
        position: b4 of the worst pose, shape (3,), in design units.
        rotation: Rotation of that pose, platform to base, shape (3, 3).
    """

    name: str
    missed: float
    bound: float
    place: FloatArray
    position: FloatArray
    rotation: FloatArray

    @property
    def is_proven(self) -> bool:
        """Whether every pose of the set keeps the demand, to the tolerance of the proof."""
        return max(self.missed, self.bound) <= 0.0


def proofs_of(
    names: Sequence[str],
    found: CellValues,
    pose_of: Callable[[int, FloatArray], tuple[FloatArray, FloatArray]],
) -> list[Proof]:
    """Return the proofs of m demands, given the largest amounts by which they are missed.

    The pose, as position and rotation, follows from the number of the demand and the place.
    """
    rows = zip(names, found.values.tolist(), found.bounds.tolist(), found.places, strict=True)
    return [
        Proof(name, missed, bound, place, *pose_of(index, place))
        for index, (name, missed, bound, place) in enumerate(rows)
    ]
