"""J⁻¹ in closed form: the twists of unit rates of the joints, and the forces that hold a load.

A load is a wrench (F; M) that acts on the platform at the tool point, along the axes of the base,
in newtons and newtons times the design unit. A positive actuator force pushes its joint's value
up. In a singular pose no forces hold a load that does work in a motion which locked actuators leave
free, and no unique ones hold any other; all results are infinite there
(`explorer.statics.loaded.LoadedPose.moves_platform` tells which it is).

With u the direction of b2b3 and M the moment about b4, leg 1 alone resists a turn about the line
b2b3 and leg 4 alone a turn about the guide:
f(l1) = l1 (M · u) / (b1y δ1) and f(l4) = −l4 x̂ · (M + p × F) / (a3y δ3).
Legs 2 and 3 hold the rest. Each can push along the guide and along its strut, but not across the
plane of both; δ2 is what this condition divides by. The forces of six unit loads are the columns of
−J⁻ᵀ, so the same closed form inverts J.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike

from explorer.mechanism.configuration import Configuration
from explorer.mechanism.margins import SINGULAR, margins_at, margins_of
from explorer.numerics.arrays import FloatArray, finite_array
from explorer.numerics.checks import FARTHEST
from explorer.numerics.compiled import helper, kernel
from explorer.numerics.computed_once import computed_once
from explorer.numerics.vectors import Vector, along, column, cross3, dot3, times

# |p| over the reach up to which b4 is at a1, where all margins vanish.
AT_A1 = 1e-26

# Columns of the row of design variables, `Design.variables`.
A3X, A3Y, B1X, B1Y, B2, B3 = range(6)


@helper
def is_singular(x: FloatArray, p: FloatArray, r: FloatArray) -> bool:
    """Return whether a margin of the pose vanishes to rounding."""
    square = p[0] * p[0] + p[1] * p[1] + p[2] * p[2]
    least = SINGULAR * math.sqrt(square)
    delta1, delta2, delta3 = margins_at(p, r)
    if square <= AT_A1 * AT_A1 * (x[A3X] * x[A3X] + x[A3Y] * x[A3Y]):
        return True
    return abs(delta1) <= least or abs(delta2) <= least or abs(delta3) <= least


@helper
def held_across(q: Vector, u: Vector, point: Vector, delta2: float) -> Vector:
    """Return the force of leg 2 or 3, given its part q across u.

    The part along u makes the force lie in the plane of the guide and the strut to `point`.
    """
    return along(q, (point[1] * q[2] - point[2] * q[1]) / delta2, u)


@helper
def held_by_legs(
    x: FloatArray,
    u: Vector,
    arm1: Vector,
    ends: tuple[Vector, Vector, Vector, Vector],
    deltas: Vector,
    force: Vector,
    moment: Vector,
) -> tuple[float, Vector, Vector, float]:
    """Return what holds a force and a moment about b4 in a regular pose.

    These are the forces of legs 1 and 4 over their lengths, and those of legs 2 and 3 as vectors
    between them. The platform ends of the legs are given, and b1 from b4.
    """
    b1, b2, b3, p = ends
    leg4 = (p[0] - x[A3X], p[1] - x[A3Y], p[2])
    f1 = dot3(moment, u) / (x[B1Y] * deltas[0])
    f4 = -(moment[0] + p[1] * force[2] - p[2] * force[1]) / (x[A3Y] * deltas[2])
    rest = along(along(force, f1, b1), f4, leg4)
    turning = along(moment, f1, cross3(arm1, b1))
    lever, zero, span = cross3(u, rest), (0.0, 0.0, 0.0), x[B3] - x[B2]
    across2 = cross3(along(turning, -x[B3], lever), u)
    across3 = cross3(along(turning, -x[B2], lever), u)
    held2 = held_across(along(zero, 1.0 / span, across2), u, b2, deltas[1])
    held3 = held_across(along(zero, -1.0 / span, across3), u, b3, deltas[1])
    return f1, held2, held3, f4


@helper
def holding_forces(
    x: FloatArray, p: FloatArray, r: FloatArray, force: Vector, moment: Vector
) -> tuple[float, float, float, float, float, float]:
    """Return the actuator forces that hold a force and a moment about b4 in a regular pose."""
    u, v, b4 = column(r, 0), column(r, 1), (p[0], p[1], p[2])
    zero = (0.0, 0.0, 0.0)
    arm1 = along(along(zero, x[B1X], u), x[B1Y], v)
    b1, b2, b3 = along(b4, 1.0, arm1), along(b4, x[B2], u), along(b4, x[B3], u)
    deltas = margins_of(b4, u, column(r, 2))
    f1, held2, held3, f4 = held_by_legs(x, u, arm1, (b1, b2, b3, b4), deltas, force, moment)
    leg4 = (p[0] - x[A3X], p[1] - x[A3Y], p[2])
    l1, l4 = math.sqrt(dot3(b1, b1)), math.sqrt(dot3(leg4, leg4))
    d2, d4 = math.sqrt(b2[1] * b2[1] + b2[2] * b2[2]), math.sqrt(b3[1] * b3[1] + b3[2] * b3[2])
    return (
        f1 * l1,
        held2[0],
        (b2[1] * held2[1] + b2[2] * held2[2]) / d2,
        held3[0],
        (b3[1] * held3[1] + b3[2] * held3[2]) / d4,
        f4 * l4,
    )


@kernel("void(f8[::1], f8[:,::1], f8[:,::1], f8[:,:,::1], f8[:,::1], f8[:,::1])")
def force_rows(
    x: FloatArray,
    tools: FloatArray,
    position: FloatArray,
    rotation: FloatArray,
    loads: FloatArray,
    out: FloatArray,
) -> None:
    """Write the actuator forces that hold loads at tools (n or 1, 3), infinite if singular."""
    for k in range(position.shape[0]):
        p, r = position[k], rotation[k]
        if is_singular(x, p, r):
            for i in range(6):
                out[k, i] = math.inf
            continue
        t, w = tools[k % tools.shape[0]], loads[k % loads.shape[0]]
        arm = times(r, t)
        force = (w[0], w[1], w[2])
        moment = along((w[3], w[4], w[5]), 1.0, cross3(arm, force))
        forces = holding_forces(x, p, r, force, moment)
        for i in range(6):
            out[k, i] = forces[i]


@kernel("void(f8[::1], f8[:,::1], f8[:,::1], f8[:,:,::1], f8[:,:,::1])")
def inverse_rows(
    x: FloatArray,
    tools: FloatArray,
    position: FloatArray,
    rotation: FloatArray,
    out: FloatArray,
) -> None:
    """Write J⁻¹ of n poses at tools (n or 1, 3), infinite in singular ones."""
    for k in range(position.shape[0]):
        p, r = position[k], rotation[k]
        if is_singular(x, p, r):
            for row in range(6):
                for i in range(6):
                    out[k, row, i] = math.inf
            continue
        t = tools[k % tools.shape[0]]
        arm = times(r, t)
        for axis in range(3):
            unit = (
                1.0 if axis == 0 else 0.0,
                1.0 if axis == 1 else 0.0,
                1.0 if axis == 2 else 0.0,
            )
            by_force = holding_forces(x, p, r, unit, cross3(arm, unit))
            by_moment = holding_forces(x, p, r, (0.0, 0.0, 0.0), unit)
            for i in range(6):
                out[k, axis, i] = -by_force[i]
                out[k, 3 + axis, i] = -by_moment[i]


@computed_once
def twists_of_actuators(configuration: Configuration) -> FloatArray:
    """Return J⁻¹ at the tool, shape (..., 6, 6): twist of the tool = J⁻¹ @ joint rates.

    Column i is the twist (v; ω) of the tool point for a unit rate of joint i, in the order of
    `JOINTS`, along the axes of the base. All entries are infinite in a singular pose.
    """
    c = configuration
    out = np.empty((len(c.positions), 6, 6))
    inverse_rows(len(out), c.variables, c.tools, c.positions, c.rotations, out)
    return out.reshape(*c.batch, 6, 6)


def load_array(load: ArrayLike) -> FloatArray:
    """Return loads (F; M) along base axes, shape (..., 6), in N and N × unit.

    Raises:
        InputError: A load is not six numbers, or one of them exceeds `FARTHEST`.
    """
    return finite_array("load (FX FY FZ MX MY MZ)", load, (6,), FARTHEST)


def forces_of(configuration: Configuration, load: ArrayLike) -> FloatArray:
    """Return the actuator forces f = −J⁻ᵀ (F; M) that hold a load, shape (..., 6), in newtons.

    Their order is that of `JOINTS`. All six are infinite in a singular pose, whatever the load. The
    load acts at the tool point, see `load_array`.

    Raises:
        InputError: The load is unusable, or batch axes do not broadcast.
    """
    w = load_array(load)
    c = configuration.spread(w)
    out = np.empty((len(c.positions), 6))
    force_rows(len(out), c.variables, c.tools, c.positions, c.rotations, c.rows_or_one(w), out)
    return out.reshape(*c.batch, 6)
