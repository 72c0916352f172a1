"""Where a turn of the platform first takes a leg out of the cone of a joint.

The cosine of a leg's angle to the axis of the cone, times the leg's length, is a polynomial of
degree 4, so a leg is on the cone where one of degree 8 vanishes.
"""

from __future__ import annotations

import math

from explorer.numerics.arrays import FloatArray
from explorer.numerics.bernstein import (
    MOST_DEGREE,
    STACK,
    is_negative_nowhere,
    keep_left,
    keep_right,
)
from explorer.numerics.compiled import helper
from explorer.workspace.limits.quantities import AXIS_X, HIGH, LEG, TURNS
from explorer.workspace.orientations.turn_polynomials import (
    ALONG,
    BINOMIALS_2,
    BINOMIALS_4,
    BINOMIALS_8,
    LEG_ROW,
    LEG_SQUARE,
    POLYNOMIAL,
    ROWS,
    SQUARE,
    START_IS_INVALID,
    add_product,
    arm_of,
    nearer_end,
    write_leg,
)

# Length of a part of the turn in u below which the search ends.
LEAST_PART = 1e-13


@helper
def end_in_cone(
    row: FloatArray,
    demand: FloatArray,
    p: FloatArray,
    tool: FloatArray,
    turn: FloatArray,
    end: float,
    scratch: FloatArray,
) -> float:
    """Return the first place before `end` where a leg leaves the cone of a joint.

    Returns:
        As `nearer_end`.
    """
    leg, half_angle = int(demand[LEG]), demand[HIGH]
    if half_angle < 0.0:
        return START_IS_INVALID
    # Half a turn is no bound.
    if half_angle >= math.pi:
        return end
    cosine = math.cos(half_angle)
    write_leg(row, leg, p, arm_of(row, leg, tool), turn, scratch)
    for index in range(ALONG, LEG_SQUARE + 1):
        for k in range(MOST_DEGREE + 1):
            scratch[index, k] = 0.0
    axis = scratch[POLYNOMIAL]
    for i in range(3):
        for k in range(3):
            if demand[TURNS] > 0.0:
                axis[k] = 0.0
                for j in range(3):
                    axis[k] += turn[i, j, k] * demand[AXIS_X + j]
            else:
                axis[k] = 0.0 if k == 1 else demand[AXIS_X + i]
        add_product(scratch[LEG_ROW + i], axis, 2, scratch[ALONG])
        add_product(scratch[LEG_ROW + i], scratch[LEG_ROW + i], 2, scratch[LEG_SQUARE])
    add_product(scratch[ALONG], scratch[ALONG], 4, scratch[SQUARE])
    if cosine > 0.0:
        for k in range(5):
            scratch[POLYNOMIAL, k] = scratch[ALONG, k] / BINOMIALS_4[k]
        end = nearer_end(4, end, scratch)
        if end < 0.0:
            return end
    # The square of the leg has to have the same degree, so it is multiplied by 1.
    share = cosine * cosine
    for k in range(MOST_DEGREE + 1):
        square = 0.0
        for j in range(3):
            if 0 <= k - 2 * j <= 4:
                square += BINOMIALS_2[j] * scratch[LEG_SQUARE, k - 2 * j]
        scratch[POLYNOMIAL, k] = (scratch[SQUARE, k] - share * square) / BINOMIALS_8[k]
    if cosine > 0.0:
        return nearer_end(8, end, scratch)
    return first_outside_wide_cone(end, scratch)


@helper
def first_outside_wide_cone(end: float, scratch: FloatArray) -> float:
    """Return the first place before `end` outside a cone with a half-angle of 90° or more.

    A leg is outside where it points backwards and its searched polynomial, the square of the
    length along the axis less that on the cone, is positive.

    Returns:
        As `nearer_end`.
    """
    pieces, second = scratch[ROWS:], ROWS + STACK[0]
    others = scratch[second:]
    for i in range(MOST_DEGREE + 1):
        pieces[0, i] = -scratch[POLYNOMIAL, i]
        others[0, i] = scratch[ALONG, i] / BINOMIALS_4[i] if i < 5 else 0.0
    keep_left(pieces[0], 8, end)
    keep_left(others[0], 4, end)
    if pieces[0, 0] < 0.0 and others[0, 0] < 0.0:
        return START_IS_INVALID
    low, width = MOST_DEGREE + 1, MOST_DEGREE + 2
    pieces[0, low], pieces[0, width] = 0.0, end
    top = 0
    while top >= 0:
        piece, other = pieces[top], others[top]
        if is_negative_nowhere(piece, 8) or is_negative_nowhere(other, 4):
            top -= 1
            continue
        if (piece[0] < 0.0 and other[0] < 0.0) or piece[width] < LEAST_PART:
            return piece[low]
        half, other_half = pieces[top + 1], others[top + 1]
        for i in range(MOST_DEGREE + 1):
            half[i], other_half[i] = piece[i], other[i]
        half[width] = piece[width] = 0.5 * piece[width]
        half[low] = piece[low]
        piece[low] += piece[width]
        keep_right(piece, 8, 0.5)
        keep_right(other, 4, 0.5)
        keep_left(half, 8, 0.5)
        keep_left(other_half, 4, 0.5)
        top += 1
    return end
