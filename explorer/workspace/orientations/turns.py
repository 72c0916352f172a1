"""The first limit that a turn of the platform about one axis meets, the tool held in its place.

Each limit is a polynomial along the turn (`explorer.workspace.orientations.turn_polynomials`): of
degree 2 for l1, l4, the guide, the gap, the carriage order, the box and the margins, of degree 4
for d2 and d4, and of degree 8 for the cones of joints. With the tool at b4, l4 and the box are
constant.
"""

from __future__ import annotations

import math

import numpy as np

from explorer.mechanism.design import Design
from explorer.numerics.arrays import FloatArray, IntArray
from explorer.numerics.compiled import helper, kernel
from explorer.numerics.vectors import Vector
from explorer.workspace.limits.quantities import (
    A3,
    ANGLE,
    B2,
    B3,
    D1,
    D3,
    DELTA1,
    DELTA3,
    GAP,
    L1,
    LOW,
    QUANTITY,
    X,
    Z,
)
from explorer.workspace.limits.table import by_quantity, demands_of
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

NO_LIMIT = -1
# Angle over which a turn is searched.
HALF_TURN = math.pi


def limit_names(design: Design) -> tuple[str, ...]:
    """Return the names of the limits by their numbers here: two for each demand of the rules."""
    demands = by_quantity(demands_of(design))
    return tuple(name for demand in demands for name in demand.end_names())


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
def coefficients_of(
    row: FloatArray, kind: int, p: FloatArray, tool: FloatArray, turn: FloatArray
) -> Vector:
    """Return the coefficients of the polynomial of a quantity that is of degree 2."""
    if DELTA1 <= kind <= DELTA3:
        index = kind - DELTA1
        return (
            margin_at(index, 0, p, tool, turn),
            margin_at(index, 1, p, tool, turn),
            margin_at(index, 2, p, tool, turn),
        )
    if kind <= D3:
        i, leg = (kind - X, 3) if kind <= Z else (0, kind - D1 + 1)
        arm = arm_of(row, leg, tool)
        return (
            p[i] + turned(turn, i, 0, arm),
            turned(turn, i, 1, arm),
            p[i] + turned(turn, i, 2, arm),
        )
    apart = row[B3] - row[B2]
    # The distance of the carriages cannot vanish before it is too small.
    if kind == GAP and apart * turn[0, 0, 0] < 0.0:
        apart = -apart
    return (apart * turn[0, 0, 0], apart * turn[0, 0, 1], apart * turn[0, 0, 2])


@helper
def first_limit(
    row: FloatArray,
    demands: FloatArray,
    p: FloatArray,
    tool: FloatArray,
    turn: FloatArray,
    most: float,
    scratch: FloatArray,
) -> tuple[float, int]:
    """Return the angle at which a turn meets its first limit, and the number of that limit.

    Args:
        row: Row of `Rules`.
        demands: Demands of `Rules`.
        p: Position of the tool, shape (3,).
        tool: Tool point in platform coordinates, shape (3,).
        turn: Coefficients of the rotation, shape (3, 3, 3): those of (1 − u)², (1 − u) u and u².
        most: Angle in radians, at most half a turn, beyond which limits do not count.
        scratch: Array of the shape `SCRATCH`.

    Returns:
        The angle in radians and the limit: `most` and `NO_LIMIT` if the turn meets none, a
        negative angle and the first limit of the list if its start violates one.
    """
    limit, end = NO_LIMIT, place_of(most)
    for index in range(demands.shape[0]):
        kind = int(demands[index, QUANTITY])
        a = b = c = 0.0
        if kind < L1:
            a, b, c = coefficients_of(row, kind, p, tool, turn)
        for side in range(2):
            bound, sign, found = demands[index, LOW + side], 1.0 - 2.0 * side, end
            if kind == ANGLE:
                if side == 1:
                    found = end_in_cone(row, demands[index], p, tool, turn, end, scratch)
            elif math.isinf(bound) or (kind >= L1 and side == 0 and bound <= 0.0):
                continue
            elif kind < L1:
                found = nearer_linear_end(sign * (a - bound), sign * b, sign * (c - bound), end)
            else:
                found = nearer_end_of_length(
                    row, kind - L1, p, tool, turn, bound, -sign, end, scratch
                )
            if found < end:
                end, limit = found, 2 * index + side
            if found < 0.0:
                return START_IS_INVALID, limit
    return (most if limit == NO_LIMIT else angle_at(end)), limit


@kernel("void(f8[::1], f8[:,::1], f8[:,::1], f8[::1], f8[:,:,:,::1], f8[::1], i8[::1])")
def turn_rows(
    row: FloatArray,
    demands: FloatArray,
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
            row, demands, positions[index], tool, turns[index], HALF_TURN, scratch
        )


@kernel("void(f8[::1], f8[:,::1], f8[:,::1], f8[::1], f8, f8[::1], f8[:,::1], i8[:,::1])")
def tilt_rows(
    row: FloatArray,
    demands: FloatArray,
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
                row, demands, positions[index], tool, turn, HALF_TURN, scratch
            )
