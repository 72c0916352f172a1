"""Agreement of the volume of a mesh with the exact volume of its workspace.

If all faces are within the tolerance of the true surface, the volume is wrong by at most the
tolerance times their area. For a workspace about as thin as the tolerance that is no bound of use,
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
        """Return the volume by which a mesh differs more than allowed; it agrees if not positive.

        The excess is infinite if some face comes from no limit, since its facet protrudes.
        """
        if (solid.limit_of_face < 0).any():
            return math.inf
        most = min(solid.tolerance * solid.area, LARGEST_SHARE * self.volume)
        return abs(solid.volume - self.volume) - most - self.error

    def is_settled_by(self, solid: Solid) -> bool:
        """Return whether a mesh agrees, and is not empty although the exact volume is not zero."""
        return self.excess(solid) <= 0.0 and not (solid.is_empty and self.volume > 0.0)

    def is_artefact(self, solid: Solid) -> bool:
        """Return whether the exact volume is zero and that of the mesh is due to its tolerance."""
        is_none = self.volume <= 0.0 and self.excess(solid) > 0.0
        return is_none and abs(solid.volume) <= solid.tolerance * solid.area


def exact_volume(limits: Sequence[Constraint], known: Volume | None = None) -> ExactVolume:
    """Return the exact volume of a workspace.

    Args:
        limits: Limits of the workspace.
        known: Volume of the workspace if it has been computed before.
    """
    region = region_of(limits)
    volume, error = volume_within(region, COLUMNS) if known is None else (known.volume, known.error)
    return ExactVolume(volume, 2.0 * error)


def exact_volume_within(
    limits: Sequence[Constraint], lows: FloatArray, highs: FloatArray
) -> ExactVolume:
    """Return the exact volume of a workspace that is known to lie in a box.

    The box makes columns closer and rounding smaller than they are without it.

    Args:
        limits: Limits of the workspace.
        lows: Lower ends of the box, shape (3,), in design units.
        highs: Upper ends of the box, shape (3,).
    """
    walls = [HalfSpace("", -axis, -float(low)) for axis, low in zip(np.eye(3), lows, strict=True)]
    walls += [HalfSpace("", axis, float(high)) for axis, high in zip(np.eye(3), highs, strict=True)]
    region = region_of([*limits, *walls])
    volume, error = volume_within(region)
    return ExactVolume(volume, 2.0 * error)
