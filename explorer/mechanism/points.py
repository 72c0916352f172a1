"""The attachment points of a pose, and the joints that follow from them: the inverse kinematics.

It is four distances and two projections.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from explorer.numerics.arrays import FloatArray

Variables = tuple[float, float, float, float, float, float]
"""The design variables X = (a3x, a3y, b1x, b1y, b2, b3), in design units."""

IN_LEGS = np.array([(1.0, 1.0, 1.0), (0.0, 1.0, 1.0), (0.0, 1.0, 1.0), (1.0, 1.0, 1.0)])
"""The parts of vectors that are in the legs, as factors: of 2 and 3 those across the guide."""


class AttachmentPoints(NamedTuple):
    """The attachment points in the base frame, each of shape (..., 3), in design units."""

    a1: FloatArray
    a2: FloatArray
    a3: FloatArray
    b1: FloatArray
    b2: FloatArray
    b3: FloatArray
    b4: FloatArray

    def legs(self) -> FloatArray:
        """Return the legs as vectors from base to platform, shape (..., 4, 3).

        Legs 2 and 3 start at their carriages, so they are perpendicular to the guide.
        """
        return np.stack((self.b1, self.b2, self.b3, self.b4 - self.a3), axis=-2) * IN_LEGS


def platform_points(variables: Variables) -> FloatArray:
    """Return b1, b2, b3 and b4 in the platform frame, shape (4, 3), in design units."""
    _, _, b1x, b1y, b2, b3 = variables
    return np.array([(b1x, b1y, 0.0), (b2, 0.0, 0.0), (b3, 0.0, 0.0), (0.0, 0.0, 0.0)])


def points_of(variables: Variables, a2x: float, p: FloatArray, r: FloatArray) -> AttachmentPoints:
    """Return the attachment points of poses (..., 3) and (..., 3, 3); no joint depends on a2x."""
    a3x, a3y, b1x, b1y, b2, b3 = variables
    x = r[..., 0]
    shape = np.broadcast_shapes(p.shape, x.shape)
    return AttachmentPoints(
        a1=np.zeros(shape),
        a2=np.broadcast_to(np.array([a2x, 0.0, 0.0]), shape),
        a3=np.broadcast_to(np.array([a3x, a3y, 0.0]), shape),
        b1=p + b1x * x + b1y * r[..., 1],
        b2=p + b2 * x,
        b3=p + b3 * x,
        b4=np.broadcast_to(p, shape),
    )


def joints_of(points: AttachmentPoints, leg_lengths: FloatArray) -> FloatArray:
    """Return the joints (l1, d1, d2, d3, d4, l4), shape (..., 6), of legs of some lengths."""
    d1, d3 = points.b2[..., 0], points.b3[..., 0]
    l1, d2, d4, l4 = (leg_lengths[..., leg] for leg in range(4))
    return np.stack([l1, d1, d2, d3, d4, l4], axis=-1)
