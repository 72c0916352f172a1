"""Agreement of the volume of a mesh with the exact volume of its workspace.

If all faces are within the tolerance of the true surface, the volume is wrong by at most the
tolerance times their area. For a workspace about as thin as the tolerance that bound is useless,
so the difference must not exceed a share of the exact volume either.
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

# The largest difference of a mesh from the exact volume, as a share of it.
LARGEST_SHARE = 0.01
# Columns per axis for the exact volume within cones, which then takes as long as the mesh.
COLUMNS = 120


@dataclass(frozen=True)
class ExactVolume:
    """The exact volume that a mesh is compared with, in cubed design units.

    Attributes:
        volume: Volume of the positions that satisfy all limits.
        error: Bound of its error, rounding included.
    """

    volume: float
    error: float

    def excess(self, solid: Solid) -> float:
        """Return the volume by which the difference of a mesh exceeds the allowed one.

        The mesh agrees if the excess is not positive. It is infinite if some face comes from no
        limit, since its facet protrudes.
        """
        if (solid.limit_of_face < 0).any():
            return math.inf
        allowed = min(solid.tolerance * solid.area, LARGEST_SHARE * self.volume)
        return abs(solid.volume - self.volume) - allowed - self.error

    def is_settled_by(self, solid: Solid) -> bool:
        """Return whether a mesh agrees, and is not empty although the exact volume is not zero."""
        return self.excess(solid) <= 0.0 and not (solid.is_empty and self.volume > 0.0)

    def is_artefact(self, solid: Solid) -> bool:
        """Return whether the exact volume is zero and that of the mesh is due to its tolerance."""
        disagrees = self.volume <= 0.0 and self.excess(solid) > 0.0
        return disagrees and abs(solid.volume) <= solid.tolerance * solid.area


def exact_volume(limits: Sequence[Constraint], known: Volume | None = None) -> ExactVolume:
    """Return the exact volume of a workspace, which may have been computed before."""
    region = region_of(limits)
    volume, error = volume_within(region, COLUMNS) if known is None else (known.volume, known.error)
    return ExactVolume(volume, 2.0 * error)


def exact_volume_within(
    limits: Sequence[Constraint], lows: FloatArray, highs: FloatArray
) -> ExactVolume:
    """Return the exact volume of a workspace that is known to lie in a box, ends (3,) each.

    The box makes columns closer and rounding smaller than they are without it.
    """
    sides = np.concatenate([-np.eye(3), np.eye(3)])
    ends = [*(-lows).tolist(), *highs.tolist()]
    walls = [HalfSpace("", side, end) for side, end in zip(sides, ends, strict=True)]
    volume, error = volume_within(region_of([*limits, *walls]))
    return ExactVolume(volume, 2.0 * error)
