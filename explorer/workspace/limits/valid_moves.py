"""Validity of straight moves: whether all demands of a design hold all along, with a proof.

No demand can fail within the safe share of a move (`explorer.workspace.limits.safe_shares`), so
the next pose to check is at the end of that share (conservative advancement; Mirtich 2000).
Along a limit the safe shares would be tiny, so a limit may be exceeded by a small tolerance
between two poses that satisfy it. A clearance, or a margin of which only the sign is demanded,
must hold everywhere.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike

from explorer.mechanism.design import Design
from explorer.mechanism.pose import checked_rotation
from explorer.numerics.arrays import (
    BoolArray,
    FloatArray,
    batch_shape,
    finite_array,
    for_kernel,
    rows_for_kernel,
)
from explorer.numerics.compiled import helper, kernel
from explorer.workspace.limits.quantities import (
    A3,
    SPEEDS,
    write_ends,
    write_speeds,
)
from explorer.workspace.limits.safe_shares import (
    LEAST_SHARE,
    rates_of_margins,
    safe_share_of_clearances,
    safe_share_of_limits,
)
from explorer.workspace.limits.valid_poses import Rules, is_valid

# The share of the reach by which a limit may be exceeded between poses that satisfy it.
DEFAULT_TOLERANCE = 1e-4
# The largest turn of a move, in radians: of half a turn neither way is the shorter one.
LARGEST_TURN = math.pi - 1e-9
# A move that needs more steps than this is refused; most such moves follow a limit all the way.
MOST_STEPS = 20_000

Scratch = tuple[
    FloatArray,
    FloatArray,
    FloatArray,
    FloatArray,
    FloatArray,
    FloatArray,
    FloatArray,
    FloatArray,
    FloatArray,
]


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
    """Return whether straight moves satisfy all limits, margins and clearances, shape (...).

    One point of the platform moves on a straight line and the platform turns about one axis the
    shorter way, as in `explorer.legs.moves`. True is a proof, but for the tolerance. A move whose
    clearances or signs hold by less than a 100th of the tolerance may be refused, and one of half a
    turn, which has no shorter way, is.

    Args:
        design: The manipulator.
        start_position: b4 in the base frame, shape (..., 3), in design units.
        start_rotation: Platform to base, shape (..., 3, 3).
        end_position: b4 at the end, shape (..., 3), in design units.
        end_rotation: Platform to base at the end, shape (..., 3, 3).
        rules: Rules of the design, if they have been computed before.
        tolerance: Length by which limits may be exceeded on the way, in design units; a
            10,000th of the reach if None.
        tool: Point that moves straight in the platform frame, shape (3,), in design units; None
            for b4.

    Raises:
        InputError: a pose that is not finite or not a rotation, or not a point.
    """
    p, q = (
        finite_array(name, value, (3,))
        for name, value in (("start position", start_position), ("end position", end_position))
    )
    r, s = checked_rotation(start_rotation), checked_rotation(end_rotation)
    batch = batch_shape((p, 1), (r, 2), (q, 1), (s, 2))
    rows = [
        rows_for_kernel(value, batch, trailing)
        for value, trailing in ((p, 1), (r, 2), (q, 1), (s, 2))
    ]
    valid = np.empty(len(rows[0]), dtype=np.bool_)
    design_rules = rules or Rules.of(design)
    limit_tolerance = DEFAULT_TOLERANCE * design.reach if tolerance is None else tolerance
    point = np.zeros(3) if tool is None else for_kernel(finite_array("tool", tool, (3,)))
    valid_move_rows(
        20 * len(rows[0]),
        design_rules.row,
        design_rules.demands,
        rows[0],
        rows[1],
        rows[2],
        rows[3],
        point,
        limit_tolerance,
        valid,
    )
    return valid.reshape(batch)


@helper
def write_turn(r: FloatArray, s: FloatArray, axis: FloatArray) -> float:
    """Write the unit axis, in the base frame, that turns r into s; return the angle in radians."""
    turn = np.empty((3, 3))
    for i in range(3):
        for j in range(3):
            turn[i, j] = s[i, 0] * r[j, 0] + s[i, 1] * r[j, 1] + s[i, 2] * r[j, 2]
    x, y, z = turn[2, 1] - turn[1, 2], turn[0, 2] - turn[2, 0], turn[1, 0] - turn[0, 1]
    sine = 0.5 * math.sqrt(x * x + y * y + z * z)
    cosine = 0.5 * (turn[0, 0] + turn[1, 1] + turn[2, 2] - 1.0)
    angle = math.atan2(sine, cosine)
    if cosine < -0.5:
        # Near half a turn the longest column of the symmetric part gives the axis best.
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
def write_pose_at(
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
def move_by_arm(share: float, r: FloatArray, arm: FloatArray, p: FloatArray) -> None:
    """Add a share of a vector in platform coordinates to a position."""
    for i in range(3):
        p[i] += share * (r[i, 0] * arm[0] + r[i, 1] * arm[1] + r[i, 2] * arm[2])


@helper
def write_line(
    start: FloatArray,
    start_rotation: FloatArray,
    end: FloatArray,
    end_rotation: FloatArray,
    tool: FloatArray,
    first: FloatArray,
    step: FloatArray,
) -> None:
    """Write where the tool starts on a straight move, and how far it goes, shape (3,) each.

    Start and end are positions of b4; the tool is in platform coordinates.
    """
    for i in range(3):
        first[i], step[i] = start[i], end[i]
    move_by_arm(1.0, start_rotation, tool, first)
    move_by_arm(1.0, end_rotation, tool, step)
    for i in range(3):
        step[i] -= first[i]


@helper
def write_velocity(
    t: float,
    first: FloatArray,
    step: FloatArray,
    axis: FloatArray,
    angle: float,
    p: FloatArray,
    velocity: FloatArray,
) -> None:
    """Write the velocity of b4 at p per share of a move, at a share t of it."""
    # From the tool, which goes straight, to b4.
    a = p[0] - first[0] - t * step[0]
    b = p[1] - first[1] - t * step[1]
    c = p[2] - first[2] - t * step[2]
    velocity[0] = step[0] + angle * (axis[1] * c - axis[2] * b)
    velocity[1] = step[1] + angle * (axis[2] * a - axis[0] * c)
    velocity[2] = step[2] + angle * (axis[0] * b - axis[1] * a)


@helper
def make_scratch() -> Scratch:
    """Return arrays that `count_steps` writes into.

    They are the legs' base ends and platform ends, a position, a rotation, the step and the axis
    of the move, the start of the tool, the velocity of b4, and the speeds.
    """
    return (
        np.zeros((4, 3)),
        np.zeros((4, 3)),
        np.zeros(3),
        np.zeros((3, 3)),
        np.zeros(3),
        np.zeros(3),
        np.zeros(3),
        np.zeros(3),
        np.zeros(SPEEDS),
    )


@helper
def count_steps(
    row: FloatArray,
    demands: FloatArray,
    start: FloatArray,
    start_rotation: FloatArray,
    end: FloatArray,
    end_rotation: FloatArray,
    tool: FloatArray,
    tolerance: float,
    most: int,
    scratch: Scratch,
) -> int:
    """Return the number of steps that prove a move valid, or 0 or less if they do not.

    A move is valid if it satisfies all rules, limits to a tolerance in design units. Start and end
    are positions of b4; the tool, in platform coordinates, moves straight. The magnitude is that of
    the steps made, `most` at most.
    """
    base, ends, p, r, step, axis, first, velocity, speeds = scratch
    if not is_valid(row, demands, end, end_rotation, base, ends):
        return 0
    if not is_valid(row, demands, start, start_rotation, base, ends):
        return 0
    write_line(start, start_rotation, end, end_rotation, tool, first, step)
    angle = write_turn(start_rotation, end_rotation, axis)
    if angle > LARGEST_TURN:
        return 0
    write_speeds(row, first, start_rotation, step, axis, angle, tool, speeds)
    t, angle_tolerance = 0.0, tolerance / math.hypot(row[A3], row[A3 + 1])
    for step_number in range(1, most + 1):
        write_pose_at(t, first, start_rotation, step, axis, angle, p, r)
        move_by_arm(-1.0, r, tool, p)
        write_ends(row, p, r, base, ends)
        write_velocity(t, first, step, axis, angle, p, velocity)
        rates = rates_of_margins(p, r, velocity, axis, angle)
        share = safe_share_of_limits(
            demands, p, r, base, ends, rates, speeds, tolerance, angle_tolerance
        )
        if share > 0.0:
            least = LEAST_SHARE * tolerance
            share = min(share, safe_share_of_clearances(row, base, ends, speeds, least))
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
    scratch = make_scratch()
    for index in range(start.shape[0]):
        first, last = (start[index], start_rotation[index]), (end[index], end_rotation[index])
        steps = count_steps(row, demands, *first, *last, tool, tolerance, MOST_STEPS, scratch)
        valid[index] = steps > 0
