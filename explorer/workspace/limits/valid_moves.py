"""Whether straight moves keep everything that a design demands, all along, with a proof.

What a pose has left of each limit and each clearance shrinks no faster than the platform's
points move, and their speeds are bounded over the whole move. So no limit is broken before the
least of what is left over what it takes per share: from there one looks again (conservative
advancement; Mirtich 2000). Where nearly nothing is left, steps would be too many: a limit
may be exceeded by a small tolerance between two poses that keep it, but no margin whose sign
is all that is asked, and no clearance.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike

from explorer.legs.segments import closest_shares, minus, square_at
from explorer.mechanism.design import Design
from explorer.mechanism.pose import checked_rotation
from explorer.numerics.arrays import BoolArray, FloatArray, batch_shape, finite_array
from explorer.numerics.compiled import helper, kernel
from explorer.workspace.limits.valid_poses import (
    B1,
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
    RADII,
    SIGNS,
    Rules,
    carriages_apart,
    keeps_all,
    vector,
    write_ends,
)

# Of the reach: how far a limit may be exceeded between poses that keep it.
DEFAULT_TOLERANCE = 1e-4
# Of the tolerance: what margins and clearances must keep on the way, so that it is certain.
LEAST_SHARE = 0.01
# So many looks that a move which needs more goes along a limit all the way.
MOST_LOOKS = 20_000


def moves_are_valid(
    design: Design,
    start_position: ArrayLike,
    start_rotation: ArrayLike,
    end_position: ArrayLike,
    end_rotation: ArrayLike,
    *,
    rules: Rules | None = None,
    tolerance: float | None = None,
) -> BoolArray:
    """Return whether straight moves keep all limits, margins and clearances, shape (...).

    The position goes on a straight line, the platform about one axis the shorter way, as in
    `explorer.legs.moves`. True is a proof, but for the tolerance; a move that keeps clearances
    or signs by less than a 100th of the tolerance may count as one that does not.

    Args:
        design: The manipulator.
        start_position: b4 in the base frame, shape (..., 3), in design units.
        start_rotation: Platform to base, shape (..., 3, 3).
        end_position: Where b4 goes, shape (..., 3).
        end_rotation: How the platform turns, shape (..., 3, 3).
        rules: Those of the design, to save making them for each call.
        tolerance: How far limits may be exceeded on the way, in design units; by default a
            10,000th of the reach.

    Raises:
        InputError: a pose that is not finite or not a rotation.
    """
    p, q = (
        finite_array(name, value, (3,))
        for name, value in (("start position", start_position), ("end position", end_position))
    )
    r, s = checked_rotation(start_rotation), checked_rotation(end_rotation)
    batch = batch_shape((p, 1), (r, 2), (q, 1), (s, 2))
    rows = [
        np.array(np.broadcast_to(each, (*batch, *shape)).reshape(-1, *shape))
        for each, shape in ((p, (3,)), (r, (3, 3)), (q, (3,)), (s, (3, 3)))
    ]
    valid = np.empty(len(rows[0]), dtype=np.bool_)
    demanded = rules or Rules.of(design)
    allowed = DEFAULT_TOLERANCE * design.reach if tolerance is None else tolerance
    valid_move_rows(
        20 * len(rows[0]),
        demanded.row,
        demanded.cones,
        rows[0],
        rows[1],
        rows[2],
        rows[3],
        allowed,
        valid,
    )
    return valid.reshape(batch)


@helper
def write_turn(r: FloatArray, s: FloatArray, axis: FloatArray) -> float:
    """Write the unit axis, in the base frame, that turns r into s; return the angle."""
    turn = np.empty((3, 3))
    for i in range(3):
        for j in range(3):
            turn[i, j] = s[i, 0] * r[j, 0] + s[i, 1] * r[j, 1] + s[i, 2] * r[j, 2]
    x, y, z = turn[2, 1] - turn[1, 2], turn[0, 2] - turn[2, 0], turn[1, 0] - turn[0, 1]
    sine = 0.5 * math.sqrt(x * x + y * y + z * z)
    cosine = 0.5 * (turn[0, 0] + turn[1, 1] + turn[2, 2] - 1.0)
    angle = math.atan2(sine, cosine)
    if cosine < -0.5:
        # Near half a turn the symmetric part tells the axis, its longest column best.
        best = 0
        for k in range(1, 3):
            if turn[k, k] > turn[best, best]:
                best = k
        off = -math.cos(angle)
        columns = (
            0.5 * (turn[0, best] + turn[best, 0]),
            0.5 * (turn[1, best] + turn[best, 1]),
            0.5 * (turn[2, best] + turn[best, 2]),
        )
        a = columns[0] + (off if best == 0 else 0.0)
        b = columns[1] + (off if best == 1 else 0.0)
        c = columns[2] + (off if best == 2 else 0.0)
        if a * x + b * y + c * z < 0.0:
            a, b, c = -a, -b, -c
        x, y, z = a, b, c
    length = math.sqrt(x * x + y * y + z * z)
    if length == 0.0:
        axis[0], axis[1], axis[2] = 1.0, 0.0, 0.0
        return 0.0
    axis[0], axis[1], axis[2] = x / length, y / length, z / length
    return angle


@helper
def write_at(
    t: float,
    p: FloatArray,
    r: FloatArray,
    step: FloatArray,
    axis: FloatArray,
    angle: float,
    p_out: FloatArray,
    r_out: FloatArray,
) -> None:
    """Write the pose at a share of a move."""
    c, s = math.cos(t * angle), math.sin(t * angle)
    x, y, z = axis[0], axis[1], axis[2]
    for j in range(3):
        a, b, d = r[0, j], r[1, j], r[2, j]
        along = (1.0 - c) * (x * a + y * b + z * d)
        r_out[0, j] = c * a + s * (y * d - z * b) + along * x
        r_out[1, j] = c * b + s * (z * a - x * d) + along * y
        r_out[2, j] = c * d + s * (x * b - y * a) + along * z
    for i in range(3):
        p_out[i] = p[i] + t * step[i]


@helper
def over(left: float, rate: float) -> float:
    """Return for what share something lasts that shrinks at a rate."""
    return left / rate if rate > 0.0 else math.inf


@helper
def share_left(left: float, rate: float, tolerance: float) -> float:
    """Return for what share of the move a limit is kept; −1 if it is not even here."""
    # Half the tolerance is left for a step.
    if left < -0.5 * tolerance:
        return -1.0
    return over(left + tolerance, rate)


@helper
def limits_share(
    row: FloatArray,
    p: FloatArray,
    r: FloatArray,
    base: FloatArray,
    ends: FloatArray,
    speeds: FloatArray,
    tolerance: float,
) -> float:
    """Return for what share of the move from here on all limits are kept for certain.

    Args:
        row: Of the rules.
        p: The position here.
        r: The rotation here.
        base: The base ends of the legs here.
        ends: The platform ends of the legs here.
        speeds: See `write_speeds`.
        tolerance: By which limits may be exceeded.
    """
    share = math.inf
    for i in range(3):
        left = min(p[i] - row[BOX_LOWS + i], row[BOX_HIGHS + i] - p[i])
        share = min(share, share_left(left, speeds[8 + i], tolerance))
    least = row[MARGIN]
    if least > -math.inf:
        k1 = -(r[0, 2] * p[0] + r[1, 2] * p[1] + r[2, 2] * p[2])
        k2 = r[1, 0] * p[2] - r[2, 0] * p[1]
        left1, left2 = row[SIGNS] * k1 - least, row[SIGNS + 1] * k2 - least
        left3 = row[SIGNS + 2] * p[2] - least
        if least < 2.0 * tolerance:
            # Their signs are certain.
            if min(left1, left2, left3) < LEAST_SHARE * tolerance:
                return -1.0
            share = min(share, over(left1, speeds[5]))
            share = min(share, over(left2, speeds[6]), over(left3, speeds[7]))
        else:
            share = min(share, share_left(left1, speeds[5], tolerance))
            share = min(share, share_left(left2, speeds[6], tolerance))
            share = min(share, share_left(left3, speeds[7], tolerance))
    d1, d3 = ends[1, 0], ends[2, 0]
    left = min(d1 - row[GUIDE_LOW], row[GUIDE_HIGH] - d1)
    share = min(share, share_left(left, speeds[1], tolerance))
    left = min(d3 - row[GUIDE_LOW], row[GUIDE_HIGH] - d3)
    share = min(share, share_left(left, speeds[2], tolerance))
    share = min(share, share_left(carriages_apart(row, d1, d3) - row[GAP], speeds[11], tolerance))
    for leg in range(4):
        square = 0.0
        for i in range(3):
            square += (ends[leg, i] - base[leg, i]) ** 2
        length = math.sqrt(square)
        left = min(length - row[LENGTH_LOWS + leg], row[LENGTH_HIGHS + leg] - length)
        share = min(share, share_left(left, speeds[leg], tolerance))
    return share


@helper
def cones_share(
    cones: FloatArray,
    r: FloatArray,
    base: FloatArray,
    ends: FloatArray,
    speeds: FloatArray,
    slack: float,
) -> float:
    """Return for what share from here on all cones are kept for certain, but for a slack."""
    share = math.inf
    for index in range(cones.shape[0]):
        leg = int(cones[index, 0]) - 1
        if leg < 0:
            return -1.0
        x, y, z = cones[index, 1], cones[index, 2], cones[index, 3]
        turning = 0.0
        if cones[index, 6] > 0.0:
            turning = speeds[4]
            x, y, z = (
                r[0, 0] * x + r[0, 1] * y + r[0, 2] * z,
                r[1, 0] * x + r[1, 1] * y + r[1, 2] * z,
                r[2, 0] * x + r[2, 1] * y + r[2, 2] * z,
            )
        a, b = ends[leg, 0] - base[leg, 0], ends[leg, 1] - base[leg, 1]
        c = ends[leg, 2] - base[leg, 2]
        length = math.sqrt(a * a + b * b + c * c)
        across = math.sqrt((b * z - c * y) ** 2 + (c * x - a * z) ** 2 + (a * y - b * x) ** 2)
        angle = math.atan2(across, a * x + b * y + c * z)
        left = math.atan2(cones[index, 5], cones[index, 4]) - angle
        # Half its length on, the leg turns twice as fast at the most.
        if length == 0.0:
            return -1.0
        share = min(share, over(0.5 * length, speeds[leg]))
        share = min(share, share_left(left, turning + 2.0 * speeds[leg] / length, slack))
    return share


@helper
def clearances_share(
    row: FloatArray, base: FloatArray, ends: FloatArray, speeds: FloatArray, least: float
) -> float:
    """Return for what share from here on no legs collide; −1 where they come too close."""
    share = math.inf
    pair = RADII
    for i in range(3):
        for j in range(i + 1, 4):
            radius = row[pair]
            pair += 1
            if radius < 0.0:
                continue
            start, other = vector(base, i), vector(base, j)
            u, v = minus(vector(ends, i), start), minus(vector(ends, j), other)
            w = minus(start, other)
            s, t = closest_shares(u, v, w)
            left = math.sqrt(square_at(s, t, u, v, w)) - radius
            if left < least:
                return -1.0
            share = min(share, over(left, speeds[i] + speeds[j]))
    return share


@helper
def write_speeds(
    row: FloatArray,
    p: FloatArray,
    r: FloatArray,
    step: FloatArray,
    axis: FloatArray,
    angle: float,
    speeds: FloatArray,
) -> None:
    """Write bounds of the speeds over a move, per share, shape (12,).

    Of the platform ends of the legs (4), of the angle, of κ1 to κ3, of b4 on each axis
    (3), and of the distance of the carriages.
    """
    forward = math.sqrt(step[0] ** 2 + step[1] ** 2 + step[2] ** 2)
    ends = ((row[B1], row[B1 + 1]), (row[B2], 0.0), (row[B3], 0.0), (0.0, 0.0))
    for leg in range(4):
        x = ends[leg][0] * r[0, 0] + ends[leg][1] * r[0, 1]
        y = ends[leg][0] * r[1, 0] + ends[leg][1] * r[1, 1]
        z = ends[leg][0] * r[2, 0] + ends[leg][1] * r[2, 1]
        a = axis[1] * z - axis[2] * y
        b = axis[2] * x - axis[0] * z
        c = axis[0] * y - axis[1] * x
        speeds[leg] = forward + angle * math.sqrt(a * a + b * b + c * c)
    speeds[4] = angle
    # b4 is farthest from a1 at an end of its line.
    far = 0.0
    for end in range(2):
        square = 0.0
        for i in range(3):
            square += (p[i] + end * step[i]) ** 2
        far = max(far, math.sqrt(square))
    speeds[5] = speeds[6] = forward + angle * far
    for i in range(3):
        speeds[8 + i] = abs(step[i])
    speeds[7] = speeds[10]
    speeds[11] = angle * abs(row[B3] - row[B2])


@kernel("void(f8[::1], f8[:,::1], f8[:,::1], f8[:,:,::1], f8[:,::1], f8[:,:,::1], f8, b1[::1])")
def valid_move_rows(
    row: FloatArray,
    cones: FloatArray,
    start: FloatArray,
    start_rotation: FloatArray,
    end: FloatArray,
    end_rotation: FloatArray,
    tolerance: float,
    valid: BoolArray,
) -> None:
    """Write for each move whether it keeps everything.

    Args:
        row: Of the rules.
        cones: Of the rules.
        start: Positions, shape (n, 3).
        start_rotation: Shape (n, 3, 3).
        end: Shape (n, 3).
        end_rotation: Shape (n, 3, 3).
        tolerance: In design units.
        valid: Written, shape (n,).
    """
    base, ends, p, r = np.zeros((4, 3)), np.zeros((4, 3)), np.zeros(3), np.zeros((3, 3))
    step, axis, speeds = np.zeros(3), np.zeros(3), np.zeros(12)
    reach, least = math.hypot(row[0], row[1]), LEAST_SHARE * tolerance
    for index in range(start.shape[0]):
        valid[index] = False
        if not keeps_all(row, cones, end[index], end_rotation[index], base, ends):
            continue
        if not keeps_all(row, cones, start[index], start_rotation[index], base, ends):
            continue
        for i in range(3):
            step[i] = end[index, i] - start[index, i]
        angle = write_turn(start_rotation[index], end_rotation[index], axis)
        write_speeds(row, start[index], start_rotation[index], step, axis, angle, speeds)
        t = 0.0
        for _ in range(MOST_LOOKS):
            write_at(t, start[index], start_rotation[index], step, axis, angle, p, r)
            write_ends(row, p, r, base, ends)
            share = limits_share(row, p, r, base, ends, speeds, tolerance)
            if share > 0.0:
                share = min(share, cones_share(cones, r, base, ends, speeds, tolerance / reach))
            if share > 0.0:
                share = min(share, clearances_share(row, base, ends, speeds, least))
            if share <= 0.0:
                break
            t += share
            if t >= 1.0:
                valid[index] = True
                break
