"""A turn of the platform about one axis as polynomials, and where they first turn negative.

Along a turn by an angle s every entry of the rotation is a + b cos s + c sin s. With cos s/2 =
(1 − u) w and sin s/2 = u w it is a polynomial in u on [0, 1], homogeneous in (1 − u, u), whose
Bernstein coefficients are its own over binomials (`explorer.numerics.bernstein`). A turn is an
array (3, 3, 3): for each entry of the rotation the coefficients of (1 − u)², (1 − u) u and u².
"""

from __future__ import annotations

import math
from typing import NamedTuple

from explorer.numerics.arrays import FloatArray
from explorer.numerics.bernstein import (
    NOWHERE,
    STACK,
    first_negative,
    is_negative_nowhere,
    keep_left,
)
from explorer.numerics.compiled import helper
from explorer.numerics.vectors import Vector
from explorer.workspace.limits.quantities import A3, B1, B2, B3

START_IS_INVALID = -1.0
"""Angle or place that means that the start of the turn already violates a limit."""

# Rows of the scratch array: the polynomial that is searched, the three coordinates of a leg, and
# a leg along its cone's axis, that squared, and the square of the leg.
ROWS = 8
POLYNOMIAL, LEG_ROW, ALONG, SQUARE, LEG_SQUARE = 0, 1, 4, 5, 6
SCRATCH = (ROWS + STACK[0] + STACK[0], STACK[1])
# Binomials of the degrees 2, 4 and 8, over which coefficients become those of Bernstein.
BINOMIALS_2 = (1.0, 2.0, 1.0)
BINOMIALS_4 = (1.0, 4.0, 6.0, 4.0, 1.0)
BINOMIALS_8 = (1.0, 8.0, 28.0, 56.0, 70.0, 56.0, 28.0, 8.0, 1.0)


class TurnSearch(NamedTuple):
    """A turn in the search for its first limit.

    Attributes:
        row, demands: Those of `Rules`.
        p: Position of the tool, shape (3,).
        tool: Tool point in platform coordinates, shape (3,).
        turn: Coefficients of the rotation, shape (3, 3, 3).
        scratch: Array of the shape `SCRATCH`.
    """

    row: FloatArray
    demands: FloatArray
    p: FloatArray
    tool: FloatArray
    turn: FloatArray
    scratch: FloatArray


@helper
def angle_at(u: float) -> float:
    """Return the angle of the turn at a place u of [0, 1], in radians."""
    return 2.0 * math.atan2(u, 1.0 - u)


@helper
def write_tilt(azimuth: float, torsion: float, turn: FloatArray) -> None:
    """Write the turn from tilt zero in an azimuth, angles in radians, see `first_limit`."""
    c, s = math.cos(azimuth), math.sin(azimuth)
    a, b = math.cos(torsion - azimuth), math.sin(torsion - azimuth)
    # R = still + level cos θ + upright sin θ.
    for column in range(3):
        across, along = (b, a) if column == 0 else ((a, -b) if column == 1 else (0.0, 0.0))
        for i in range(3):
            if column == 2:
                still = 0.0
                level = 1.0 if i == 2 else 0.0
                upright = c if i == 0 else (s if i == 1 else 0.0)
            else:
                still = -across * s if i == 0 else (across * c if i == 1 else 0.0)
                level = along * c if i == 0 else (along * s if i == 1 else 0.0)
                upright = -along if i == 2 else 0.0
            turn[i, column, 0] = still + level
            turn[i, column, 1] = 2.0 * upright
            turn[i, column, 2] = still - level


@helper
def arm_of(row: FloatArray, leg: int, tool: FloatArray) -> Vector:
    """Return the vector from the tool to the platform end of a leg, numbered from 0 on."""
    x, y = 0.0, 0.0
    if leg == 0:
        x, y = row[B1], row[B1 + 1]
    elif leg == 1:
        x = row[B2]
    elif leg == 2:
        x = row[B3]
    return (x - tool[0], y - tool[1], -tool[2])


@helper
def turn_direction(turn: FloatArray, i: int, k: int, arm: Vector) -> float:
    """Return a coefficient of a coordinate of a vector of the platform that turns."""
    return arm[0] * turn[i, 0, k] + arm[1] * turn[i, 1, k] + arm[2] * turn[i, 2, k]


@helper
def write_leg(search: TurnSearch, leg: int) -> None:
    """Write the coordinates of a leg from base to platform, polynomials of degree 2 each.

    Legs 2 and 3, from 0 on numbers 1 and 2, start at their carriages, so they have no x.
    """
    arm = arm_of(search.row, leg, search.tool)
    for i in range(3):
        for k in range(3):
            value = turn_direction(search.turn, i, k, arm)
            if k != 1:
                value += search.p[i]
                if leg == 3 and i < 2:
                    value -= search.row[A3 + i]
            if i == 0 and 1 <= leg <= 2:
                value = 0.0
            search.scratch[LEG_ROW + i, k] = value


@helper
def add_product(a: FloatArray, b: FloatArray, degree: int, out: FloatArray) -> None:
    """Add the product of two polynomials of one degree to a polynomial."""
    for i in range(degree + 1):
        for k in range(degree + 1):
            out[i + k] += a[i] * b[k]


@helper
def nearer_end(degree: int, end: float, scratch: FloatArray) -> float:
    """Return the first place before `end` where the searched polynomial turns negative.

    It is `end` if there is none, and -1 if the polynomial is negative at the start.
    """
    b = scratch[POLYNOMIAL]
    if is_negative_nowhere(b, degree):
        return end
    if not b[0] >= 0.0:
        return START_IS_INVALID
    if end < 1.0:
        keep_left(b, degree, end)
        if is_negative_nowhere(b, degree):
            return end
    found = first_negative(b, degree, scratch[ROWS:])
    return end if found == NOWHERE else found * end


@helper
def nearer_linear_end(a: float, b: float, c: float, end: float) -> float:
    """Return what `nearer_end` does for a (1 − u)² + b (1 − u) u + c u², in closed form."""
    if not a >= 0.0:
        return START_IS_INVALID
    half = 0.5 * b
    square = half * half - a * c
    if (b >= 0.0 and c >= 0.0) or square < 0.0:
        return end
    # The first positive root of a + b t + c t², with t = u / (1 − u). Of its two forms each is
    # taken where its sum has terms of one sign, so that nothing cancels.
    root = math.sqrt(square)
    if b >= 0.0:
        above = half + root
        return min(end, above / (above - c))
    below = root - half
    return min(end, a / (a + below))
