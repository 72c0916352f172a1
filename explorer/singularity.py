"""Singularities: margins, tetrahedra and the Jacobian (the paper's section 2).

The manipulator is singular exactly where one of three tetrahedra is flat, which is where
two flags meet. Each margin is the signed distance to one such incidence, and their signs
name the assembly mode.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from explorer.arrays import FloatArray, IntArray, batch_shape, dot, finite_array
from explorer.design import Design
from explorer.kinematics import attachment_points
from explorer.pose import checked_rotation

INCIDENCES = (
    "a1 on the platform plane",
    "lines a1a2 and b2b3 meeting",
    "b4 on the base plane",
)
"""What a margin of zero means, in the order κ1, κ2, κ3."""

TETRAHEDRA = (("b1", "b2", "b3", "a1"), ("a1", "a2", "b2", "b3"), ("b4", "a1", "a2", "a3"))
"""The tetrahedra of the three trilaterations, in the order κ1, κ2, κ3."""

MODE_BITS = np.array([4, 2, 1])


def margins(position: ArrayLike, rotation: ArrayLike) -> FloatArray:
    """Return the signed margins (κ1, κ2, κ3), shape (..., 3), in design units.

    κ1 = -(R ẑ)·p, κ2 = (x̂ × R x̂)·p and κ3 = ẑ·p: zero where a1 lies on the platform
    plane, where the lines a1a2 and b2b3 meet or are parallel, where b4 lies on the base
    plane. They do not depend on the design.

    Args:
        position: b4 in the base frame, shape (..., 3), in design units.
        rotation: Platform to base, shape (..., 3, 3).

    Raises:
        InputError: a pose that is not finite or not a rotation.
    """
    p = finite_array("position", position, (3,))
    r = checked_rotation(rotation)
    shape = batch_shape((p, 1), (r, 2))
    kappa1 = -dot(r[..., 2], p)
    kappa2 = r[..., 1, 0] * p[..., 2] - r[..., 2, 0] * p[..., 1]
    kappa3 = np.broadcast_to(p[..., 2], shape)
    return np.stack([kappa1, kappa2, kappa3], axis=-1)


def mode_of(margin: FloatArray) -> IntArray:
    """Return the assembly mode 0 to 7 of margins (..., 3): bit 2 is set where κ1 > 0, …."""
    return np.asarray((margin > 0.0) @ MODE_BITS, dtype=np.int64)


def signs_of(mode: int) -> tuple[int, int, int]:
    """Return the sign triple (±1, ±1, ±1) of an assembly mode."""
    return (1 if mode & 4 else -1, 1 if mode & 2 else -1, 1 if mode & 1 else -1)


def mode_name(mode: int) -> str:
    """Return the sign triple as people read it, such as ``+ − +``."""
    return " ".join("+" if sign > 0 else "−" for sign in signs_of(mode))


def mode_words(modes: tuple[int, ...]) -> str:
    """Return the modes that meet in a pose, such as "boundary of modes 1 and 3", or "5"."""
    if len(modes) == 1:
        return str(modes[0])
    if len(modes) == 8:
        return "boundary of all eight modes"
    *most, last = modes
    return f"boundary of modes {', '.join(map(str, most))} and {last}"


def tetrahedron_volumes(design: Design, margin: FloatArray) -> FloatArray:
    """Return the volumes (..., 3) of the three tetrahedra, in cubed design units.

    Those of the second and third grow with a2x, that is with where a2 is drawn.
    """
    span = design.b3 - design.b2
    factors = np.array(
        [design.b1[1] * span, design.a2x * span, design.a2x * design.a3[1]], dtype=np.float64
    )
    return np.abs(margin * factors) / 6.0


def jacobian(design: Design, position: ArrayLike, rotation: ArrayLike) -> FloatArray:
    """Return the actuator Jacobian J, shape (..., 6, 6): joint rates = J @ twist.

    The twist is (velocity of b4, angular velocity), both in the base frame; the columns
    of the velocity are dimensionless, those of the angular velocity lengths. Where a
    length is zero its direction is undefined and its row is zero: such a pose is singular.

    Args:
        design: The manipulator.
        position: b4 in the base frame, shape (..., 3), in design units.
        rotation: Platform to base, shape (..., 3, 3).

    Raises:
        InputError: a pose that is not finite or not a rotation.
    """
    points = attachment_points(design, position, rotation)
    p = points.b4
    radial = np.array([0.0, 1.0, 1.0])
    spokes = [points.b1, points.b2 * radial, points.b3 * radial, p - points.a3]
    out = np.zeros((*p.shape[:-1], 6, 6))
    out[..., [0, 2, 4, 5], :3] = _unit(np.stack(spokes, axis=-2))
    out[..., [1, 3], 0] = 1.0
    b1, b2, b3 = points.b1 - p, points.b2 - p, points.b3 - p
    arms = np.stack([b1, b2, b2, b3, b3, np.zeros_like(p)], axis=-2)
    # The moment arm × direction of all rows at once; np.cross takes three times as long.
    dx, dy, dz = (out[..., i] for i in range(3))
    ax, ay, az = (arms[..., i] for i in range(3))
    out[..., 3] = ay * dz - az * dy
    out[..., 4] = az * dx - ax * dz
    out[..., 5] = ax * dy - ay * dx
    return out


def determinant(design: Design, joints: FloatArray, margin: FloatArray) -> FloatArray:
    """Return det J, shape (...), by det J · l1 d2 d4 l4 = -b1y a3y (b3 - b2)² κ1 κ2 κ3.

    Where a length is zero the determinant has no limit and zero is returned, in keeping
    with `jacobian`.

    Args:
        design: The manipulator.
        joints: Those of the pose, shape (..., 6).
        margin: Those of the pose, shape (..., 3).
    """
    lengths = joints[..., [0, 2, 4, 5]]
    product = np.prod(lengths, axis=-1)
    numerator = (
        -design.b1[1] * design.a3[1] * (design.b3 - design.b2) ** 2 * np.prod(margin, axis=-1)
    )
    return np.divide(numerator, product, out=np.zeros_like(product), where=product > 0.0)


def inverse_condition(jacobian: FloatArray, length: float) -> FloatArray:
    """Return the least over the largest singular value of J made homogeneous, shape (...).

    Args:
        jacobian: Shape (..., 6, 6).
        length: The characteristic length that divides the columns of the angular
            velocity, in design units.
    """
    homogeneous = jacobian / np.array([1.0, 1.0, 1.0, length, length, length])
    values = np.linalg.svd(homogeneous, compute_uv=False)
    return np.asarray(values[..., -1] / values[..., 0])


def _unit(vector: FloatArray) -> FloatArray:
    length = np.sqrt(dot(vector, vector))[..., None]
    return np.divide(vector, length, out=np.zeros_like(vector), where=length > 0.0)
