"""Forces of the six actuators and of the struts under a load on the platform.

A load is a wrench (F; M) that acts on the platform at the tool point, along the axes of the base,
in newtons and newtons times the design unit. A positive actuator force pushes its joint's value
up. The legs are weightless: legs 1 and 4 then carry forces along their axes only; legs 2 and 3 also
carry a force along the guide, which bends their struts. In a singular pose no forces hold a load
that does work in a motion which locked actuators leave free, and no unique ones hold any other; all
results are infinite there (`explorer.statics.loaded.LoadedPose.moves_platform` tells which it is).

With u the direction of b2b3 and M the moment about b4, leg 1 alone resists a turn about the line
b2b3 and leg 4 alone a turn about the guide:
f(l1) = l1 (M · u) / (b1y δ1) and f(l4) = −l4 x̂ · (M + p × F) / (a3y δ3).
Legs 2 and 3 hold the rest. Each can push along the guide and along its strut, but not across the
plane of both; δ2 is what this condition divides by. The forces of six unit loads are the columns of
−J⁻ᵀ, so the same closed form inverts J.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from explorer.mechanism.configuration import Configuration, computed_once
from explorer.mechanism.design import GUIDE_ROWS, STRUT_ROWS, Design
from explorer.mechanism.margins import SINGULAR, margins_at, margins_of
from explorer.numerics.arrays import FloatArray, IntArray, finite_array, positive_array
from explorer.numerics.checks import FARTHEST
from explorer.numerics.compiled import helper, kernel
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
def holding_forces(
    x: FloatArray, p: FloatArray, r: FloatArray, force: Vector, moment: Vector
) -> tuple[float, float, float, float, float, float]:
    """Return the actuator forces that hold a force and a moment about b4 in a regular pose."""
    u, v, b4 = column(r, 0), column(r, 1), (p[0], p[1], p[2])
    zero = (0.0, 0.0, 0.0)
    delta1, delta2, delta3 = margins_of(b4, u, column(r, 2))
    arm1 = along(along(zero, x[B1X], u), x[B1Y], v)
    leg1 = along(b4, 1.0, arm1)
    leg4 = (p[0] - x[A3X], p[1] - x[A3Y], p[2])
    l1, l4 = math.sqrt(dot3(leg1, leg1)), math.sqrt(dot3(leg4, leg4))
    # Forces over lengths.
    f1 = dot3(moment, u) / (x[B1Y] * delta1)
    f4 = -(moment[0] + p[1] * force[2] - p[2] * force[1]) / (x[A3Y] * delta3)
    rest = along(along(force, f1, leg1), f4, leg4)
    turning = along(moment, f1, cross3(arm1, leg1))
    lever = cross3(u, rest)
    span = x[B3] - x[B2]
    c2, c3 = along(b4, x[B2], u), along(b4, x[B3], u)
    across2 = cross3(along(turning, -x[B3], lever), u)
    across3 = cross3(along(turning, -x[B2], lever), u)
    held2 = held_across(along(zero, 1.0 / span, across2), u, c2, delta2)
    held3 = held_across(along(zero, -1.0 / span, across3), u, c3, delta2)
    d2, d4 = math.sqrt(c2[1] * c2[1] + c2[2] * c2[2]), math.sqrt(c3[1] * c3[1] + c3[2] * c3[2])
    return (
        f1 * l1,
        held2[0],
        (c2[1] * held2[1] + c2[2] * held2[2]) / d2,
        held3[0],
        (c3[1] * held3[1] + c3[2] * held3[2]) / d4,
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


class WorstDirection(NamedTuple):
    """The direction in which a force loads an actuator most.

    Attributes:
        direction: Unit vector along the axes of the base, shape (..., 3); NaN in a singular pose.
        actuator: Index of that actuator in `JOINTS`, shape (...).
        share: Its force over its limit for a force of 1 N, shape (...), in 1/N.
    """

    direction: FloatArray
    actuator: IntArray
    share: FloatArray


def actuator_forces(
    design: Design,
    position: ArrayLike,
    rotation: ArrayLike,
    load: ArrayLike,
    tool: ArrayLike | None = None,
) -> FloatArray:
    """Return `forces_of` of `Configuration(design, position, rotation, tool)` under a load."""
    return forces_of(Configuration(design, position, rotation, tool), load)


def strut_bending(
    design: Design,
    position: ArrayLike,
    rotation: ArrayLike,
    load: ArrayLike,
    tool: ArrayLike | None = None,
) -> FloatArray:
    """Return the bending moments of struts 2 and 3 at their carriages, shape (..., 2), N × unit.

    They are |f(d1)| d2 and |f(d3)| d4; the guide takes the same moments. Both are infinite in a
    singular pose. The arguments are those of `Configuration` and the load of `forces_of`.
    """
    c = Configuration(design, position, rotation, tool)
    along = np.abs(forces_of(c, load)[..., GUIDE_ROWS])
    # An infinite force gives an infinite moment, even if its strut has no length.
    with np.errstate(invalid="ignore"):
        moments = along * c.joints[..., STRUT_ROWS]
    return np.where(np.isinf(along), np.inf, moments)


def largest_force(
    design: Design,
    position: ArrayLike,
    rotation: ArrayLike,
    most: ArrayLike,
    tool: ArrayLike | None = None,
) -> FloatArray:
    """Return the largest force that the actuators hold in every direction, shape (...), in N.

    It acts at the tool point, without a moment. It is the least over the actuators of the limit
    over the length of the actuator's row of J⁻ᵀ, its first three entries; 0 in a singular pose.
    The arguments are those of `Configuration` and of `worst_direction`.
    """
    shares = worst_direction(Configuration(design, position, rotation, tool), most).share
    return np.divide(1.0, shares, out=np.full(shares.shape, np.inf), where=shares > 0.0)


def worst_direction(configuration: Configuration, most: ArrayLike) -> WorstDirection:
    """Return the direction in which a force at the tool loads an actuator most.

    The limits of the actuators to either side, shape (..., 6), in N, may be infinite. The opposite
    direction is as bad, with a pull for a push. The share is infinite in a singular pose, and zero
    if no actuator has a limit.

    Raises:
        InputError: A limit is not positive, or batch axes do not broadcast.
    """
    limits = positive_array("the largest forces", most, 6)
    twists = twists_of_actuators(configuration)
    # Row i: the force of actuator i is the product with the load's force.
    rows = -np.swapaxes(twists[..., :3, :], -1, -2)
    sizes = np.sqrt(np.einsum("...ij,...ij->...i", rows, rows))
    sizes, limits = np.broadcast_arrays(sizes, limits)
    # A share is infinite in a singular pose, even without a limit.
    shares = np.full(sizes.shape, np.inf)
    np.divide(sizes, limits, out=shares, where=np.isfinite(sizes))
    actuator = np.argmax(shares, axis=-1)
    row = np.take_along_axis(rows, actuator[..., None, None], axis=-2)[..., 0, :]
    size = np.take_along_axis(sizes, actuator[..., None], axis=-1)
    regular = np.isfinite(size) & (size > 0.0)
    direction = np.full(row.shape, np.nan)
    np.divide(row, size, out=direction, where=regular)
    return WorstDirection(direction, actuator, shares.max(axis=-1))
