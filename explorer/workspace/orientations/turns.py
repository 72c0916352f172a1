"""The first limit that a turn of the platform about one axis meets, the tool held in its place.

Each limit is a polynomial along the turn (`explorer.workspace.orientations.turn_polynomials`): of
degree 2 for l1, l4, the guide, the gap, the carriage order, the box and the margins, of degree 4
for d2 and d4, and of degree 8 for the cones of joints. With the tool at b4, l4 and the box are
constant.
"""

from __future__ import annotations

import math

import numpy as np

from explorer.mechanism.design import LENGTHS, Design
from explorer.numerics.arrays import FloatArray, IntArray
from explorer.numerics.compiled import helper, kernel
from explorer.numerics.vectors import Vector
from explorer.workspace.limits.constraints import CARRIAGE_ORDER, GAP as GAP_NAME
from explorer.workspace.limits.joint_cones import joint_cones
from explorer.workspace.limits.valid_poses import (
    A3,
    B2,
    B3,
    BOX_HIGHS,
    BOX_LOWS,
    GAP,
    GUIDE_HIGH,
    GUIDE_LOW,
    LENGTH_HIGHS,
    LENGTH_LOWS,
    MARGIN,
    ORDER,
    SIGNS,
)
from explorer.workspace.orientations.turn_cones import end_in_cone
from explorer.workspace.orientations.turn_polynomials import (
    BINOMIALS_4,
    LEG_ROW,
    POLYNOMIAL,
    SCRATCH,
    START_IS_INVALID,
    add_product,
    angle_at,
    arm_of,
    nearer_end,
    nearer_linear_end,
    place_of,
    turned,
    write_tilt,
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
# Angle over which a turn is searched.
HALF_TURN = math.pi


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
def nearer_end_of_length(
    row: FloatArray,
    leg: int,
    p: FloatArray,
    tool: FloatArray,
    turn: FloatArray,
    bound: float,
    sign: float,
    end: float,
    scratch: FloatArray,
) -> float:
    """Return what `nearer_end` does for a bound of a length, with sign 1 for a maximum."""
    limit, arm = bound * bound, arm_of(row, leg, tool)
    if leg % 3 == 0:
        # The square of the length of q + R arm is that of q, that of the arm, and 2 q·(R arm).
        q = (p[0], p[1], p[2])
        if leg == 3:
            q = (p[0] - row[A3], p[1] - row[A3 + 1], p[2])
        a = b = c = 0.0
        for i in range(3):
            a += q[i] * turned(turn, i, 0, arm)
            b += q[i] * turned(turn, i, 1, arm)
            c += q[i] * turned(turn, i, 2, arm)
        square = q[0] * q[0] + q[1] * q[1] + q[2] * q[2]
        offset = limit - (square + arm[0] * arm[0] + arm[1] * arm[1] + arm[2] * arm[2])
        return nearer_linear_end(
            sign * (offset - 2.0 * a), -2.0 * sign * b, sign * (offset - 2.0 * c), end
        )
    length, radius = math.hypot(math.hypot(arm[0], arm[1]), arm[2]), math.hypot(p[1], p[2])
    # Most bounds are beyond what any orientation needs.
    if radius + length <= bound if sign > 0.0 else radius - length >= bound:
        return end
    polynomial = scratch[POLYNOMIAL]
    for k in range(5):
        polynomial[k] = -limit * (1.0 if k % 4 == 0 else (2.0 if k == 2 else 0.0))
    for i in range(1, 3):
        leg_row = scratch[LEG_ROW + i]
        for k in range(3):
            leg_row[k] = turned(turn, i, k, arm) + (0.0 if k == 1 else p[i])
        add_product(leg_row, leg_row, 2, polynomial)
    for k in range(5):
        polynomial[k] *= -sign / BINOMIALS_4[k]
    return nearer_end(4, end, scratch)


@helper
def margin_at(index: int, k: int, p: FloatArray, tool: FloatArray, turn: FloatArray) -> float:
    """Return a coefficient of a margin's polynomial."""
    constant = 0.0 if k == 1 else 1.0
    if index == 0:
        normal = p[0] * turn[0, 2, k] + p[1] * turn[1, 2, k] + p[2] * turn[2, 2, k]
        return constant * tool[2] - normal
    if index == 1:
        across = tool[1] * turn[0, 2, k] - tool[2] * turn[0, 1, k]
        return turn[1, 0, k] * p[2] - turn[2, 0, k] * p[1] - across
    return constant * p[2] - turned(turn, 2, k, (tool[0], tool[1], tool[2]))


@helper
def end_by_lengths(
    row: FloatArray,
    p: FloatArray,
    tool: FloatArray,
    turn: FloatArray,
    end: float,
    scratch: FloatArray,
) -> tuple[float, int]:
    """Return what `first_limit` does as a place, for the lengths alone."""
    limit = NO_LIMIT
    for leg in range(4):
        low, high = row[LENGTH_LOWS + leg], row[LENGTH_HIGHS + leg]
        for side in range(2):
            if side == 0 and low <= 0.0:
                continue
            bound, sign = (high, 1.0) if side else (low, -1.0)
            found = nearer_end_of_length(row, leg, p, tool, turn, bound, sign, end, scratch)
            if found < end:
                end, limit = found, LENGTH_LIMITS + 2 * leg + side
            if found < 0.0:
                return end, limit
    return end, limit


@helper
def end_at_bound(
    offset: float, i: int, side: int, arm: Vector, turn: FloatArray, end: float
) -> float:
    """Return what `nearer_linear_end` does for coordinate i of a point and one bound of it.

    The offset is that of the tool from the bound, the arm leads from the tool to the point, and the
    side is 0 for a lower bound and 1 for an upper one.
    """
    sign = -1.0 if side else 1.0
    return nearer_linear_end(
        sign * (offset + turned(turn, i, 0, arm)),
        sign * turned(turn, i, 1, arm),
        sign * (offset + turned(turn, i, 2, arm)),
        end,
    )


@helper
def end_by_guide(
    row: FloatArray, p: FloatArray, tool: FloatArray, turn: FloatArray, end: float
) -> tuple[float, int]:
    """Return what `first_limit` does as a place, for the ends of the guide alone."""
    limit = NO_LIMIT
    for carriage in range(2):
        arm = arm_of(row, 1 + carriage, tool)
        for side in range(2):
            bound = row[GUIDE_HIGH] if side else row[GUIDE_LOW]
            if math.isinf(bound):
                continue
            found = end_at_bound(p[0] - bound, 0, side, arm, turn, end)
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
def end_by_box(
    row: FloatArray, p: FloatArray, tool: FloatArray, turn: FloatArray, end: float
) -> tuple[float, int]:
    """Return what `first_limit` does as a place, for the box alone."""
    arm, limit = arm_of(row, 3, tool), NO_LIMIT
    for i in range(3):
        for side in range(2):
            bound = row[BOX_HIGHS + i] if side else row[BOX_LOWS + i]
            if math.isinf(bound):
                continue
            found = end_at_bound(p[i] - bound, i, side, arm, turn, end)
            if found < end:
                end, limit = found, BOX_LIMITS + 2 * i + side
            if found < 0.0:
                return end, limit
    return end, limit


@helper
def end_by_margins(
    row: FloatArray, p: FloatArray, tool: FloatArray, turn: FloatArray, end: float
) -> tuple[float, int]:
    """Return what `first_limit` does as a place, for the margins alone."""
    least, limit = row[MARGIN], NO_LIMIT
    if least == -math.inf:
        return end, limit
    for index in range(3):
        sign = row[SIGNS + index]
        found = nearer_linear_end(
            sign * margin_at(index, 0, p, tool, turn) - least,
            sign * margin_at(index, 1, p, tool, turn),
            sign * margin_at(index, 2, p, tool, turn) - least,
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
    tool: FloatArray,
    turn: FloatArray,
    most: float,
    scratch: FloatArray,
) -> tuple[float, int]:
    """Return the angle at which a turn meets its first limit, and the number of that limit.

    Args:
        row: Row of `Rules`.
        cones: Cones of `Rules`.
        p: Position of the tool, shape (3,).
        tool: Tool point in platform coordinates, shape (3,).
        turn: Coefficients of the rotation, shape (3, 3, 3): those of (1 − u)², (1 − u) u and u².
        most: Angle in radians, at most half a turn, beyond which limits do not count.
        scratch: Array of the shape `SCRATCH`.

    Returns:
        The angle in radians and the limit: `most` and `NO_LIMIT` if the turn meets none, a
        negative angle and the first limit of the list if its start violates one.
    """
    limit = NO_LIMIT
    end, found = end_by_lengths(row, p, tool, turn, place_of(most), scratch)
    limit = found if found >= 0 else limit
    if end >= 0.0:
        end, found = end_by_guide(row, p, tool, turn, end)
        limit = found if found >= 0 else limit
    if end >= 0.0:
        end, found = end_by_carriages(row, turn, end)
        limit = found if found >= 0 else limit
    if end >= 0.0:
        end, found = end_by_box(row, p, tool, turn, end)
        limit = found if found >= 0 else limit
    if end >= 0.0:
        end, found = end_by_margins(row, p, tool, turn, end)
        limit = found if found >= 0 else limit
    for index in range(cones.shape[0]):
        if end >= 0.0:
            place = end_in_cone(row, cones[index], p, tool, turn, end, scratch)
            if place < end:
                end, limit = place, CONE_LIMITS + index
    if end < 0.0:
        return START_IS_INVALID, limit
    return (most if limit == NO_LIMIT else angle_at(end)), limit


@kernel("void(f8[::1], f8[:,::1], f8[:,::1], f8[::1], f8[:,:,:,::1], f8[::1], i8[::1])")
def turn_rows(
    row: FloatArray,
    cones: FloatArray,
    positions: FloatArray,
    tool: FloatArray,
    turns: FloatArray,
    angles: FloatArray,
    limits: IntArray,
) -> None:
    """Write the angles and first limits of n turns, shape (n, 3, 3, 3), as `first_limit` does."""
    scratch = np.zeros(SCRATCH)
    for index in range(positions.shape[0]):
        angles[index], limits[index] = first_limit(
            row, cones, positions[index], tool, turns[index], HALF_TURN, scratch
        )


@kernel("void(f8[::1], f8[:,::1], f8[:,::1], f8[::1], f8, f8[::1], f8[:,::1], i8[:,::1])")
def tilt_rows(
    row: FloatArray,
    cones: FloatArray,
    positions: FloatArray,
    tool: FloatArray,
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
                row, cones, positions[index], tool, turn, HALF_TURN, scratch
            )
