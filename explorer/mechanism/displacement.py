"""How far a pose is from another: the root-mean-square way of the platform's four points.

The mean square way of b1, b2, b3 and b4 between two poses is that of their centroid and a
part of the rotations alone, |g' − g|² + 2 tr M − 2 tr(R' M Rᵀ), with the centroid g and the
scatter M of the points about it (Kabsch 1976; Horn 1987). It has the unit of the design,
needs no weighing of angles against lengths, and does not depend on the frames.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from explorer.mechanism.design import Design
from explorer.mechanism.pose import checked_rotation
from explorer.numerics.arrays import FloatArray, batch_shape, dot, finite_array


@dataclass(frozen=True)
class PlatformPoints:
    """The four points of a platform by their first and second moments, in its own frame.

    Attributes:
        points: b1, b2, b3 and b4, shape (4, 3), in design units.
        centroid: Their mean c, shape (3,).
        scatter: The mean of (b − c)(b − c)ᵀ, shape (3, 3).
        length: The root of its trace: the root-mean-square distance from the centroid.
    """

    points: FloatArray
    centroid: FloatArray
    scatter: FloatArray
    length: float

    @staticmethod
    def of(design: Design) -> PlatformPoints:
        """Return those of a design."""
        points = np.zeros((4, 3))
        points[0, :2] = design.b1
        points[1, 0], points[2, 0] = design.b2, design.b3
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
    """Return the root-mean-square way of b1 to b4 from one pose to another, shape (...).

    Args:
        design: The manipulator.
        position: b4 in the base frame, shape (..., 3), in design units.
        rotation: Platform to base, shape (..., 3, 3).
        other_position: Of the other pose, shape (..., 3).
        other_rotation: Of the other pose, shape (..., 3, 3).

    Raises:
        InputError: a pose that is not finite or not a rotation.
    """
    p = finite_array("position", position, (3,))
    q = finite_array("other position", other_position, (3,))
    r, s = checked_rotation(rotation), checked_rotation(other_rotation)
    batch_shape((p, 1), (r, 2), (q, 1), (s, 2))
    points = PlatformPoints.of(design).points
    # Sums of squares of the ways themselves keep their digits where the poses are close.
    way = (q - p)[..., None, :] + points @ np.swapaxes(s - r, -1, -2)
    return np.sqrt(dot(way, way).mean(axis=-1))
