"""The quantities that limits bound, and how fast each of them can change.

Every limit demands low ≤ g(pose) ≤ high of one quantity g. Kernels take demands as rows; see
`explorer.workspace.limits.table` for what makes them.
"""

from __future__ import annotations

import math

import numpy as np

from explorer.mechanism.margins import margins_at
from explorer.numerics.arrays import FloatArray
from explorer.numerics.compiled import helper, kernel
from explorer.numerics.vectors import cross3, dot3, minus, norm3, vector

# Quantities, those first that take the least time: b4, the margins, the carriages, their distance,
# d3 − d1, the lengths in the order of the legs, and the angle in radians of a leg from an axis.
X, Y, Z, DELTA1, DELTA2, DELTA3, D1, D3, GAP, ORDER, L1, D2, D4, L4, ANGLE = range(15)

# Columns of the rows of demands: the quantity, its range, and what an angle needs: the index of the
# leg, the axis, which is zero if there is none, and whether it turns with the platform.
QUANTITY, LOW, HIGH, LEG, AXIS_X, AXIS_Y, AXIS_Z, TURNS, DEMAND_COLUMNS = range(9)

# Columns of the row of geometry: the design variables and the sums of radii of the pairs of legs.
A3, B1, B2, B3, RADII, GEOMETRY_COLUMNS = 0, 2, 4, 5, 6, 12

# Speeds over a move, after those of the quantities: bounds of the second derivatives of the
# margins. The speed of an angle is that of a direction of the platform, in radians.
BENDS, SPEEDS = 15, 18


@helper
def write_ends(
    row: FloatArray, p: FloatArray, r: FloatArray, base: FloatArray, ends: FloatArray
) -> None:
    """Write the base ends and the platform ends of the four legs, shape (4, 3) each."""
    for i in range(3):
        ends[0, i] = p[i] + row[B1] * r[i, 0] + row[B1 + 1] * r[i, 1]
        ends[1, i] = p[i] + row[B2] * r[i, 0]
        ends[2, i] = p[i] + row[B3] * r[i, 0]
        ends[3, i] = p[i]
        base[0, i] = base[1, i] = base[2, i] = base[3, i] = 0.0
    base[1, 0], base[2, 0] = ends[1, 0], ends[2, 0]
    base[3, 0], base[3, 1] = row[A3], row[A3 + 1]


@helper
def quantity_at(
    kind: int, p: FloatArray, r: FloatArray, base: FloatArray, ends: FloatArray
) -> float:
    """Return a quantity that is no angle, in a pose, given the ends of its legs."""
    if kind <= Z:
        return p[kind - X]
    if kind <= DELTA3:
        return margins_at(p, r)[kind - DELTA1]
    if kind <= D3:
        return ends[kind - D1 + 1, 0]
    if kind <= ORDER:
        apart = ends[2, 0] - ends[1, 0]
        return apart if kind == ORDER else abs(apart)
    return norm3(minus(vector(ends, kind - L1), vector(base, kind - L1)))


@helper
def angle_at(
    demands: FloatArray, index: int, r: FloatArray, base: FloatArray, ends: FloatArray
) -> float:
    """Return the angle of a leg that a demand is on, in radians; half a turn without an axis."""
    axis = (demands[index, AXIS_X], demands[index, AXIS_Y], demands[index, AXIS_Z])
    if axis == (0.0, 0.0, 0.0):
        return math.pi
    if demands[index, TURNS] > 0.0:
        axis = (dot3(vector(r, 0), axis), dot3(vector(r, 1), axis), dot3(vector(r, 2), axis))
    leg = int(demands[index, LEG])
    along = minus(vector(ends, leg), vector(base, leg))
    return math.atan2(norm3(cross3(along, axis)), dot3(along, axis))


@helper
def write_speeds(
    row: FloatArray,
    p: FloatArray,
    r: FloatArray,
    step: FloatArray,
    axis: FloatArray,
    angle: float,
    tool: FloatArray,
    speeds: FloatArray,
) -> None:
    """Write upper bounds of the speeds over a move, per share of it, shape (SPEEDS,).

    The point of the platform that moves straight is `tool`, in platform coordinates; it starts at
    p and moves by `step`. The lengths and the carriages have the speed of the leg's platform end.
    """
    forward = math.sqrt(step[0] ** 2 + step[1] ** 2 + step[2] ** 2)
    ends = ((row[B1], row[B1 + 1]), (row[B2], 0.0), (row[B3], 0.0), (0.0, 0.0))
    swing = 0.0
    for leg in range(4):
        u, v, w = ends[leg][0] - tool[0], ends[leg][1] - tool[1], -tool[2]
        x = u * r[0, 0] + v * r[0, 1] + w * r[0, 2]
        y = u * r[1, 0] + v * r[1, 1] + w * r[1, 2]
        z = u * r[2, 0] + v * r[2, 1] + w * r[2, 2]
        swing = angle * norm3(cross3((axis[0], axis[1], axis[2]), (x, y, z)))
        speeds[L1 + leg] = forward + swing
    speeds[D1], speeds[D3] = speeds[D2], speeds[D4]
    speeds[GAP] = speeds[ORDER] = angle * abs(row[B3] - row[B2])
    speeds[ANGLE] = angle
    # b4 came last of the ends; it swings about the tool, perpendicular to the axis of the turn.
    for i in range(3):
        share = math.sqrt(max(0.0, 1.0 - axis[i] * axis[i]))
        speeds[X + i] = abs(step[i]) + swing * share
    # On its line the tool is farthest from a1 at one of the ends.
    farthest = 0.0
    for end in range(2):
        square = 0.0
        for i in range(3):
            square += (p[i] + end * step[i]) ** 2
        farthest = max(farthest, math.sqrt(square))
    # With c the position of the tool, δ1 = tool z − R ẑ·c and δ2 = (x̂ × R x̂)·c − x̂·R (x̂ × tool).
    speeds[DELTA1] = forward + angle * farthest
    speeds[DELTA2] = speeds[DELTA1] + angle * math.hypot(tool[1], tool[2])
    speeds[DELTA3] = speeds[Z]
    # c goes straight, and directions turn evenly; δ3 = ẑ·c − ẑ·R tool.
    square = angle * angle
    speeds[BENDS] = square * farthest + 2.0 * angle * forward
    speeds[BENDS + 1] = speeds[BENDS] + square * math.hypot(tool[1], tool[2])
    speeds[BENDS + 2] = square * math.sqrt(tool[0] ** 2 + tool[1] ** 2 + tool[2] ** 2)


@kernel("void(f8[::1], f8[:,::1], f8[:,::1], f8[:,:,::1], f8[:,::1])")
def quantity_rows(
    row: FloatArray,
    demands: FloatArray,
    positions: FloatArray,
    rotations: FloatArray,
    values: FloatArray,
) -> None:
    """Write the quantities of m demands in n poses, shape (n, m)."""
    base, ends = np.zeros((4, 3)), np.zeros((4, 3))
    for k in range(positions.shape[0]):
        p, r = positions[k], rotations[k]
        write_ends(row, p, r, base, ends)
        for index in range(demands.shape[0]):
            kind = int(demands[index, QUANTITY])
            if kind == ANGLE:
                values[k, index] = angle_at(demands, index, r, base, ends)
            else:
                values[k, index] = quantity_at(kind, p, r, base, ends)
