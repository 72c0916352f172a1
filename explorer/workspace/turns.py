"""The first limit that a turn of the platform about one axis meets, b4 held in its place.

Along a turn by an angle s every entry of the rotation is a + b cos s + c sin s, so each limit is
a trigonometric polynomial: of order 1 for l1, the guide, the gap, the carriage order and the
margins, of order 2 for d2 and d4, of order 4 for the cones of the joints. With cos s/2 = (1 − u) w
and sin s/2 = u w it is a polynomial in u on [0, 1], homogeneous in (1 − u, u), whose Bernstein
coefficients are its own over binomials (`explorer.numerics.bernstein`).
"""

from __future__ import annotations

import math

import numpy as np

from explorer.mechanism.design import LENGTHS, Design
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
from explorer.workspace.limits.constraints import CARRIAGE_ORDER, GAP as GAP_NAME
from explorer.workspace.limits.joint_cones import joint_cones
from explorer.workspace.limits.valid_poses import (
    A3,
    AXIS_X,
    B1,
    B2,
    B3,
    BOX_HIGHS,
    BOX_LOWS,
    COSINE,
    GAP,
    GUIDE_HIGH,
    GUIDE_LOW,
    LEG,
    LENGTH_HIGHS,
    LENGTH_LOWS,
    MARGIN,
    ORDER,
    SIGNS,
    SINE,
    TURNS,
)

# Numbers of the limits in the order of `limit_names`; those of the cones follow.
LENGTH_LIMITS, GUIDE_LIMITS, GAP_LIMIT, ORDER_LIMIT, BOX_LIMITS, MARGIN_LIMITS, CONE_LIMITS = (
    0,
    8,
    12,
    13,
    14,
    20,
    23,
)
NO_LIMIT = -1
# Angle that means that the start of the turn already violates a limit.
NOT_EVEN_THE_START = -1.0
# Rows of the scratch array: the polynomial that is searched, the three coordinates of a leg, and
# a leg along its cone's axis, that squared, and the square of the leg.
ROWS = 8
POLYNOMIAL, LEG_ROW, ALONG, SQUARE, LEG_SQUARE = 0, 1, 4, 5, 6
SCRATCH = (ROWS + STACK[0] + STACK[0], STACK[1])
# Binomials of the degrees 2, 4 and 8, over which coefficients become those of Bernstein.
BINOMIALS_2 = (1.0, 2.0, 1.0)
BINOMIALS_4 = (1.0, 4.0, 6.0, 4.0, 1.0)
BINOMIALS_8 = (1.0, 8.0, 28.0, 56.0, 70.0, 56.0, 28.0, 8.0, 1.0)
# Angle over which a turn is searched.
HALF_TURN = math.pi
# Share of a bracket that the search by the golden section keeps, and the width at which it ends,
# in radians.
GOLDEN_SECTION = 0.5 * (math.sqrt(5.0) - 1.0)
AZIMUTH_WIDTH = 1e-4


def limit_names(design: Design) -> tuple[str, ...]:
    """Return the names of the limits by their numbers here, as in the constraints of a region."""
    return (
        *(f"{name} {end}" for name in LENGTHS for end in ("minimum", "maximum")),
        *(f"{name} {end}" for name in ("d1", "d3") for end in ("minimum", "maximum")),
        GAP_NAME,
        CARRIAGE_ORDER,
        *(f"box {axis} {end}" for axis in "xyz" for end in ("minimum", "maximum")),
        *(f"margin δ{index}" for index in (1, 2, 3)),
        *(f"swing {cone.joint}" for cone in joint_cones(design)),
    )


@helper
def angle_at(u: float) -> float:
    """Return the angle of the turn at a place u of [0, 1], in radians."""
    return 2.0 * math.atan2(u, 1.0 - u)


@helper
def place_of(angle: float) -> float:
    """Return the place in [0, 1] of an angle of at most half a turn."""
    c, s = math.cos(0.5 * angle), math.sin(0.5 * angle)
    return s / (c + s)


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
def write_leg(
    row: FloatArray, leg: int, p: FloatArray, turn: FloatArray, scratch: FloatArray
) -> None:
    """Write the coordinates of a leg from base to platform, polynomials of degree 2 each.

    Legs 2 and 3, from 0 on numbers 1 and 2, start at their carriages, so they have no x.
    """
    for i in range(3):
        for k in range(3):
            value = 0.0
            if leg == 0:
                value = row[B1] * turn[i, 0, k] + row[B1 + 1] * turn[i, 1, k]
            elif leg == 1:
                value = row[B2] * turn[i, 0, k]
            elif leg == 2:
                value = row[B3] * turn[i, 0, k]
            if k != 1:
                value += p[i]
                if leg == 3 and i < 2:
                    value -= row[A3 + i]
            if i == 0 and 1 <= leg <= 2:
                value = 0.0
            scratch[LEG_ROW + i, k] = value


@helper
def add_product(a: FloatArray, b: FloatArray, degree: int, out: FloatArray) -> None:
    """Add the product of two polynomials of one degree to a polynomial."""
    for i in range(degree + 1):
        for k in range(degree + 1):
            out[i + k] += a[i] * b[k]


@helper
def nearer_end(degree: int, end: float, scratch: FloatArray) -> float:
    """Return the first place before `end` where the searched polynomial turns negative.

    Returns:
        The place; `end` if there is none; -1 if the polynomial is negative at the start.
    """
    b = scratch[POLYNOMIAL]
    if is_negative_nowhere(b, degree):
        return end
    if not b[0] >= 0.0:
        return NOT_EVEN_THE_START
    if end < 1.0:
        keep_left(b, degree, end)
        if is_negative_nowhere(b, degree):
            return end
    found = first_negative(b, degree, scratch[ROWS:])
    return end if found == NOWHERE else found * end


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
        return NOT_EVEN_THE_START
    low, width = MOST_DEGREE + 1, MOST_DEGREE + 2
    pieces[0, low], pieces[0, width] = 0.0, end
    top = 0
    while top >= 0:
        piece, other = pieces[top], others[top]
        if is_negative_nowhere(piece, 8) or is_negative_nowhere(other, 4):
            top -= 1
            continue
        if (piece[0] < 0.0 and other[0] < 0.0) or piece[width] < 1e-13:
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
def end_in_cone(
    row: FloatArray,
    cone: FloatArray,
    p: FloatArray,
    turn: FloatArray,
    end: float,
    scratch: FloatArray,
) -> float:
    """Return the first place before `end` where a leg leaves the cone of a joint.

    Returns:
        As `nearer_end`.
    """
    leg = int(cone[LEG]) - 1
    if leg < 0:
        return NOT_EVEN_THE_START
    if cone[SINE] == 0.0:
        return end
    write_leg(row, leg, p, turn, scratch)
    for index in range(ALONG, LEG_SQUARE + 1):
        for k in range(MOST_DEGREE + 1):
            scratch[index, k] = 0.0
    axis = scratch[POLYNOMIAL]
    for i in range(3):
        for k in range(3):
            if cone[TURNS] > 0.0:
                axis[k] = 0.0
                for j in range(3):
                    axis[k] += turn[i, j, k] * cone[AXIS_X + j]
            else:
                axis[k] = 0.0 if k == 1 else cone[AXIS_X + i]
        add_product(scratch[LEG_ROW + i], axis, 2, scratch[ALONG])
        add_product(scratch[LEG_ROW + i], scratch[LEG_ROW + i], 2, scratch[LEG_SQUARE])
    add_product(scratch[ALONG], scratch[ALONG], 4, scratch[SQUARE])
    if cone[COSINE] > 0.0:
        for k in range(5):
            scratch[POLYNOMIAL, k] = scratch[ALONG, k] / BINOMIALS_4[k]
        end = nearer_end(4, end, scratch)
        if end < 0.0:
            return end
    # The square of the leg has to have the same degree, so it is multiplied by 1.
    share = cone[COSINE] * cone[COSINE]
    for k in range(MOST_DEGREE + 1):
        square = 0.0
        for j in range(3):
            if 0 <= k - 2 * j <= 4:
                square += BINOMIALS_2[j] * scratch[LEG_SQUARE, k - 2 * j]
        scratch[POLYNOMIAL, k] = (scratch[SQUARE, k] - share * square) / BINOMIALS_8[k]
    if cone[COSINE] > 0.0:
        return nearer_end(8, end, scratch)
    return first_outside_wide_cone(end, scratch)


@helper
def nearer_linear_end(a: float, b: float, c: float, end: float) -> float:
    """Return what `nearer_end` does for a (1 − u)² + b (1 − u) u + c u², in closed form."""
    if not a >= 0.0:
        return NOT_EVEN_THE_START
    square = 0.25 * b * b - a * c
    if (b >= 0.0 and c >= 0.0) or square < 0.0:
        return end
    # The first positive root of a + b t + c t², with t = u / (1 − u).
    below = math.sqrt(square) - 0.5 * b
    if below <= 0.0:
        return end
    return min(end, a / (a + below))


@helper
def nearer_end_of_length(
    row: FloatArray,
    leg: int,
    p: FloatArray,
    turn: FloatArray,
    bound: float,
    sign: float,
    end: float,
    scratch: FloatArray,
) -> float:
    """Return what `nearer_end` does for a bound of a length, with sign 1 for a maximum."""
    limit = bound * bound
    if leg == 0:
        x, y = row[B1], row[B1 + 1]
        sum_of_squares = p[0] * p[0] + p[1] * p[1] + p[2] * p[2] + x * x + y * y
        a = b = c = 0.0
        for i in range(3):
            a += p[i] * (x * turn[i, 0, 0] + y * turn[i, 1, 0])
            b += p[i] * (x * turn[i, 0, 1] + y * turn[i, 1, 1])
            c += p[i] * (x * turn[i, 0, 2] + y * turn[i, 1, 2])
        offset = limit - sum_of_squares
        return nearer_linear_end(
            sign * (offset - 2.0 * a), -2.0 * sign * b, sign * (offset - 2.0 * c), end
        )
    if leg == 3:
        x, y = p[0] - row[A3], p[1] - row[A3 + 1]
        is_kept = sign * (limit - x * x - y * y - p[2] * p[2]) >= 0.0
        return end if is_kept else NOT_EVEN_THE_START
    arm = row[B2] if leg == 1 else row[B3]
    radius = math.hypot(p[1], p[2])
    # Most bounds are beyond what any orientation needs.
    if radius + abs(arm) <= bound if sign > 0.0 else radius - abs(arm) >= bound:
        return end
    square = scratch[POLYNOMIAL]
    for k in range(5):
        square[k] = -limit * (1.0 if k % 4 == 0 else (2.0 if k == 2 else 0.0))
    for i in range(1, 3):
        leg_row = scratch[LEG_ROW + i]
        for k in range(3):
            leg_row[k] = arm * turn[i, 0, k] + (0.0 if k == 1 else p[i])
        add_product(leg_row, leg_row, 2, square)
    for k in range(5):
        square[k] *= -sign / BINOMIALS_4[k]
    return nearer_end(4, end, scratch)


@helper
def margin_at(index: int, k: int, p: FloatArray, turn: FloatArray) -> float:
    """Return a coefficient of a margin's polynomial."""
    if index == 0:
        return -(p[0] * turn[0, 2, k] + p[1] * turn[1, 2, k] + p[2] * turn[2, 2, k])
    if index == 1:
        return turn[1, 0, k] * p[2] - turn[2, 0, k] * p[1]
    return 0.0 if k == 1 else p[2]


@helper
def end_by_lengths(
    row: FloatArray, p: FloatArray, turn: FloatArray, end: float, scratch: FloatArray
) -> tuple[float, int]:
    """Return what `first_limit` does as a place, for the lengths alone."""
    limit = NO_LIMIT
    for leg in range(4):
        low, high = row[LENGTH_LOWS + leg], row[LENGTH_HIGHS + leg]
        for side in range(2):
            if side == 0 and low <= 0.0:
                continue
            bound, sign = (high, 1.0) if side else (low, -1.0)
            found = nearer_end_of_length(row, leg, p, turn, bound, sign, end, scratch)
            if found < end:
                end, limit = found, LENGTH_LIMITS + 2 * leg + side
            if found < 0.0:
                return end, limit
    return end, limit


@helper
def end_by_guide(row: FloatArray, p: FloatArray, turn: FloatArray, end: float) -> tuple[float, int]:
    """Return what `first_limit` does as a place, for the ends of the guide alone."""
    limit = NO_LIMIT
    for carriage in range(2):
        b = row[B3] if carriage else row[B2]
        for side in range(2):
            bound = row[GUIDE_HIGH] if side else row[GUIDE_LOW]
            if math.isinf(bound):
                continue
            sign = -1.0 if side else 1.0
            offset = p[0] - bound
            found = nearer_linear_end(
                sign * (offset + b * turn[0, 0, 0]),
                sign * b * turn[0, 0, 1],
                sign * (offset + b * turn[0, 0, 2]),
                end,
            )
            if found < end:
                end, limit = found, GUIDE_LIMITS + 2 * carriage + side
            if found < 0.0:
                return end, limit
    return end, limit


@helper
def end_by_carriages(row: FloatArray, turn: FloatArray, end: float) -> tuple[float, int]:
    """Return what `first_limit` does as a place, for the gap and the order of the carriages."""
    apart = row[B3] - row[B2]
    order = row[ORDER]
    if order == 0.0 and row[GAP] <= 0.0:
        return end, NO_LIMIT
    at_start = apart * turn[0, 0, 0]
    if order == 0.0:
        order = 1.0 if at_start >= 0.0 else -1.0
    limit = GAP_LIMIT
    if row[GAP] <= 0.0 or (order * at_start < 0.0 and abs(at_start) >= row[GAP]):
        limit = ORDER_LIMIT
    found = nearer_linear_end(
        order * apart * turn[0, 0, 0] - row[GAP],
        order * apart * turn[0, 0, 1],
        order * apart * turn[0, 0, 2] - row[GAP],
        end,
    )
    return (found, limit) if found < end else (end, NO_LIMIT)


@helper
def broken_side_of_box(row: FloatArray, p: FloatArray) -> int:
    """Return the number of the first side of the box that a position violates, or `NO_LIMIT`."""
    for i in range(3):
        if p[i] < row[BOX_LOWS + i]:
            return BOX_LIMITS + 2 * i
        if p[i] > row[BOX_HIGHS + i]:
            return BOX_LIMITS + 2 * i + 1
    return NO_LIMIT


@helper
def end_by_margins(
    row: FloatArray, p: FloatArray, turn: FloatArray, end: float
) -> tuple[float, int]:
    """Return what `first_limit` does as a place, for the margins alone."""
    least, limit = row[MARGIN], NO_LIMIT
    if least == -math.inf:
        return end, limit
    for index in range(3):
        sign = row[SIGNS + index]
        found = nearer_linear_end(
            sign * margin_at(index, 0, p, turn) - least,
            sign * margin_at(index, 1, p, turn),
            sign * margin_at(index, 2, p, turn) - least,
            end,
        )
        if found < end:
            end, limit = found, MARGIN_LIMITS + index
        if found < 0.0:
            return end, limit
    return end, limit


@helper
def first_limit(
    row: FloatArray,
    cones: FloatArray,
    p: FloatArray,
    turn: FloatArray,
    most: float,
    scratch: FloatArray,
) -> tuple[float, int]:
    """Return the angle at which a turn meets its first limit, and the number of that limit.

    Args:
        row: Row of `Rules`.
        cones: Cones of `Rules`.
        p: Position of b4, shape (3,).
        turn: Coefficients of the rotation, shape (3, 3, 3): those of (1 − u)², (1 − u) u and u².
        most: Angle in radians, at most half a turn, beyond which limits do not count.
        scratch: Array of the shape `SCRATCH`.

    Returns:
        The angle in radians and the limit: `most` and `NO_LIMIT` if the turn meets none, a
        negative angle and the first limit of the list if its start violates one.
    """
    limit = NO_LIMIT
    end, found = end_by_lengths(row, p, turn, place_of(most), scratch)
    limit = found if found >= 0 else limit
    if end >= 0.0:
        end, found = end_by_guide(row, p, turn, end)
        limit = found if found >= 0 else limit
    if end >= 0.0:
        end, found = end_by_carriages(row, turn, end)
        limit = found if found >= 0 else limit
    if end >= 0.0:
        found = broken_side_of_box(row, p)
        if found >= 0:
            end, limit = NOT_EVEN_THE_START, found
    if end >= 0.0:
        end, found = end_by_margins(row, p, turn, end)
        limit = found if found >= 0 else limit
    for index in range(cones.shape[0]):
        if end >= 0.0:
            place = end_in_cone(row, cones[index], p, turn, end, scratch)
            if place < end:
                end, limit = place, CONE_LIMITS + index
    if end < 0.0:
        return NOT_EVEN_THE_START, limit
    return (most if limit == NO_LIMIT else angle_at(end)), limit


@kernel("void(f8[::1], f8[:,::1], f8[:,::1], f8[:,:,:,::1], f8[::1], i8[::1])")
def turn_rows(
    row: FloatArray,
    cones: FloatArray,
    positions: FloatArray,
    turns: FloatArray,
    angles: FloatArray,
    limits: IntArray,
) -> None:
    """Write the angles and first limits of n turns, shape (n, 3, 3, 3), as `first_limit` does."""
    scratch = np.zeros(SCRATCH)
    for index in range(positions.shape[0]):
        angles[index], limits[index] = first_limit(
            row, cones, positions[index], turns[index], HALF_TURN, scratch
        )


@kernel("void(f8[::1], f8[:,::1], f8[:,::1], f8, f8[::1], f8[:,::1], i8[:,::1])")
def tilt_rows(
    row: FloatArray,
    cones: FloatArray,
    positions: FloatArray,
    torsion: float,
    azimuths: FloatArray,
    tilts: FloatArray,
    limits: IntArray,
) -> None:
    """Write the greatest tilts of n positions in m azimuths, shape (n, m), angles in radians."""
    scratch, turn = np.zeros(SCRATCH), np.zeros((3, 3, 3))
    for index in range(positions.shape[0]):
        for k in range(azimuths.shape[0]):
            write_tilt(azimuths[k], torsion, turn)
            tilts[index, k], limits[index, k] = first_limit(
                row, cones, positions[index], turn, HALF_TURN, scratch
            )


@helper
def tilt_in(
    row: FloatArray,
    cones: FloatArray,
    p: FloatArray,
    azimuth: float,
    torsion: float,
    turn: FloatArray,
    scratch: FloatArray,
) -> tuple[float, int]:
    """Return the greatest tilt of a position in one azimuth and its limit, in radians."""
    write_tilt(azimuth, torsion, turn)
    return first_limit(row, cones, p, turn, HALF_TURN, scratch)


@helper
def lowest_between(
    row: FloatArray,
    cones: FloatArray,
    p: FloatArray,
    torsion: float,
    low: float,
    high: float,
    turn: FloatArray,
    scratch: FloatArray,
) -> tuple[float, float, int]:
    """Return the least of the greatest tilts between two azimuths, its azimuth and its limit.

    The search by the golden section narrows the bracket to `AZIMUTH_WIDTH`, at which the tilt of
    a smooth minimum is good to rounding.
    """
    span = GOLDEN_SECTION * (high - low)
    first, second = high - span, low + span
    at_first, limit_first = tilt_in(row, cones, p, first, torsion, turn, scratch)
    at_second, limit_second = tilt_in(row, cones, p, second, torsion, turn, scratch)
    while high - low > AZIMUTH_WIDTH:
        if at_first <= at_second:
            high, second, at_second, limit_second = second, first, at_first, limit_first
            first = high - GOLDEN_SECTION * (high - low)
            at_first, limit_first = tilt_in(row, cones, p, first, torsion, turn, scratch)
        else:
            low, first, at_first, limit_first = first, second, at_second, limit_second
            second = low + GOLDEN_SECTION * (high - low)
            at_second, limit_second = tilt_in(row, cones, p, second, torsion, turn, scratch)
    if at_first <= at_second:
        return at_first, first, limit_first
    return at_second, second, limit_second


@kernel("void(f8[::1], f8[:,::1], f8[:,::1], f8, f8[::1], f8[::1], f8[::1], f8[::1], i8[::1])")
def least_tilt_rows(
    row: FloatArray,
    cones: FloatArray,
    positions: FloatArray,
    torsion: float,
    azimuths: FloatArray,
    tilts: FloatArray,
    least: FloatArray,
    towards: FloatArray,
    limits: IntArray,
) -> None:
    """Write the least of the greatest tilts over all azimuths, of n positions, in radians.

    Args:
        row: Row of `Rules`.
        cones: Cones of `Rules`.
        positions: Positions of b4, shape (n, 3).
        torsion: Torsion in radians.
        azimuths: Azimuths in radians at equal distances once around, shape (m,).
        tilts: Scratch array, shape (m,).
        least: Least tilt of each position, negative where tilt zero violates a limit, shape (n,).
        towards: Azimuth of the least tilt, shape (n,).
        limits: Number of the limit that ends it, shape (n,).
    """
    scratch, turn = np.zeros(SCRATCH), np.zeros((3, 3, 3))
    count = azimuths.shape[0]
    step = 2.0 * math.pi / count
    for index in range(positions.shape[0]):
        p = positions[index]
        best, towards[index], limits[index] = HALF_TURN, 0.0, NO_LIMIT
        for k in range(count):
            tilts[k], limit = tilt_in(row, cones, p, azimuths[k], torsion, turn, scratch)
            if tilts[k] < best:
                best, towards[index], limits[index] = tilts[k], azimuths[k], limit
            if best < 0.0:
                break
        if best > 0.0:
            for k in range(count):
                before, after = tilts[k - 1], tilts[(k + 1) % count]
                # Between its neighbours a smooth minimum is lower by an eighth of the rise at most.
                rise = max(before, after) - tilts[k]
                is_lowest = tilts[k] <= before and tilts[k] <= after and rise > 0.0
                if not is_lowest or tilts[k] - 0.25 * rise > best:
                    continue
                found, azimuth, limit = lowest_between(
                    row,
                    cones,
                    p,
                    torsion,
                    azimuths[k] - step,
                    azimuths[k] + step,
                    turn,
                    scratch,
                )
                if found < best:
                    best, towards[index], limits[index] = found, azimuth, limit
        least[index] = best
