"""The first limit that a turn of the platform about one axis meets, the tool kept in its place.

Along a turn by an angle s every entry of the rotation is a + b cos s + c sin s. With cos s/2 =
(1 − u) w and sin s/2 = u w it is a polynomial in u on [0, 1], homogeneous in (1 − u, u), whose
Bernstein coefficients are its own over binomials (`explorer.numerics.bernstein`). A turn is an
array (3, 3, 3): for each entry of the rotation the coefficients of (1 − u)², (1 − u) u and u².

Each limit but a cone is such a polynomial: of degree 2 for l1, l4, the guide, the gap, the carriage
order, the box and the margins, of degree 4 for d2 and d4. Whether a cone contains its leg follows
from the signs of two, of degrees 4 and 8. With the tool at b4, l4 and the box are constant.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from explorer.numerics.arrays import FloatArray, IntArray
from explorer.numerics.bernstein import (
    MOST_DEGREE,
    NOWHERE,
    STACK,
    first_negative,
    is_negative_nowhere,
    keep_left,
    keep_right,
)
from explorer.numerics.compiled import helper, kernel
from explorer.numerics.vectors import Vector
from explorer.workspace.limits.quantities import (
    A3,
    ANGLE,
    AXIS_X,
    B1,
    B2,
    B3,
    D1,
    D3,
    DELTA1,
    DELTA3,
    GAP,
    HIGH,
    L1,
    LEG,
    LOW,
    QUANTITY,
    TURNS,
    X,
    Z,
)

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
        p, tool: Tool in the base frame and in the platform's, shape (3,).
        turn, scratch: Coefficients of the rotation, (3, 3, 3), and array of the shape `SCRATCH`.
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


NO_LIMIT = -1
# Length of a part of the turn in u below which the search for the end of a cone ends.
LEAST_PART = 1e-13


@helper
def nearer_end_of_length(
    search: TurnSearch, leg: int, bound: float, sign: float, end: float
) -> float:
    """Return the first place at which a leg meets a bound as `nearer_end`; sign 1 for a maximum."""
    row, p, turn, limit = search.row, search.p, search.turn, bound * bound
    arm = arm_of(row, leg, search.tool)
    if leg % 3 == 0:
        # The square of the length of q + R arm is that of q, that of the arm, and 2 q·(R arm).
        q = (p[0], p[1], p[2])
        if leg == 3:
            q = (p[0] - row[A3], p[1] - row[A3 + 1], p[2])
        a = b = c = 0.0
        for i in range(3):
            a += q[i] * turn_direction(turn, i, 0, arm)
            b += q[i] * turn_direction(turn, i, 1, arm)
            c += q[i] * turn_direction(turn, i, 2, arm)
        square = q[0] * q[0] + q[1] * q[1] + q[2] * q[2]
        offset = limit - (square + arm[0] * arm[0] + arm[1] * arm[1] + arm[2] * arm[2])
        return nearer_linear_end(
            sign * (offset - 2.0 * a), -2.0 * sign * b, sign * (offset - 2.0 * c), end
        )
    length, radius = math.hypot(math.hypot(arm[0], arm[1]), arm[2]), math.hypot(p[1], p[2])
    # Most bounds are beyond what any orientation needs.
    if radius + length <= bound if sign > 0.0 else radius - length >= bound:
        return end
    polynomial = search.scratch[POLYNOMIAL]
    for k in range(5):
        polynomial[k] = -limit * (1.0 if k % 4 == 0 else (2.0 if k == 2 else 0.0))
    for i in range(1, 3):
        leg_row = search.scratch[LEG_ROW + i]
        for k in range(3):
            leg_row[k] = turn_direction(turn, i, k, arm) + (0.0 if k == 1 else p[i])
        add_product(leg_row, leg_row, 2, polynomial)
    for k in range(5):
        polynomial[k] *= -sign / BINOMIALS_4[k]
    return nearer_end(4, end, search.scratch)


@helper
def margin_at(search: TurnSearch, index: int, k: int) -> float:
    """Return a coefficient of a margin's polynomial."""
    p, tool, turn = search.p, search.tool, search.turn
    constant = 0.0 if k == 1 else 1.0
    if index == 0:
        normal = p[0] * turn[0, 2, k] + p[1] * turn[1, 2, k] + p[2] * turn[2, 2, k]
        return constant * tool[2] - normal
    if index == 1:
        across = tool[1] * turn[0, 2, k] - tool[2] * turn[0, 1, k]
        return turn[1, 0, k] * p[2] - turn[2, 0, k] * p[1] - across
    return constant * p[2] - turn_direction(turn, 2, k, (tool[0], tool[1], tool[2]))


@helper
def coefficients_of(search: TurnSearch, kind: int) -> Vector:
    """Return the coefficients of the polynomial of a quantity that is of degree 2."""
    row, p, turn = search.row, search.p, search.turn
    if DELTA1 <= kind <= DELTA3:
        index = kind - DELTA1
        return (
            margin_at(search, index, 0),
            margin_at(search, index, 1),
            margin_at(search, index, 2),
        )
    if kind <= D3:
        i, leg = (kind - X, 3) if kind <= Z else (0, kind - D1 + 1)
        arm = arm_of(row, leg, search.tool)
        return (
            p[i] + turn_direction(turn, i, 0, arm),
            turn_direction(turn, i, 1, arm),
            p[i] + turn_direction(turn, i, 2, arm),
        )
    apart = row[B3] - row[B2]
    # The distance of the carriages cannot vanish before it is too small.
    if kind == GAP and apart * turn[0, 0, 0] < 0.0:
        apart = -apart
    return (apart * turn[0, 0, 0], apart * turn[0, 0, 1], apart * turn[0, 0, 2])


@helper
def end_in_cone(search: TurnSearch, index: int, end: float) -> float:
    """Return the first place before `end` where a leg leaves the cone of a demand, as `nearer_end`.

    The cosine of the leg's angle to the axis of the cone, times the leg's length, is a polynomial
    of degree 4, so the leg is on the cone where one of degree 8 vanishes.
    """
    demand, turn, scratch = search.demands[index], search.turn, search.scratch
    half_angle = demand[HIGH]
    if half_angle < 0.0:
        return START_IS_INVALID
    # Half a turn is no bound.
    if half_angle >= math.pi:
        return end
    cosine = math.cos(half_angle)
    write_leg(search, int(demand[LEG]))
    for row in range(ALONG, LEG_SQUARE + 1):
        for k in range(MOST_DEGREE + 1):
            scratch[row, k] = 0.0
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
    """Return what `end_in_cone` does for a half-angle of 90° or more.

    A leg is outside where it points backwards and its searched polynomial, the square of the
    length along the axis less that on the cone, is positive.
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


@helper
def first_limit(search: TurnSearch) -> tuple[float, int]:
    """Return the angle within half a turn at which a turn meets its first limit, and its number.

    They are π and `NO_LIMIT` if the turn meets none, a negative angle and the first limit of the
    list if its start violates one.
    """
    limit, end = NO_LIMIT, 1.0
    for index in range(search.demands.shape[0]):
        demand = search.demands[index]
        kind = int(demand[QUANTITY])
        a = b = c = 0.0
        if kind < L1:
            a, b, c = coefficients_of(search, kind)
        for side in range(2):
            bound, sign, found = demand[LOW + side], 1.0 - 2.0 * side, end
            if kind == ANGLE:
                if side == 1:
                    found = end_in_cone(search, index, end)
            elif math.isinf(bound) or (kind >= L1 and side == 0 and bound <= 0.0):
                continue
            elif kind < L1:
                found = nearer_linear_end(sign * (a - bound), sign * b, sign * (c - bound), end)
            else:
                found = nearer_end_of_length(search, kind - L1, bound, -sign, end)
            if found < end:
                end, limit = found, 2 * index + side
            if found < 0.0:
                return START_IS_INVALID, limit
    return (math.pi if limit == NO_LIMIT else angle_at(end)), limit


@kernel("void(f8[::1], f8[:,::1], f8[::1], f8[::1], f8[:,:,:,::1], f8[::1], i8[::1])")
def turn_rows(
    row: FloatArray,
    demands: FloatArray,
    p: FloatArray,
    tool: FloatArray,
    turns: FloatArray,
    angles: FloatArray,
    limits: IntArray,
) -> None:
    """Write the angles and first limits of n turns, shape (n, 3, 3, 3), as `first_limit` does."""
    scratch = np.zeros(SCRATCH)
    for index in range(turns.shape[0]):
        search = TurnSearch(row, demands, p, tool, turns[index], scratch)
        angles[index], limits[index] = first_limit(search)
