"""The actuator Jacobian, its determinant and conditioning, and the volumes of the tetrahedra."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from explorer.mechanism.configuration import Configuration, computed_once
from explorer.mechanism.design import Design
from explorer.numerics.arrays import FloatArray


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
    out[..., [0, 2, 4, 5], :3] = configuration.leg_directions
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
    lengths = joints[..., [0, 2, 4, 5]]
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
    l1, d2, d4, l4 = (joints[..., index] for index in (0, 2, 4, 5))
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
