"""The largest share of a limit that a load uses over a whole straight move, with a proof.

An interval of the move is halved until an upper bound of the share over all of it is within the
tolerance of the largest share found, see `explorer.paths.taylor_models`. The closed form of the
forces is that of `explorer.statics.equilibrium`, the weights of the legs are those of
`explorer.statics.weights`. Where a margin may vanish in an interval, the bound is infinite.
"""

from __future__ import annotations

import math
from typing import TypeAlias

import numpy as np

from explorer.numerics.arrays import FloatArray
from explorer.numerics.compiled import helper, kernel
from explorer.numerics.vectors import Vector
from explorer.paths.taylor_models import (
    Model,
    Models,
    constant,
    constants,
    deviation,
    inner,
    minor,
    outer,
    plus,
    plus3,
    product,
    reciprocal,
    scale,
    scale3,
    size_of,
    times3,
    turning,
)
from explorer.statics.equilibrium import A3X, A3Y, B1X, B1Y, B2, B3, column, is_singular
from explorer.workspace.limits.valid_moves import move_by_arm, write_line, write_pose_at, write_turn

# Columns of the row of a machine and its load after the design variables: the point of the load in
# platform coordinates, the load there, the force of any direction, the first moment and the weight
# of the masses on the platform, the acceleration of gravity, the legs, and the limits of
# `explorer.statics.reactions.part_limits`.
POINT, LOAD, FORCE, FIRST_MOMENT, WEIGHT, GRAVITY, LEGS, LIMITS, END = (
    *(6, 9, 15, 16, 19, 22),
    *(25, 45, 65),
)
# Columns of a leg: the masses, and those of cylinder and rod times the distance of their centres.
CARRIAGE, CYLINDER, CYLINDER_MOMENT, ROD, ROD_MOMENT, LEG = range(6)
# Number of intervals whose ends give the first estimate, and the most intervals of a move.
SAMPLES, MOST_INTERVALS = 8, 20_000
# Largest number of intervals in the queue: one for each halving.
DEEPEST = 60
PARTS = 10
# Columns of the results.
BOUND, SHARE, PLACE, COLUMNS = range(4)

Frame: TypeAlias = tuple[Models, Models, Models, Models, Models, Models, Models]
"""b4, u, arm and vector of leg 1, vector of leg 4, c2 and c3."""
Sizes: TypeAlias = tuple[Model, Model, Model, Model]
"""Lengths of the four legs."""
Inverses: TypeAlias = tuple[Model, Model, Model, Model, Model]
"""Reciprocals of δ1, δ2, δ3, d2 and d4."""
Forces: TypeAlias = tuple[Model, Model, Model, Model, Model, Model]
"""Forces of the actuators."""


@helper
def three(row: FloatArray, at: int) -> Vector:
    """Return three numbers of a row."""
    return (row[at], row[at + 1], row[at + 2])


@helper
def turned(r: FloatArray, a: Vector) -> Vector:
    """Return a vector of the platform along the axes of the base."""
    return (
        r[0, 0] * a[0] + r[0, 1] * a[1] + r[0, 2] * a[2],
        r[1, 0] * a[0] + r[1, 1] * a[1] + r[1, 2] * a[2],
        r[2, 0] * a[0] + r[2, 1] * a[1] + r[2, 2] * a[2],
    )


@helper
def held_of_leg(
    q: Models, u: Models, c: Models, by_delta2: Model, by_length: Model, half: float
) -> tuple[Model, Model]:
    """Return the forces along the guide and the strut of leg 2 or 3, given its part across u."""
    k = product(minor(c, q, 1, 2, half), by_delta2, half)
    held = plus3(q, times3(k, u, half))
    radial = plus(product(c[1], held[1], half), product(c[2], held[2], half))
    return held[0], product(radial, by_length, half)


@helper
def holding(
    x: FloatArray,
    frame: Frame,
    sizes: Sizes,
    by: Inverses,
    force: Models,
    moment: Models,
    half: float,
) -> Forces:
    """Return the forces that hold a load, see `explorer.statics.equilibrium.holding_forces`."""
    b4, u, arm1, leg1, leg4, c2, c3 = frame
    f1 = scale(1.0 / x[B1Y], product(inner(moment, u, half), by[0], half))
    about_guide = plus(moment[0], minor(b4, force, 1, 2, half))
    f4 = scale(-1.0 / x[A3Y], product(about_guide, by[2], half))
    rest = plus3(plus3(force, times3(f1, leg1, half)), times3(f4, leg4, half))
    turn = plus3(moment, times3(f1, outer(arm1, leg1, half), half))
    lever, span = outer(u, rest, half), x[B3] - x[B2]
    q2 = outer(plus3(turn, scale3(-x[B3], lever)), u, half)
    q3 = outer(plus3(turn, scale3(-x[B2], lever)), u, half)
    d1, d2 = held_of_leg(scale3(1.0 / span, q2), u, c2, by[1], by[3], half)
    d3, d4 = held_of_leg(scale3(-1.0 / span, q3), u, c3, by[1], by[4], half)
    return product(f1, sizes[0], half), d1, d2, d3, d4, product(f4, sizes[3], half)


@helper
def at_joint(
    row: FloatArray,
    leg: int,
    on_guide: float,
    vector: Models,
    length: Model,
    g: Vector,
    half: float,
) -> Models:
    """Return the force on the platform that stands for the weight of a leg.

    `on_guide` is 1 for a leg on the guide and 0 for another.
    """
    at = LEGS + leg * LEG
    rod, moved = row[at + ROD], on_guide * (row[at + CYLINDER] + row[at + CARRIAGE])
    own = constants(((rod + moved) * g[0], rod * g[1], rod * g[2]))
    moment = row[at + CYLINDER_MOMENT] - row[at + ROD_MOMENT]
    if moment == 0.0:
        return own
    across = constants(((1.0 - on_guide) * g[0], g[1], g[2]))
    by = reciprocal(length, half)
    along = product(inner(across, vector, half), product(by, by, half), half)
    across = plus3(across, scale3(-1.0, times3(along, vector, half)))
    return plus3(own, times3(scale(moment, by), across, half))


@helper
def share_of(value: Model, spread: Model, limit: float, half: float) -> tuple[float, float]:
    """Return the share of a limit that a value and its spread use, and a bound over an interval."""
    both = plus(value, spread)
    return both[0] / limit, (both[0] + deviation(both, half)) / limit


@helper
def bound_share(
    row: FloatArray,
    p: FloatArray,
    r: FloatArray,
    tool: FloatArray,
    step: FloatArray,
    axis: FloatArray,
    angle: float,
    half: float,
) -> tuple[float, float]:
    """Return the largest share of a limit at the middle of an interval, and a bound over it.

    If a margin may vanish in the interval, the bound is infinite and the share is 0; in a singular
    pose both are infinite.

    Args:
        row: The machine and its load, see `POINT`.
        p: b4 at the middle.
        r: Platform to base there.
        tool: Point that moves straight, in platform coordinates.
        step: Its displacement over the move.
        axis: Axis of the turn.
        angle: Angle of the turn over the move, in radians.
        half: Half of the interval, as a share of the move.
    """
    if is_singular(row, p, r):
        return math.inf, math.inf
    turn = three(axis, 0)
    u = turning(column(r, 0), turn, angle, half)
    v = turning(column(r, 1), turn, angle, half)
    w = turning(column(r, 2), turn, angle, half)
    swing = turning(turned(r, three(tool, 0)), turn, angle, half)
    b4 = (
        (p[0], step[0] - swing[0][1], swing[0][2]),
        (p[1], step[1] - swing[1][1], swing[1][2]),
        (p[2], step[2] - swing[2][1], swing[2][2]),
    )
    zero = constant(0.0)
    arm1 = plus3(scale3(row[B1X], u), scale3(row[B1Y], v))
    leg1, c2, c3 = plus3(b4, arm1), plus3(b4, scale3(row[B2], u)), plus3(b4, scale3(row[B3], u))
    leg2, leg3 = (zero, c2[1], c2[2]), (zero, c3[1], c3[2])
    leg4 = plus3(b4, constants((-row[A3X], -row[A3Y], 0.0)))
    delta1, delta2 = scale(-1.0, inner(w, b4, half)), minor(u, b4, 1, 2, half)
    sizes = size_of(leg1, half), size_of(leg2, half), size_of(leg3, half), size_of(leg4, half)
    for each in (delta1, delta2, b4[2], sizes[0], sizes[1], sizes[2], sizes[3]):
        if abs(each[0]) <= deviation(each, half):
            return 0.0, math.inf
    frame = b4, u, arm1, leg1, leg4, c2, c3
    by = (
        reciprocal(delta1, half),
        reciprocal(delta2, half),
        reciprocal(b4[2], half),
        reciprocal(sizes[1], half),
        reciprocal(sizes[2], half),
    )
    g, given = three(row, GRAVITY), constants(three(row, LOAD))
    arm = turning(turned(r, three(row, POINT)), turn, angle, half)
    first = turning(turned(r, three(row, FIRST_MOMENT)), turn, angle, half)
    h1 = at_joint(row, 0, 0.0, leg1, sizes[0], g, half)
    h2 = at_joint(row, 1, 1.0, leg2, sizes[1], g, half)
    h3 = at_joint(row, 2, 1.0, leg3, sizes[2], g, half)
    h4 = at_joint(row, 3, 0.0, leg4, sizes[3], g, half)
    force = plus3(plus3(given, constants(three(row, WEIGHT))), plus3(plus3(h1, h2), plus3(h3, h4)))
    moment = plus3(constants(three(row, LOAD + 3)), outer(arm, given, half))
    moment = plus3(moment, outer(first, constants(g), half))
    moment = plus3(moment, outer(arm1, h1, half))
    of_guide = plus3(scale3(row[B2], h2), scale3(row[B3], h3))
    moment = plus3(moment, outer(u, of_guide, half))
    f = holding(row, frame, sizes, by, force, moment, half)
    e = zero, zero, zero, zero, zero, zero
    if row[FORCE] > 0.0:
        x, y, z = constants((1.0, 0.0, 0.0)), constants((0.0, 1.0, 0.0)), constants((0.0, 0.0, 1.0))
        gx = holding(row, frame, sizes, by, x, outer(arm, x, half), half)
        gy = holding(row, frame, sizes, by, y, outer(arm, y, half), half)
        gz = holding(row, frame, sizes, by, z, outer(arm, z, half), half)
        e = (
            scale(row[FORCE], size_of((gx[0], gy[0], gz[0]), half)),
            scale(row[FORCE], size_of((gx[1], gy[1], gz[1]), half)),
            scale(row[FORCE], size_of((gx[2], gy[2], gz[2]), half)),
            scale(row[FORCE], size_of((gx[3], gy[3], gz[3]), half)),
            scale(row[FORCE], size_of((gx[4], gy[4], gz[4]), half)),
            scale(row[FORCE], size_of((gx[5], gy[5], gz[5]), half)),
        )
    bending2, across2 = at_carriage(row, 1, f[1], f[2], c2, sizes[1], by[3], h2, g, half)
    bending3, across3 = at_carriage(row, 2, f[3], f[4], c3, sizes[2], by[4], h3, g, half)
    values = (f[0], f[1], f[2], f[3], f[4], f[5], bending2, bending3, across2, across3)
    by2, by3 = product(e[1], sizes[1], half), product(e[3], sizes[2], half)
    spreads = (e[0], e[1], e[2], e[3], e[4], e[5], by2, by3, e[2], e[4])
    share, bound = 0.0, 0.0
    for i in range(PARTS):
        up, up_bound = share_of(values[i], spreads[i], row[LIMITS + i], half)
        down, down_bound = share_of(
            scale(-1.0, values[i]), spreads[i], row[LIMITS + PARTS + i], half
        )
        share, bound = max(share, up, down), max(bound, up_bound, down_bound)
    return share, bound


@helper
def at_carriage(
    row: FloatArray,
    leg: int,
    guide: Model,
    strut: Model,
    c: Models,
    length: Model,
    by_length: Model,
    joint: Models,
    g: Vector,
    half: float,
) -> tuple[Model, Model]:
    """Return the moment at the carriage of leg 2 or 3, and the force across the guide.

    See `explorer.statics.reactions.Reactions`; the moment has a sign.
    """
    at = LEGS + leg * LEG
    masses = row[at + CARRIAGE] + row[at + CYLINDER]
    moment = plus(product(guide, length, half), scale(g[0] * masses, length))
    own = g[0] * (row[at + ROD_MOMENT] - row[at + CYLINDER_MOMENT])
    k, weight = scale(-1.0, product(strut, by_length, half)), masses + row[at + ROD]
    y = plus(constant(weight * g[1]), scale(-1.0, joint[1]))
    z = plus(constant(weight * g[2]), scale(-1.0, joint[2]))
    across = (
        constant(0.0),
        plus(y, product(k, c[1], half)),
        plus(z, product(k, c[2], half)),
    )
    return plus(moment, constant(own)), size_of(across, half)


@kernel("void(f8[::1], f8[:,::1], f8[:,:,::1], f8[:,::1], f8[:,:,::1], f8[::1], f8, f8, f8[:,::1])")
def share_rows_of_moves(
    row: FloatArray,
    start: FloatArray,
    start_rotation: FloatArray,
    end: FloatArray,
    end_rotation: FloatArray,
    tool: FloatArray,
    tolerance: float,
    target: float,
    out: FloatArray,
) -> None:
    """Write the largest share of a limit over n moves, and an upper bound of it.

    Starts and ends are positions of b4; the tool, in platform coordinates, moves straight.

    Args:
        row: The machine and its load, shape (END,), see `POINT`.
        start: b4 at the start, shape (n, 3).
        start_rotation: Platform to base, shape (n, 3, 3).
        end: b4 at the end, shape (n, 3).
        end_rotation: Platform to base at the end, shape (n, 3, 3).
        tool: Point that moves straight, shape (3,).
        tolerance: Largest difference of bound and share, over the share if that exceeds 1.
        target: Share; the search ends once it is certain whether the largest is at most that. NaN
            for a search to the tolerance.
        out: Output, shape (n, COLUMNS): the upper bound, infinite if none was found; the largest
            share of all evaluated poses; and the share of the move at which it occurs.
    """
    p, r, axis, step = np.empty(3), np.empty((3, 3)), np.empty(3), np.empty(3)
    first = np.empty(3)
    middles, halves = np.empty(DEEPEST), np.empty(DEEPEST)
    for index in range(start.shape[0]):
        write_line(start[index], start_rotation[index], end[index], end_rotation[index], tool,
                   first, step)  # fmt: skip
        angle = write_turn(start_rotation[index], end_rotation[index], axis)
        best, best_at, largest_bound, examined, queued = -1.0, 0.0, 0.0, 0, 1
        middles[0], halves[0] = 0.5, 0.5
        while queued > 0 and largest_bound < math.inf:
            # A good estimate saves halvings; its poses are intervals without a length.
            is_sample = examined <= SAMPLES
            t, half = examined / SAMPLES, 0.0
            if not is_sample:
                queued -= 1
                t, half = middles[queued], halves[queued]
            examined += 1
            write_pose_at(t, first, start_rotation[index], step, axis, angle, p, r)
            move_by_arm(-1.0, r, tool, p)
            value, high = bound_share(row, p, r, tool, step, axis, angle, half)
            if value > best:
                best, best_at = value, t
            if best > target or best == math.inf:
                # The largest is beyond the target: the rest needs no bound.
                largest_bound = math.inf
            if is_sample:
                continue
            if high <= best + tolerance * max(1.0, best) or high <= target:
                largest_bound = max(largest_bound, high)
            elif queued + 2 > DEEPEST or examined >= MOST_INTERVALS:
                largest_bound = math.inf
            else:
                half *= 0.5
                # The half nearer to the largest so far comes first.
                near = half if best_at > t else -half
                middles[queued], halves[queued] = t - near, half
                middles[queued + 1], halves[queued + 1] = t + near, half
                queued += 2
        out[index, BOUND], out[index, SHARE] = max(largest_bound, best), best
        out[index, PLACE] = best_at
