"""Velocity and force ellipsoids of a pose, and its distance from the singular poses.

Since joint rates = J · twist, actuator forces J⁻ᵀ · wrench balance a wrench. So the speed of a
point (b4, or that of the tool) per unit of actuator speed and the actuator force per unit of force
at that point are the same three numbers along the same three directions: the faster the platform,
the weaker it is. The reach makes rotations comparable: it multiplies angular velocities and divides
moments.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from explorer.mechanism.design import Design
from explorer.mechanism.margins import margins
from explorer.mechanism.pose import Pose, checked_rotation
from explorer.numerics.arrays import FloatArray, position_array
from explorer.singularity.jacobian import jacobian
from explorer.singularity.nearest import nearest_singularities

# Share of the largest singular value up to which a singular value counts as zero.
SINGULAR = 1e-13


@dataclass(frozen=True)
class Ellipsoid:
    """The velocity ellipsoid of a pose, and the force ellipsoid reciprocal to it.

    Attributes:
        axes: Principal directions in the base frame, in columns, shape (3, 3), a right-handed
            frame.
        gain: Speed per unit of actuator speed along each axis, which is also the actuator
            force per unit of force; descending, inf in a singular direction, shape (3,).
    """

    axes: FloatArray
    gain: FloatArray

    @property
    def velocity(self) -> FloatArray:
        """Semi-axes of the ellipsoid of velocities at unit actuator speed, shape (3,)."""
        return self.gain

    @property
    def force(self) -> FloatArray:
        """Semi-axes of the ellipsoid of forces that unit actuator force balances, shape (3,)."""
        with np.errstate(divide="ignore"):
            return np.where(np.isinf(self.gain), 0.0, 1.0 / self.gain)


@dataclass(frozen=True)
class Performance:
    """The ellipsoids of a pose.

    Attributes:
        translation: Velocities of the point and forces at it; dimensionless.
        rotation: Angular velocities times the reach, and moments over the reach;
            dimensionless. It does not depend on the point.
    """

    translation: Ellipsoid
    rotation: Ellipsoid


@dataclass(frozen=True)
class SingularityFreeBall:
    """The largest ball of positions about a pose, at its orientation, without singularity.

    Attributes:
        radius: Radius in design units; 0 at a singular pose.
        incidence: Index 1, 2 or 3 of the margin whose plane the ball touches.
        touches: Point of contact in the base frame, shape (3,), in design units.
        distances: Distances of b4 from the planes of δ1, δ2 and δ3, shape (3,), in design
            units.
    """

    radius: float
    incidence: int
    touches: FloatArray
    distances: FloatArray


def performance(design: Design, pose: Pose, tool: ArrayLike | None = None) -> Performance:
    """Return the ellipsoids of a pose; some axes are infinite if it is singular.

    Args:
        design: The manipulator.
        pose: The pose.
        tool: Point of the velocities and forces in the platform frame, shape (3,), in design
            units; None for b4.

    Raises:
        InputError: The tool is not finite.
    """
    scale = np.array([1.0] * 3 + [design.reach] * 3)
    rates = jacobian(design, pose.position, pose.rotation, tool) / scale
    _, values, rows = np.linalg.svd(rates)
    is_lost = values <= SINGULAR * values[0]
    inverse = np.divide(1.0, values, out=np.zeros(6), where=~is_lost)
    # Twists by column: those at zero actuator speed, and those per unit of actuator speed.
    return Performance(
        _ellipsoid(rows.T[:3, is_lost], rows.T[:3] * inverse),
        _ellipsoid(rows.T[3:, is_lost], rows.T[3:] * inverse),
    )


def planes_of_singularity(rotation: ArrayLike) -> FloatArray:
    """Return the gradients of (δ1, δ2, δ3) with respect to p, shape (..., 3, 3), in rows.

    At a fixed orientation the singular positions are up to three planes through a1 with these
    normals; the first and the third coincide where the planes of platform and base are parallel.
    The gradient of δ2 has the length of the sine between the lines a1a2 and b2b3, which is zero
    if they are parallel; the others have unit length. The rotation has the shape (..., 3, 3).
    """
    r = checked_rotation(rotation)
    gradients = np.zeros(r.shape)
    gradients[..., 0, :] = -r[..., :, 2]
    gradients[..., 1, 1], gradients[..., 1, 2] = -r[..., 2, 0], r[..., 1, 0]
    gradients[..., 2, 2] = 1.0
    return gradients


def singular_plane_distances(position: ArrayLike, rotation: ArrayLike) -> FloatArray:
    """Return the distances of positions from the singular planes of δ1 to δ3, shape (..., 3).

    If the lines a1a2 and b2b3 are parallel every position is singular, and the distance for δ2
    is zero. Arguments and errors are those of `margins`.
    """
    p, r = position_array("position", position), checked_rotation(rotation)
    distances = np.abs(margins(p, r))
    sine = np.broadcast_to(np.hypot(r[..., 1, 0], r[..., 2, 0]), distances.shape[:-1])
    distances[..., 1] = np.divide(
        distances[..., 1], sine, out=np.zeros(sine.shape), where=sine > SINGULAR
    )
    return distances


def singularity_free_ball(pose: Pose) -> SingularityFreeBall:
    """Return the largest open ball of positions about a pose without a singular position.

    The orientation is fixed. The ball about b4 touches the nearest of the singular planes, so
    it is exact.
    """
    distances = singular_plane_distances(pose.position, pose.rotation)
    index = int(distances.argmin())
    normal = planes_of_singularity(pose.rotation)[index]
    length = float(np.linalg.norm(normal))
    touches = np.array(pose.position)
    if length > SINGULAR:
        touches -= normal * float(normal @ touches) / length**2
    return SingularityFreeBall(float(distances[index]), index + 1, touches, distances)


def certified_radius(design: Design, pose: Pose) -> float:
    """Return the root-mean-square displacement of b1 to b4 below which no pose is singular.

    The result is in design units. It is a proven lower bound over all six degrees of freedom,
    see `explorer.singularity.nearest`.
    """
    return min(nearest.bound for nearest in nearest_singularities(design, pose))


def _ellipsoid(free: FloatArray, driven: FloatArray) -> Ellipsoid:
    """Return the ellipsoid of the velocities at unit actuator speed.

    Columns are velocities: free at zero actuator speed (3, k), and driven per unit of it (3, 6).
    """
    axes, sizes, _ = np.linalg.svd(free @ free.T)
    count = int((sizes > SINGULAR).sum())
    infinite = axes[:, :count]
    projector = np.eye(3) - infinite @ infinite.T
    directions, gains, _ = np.linalg.svd(projector @ driven, full_matrices=False)
    finite = 3 - count
    axes = np.concatenate([infinite, directions[:, :finite]], axis=1)
    if np.linalg.det(axes) < 0.0:
        axes[:, 2] *= -1.0
    return Ellipsoid(axes, np.concatenate([np.full(count, math.inf), gains[:finite]]))
