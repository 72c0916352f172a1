"""Validity of straight moves: whether all demands of a design hold all along, with a proof.

The slack of each limit and each clearance shrinks no faster than its quantity changes, and
`write_speeds` bounds these speeds over the whole move. So no demand can fail within some safe share
of the move, and the next pose to check is at the end of that share (conservative advancement;
Mirtich 2000). Along a limit the safe shares would be tiny, so a limit may be exceeded by a small
tolerance between two poses that satisfy it. A clearance, or a margin of which only the sign is
demanded, must hold everywhere.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from explorer.legs.moves import ends_of_moves
from explorer.mechanism.configuration import one_tool
from explorer.mechanism.design import Design
from explorer.mechanism.margins import margins_of
from explorer.numerics.arrays import BoolArray, FloatArray
from explorer.numerics.compiled import helper, kernel
from explorer.numerics.vectors import (
    Vector,
    along,
    column,
    cross3,
    dot3,
    minus,
    norm3,
    vector,
    vector_of,
)
from explorer.workspace.limits.quantities import (
    A3,
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
    SPEEDS,
    TURNS,
    angle_at,
    is_valid,
    quantity_at,
    square_between,
    write_ends,
    write_speeds,
)
from explorer.workspace.limits.valid_poses import Rules

# The share of the reach by which a limit may be exceeded between poses that satisfy it, and the
# share of this tolerance that signs and clearances must exceed on the way, to be certain.
DEFAULT_TOLERANCE, LEAST_SHARE = 1e-4, 0.01
# The largest turn of a move, in radians: of half a turn neither way is the shorter one.
LARGEST_TURN = math.pi - 1e-9
# A move that needs more steps than this is refused; most such moves follow a limit all the way.
MOST_STEPS = 20_000


def moves_are_valid(
    design: Design,
    start_position: ArrayLike,
    start_rotation: ArrayLike,
    end_position: ArrayLike,
    end_rotation: ArrayLike,
    *,
    rules: Rules | None = None,
    tolerance: float | None = None,
    tool: ArrayLike | None = None,
) -> BoolArray:
    """Return whether straight moves are proven to satisfy all limits and clearances, shape (...).

    A move that turns by half a turn is not valid, since neither way is the shorter one. The ends
    are positions of b4 in the base frame, shape (..., 3), and rotations from platform to base. The
    tolerance is the length by which limits may be exceeded, a 10,000th of the reach if None. Rules
    may have been computed before. The tool, shape (3,), moves straight; None for b4.

    Raises:
        InputError: A pose that is not finite or not a rotation, or not a point.
    """
    batch, ends = ends_of_moves(start_position, start_rotation, end_position, end_rotation)
    valid = np.empty(len(ends[0]), dtype=np.bool_)
    rules = rules or Rules.of(design)
    most = DEFAULT_TOLERANCE * design.reach if tolerance is None else tolerance
    valid_move_rows(20 * len(valid), *rules, *ends, one_tool(tool), most, valid)
    return valid.reshape(batch)


class MoveCheck(NamedTuple):
    """Rules and a tool, with the arrays that the check of a move writes into.

    Attributes:
        row, demands: Those of `Rules`.
        tool: Point that moves straight, in platform coordinates, shape (3,).
        base, ends: Ends of the legs in a pose, shape (4, 3).
        p, r: Position, first of the tool and then of b4, and rotation of that pose.
        first, step: Place of the tool at the start, and how far it goes, shape (3,).
        axis: Axis about which the platform turns, shape (3,).
        speeds: Speeds over the move, see `write_speeds`.
    """

    row: FloatArray
    demands: FloatArray
    tool: FloatArray
    base: FloatArray
    ends: FloatArray
    p: FloatArray
    r: FloatArray
    first: FloatArray
    step: FloatArray
    axis: FloatArray
    speeds: FloatArray


@helper
def make_check(row: FloatArray, demands: FloatArray, tool: FloatArray) -> MoveCheck:
    """Return a check of moves."""
    base, ends, r, v = np.zeros((4, 3)), np.zeros((4, 3)), np.zeros((3, 3)), np.zeros((4, 3))
    speeds = np.zeros(SPEEDS)
    return MoveCheck(row, demands, tool, base, ends, v[0], r, v[1], v[2], v[3], speeds)


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
    check: MoveCheck, rates: Vector, tolerance: float, angle_tolerance: float
) -> float:
    """Return the share of a move from a pose on over which all limits hold to a tolerance.

    It is −1 if a limit fails in that pose. A margin is bounded on one side of zero, and has one of
    the rates in that pose.
    """
    demands, p, r, base, ends = check.demands, check.p, check.r, check.base, check.ends
    speeds, share = check.speeds, math.inf
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
def safe_share_of_clearances(check: MoveCheck, least: float) -> float:
    """Return the share of a move over which no legs collide; −1 if they are closer than `least`."""
    base, ends, speeds = check.base, check.ends, check.speeds
    share = math.inf
    pair = RADII
    for i in range(3):
        for j in range(i + 1, 4):
            radius = check.row[pair]
            pair += 1
            if radius < 0.0:
                continue
            clearance = math.sqrt(square_between(i, j, base, ends)) - radius
            if clearance < least:
                return -1.0
            share = min(share, lasting_share(clearance, speeds[L1 + i] + speeds[L1 + j]))
    return share


@helper
def write_turn(r: FloatArray, s: FloatArray, axis: FloatArray) -> float:
    """Write the unit axis, in the base frame, that turns r into s; return the angle in radians."""
    turn = np.empty((3, 3))
    for i in range(3):
        for j in range(3):
            turn[i, j] = dot3(vector(s, i), vector(r, j))
    across = (turn[2, 1] - turn[1, 2], turn[0, 2] - turn[2, 0], turn[1, 0] - turn[0, 1])
    axis[0], axis[1], axis[2] = across
    cosine = 0.5 * (turn[0, 0] + turn[1, 1] + turn[2, 2] - 1.0)
    angle = math.atan2(0.5 * norm3(across), cosine)
    if cosine < -0.5:
        # Near half a turn the longest column of the symmetric part gives the axis best.
        best = 0
        for k in range(1, 3):
            if turn[k, k] > turn[best, best]:
                best = k
        for k in range(3):
            axis[k] = 0.5 * (turn[k, best] + turn[best, k])
        axis[best] -= math.cos(angle)
        if dot3(vector_of(axis), across) < 0.0:
            for k in range(3):
                axis[k] = -axis[k]
    length = norm3(vector_of(axis))
    if length == 0.0:
        axis[0] = 1.0
        return 0.0
    for k in range(3):
        axis[k] /= length
    return angle


@helper
def write_pose_at(check: MoveCheck, t: float, start_rotation: FloatArray, angle: float) -> None:
    """Write the pose at a share t of a move."""
    c, s, axis = math.cos(t * angle), math.sin(t * angle), vector_of(check.axis)
    for j in range(3):
        u = column(start_rotation, j)
        across, along = cross3(axis, u), (1.0 - c) * dot3(axis, u)
        for i in range(3):
            check.r[i, j] = c * u[i] + s * across[i] + along * axis[i]
    for i in range(3):
        arm = dot3(vector(check.r, i), vector_of(check.tool))
        check.p[i] = check.first[i] + t * check.step[i] - arm


@helper
def rates_of_margins(check: MoveCheck, t: float, angle: float) -> Vector:
    """Return the rates of the margins in the pose at a share t of a move, per share of it."""
    place, axis = vector_of(check.p), vector_of(check.axis)
    # b4 turns about the tool, which goes straight.
    step, u, n = vector_of(check.step), column(check.r, 0), column(check.r, 2)
    turn = (angle * axis[0], angle * axis[1], angle * axis[2])
    pace = along(step, 1.0, cross3(turn, minus(place, along(vector_of(check.first), t, step))))
    going, turning = margins_of(pace, u, n), margins_of(place, cross3(turn, u), cross3(turn, n))
    return (going[0] + turning[0], going[1] + turning[1], going[2])


@helper
def count_steps(
    check: MoveCheck,
    start: FloatArray,
    start_rotation: FloatArray,
    end: FloatArray,
    end_rotation: FloatArray,
    tolerance: float,
    most: int,
) -> int:
    """Return the number of steps that prove a move valid, or 0 or less if they do not.

    A move is valid if it satisfies all rules, limits to a tolerance in design units. Start and end
    are positions of b4. The magnitude is that of the steps made, `most` at most.
    """
    row, demands, base, ends, step = check.row, check.demands, check.base, check.ends, check.step
    if not is_valid(row, demands, end, end_rotation, base, ends):
        return 0
    if not is_valid(row, demands, start, start_rotation, base, ends):
        return 0
    for i in range(3):
        check.first[i] = start[i] + dot3(vector(start_rotation, i), vector_of(check.tool))
        last = end[i] + dot3(vector(end_rotation, i), vector_of(check.tool))
        step[i] = last - check.first[i]
    angle = write_turn(start_rotation, end_rotation, check.axis)
    if angle > LARGEST_TURN:
        return 0
    write_speeds(
        row, check.first, start_rotation, step, check.axis, angle, check.tool, check.speeds
    )
    t, angle_tolerance = 0.0, tolerance / math.hypot(row[A3], row[A3 + 1])
    for step_number in range(1, most + 1):
        write_pose_at(check, t, start_rotation, angle)
        write_ends(row, check.p, check.r, base, ends)
        rates = rates_of_margins(check, t, angle)
        share = safe_share_of_limits(check, rates, tolerance, angle_tolerance)
        if share > 0.0:
            share = min(share, safe_share_of_clearances(check, LEAST_SHARE * tolerance))
        if share <= 0.0:
            return -step_number
        t += share
        if t >= 1.0:
            return step_number
    return -most


@kernel(
    "void(f8[::1], f8[:,::1], f8[:,::1], f8[:,:,::1], f8[:,::1], f8[:,:,::1], f8[::1], f8, b1[::1])"
)
def valid_move_rows(
    row: FloatArray,
    demands: FloatArray,
    start: FloatArray,
    start_rotation: FloatArray,
    end: FloatArray,
    end_rotation: FloatArray,
    tool: FloatArray,
    tolerance: float,
    valid: BoolArray,
) -> None:
    """Write whether n moves are valid, see `count_steps`."""
    check = make_check(row, demands, tool)
    for index in range(start.shape[0]):
        first, last = (start[index], start_rotation[index]), (end[index], end_rotation[index])
        valid[index] = count_steps(check, *first, *last, tolerance, MOST_STEPS) > 0
