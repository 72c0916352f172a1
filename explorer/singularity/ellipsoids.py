"""The actuator Jacobian of a pose: determinant, conditioning, ellipsoids of velocities and forces.

Since joint rates = J · twist, actuator forces J⁻ᵀ · wrench balance a wrench. So the speed of a
point (b4, or that of the tool) per unit of actuator speed and the actuator force per unit of force
at that point are the same three numbers along the same three directions: the faster the platform,
the weaker it is. The reach makes rotations comparable: it multiplies angular velocities and divides
moments. With the ellipsoids stand the distances of a pose from the singular poses.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from explorer.mechanism.configuration import Configuration, computed_once
from explorer.mechanism.design import LENGTH_ROWS, Design
from explorer.mechanism.margins import margins
from explorer.mechanism.pose import Pose, checked_rotation
from explorer.numerics.arrays import FloatArray, position_array
from explorer.singularity.nearest import nearest_singularities


def tetrahedron_volumes(design: Design, margin: FloatArray) -> FloatArray:
    """Return the volumes of the three tetrahedra, shape (..., 3), in cubed design units.

    They are proportional to the margins (δ1, δ2, δ3), shape (..., 3); the second and third also
    to a2x, the position at which a2 is drawn.
    """
    span = design.b3 - design.b2
    factors = np.array([design.b1[1] * span, design.a2x * span, design.a2x * design.a3[1]])
    return np.abs(margin * factors) / 6.0


def jacobian(
    design: Design, position: ArrayLike, rotation: ArrayLike, tool: ArrayLike | None = None
) -> FloatArray:
    """Return `jacobian_of` of `Configuration(design, position, rotation, tool)`."""
    return jacobian_of(Configuration(design, position, rotation, tool))


@computed_once
def jacobian_of(configuration: Configuration) -> FloatArray:
    """Return the actuator Jacobian J, shape (..., 6, 6): joint rates = J @ twist.

    J maps the platform's twist to the joint rates; Merlet ("Parallel Robots", 2006) calls this
    matrix the inverse Jacobian. The twist is (v; ω): the velocity v of the tool point, in design
    units per unit of time, and the angular velocity ω, in radians per unit of time, both along
    the axes of the base frame. The rows are the rates of (l1, d1, d2, d3, d4, l4), the order of
    `JOINTS`, in design units per unit of time; so columns 1 to 3 are dimensionless and columns
    4 to 6 are lengths in design units. The determinant does not depend on the tool point.

    A joint of length zero has no direction, and its row is zero: such a pose is singular.
    """
    points, c = configuration.points, configuration.position + configuration.arm
    out = np.zeros((*configuration.batch, 6, 6))
    out[..., LENGTH_ROWS, :3] = configuration.leg_directions
    out[..., [1, 3], 0] = 1.0
    b1, b2, b3, b4 = points.b1 - c, points.b2 - c, points.b3 - c, points.b4 - c
    arms = np.stack(np.broadcast_arrays(b1, b2, b2, b3, b3, b4), axis=-2)
    # The moment arm × direction of every row; np.cross takes three times as long.
    dx, dy, dz = (out[..., i] for i in range(3))
    ax, ay, az = (arms[..., i] for i in range(3))
    out[..., 3] = ay * dz - az * dy
    out[..., 4] = az * dx - ax * dz
    out[..., 5] = ax * dy - ay * dx
    return out


def determinant(design: Design, joints: FloatArray, margin: FloatArray) -> FloatArray:
    """Return det J, shape (...), in cubed design units.

    The closed form is det J · l1 d2 d4 l4 = -b1y a3y (b3 - b2)² δ1 δ2 δ3. At a length of zero
    the determinant has no limit; the result is then zero, as for the matrix of `jacobian`.

    Args:
        design: The manipulator.
        joints: Joints of the pose, shape (..., 6), in design units.
        margin: Margins (δ1, δ2, δ3) of the pose, shape (..., 3), in design units.
    """
    lengths = joints[..., LENGTH_ROWS]
    product = np.prod(lengths, axis=-1)
    factor = -design.b1[1] * design.a3[1] * (design.b3 - design.b2) ** 2
    numerator = factor * np.prod(margin, axis=-1)
    return np.divide(numerator, product, out=np.zeros_like(product), where=product > 0.0)


def scaled_margins(design: Design, joints: FloatArray, margin: FloatArray) -> FloatArray:
    """Return the sizes of the margins as they enter the Jacobian, shape (..., 3), dimensionless.

    Their product is |det J| over the cubed reach. The first and the third are the moment arms of
    legs 1 and 4 about the lines b2b3 and a1a2, over the reach. Where J is badly conditioned, the
    least of them names the incidence that makes it so; this may be far away if the design itself
    is nearly degenerate.

    Args:
        design: The manipulator.
        joints: Joints of the pose, shape (..., 6), in design units.
        margin: Margins (δ1, δ2, δ3) of the pose, shape (..., 3), in design units.
    """
    span, reach = design.b3 - design.b2, design.reach
    l1, d2, d4, l4 = (joints[..., index] for index in LENGTH_ROWS)
    factors = np.array([design.b1[1] / reach, (span / reach) * span, design.a3[1] / reach])
    lengths = np.stack([l1, d2 * d4, l4], axis=-1)
    sizes = np.abs(margin * factors)
    return np.divide(sizes, lengths, out=np.zeros(sizes.shape), where=lengths > 0.0)


def singular_values(jacobian: FloatArray, length: float) -> FloatArray:
    """Return the singular values of the homogeneous J, dimensionless, descending, shape (..., 6).

    One over the smallest is the largest factor by which J⁻¹ enlarges errors of the actuators, to
    those of the platform (displacement; length × turn), and loads (force; moment / length), to
    forces of the actuators; all as Euclidean norms of six numbers.

    Args:
        jacobian: Matrices J, shape (..., 6, 6).
        length: Normalising length that divides the columns of the angular velocity, in design
            units.
    """
    homogeneous = jacobian / np.array([1.0, 1.0, 1.0, length, length, length])
    return np.asarray(np.linalg.svd(homogeneous, compute_uv=False), dtype=np.float64)


def inverse_condition(jacobian: FloatArray, length: float) -> FloatArray:
    """Return the inverse condition number of the homogeneous J, from 0 to 1, shape (...).

    It is the smallest singular value over the largest. The arguments are those of
    `singular_values`.
    """
    values = singular_values(jacobian, length)
    return np.asarray(values[..., -1] / values[..., 0])


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
