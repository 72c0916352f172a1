"""Safe shares: how far along a move no limit and no clearance can be violated.

The slack of each limit and each clearance shrinks no faster than its quantity changes, and
`write_speeds` bounds these speeds over the whole move.
"""

from __future__ import annotations

import math

from explorer.legs.segments import closest_shares, square_at
from explorer.mechanism.margins import margins_of
from explorer.numerics.arrays import FloatArray
from explorer.numerics.compiled import helper
from explorer.numerics.vectors import Vector, column, cross3, minus, vector
from explorer.workspace.limits.quantities import (
    ANGLE,
    BENDS,
    DELTA1,
    DELTA3,
    HIGH,
    L1,
    LEG,
    LOW,
    QUANTITY,
    RADII,
    TURNS,
    angle_at,
    quantity_at,
)

# The share of the tolerance that signs and clearances must exceed on the way, to be certain.
LEAST_SHARE = 0.01


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
def rates_of_margins(
    p: FloatArray, r: FloatArray, velocity: FloatArray, axis: FloatArray, angle: float
) -> Vector:
    """Return the rates of the margins in a pose of a move, per share of it; see `margins_of`."""
    turn = (angle * axis[0], angle * axis[1], angle * axis[2])
    place, pace, u, n = vector_of(p), vector_of(velocity), column(r, 0), column(r, 2)
    going, turning = margins_of(pace, u, n), margins_of(place, cross3(turn, u), cross3(turn, n))
    return (going[0] + turning[0], going[1] + turning[1], going[2])


@helper
def vector_of(values: FloatArray) -> Vector:
    """Return an array (3,) as a vector."""
    return (values[0], values[1], values[2])


@helper
def safe_share_of_margin(
    least: float, slack: float, rate: float, speed: float, bend: float, tolerance: float
) -> float:
    """Return the share of a move over which a margin keeps to a least magnitude; −1 if not here."""
    if least < 2.0 * tolerance:
        # Only the sign is demanded, and it must be certain.
        if slack < LEAST_SHARE * tolerance:
            return -1.0
    elif slack < -0.5 * tolerance:
        return -1.0
    else:
        slack += tolerance
    return max(lasting_share(slack, speed), rising_share(slack, rate, bend))


@helper
def safe_share_of_angle(
    slack: float, length: float, turning: float, speed: float, tolerance: float
) -> float:
    """Return the share of a move over which an angle of a leg holds to a tolerance in radians.

    It is −1 if the angle fails in the pose given, or the leg has no length there.
    """
    if length == 0.0:
        return -1.0
    # Until its length has halved, the leg turns at most twice as fast.
    return min(
        lasting_share(0.5 * length, speed),
        safe_share(slack, turning + 2.0 * speed / length, tolerance),
    )


@helper
def safe_share_of_limits(
    demands: FloatArray,
    p: FloatArray,
    r: FloatArray,
    base: FloatArray,
    ends: FloatArray,
    rates: Vector,
    speeds: FloatArray,
    tolerance: float,
    angle_tolerance: float,
) -> float:
    """Return the share of a move from a pose on over which all limits hold to a tolerance.

    It is −1 if a limit fails in that pose. The ends of the legs and the rates of the margins are
    those of the pose. A margin is bounded on one side of zero.
    """
    share = math.inf
    for index in range(demands.shape[0]):
        kind, low, high = int(demands[index, QUANTITY]), demands[index, LOW], demands[index, HIGH]
        if kind == ANGLE:
            leg, value = int(demands[index, LEG]), angle_at(demands, index, r, base, ends)
            found = safe_share_of_angle(
                min(value - low, high - value),
                quantity_at(L1 + leg, p, r, base, ends),
                demands[index, TURNS] * speeds[ANGLE],
                speeds[L1 + leg],
                angle_tolerance,
            )
        else:
            value = quantity_at(kind, p, r, base, ends)
            slack, speed = min(value - low, high - value), speeds[kind]
            if DELTA1 <= kind <= DELTA3:
                rate, bend = rates[kind - DELTA1], speeds[BENDS + kind - DELTA1]
                rate = rate if low > -math.inf else -rate
                found = safe_share_of_margin(max(low, -high), slack, rate, speed, bend, tolerance)
            else:
                found = safe_share(slack, speed, tolerance)
        if found <= 0.0:
            return -1.0
        share = min(share, found)
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
            share = min(share, lasting_share(clearance, speeds[L1 + i] + speeds[L1 + j]))
    return share
