"""Inverse and forward kinematics and det J in closed form, over any batch.

The inverse kinematics is that of `explorer.mechanism.points`, and J itself a value of a
configuration. The forward kinematics, with its eight assembly modes, consists of three
trilaterations (the paper's geometric analysis, Figure 2). With c = cos between the guide and the
line b2b3, X and Y the platform's x and y components of the vector from a1 to b4, and r, β, ε and
the folds φ1 to φ3 of `explorer.mechanism.folds`, the joints determine px, py, c, X and Y, and with
them one cosine for each trilateration:

    trilateration 1 (b1 b2 b3 a1):  cos φ1 = −Y / (r sin ε)
    trilateration 2 (a1 a2 b2 b3):  cos φ2 = (cos β cos ε − c) / (sin β sin ε)
    trilateration 3 (b4 a1 a2 a3):  cos φ3 = py / (r sin β)

Each cosine has two folds, of opposite signs, or one flat fold: the eight modes. The discriminants
are the squared margins, equal in all of them.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from explorer.mechanism.configuration import Configuration
from explorer.mechanism.design import JOINTS, LENGTH_ROWS, LENGTHS, Design
from explorer.mechanism.folds import write_rotation
from explorer.numerics.arrays import BoolArray, FloatArray, finite_array, for_kernel
from explorer.numerics.checks import FARTHEST
from explorer.numerics.compiled import helper, kernel

# Relative rounding of one operation.
EPSILON = 2.0**-52
# Number of error bounds below zero within which a discriminant counts as zero.
ROUNDINGS = 8.0


@helper
def sine_of(cosine: float) -> float:
    """Return the sine, 0 or more, of a cosine within ±1."""
    return math.sqrt((1.0 - cosine) * (1.0 + cosine))


@kernel("void(f8[::1], f8[:,::1], f8[:,:,::1], f8[:,:,:,::1], b1[::1], f8[:,::1])")
def solve_rows(
    variables: FloatArray,
    joints: FloatArray,
    positions: FloatArray,
    rotations: FloatArray,
    feasible: BoolArray,
    discriminants: FloatArray,
) -> None:
    """Solve the forward kinematics of n rows of joints (n, 6).

    Joints that do not close yield poses in which each cosine beyond ±1 is ±1: finite and rigid, but
    with other joints; of their discriminants δ1², δ2² and δ3² some are negative. The eight
    positions are of shape (n, 8, 3).
    """
    for row in range(joints.shape[0]):
        a3x, a3y, b1x, b1y, b2, b3 = variables
        l1, d1, d2, d3, d4, l4 = joints[row]

        # h and g are the distances of b4 from the guide and of a1 from the line b2b3. First-order
        # bounds of rounding errors have a leading e.
        span = b3 - b2
        ends = abs(b3) + abs(b2)
        c = (d3 - d1) / span
        ec = EPSILON * (abs(d3) + abs(d1) + abs(c) * ends) / abs(span)
        sine_square = (1.0 - c) * (1.0 + c)
        e_sine = 2.0 * abs(c) * ec + EPSILON * abs(sine_square)
        px = d1 - b2 * c
        epx = abs(b2) * ec + EPSILON * (abs(d1) + abs(b2 * c))
        t = -b2 / span
        pull = t * (1.0 - t) * span * span
        h_square = (1.0 - t) * d2 * d2 + t * d4 * d4 - pull * sine_square
        eh = abs(pull) * e_sine + EPSILON * (
            abs(1.0 - t) * d2 * d2 + abs(t) * d4 * d4 + abs(pull * sine_square)
        ) * (1.0 + ends / abs(span))
        lean = (d4 * d4 - d2 * d2 - (b3 + b2) * span * sine_square) / (2.0 * span)
        e_lean = 0.5 * abs(b3 + b2) * e_sine + EPSILON * (
            (d4 * d4 + d2 * d2) / (2.0 * abs(span)) + abs(lean) * (1.0 + ends / abs(span))
        )
        along = c * px + lean
        e_along = abs(px) * ec + abs(c) * epx + e_lean
        r_square = px * px + h_square
        er = 2.0 * abs(px) * epx + eh + EPSILON * px * px
        g_square = r_square - along * along
        side = px - a3x
        py = (side * side + h_square + a3y * a3y - l4 * l4) / (2.0 * a3y)
        epy = (
            2.0 * abs(side) * epx
            + eh
            + EPSILON * (side * side + abs(h_square) + a3y * a3y + l4 * l4)
        ) / (2.0 * abs(a3y))
        b1_square = b1x * b1x + b1y * b1y
        across = (l1 * l1 - r_square - b1_square - 2.0 * b1x * along) / (2.0 * b1y)
        e_across = (
            er + 2.0 * abs(b1x) * e_along + EPSILON * (l1 * l1 + abs(r_square) + b1_square)
        ) / (2.0 * abs(b1y))

        square1 = g_square - across * across
        e1 = er + (2.0 * abs(along) + e_along) * e_along + (2.0 * abs(across) + e_across) * e_across
        square2 = sine_square * h_square - lean * lean
        e2 = abs(sine_square) * eh + abs(h_square) * e_sine + (2.0 * abs(lean) + e_lean) * e_lean
        if sine_square < 0.0 or h_square < 0.0:
            # Their product may be positive. The sine is made a length by the largest one.
            size = max(abs(a3x), abs(a3y), abs(b1x), abs(b1y), abs(b2), abs(b3))
            size = max(size, l1, abs(d1), d2, abs(d3), d4, l4)
            square2 = min(square2, size * size * sine_square, h_square)
            e2 += size * size * e_sine + eh
        square3 = h_square - py * py
        e3 = eh + (2.0 * abs(py) + epy) * epy
        feasible[row] = (
            square1 >= -ROUNDINGS * e1 and square2 >= -ROUNDINGS * e2 and square3 >= -ROUNDINGS * e3
        )
        discriminants[row, 0] = square1
        discriminants[row, 1] = square2
        discriminants[row, 2] = square3

        # Where a cosine is beyond ±1, the fold is flat. Undefined ones are 0.
        c = min(1.0, max(-1.0, c))
        h = math.sqrt(max(0.0, h_square))
        r = math.sqrt(px * px + h * h)
        cos_b, sin_b = (px / r, h / r) if r > 0.0 else (1.0, 0.0)
        cos_e = min(1.0, max(-1.0, along / r)) if r > 0.0 else c
        sin_e = sine_of(cos_e)
        cos2 = (cos_b * cos_e - c) / (sin_b * sin_e) if sin_b * sin_e > 0.0 else 1.0
        if abs(cos2) >= 1.0:
            # The lines are in one plane, so that ε follows from β and the angle between them.
            cos2 = math.copysign(1.0, cos2)
            sine = math.copysign(sine_of(c), sin_b * cos_e + cos2 * cos_b * sin_e)
            cos_e = cos_b * c + sin_b * sine
            sin_e = cos2 * (cos_b * sine - sin_b * c)
        cos1 = min(1.0, max(-1.0, -across / (r * sin_e))) if r * sin_e > 0.0 else 1.0
        cos3 = min(1.0, max(-1.0, py / h)) if h > 0.0 else 1.0
        sin1, sin2, sin3 = sine_of(cos1), sine_of(cos2), sine_of(cos3)
        angles = (cos_b, sin_b), (cos_e, sin_e)
        for mode in range(8):
            folds = (
                (cos1, sin1 if mode & 4 else -sin1),
                (cos2, sin2 if mode & 2 else -sin2),
                (cos3, sin3 if mode & 1 else -sin3),
            )
            positions[row, mode, 0] = px
            positions[row, mode, 1] = h * cos3
            positions[row, mode, 2] = h * folds[2][1]
            write_rotation(angles, folds, rotations[row, mode])


class ForwardKinematics(NamedTuple):
    """The eight assembly modes; mode k has the sign triple of the bits of k.

    Bit 2 of k is set if δ1 is positive, bit 1 if δ2 is, bit 0 if δ3 is.

    Attributes:
        position: b4 in the base frame, shape (..., 8, 3), in design units.
        rotation: Platform to base, shape (..., 8, 3, 3).
        feasible: Whether the joints close, shape (...), in all eight modes or in none. If they
            do not, the poses are finite but have other joints.
    """

    position: FloatArray
    rotation: FloatArray
    feasible: BoolArray


def inverse(design: Design, position: ArrayLike, rotation: ArrayLike) -> FloatArray:
    """Return the joints of `Configuration(design, position, rotation)`, shape (..., 6)."""
    return Configuration(design, position, rotation).joints


def jacobian(
    design: Design, position: ArrayLike, rotation: ArrayLike, tool: ArrayLike | None = None
) -> FloatArray:
    """Return J of `Configuration(design, position, rotation, tool)`, shape (..., 6, 6)."""
    return Configuration(design, position, rotation, tool).jacobian


def tetrahedron_volumes(design: Design, margin: FloatArray) -> FloatArray:
    """Return the volumes of the three tetrahedra, shape (..., 3), in cubed design units.

    They are proportional to the margins (δ1, δ2, δ3), shape (..., 3); the second and third also
    to a2x, the position at which a2 is drawn.
    """
    span = design.b3 - design.b2
    factors = np.array([design.b1[1] * span, design.a2x * span, design.a2x * design.a3[1]])
    return np.abs(margin * factors) / 6.0


def determinant(design: Design, joints: FloatArray, margin: FloatArray) -> FloatArray:
    """Return det J, shape (...), in cubed design units, of joints (..., 6) and margins (..., 3).

    The closed form is det J · l1 d2 d4 l4 = -b1y a3y (b3 - b2)² δ1 δ2 δ3. At a length of zero
    the determinant has no limit; the result is then zero, as for the matrix J.
    """
    lengths = joints[..., LENGTH_ROWS]
    product = np.prod(lengths, axis=-1)
    factor = -design.b1[1] * design.a3[1] * (design.b3 - design.b2) ** 2
    numerator = factor * np.prod(margin, axis=-1)
    return np.divide(numerator, product, out=np.zeros_like(product), where=product > 0.0)


def jacobian_factors(design: Design, joints: FloatArray, margin: FloatArray) -> FloatArray:
    """Return the sizes of the margins as they enter the Jacobian, shape (..., 3), dimensionless.

    Their product is |det J| over the cubed reach. The first and the third are the moment arms of
    legs 1 and 4 about the lines b2b3 and a1a2, over the reach. Where J is badly conditioned, the
    least of them names the incidence that makes it so; this may be far away if the design itself
    is nearly degenerate.
    """
    span, reach = design.b3 - design.b2, design.reach
    l1, d2, d4, l4 = (joints[..., index] for index in LENGTH_ROWS)
    factors = np.array([design.b1[1] / reach, (span / reach) * span, design.a3[1] / reach])
    lengths = np.stack([l1, d2 * d4, l4], axis=-1)
    sizes = np.abs(margin * factors)
    return np.divide(sizes, lengths, out=np.zeros(sizes.shape), where=lengths > 0.0)


def forward(design: Design, joints: ArrayLike) -> ForwardKinematics:
    """Return all eight assembly modes of joints as in `JOINTS`, shape (..., 6), in design units.

    Raises:
        InputError: The joints are not usable, see `joint_array`.
    """
    return ForwardKinematics(*_solve(design, joints)[:3])


def discriminants(design: Design, joints: ArrayLike) -> FloatArray:
    """Return δ1², δ2², δ3² of the joints, shape (..., 3), in squared design units.

    The joints close if none is negative (to rounding); a negative one shows which trilateration
    fails, and by how much. The joints and errors are those of `forward`.
    """
    return _solve(design, joints)[3]


def joint_array(joints: ArrayLike) -> FloatArray:
    """Return joints (..., 6) as float64 after checking them.

    Raises:
        InputError: The joints are not six finite numbers, a length is negative, or a joint is
            beyond `FARTHEST`.
    """
    array = finite_array(f"joints ({', '.join(JOINTS)})", joints, (6,), FARTHEST)
    for name, row in zip(LENGTHS, LENGTH_ROWS, strict=True):
        finite_array(f"the length {name}", array[..., row], (), signed=False)
    return array


def _solve(
    design: Design, joints: ArrayLike
) -> tuple[FloatArray, FloatArray, BoolArray, FloatArray]:
    q = joint_array(joints)
    batch = q.shape[:-1]
    rows = for_kernel(q.reshape(-1, 6))
    count = len(rows)
    position = np.empty((count, 8, 3))
    rotation = np.empty((count, 8, 3, 3))
    feasible = np.empty(count, dtype=np.bool_)
    squares = np.empty((count, 3))
    solve_rows(count, np.array(design.variables), rows, position, rotation, feasible, squares)
    return (
        position.reshape(*batch, 8, 3),
        rotation.reshape(*batch, 8, 3, 3),
        feasible.reshape(batch),
        squares.reshape(*batch, 3),
    )
