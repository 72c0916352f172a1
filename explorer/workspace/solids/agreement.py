"""Whether a mesh has the volume of the workspace that it stands for.

Faces within the tolerance of the true surface are off by no more volume than the tolerance times
their area. Of a workspace about as thin as the tolerance that says nothing, so that a share of
the volume bounds the difference as well.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from explorer.numerics.arrays import FloatArray
from explorer.workspace.limits.constraints import Constraint, HalfSpace
from explorer.workspace.limits.region import region_of
from explorer.workspace.slices.volume import Volume, volume_within
from explorer.workspace.solids.solid import Solid

# A mesh may be off by this share of the exact volume, however coarse its tolerance.
LARGEST_SHARE = 0.01
# Columns an axis for the exact volume within cones: the cost is that of a mesh.
COLUMNS = 120


@dataclass(frozen=True)
class Exact:
    """The exact volume that a mesh is compared with, in cubed design units.

    Attributes:
        volume: Of what keeps all limits.
        error: Largest difference of it from the truth, rounding included.
    """

    volume: float
    error: float

    def excess(self, solid: Solid) -> float:
        """Return by how much more than allowed a mesh is off; it agrees if that is not positive.

        Infinite where facets stand out so far that a face belongs to no limit.
        """
        if (solid.limit_of_face < 0).any():
            return math.inf
        most = min(solid.tolerance * solid.area, LARGEST_SHARE * self.volume)
        return abs(solid.volume - self.volume) - most - self.error

    def is_settled_by(self, solid: Solid) -> bool:
        """Whether a mesh agrees, and is not empty merely because there is so little to miss."""
        return self.excess(solid) <= 0.0 and not (solid.is_empty and self.volume > 0.0)

    def is_artefact(self, solid: Solid) -> bool:
        """Whether there is no such volume, and that of the mesh is all due to its tolerance."""
        is_none = self.volume <= 0.0 and self.excess(solid) > 0.0
        return is_none and abs(solid.volume) <= solid.tolerance * solid.area


def exact_of(limits: Sequence[Constraint], known: Volume | None = None) -> Exact:
    """Return the exact volume of what keeps all limits.

    Args:
        limits: Of one workspace.
        known: Its volume if it has been computed before.
    """
    region = region_of(limits)
    volume, error = volume_within(region, COLUMNS) if known is None else (known.volume, known.error)
    return Exact(volume, 2.0 * error)


def exact_within(limits: Sequence[Constraint], lows: FloatArray, highs: FloatArray) -> Exact:
    """Return the exact volume of what keeps all limits, all of it known to lie in a box.

    Columns are no farther apart than the box asks for, and rounding counts for no more.

    Args:
        limits: Of one workspace.
        lows: Of the box, shape (3,).
        highs: Of the box, shape (3,).
    """
    walls = [HalfSpace("", -axis, -float(low)) for axis, low in zip(np.eye(3), lows, strict=True)]
    walls += [HalfSpace("", axis, float(high)) for axis, high in zip(np.eye(3), highs, strict=True)]
    region = region_of([*limits, *walls])
    volume, error = volume_within(region)
    return Exact(volume, 2.0 * error)
