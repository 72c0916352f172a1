"""Safe shares: how far along a move no limit and no clearance can be violated.

The slack of each limit and each clearance shrinks no faster than points of the platform move, and
`write_speeds` bounds their speeds over the whole move.
"""

from __future__ import annotations

import math

from explorer.legs.segments import closest_shares, square_at
from explorer.numerics.arrays import FloatArray
from explorer.numerics.compiled import helper
from explorer.numerics.vectors import minus, vector
from explorer.workspace.limits.valid_poses import (
    AXIS_X,
    AXIS_Y,
    AXIS_Z,
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
    RADII,
    SIGNS,
    SINE,
    TURNS,
    carriages_apart,
)

# The share of the tolerance that signs and clearances must exceed on the way, to be certain.
LEAST_SHARE = 0.01
# Entries of the speeds over a move: those of the platform ends of the four legs, the angle, the
# three margins, b4 on each axis, the distance of the carriages; and the bending of the margins,
# which is a bound of their second derivatives.
LEG_SPEEDS, TURN_SPEED, MARGIN_SPEEDS, BOX_SPEEDS, GAP_SPEED, MARGIN_BENDS = 0, 4, 5, 8, 11, 12
SPEEDS = 15


@helper
def lasting_share(slack: float, rate: float) -> float:
    """Return the share of a move after which a slack that shrinks at a rate is zero."""
    return slack / rate if rate > 0.0 else math.inf


@helper
def safe_share(slack: float, rate: float, tolerance: float) -> float:
    """Return the share of a move over which a limit holds to a tolerance; −1 if it fails here."""
    # Half of the tolerance remains for a step.
    if slack < -0.5 * tolerance:
        return -1.0
    return lasting_share(slack + tolerance, rate)


@helper
def rising_share(slack: float, rate: float, bend: float) -> float:
    """Return the share over which a slack lasts, given its rate here and a bound of its bending."""
    if rate < 0.0:
        return 2.0 * slack / (math.sqrt(rate * rate + 2.0 * bend * slack) - rate)
    return (rate + math.sqrt(rate * rate + 2.0 * bend * slack)) / bend if bend > 0.0 else math.inf


@helper
def safe_share_of_margins(
    row: FloatArray,
    p: FloatArray,
    r: FloatArray,
    velocity: FloatArray,
    axis: FloatArray,
    angle: float,
    speeds: FloatArray,
    tolerance: float,
) -> float:
    """Return the share of a move from a pose on over which the demand on the margins holds.

    It is −1 if the demand fails in that pose. The velocity is that of b4, per share of the move.
    """
    least, share = row[MARGIN], math.inf
    if least == -math.inf:
        return share
    (px, py, pz), (vx, vy, vz) = (p[0], p[1], p[2]), (velocity[0], velocity[1], velocity[2])
    (ux, uy, uz), (nx, ny, nz) = (r[0, 0], r[1, 0], r[2, 0]), (r[0, 2], r[1, 2], r[2, 2])
    x, y, z = angle * axis[0], angle * axis[1], angle * axis[2]
    # The rates of the normal n and of the direction u are ω × n and ω × u, with ω = (x, y, z).
    spin1 = x * (ny * pz - nz * py) + y * (nz * px - nx * pz) + z * (nx * py - ny * px)
    spin2 = (z * ux - x * uz) * pz - (x * uy - y * ux) * py
    values = (-(nx * px + ny * py + nz * pz), uy * pz - uz * py, pz)
    rates = (-spin1 - (nx * vx + ny * vy + nz * vz), spin2 + uy * vz - uz * vy, vz)
    for i in range(3):
        sign = row[SIGNS + i]
        slack, rate = sign * values[i] - least, sign * rates[i]
        if least < 2.0 * tolerance:
            # Only the signs are demanded, and they must be certain.
            if slack < LEAST_SHARE * tolerance:
                return -1.0
        elif slack < -0.5 * tolerance:
            return -1.0
        else:
            slack += tolerance
        lasting = lasting_share(slack, speeds[MARGIN_SPEEDS + i])
        share = min(share, max(lasting, rising_share(slack, rate, speeds[MARGIN_BENDS + i])))
    return share


@helper
def safe_share_of_limits(
    row: FloatArray,
    p: FloatArray,
    base: FloatArray,
    ends: FloatArray,
    speeds: FloatArray,
    tolerance: float,
) -> float:
    """Return the share of a move from a pose on over which all limits hold to a tolerance.

    They are those of the box, the guide and the lengths. It is −1 if a limit fails in that pose.
    The ends of the legs are those of the pose.
    """
    share = math.inf
    for i in range(3):
        slack = min(p[i] - row[BOX_LOWS + i], row[BOX_HIGHS + i] - p[i])
        share = min(share, safe_share(slack, speeds[BOX_SPEEDS + i], tolerance))
    d1, d3 = ends[1, 0], ends[2, 0]
    slack = min(d1 - row[GUIDE_LOW], row[GUIDE_HIGH] - d1)
    share = min(share, safe_share(slack, speeds[LEG_SPEEDS + 1], tolerance))
    slack = min(d3 - row[GUIDE_LOW], row[GUIDE_HIGH] - d3)
    share = min(share, safe_share(slack, speeds[LEG_SPEEDS + 2], tolerance))
    share = min(
        share, safe_share(carriages_apart(row, d1, d3) - row[GAP], speeds[GAP_SPEED], tolerance)
    )
    for leg in range(4):
        square = 0.0
        for i in range(3):
            square += (ends[leg, i] - base[leg, i]) ** 2
        length = math.sqrt(square)
        slack = min(length - row[LENGTH_LOWS + leg], row[LENGTH_HIGHS + leg] - length)
        share = min(share, safe_share(slack, speeds[LEG_SPEEDS + leg], tolerance))
    return share


@helper
def safe_share_of_cones(
    cones: FloatArray,
    r: FloatArray,
    base: FloatArray,
    ends: FloatArray,
    speeds: FloatArray,
    tolerance: float,
) -> float:
    """Return the share of a move over which all cones hold to a tolerance in radians.

    It is −1 if a cone fails in the pose given.
    """
    share = math.inf
    for index in range(cones.shape[0]):
        leg = int(cones[index, LEG]) - 1
        if leg < 0:
            return -1.0
        x, y, z = cones[index, AXIS_X], cones[index, AXIS_Y], cones[index, AXIS_Z]
        turning = 0.0
        if cones[index, TURNS] > 0.0:
            turning = speeds[TURN_SPEED]
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
        slack = math.atan2(cones[index, SINE], cones[index, COSINE]) - angle
        if length == 0.0:
            return -1.0
        # Until its length has halved, the leg turns at most twice as fast.
        share = min(share, lasting_share(0.5 * length, speeds[LEG_SPEEDS + leg]))
        share = min(
            share, safe_share(slack, turning + 2.0 * speeds[LEG_SPEEDS + leg] / length, tolerance)
        )
    return share


@helper
def safe_share_of_clearances(
    row: FloatArray, base: FloatArray, ends: FloatArray, speeds: FloatArray, least: float
) -> float:
    """Return the share of a move over which no legs collide; −1 if they are closer than `least`."""
    share = math.inf
    pair = RADII
    for i in range(3):
        for j in range(i + 1, 4):
            radius = row[pair]
            pair += 1
            if radius < 0.0:
                continue
            first, second = vector(base, i), vector(base, j)
            u, v = minus(vector(ends, i), first), minus(vector(ends, j), second)
            w = minus(first, second)
            s, t = closest_shares(u, v, w)
            clearance = math.sqrt(square_at(s, t, u, v, w)) - radius
            if clearance < least:
                return -1.0
            share = min(
                share, lasting_share(clearance, speeds[LEG_SPEEDS + i] + speeds[LEG_SPEEDS + j])
            )
    return share


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
    p and moves by `step`.
    """
    forward = math.sqrt(step[0] ** 2 + step[1] ** 2 + step[2] ** 2)
    ends = ((row[B1], row[B1 + 1]), (row[B2], 0.0), (row[B3], 0.0), (0.0, 0.0))
    swing = 0.0
    for leg in range(4):
        u, v, w = ends[leg][0] - tool[0], ends[leg][1] - tool[1], -tool[2]
        x = u * r[0, 0] + v * r[0, 1] + w * r[0, 2]
        y = u * r[1, 0] + v * r[1, 1] + w * r[1, 2]
        z = u * r[2, 0] + v * r[2, 1] + w * r[2, 2]
        a = axis[1] * z - axis[2] * y
        b = axis[2] * x - axis[0] * z
        c = axis[0] * y - axis[1] * x
        swing = angle * math.sqrt(a * a + b * b + c * c)
        speeds[LEG_SPEEDS + leg] = forward + swing
    speeds[TURN_SPEED] = angle
    # On its line the tool is farthest from a1 at one of the ends.
    farthest = 0.0
    for end in range(2):
        square = 0.0
        for i in range(3):
            square += (p[i] + end * step[i]) ** 2
        farthest = max(farthest, math.sqrt(square))
    # With c the position of the tool, δ1 = tool z − R ẑ·c and δ2 = (x̂ × R x̂)·c − x̂·R (x̂ × tool).
    speeds[MARGIN_SPEEDS] = forward + angle * farthest
    speeds[MARGIN_SPEEDS + 1] = speeds[MARGIN_SPEEDS] + angle * math.hypot(tool[1], tool[2])
    # c goes straight, and directions turn evenly; δ3 = ẑ·c − ẑ·R tool.
    square = angle * angle
    speeds[MARGIN_BENDS] = square * farthest + 2.0 * angle * forward
    speeds[MARGIN_BENDS + 1] = speeds[MARGIN_BENDS] + square * math.hypot(tool[1], tool[2])
    speeds[MARGIN_BENDS + 2] = square * math.sqrt(tool[0] ** 2 + tool[1] ** 2 + tool[2] ** 2)
    # b4 comes last of the ends; it swings about the tool, perpendicular to the axis of the turn.
    for i in range(3):
        share = math.sqrt(max(0.0, 1.0 - axis[i] * axis[i]))
        speeds[BOX_SPEEDS + i] = abs(step[i]) + swing * share
    speeds[MARGIN_SPEEDS + 2] = speeds[BOX_SPEEDS + 2]
    speeds[GAP_SPEED] = angle * abs(row[B3] - row[B2])
