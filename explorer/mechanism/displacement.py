"""The distance between two poses: the root-mean-square displacement of b1, b2, b3 and b4.

It is a metric of G. Nawratil ("New performance indices for 6-dof UPS and 3-dof RPR parallel
manipulators", 2009), who calls its least value to a singular pose the singularity distance.

Its square is |g' − g|² + 2 tr M − 2 tr(R' M Rᵀ), with the centroid g of the four points and
their scatter M about it (Kabsch 1976; Horn 1987). The distance has the unit of the design,
needs no length that weights angles, and does not depend on the frames.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from explorer.mechanism.design import Design
from explorer.mechanism.pose import checked_rotation
from explorer.numerics.arrays import FloatArray, batch_shape, dot, position_array


@dataclass(frozen=True)
class PlatformPoints:
    """The four points of a platform with their first and second moments, in the platform frame.

    Attributes:
        points: b1, b2, b3 and b4, shape (4, 3), in design units.
        centroid: Mean c of the points, shape (3,), in design units.
        scatter: Mean of (b − c)(b − c)ᵀ, shape (3, 3), in squared design units.
        length: Root-mean-square distance of the points from the centroid, in design units.
    """

    points: FloatArray
    centroid: FloatArray
    scatter: FloatArray
    length: float

    @staticmethod
    def of(design: Design) -> PlatformPoints:
        """Return the points of a design's platform."""
        points = design.platform_points
        centroid = points.mean(axis=0)
        off = points - centroid
        scatter = off.T @ off / len(points)
        return PlatformPoints(points, centroid, scatter, float(np.sqrt(np.trace(scatter))))


def displacement(
    design: Design,
    position: ArrayLike,
    rotation: ArrayLike,
    other_position: ArrayLike,
    other_rotation: ArrayLike,
) -> FloatArray:
    """Return the root-mean-square displacement of b1 to b4, shape (...), in design units.

    Args:
        design: The manipulator.
        position: b4 in the base frame, shape (..., 3), in design units.
        rotation: Platform to base, shape (..., 3, 3).
        other_position: b4 of the other pose, shape (..., 3).
        other_rotation: Platform to base in the other pose, shape (..., 3, 3).

    Raises:
        InputError: A position is not finite, or a rotation is not one.
    """
    p = position_array("position", position)
    q = position_array("other position", other_position)
    r, s = checked_rotation(rotation), checked_rotation(other_rotation)
    batch_shape((p, 1), (r, 2), (q, 1), (s, 2))
    # For close poses the formula with the scatter would cancel; these squares do not.
    moves = (q - p)[..., None, :] + design.platform_points @ np.swapaxes(s - r, -1, -2)
    return np.sqrt(dot(moves, moves).mean(axis=-1))
