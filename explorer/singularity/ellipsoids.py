"""How strong and how fast the platform is in a pose, and how far it keeps from singularity.

With joint rates = J · twist, a wrench takes the actuator forces J⁻ᵀ · wrench. So the speed of
b4 per unit of actuator speed and the actuator force per unit of force at b4 are the same three
numbers along the same three directions: where the platform is fast, it is weak. Rotations
are made comparable with the reach as the length that multiplies angular velocities and divides
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
from explorer.numerics.arrays import FloatArray, finite_array
from explorer.singularity.jacobian import jacobian
from explorer.singularity.nearest import nearest_singularities

# A singular value below this share of the largest is zero.
SINGULAR = 1e-13


@dataclass(frozen=True)
class Ellipsoid:
    """What unit actuator speeds, or unit actuator forces, do in all directions.

    Attributes:
        axes: The principal directions in the base frame, in columns, shape (3, 3), a
            right-handed frame.
        gain: Along each, the speed per unit of actuator speed, which is also the actuator
            force per unit of force; descending, inf in a singular direction, shape (3,).
    """

    axes: FloatArray
    gain: FloatArray

    @property
    def velocity(self) -> FloatArray:
        """The semi-axes of all speeds that a unit of actuator speed reaches, shape (3,)."""
        return self.gain

    @property
    def force(self) -> FloatArray:
        """The semi-axes of all forces that a unit of actuator force holds, shape (3,)."""
        with np.errstate(divide="ignore"):
            return np.where(np.isinf(self.gain), 0.0, 1.0 / self.gain)


@dataclass(frozen=True)
class Performance:
    """The ellipsoids of a pose.

    Attributes:
        translation: Of b4: speeds and forces, without dimension.
        rotation: Of angular velocity times the reach, and of moments over the reach.
    """

    translation: Ellipsoid
    rotation: Ellipsoid


@dataclass(frozen=True)
class SingularityFreeBall:
    """The largest ball of positions about a pose, at its orientation, without singularity.

    Attributes:
        radius: In design units; 0 on the singular set.
        incidence: 1, 2 or 3: of the plane that it touches.
        touches: Where, shape (3,).
        distances: Of b4 from the three planes, in the order κ1, κ2, κ3, shape (3,).
    """

    radius: float
    incidence: int
    touches: FloatArray
    distances: FloatArray


def performance(design: Design, pose: Pose) -> Performance:
    """Return the ellipsoids of a pose; where it is singular some axes are infinite.

    Args:
        design: The manipulator.
        pose: Of its platform.
    """
    length = design.reach
    rates = jacobian(design, pose.position, pose.rotation) / np.array([1.0] * 3 + [length] * 3)
    _, values, rows = np.linalg.svd(rates)
    lost = values <= SINGULAR * values[0]
    inverse = np.divide(1.0, values, out=np.zeros(6), where=~lost)
    # Platform motions by column: those that no actuator feels, and those per unit of speed.
    return Performance(
        _ellipsoid(rows.T[:3, lost], rows.T[:3] * inverse),
        _ellipsoid(rows.T[3:, lost], rows.T[3:] * inverse),
    )


def planes_of_singularity(rotation: ArrayLike) -> FloatArray:
    """Return the gradients of (κ1, κ2, κ3) with respect to p, shape (..., 3, 3), in rows.

    At a fixed orientation the singular positions are the planes through a1 with these
    normals. That of κ2 is as long as the sine between the lines, and zero if they are parallel.
    """
    r = checked_rotation(rotation)
    gradients = np.zeros(r.shape)
    gradients[..., 0, :] = -r[..., :, 2]
    gradients[..., 1, 1], gradients[..., 1, 2] = -r[..., 2, 0], r[..., 1, 0]
    gradients[..., 2, 2] = 1.0
    return gradients


def singular_plane_distances(position: ArrayLike, rotation: ArrayLike) -> FloatArray:
    """Return the distances of positions from the three singular planes, shape (..., 3).

    Where the lines are parallel every position is singular, and that of κ2 is zero.

    Args:
        position: b4 in the base frame, shape (..., 3).
        rotation: Platform to base, shape (..., 3, 3).

    Raises:
        InputError: a pose that is not finite or not a rotation.
    """
    p, r = finite_array("position", position, (3,)), checked_rotation(rotation)
    found = np.abs(margins(p, r))
    sine = np.broadcast_to(np.hypot(r[..., 1, 0], r[..., 2, 0]), found.shape[:-1])
    found[..., 1] = np.divide(
        found[..., 1], sine, out=np.zeros(found.shape[:-1]), where=sine > SINGULAR
    )
    return found


def singularity_free_ball(pose: Pose) -> SingularityFreeBall:
    """Return the largest ball of positions about a pose that holds no singular one.

    It is exact: the ball about b4 that touches the nearest of three planes.
    """
    distances = singular_plane_distances(pose.position, pose.rotation)
    index = int(distances.argmin())
    normal = planes_of_singularity(pose.rotation)[index]
    length = float(np.linalg.norm(normal))
    position = np.array(pose.position)
    if length > SINGULAR:
        touches = position - normal * float(normal @ position) / length**2
    else:
        touches = position
    return SingularityFreeBall(float(distances[index]), index + 1, touches, distances)


def certified_radius(design: Design, pose: Pose) -> float:
    """Return the root-mean-square way of b1 to b4 below which no pose is singular.

    In design units. It holds for all six degrees of freedom, and comes with a proof, see
    `explorer.singularity.nearest`.
    """
    return min(each.bound for each in nearest_singularities(design, pose))


def _ellipsoid(free: FloatArray, driven: FloatArray) -> Ellipsoid:
    """Return the ellipsoid of directions (3, k) that go freely and those (3, 6) of unit drive."""
    axes, sizes, _ = np.linalg.svd(free @ free.T)
    count = int((sizes > SINGULAR).sum())
    infinite = axes[:, :count]
    across = np.eye(3) - infinite @ infinite.T
    directions, gains, _ = np.linalg.svd(across @ driven, full_matrices=False)
    finite = 3 - count
    axes = np.concatenate([infinite, directions[:, :finite]], axis=1)
    if np.linalg.det(axes) < 0.0:
        axes[:, 2] *= -1.0
    return Ellipsoid(axes, np.concatenate([np.full(count, math.inf), gains[:finite]]))
