"""All that a load does to the parts of the machine, and the utilisations of their limits."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from explorer.mechanism.configuration import Configuration
from explorer.mechanism.design import GUIDE_ROWS, JOINTS, LENGTH_ROWS, STRUT_ROWS, Design
from explorer.mechanism.pose import Triple
from explorer.motion.inverse_jacobian import forces_of, twists_of_actuators
from explorer.motion.weights import Carried, MovingBodies, carry
from explorer.numerics.arrays import BoolArray, FloatArray, dot
from explorer.numerics.computed_once import computed_once

LIMITED = (
    *JOINTS,
    *("bending 2", "bending 3", "guide force 2", "guide force 3"),
    *("guide moment 2", "guide moment 3"),
)
"""The loaded parts with a limit, in the order of `limit_shares`."""

PART_NAMES = (
    *(f"actuator {joint}" for joint in JOINTS),
    *("bending of strut 2", "bending of strut 3"),
    *("force of carriage 2", "force of carriage 3"),
    *("moment of carriage 2", "moment of carriage 3"),
)
"""Words for these parts, in the order of `LIMITED`."""

# Columns of `_limited_reactions` after the actuators: moments at the carriages, and forces across
# the guide (y, z).
_MOMENTS, _ACROSS_2, _ACROSS_3 = slice(6, 8), slice(8, 10), slice(10, 12)


class Reactions(NamedTuple):
    """The reactions that hold a load in a pose; in a singular pose all but the spread is infinite.

    Attributes:
        actuators: Forces in the order of `JOINTS`, shape (..., 6), in N; positive ones push.
        joints: Forces of the legs on the platform at b1 to b4, base axes, shape (..., 4, 3), in N.
        bending: Bending moments of struts 2 and 3 at their carriages, shape (..., 2), in N × unit.
        guide_force: Forces of carriages 2 and 3 across the guide, shape (..., 2), in N.
        spread: Most by which the payload's force of any direction increases each of these, in the
            order of `LIMITED`, shape (..., 12).
    """

    actuators: FloatArray
    joints: FloatArray
    bending: FloatArray
    guide_force: FloatArray
    spread: FloatArray

    @property
    def guide_moment(self) -> FloatArray:
        """Moments of carriages 2 and 3 on the guide, shape (..., 2), in N × unit."""
        return self.bending


def reactions(
    configuration: Configuration, load: ArrayLike, weights: MovingBodies | Carried | None = None
) -> Reactions:
    """Return all that holds a load and weights.

    The payload's force of any direction is not part of the load; its effect is the `spread`. Where
    legs have weights, that of the force on the guide is an upper bound.

    The bending of a strut across the guide by its own weight is left out: its carriage turns
    about the guide, so that this moment vanishes at the carriage.

    The load (F; M) acts at the tool point of the configuration, base axes, shape (..., 6), in N and
    N × unit. The weights are those of moving bodies, or what they do by `carry`; None for none.

    Raises:
        InputError: The load is not finite, or batch axes do not broadcast.
    """
    known = isinstance(weights, Carried)
    carried = weights if known else carry(configuration, weights or MovingBodies())
    forces = forces_of(configuration, carried.wrench + np.asarray(load, dtype=np.float64))
    limited = _limited_reactions(configuration, forces, carried)
    across = limited[..., 8:].reshape(*limited.shape[:-1], 2, 2)
    return Reactions(
        actuators=forces,
        joints=_joint_forces(configuration, forces, carried),
        bending=np.abs(limited[..., _MOMENTS]),
        guide_force=np.sqrt(dot(across, across)),
        spread=_spread(configuration, forces.shape[:-1]),
    )


@computed_once
def payload_reactions(configuration: Configuration) -> Reactions:
    """Return the reactions to the weight of a design's payload alone."""
    return reactions(configuration, np.zeros(6), MovingBodies().with_payload(configuration.design))


def limit_shares(design: Design, result: Reactions) -> FloatArray:
    """Return the utilisations of a design's limits by reactions, shape (..., 12), as in `LIMITED`.

    That of a part without a limit is 0, unless the pose is singular.
    """
    values = np.concatenate(
        [result.actuators, result.bending, result.guide_force, result.guide_moment], axis=-1
    )
    is_regular = np.isfinite(values)
    values = np.where(is_regular, values, 0.0)
    highs, lows = _limits(design)
    up, down = (values + result.spread) / highs, (result.spread - values) / lows
    return np.where(is_regular, np.maximum(up, down), np.inf)


def part_limits(design: Design) -> FloatArray:
    """Return the largest and, with a minus, the least values of loaded parts, shape (2, 10).

    The parts are the actuators, the bending of struts 2 and 3 in N × unit, which the guide takes
    too, and the forces of carriages 2 and 3 across the guide. A limit that is not given is
    infinite.
    """
    limits = _limits(design)
    moments = np.minimum(limits[:, 6:8], limits[:, 10:])
    return np.hstack([limits[:, :6], moments, limits[:, 8:10]])


def limited_parts(design: Design) -> BoolArray:
    """Return whether each part of `LIMITED` has a limit, shape (12,)."""
    return np.isfinite(_limits(design).min(axis=0))


def has_limits(design: Design) -> bool:
    """Return whether an actuator, a strut or the guide of a design has a limit."""
    return bool(limited_parts(design).any())


def largest_payload(
    configuration: Configuration,
    load: ArrayLike = (0.0,) * 6,
    weights: MovingBodies | None = None,
) -> FloatArray:
    """Return the largest mass at the payload's centre that keeps all limits, shape (...), in kg.

    The payload's force of any direction acts besides. A load that exceeds a limit alone may be
    held with a mass. The result is 0 in a singular pose and where no mass keeps all limits, and
    infinite if there is no limit. Load and weights are those of `reactions`, besides the payload.

    Raises:
        InputError: The load is not finite, or batch axes do not broadcast.
    """
    design = configuration.design
    base = carry(configuration, weights or MovingBodies())
    kilogram = carry(configuration, MovingBodies().with_mass(1.0, design.payload.centre))
    at_zero = forces_of(configuration, base.wrench + np.asarray(load, dtype=np.float64))
    by_one = forces_of(configuration, kilogram.wrench)
    regular = np.isfinite(at_zero[..., 0])
    at_zero, by_one = np.nan_to_num(at_zero, posinf=0.0), np.nan_to_num(by_one, posinf=0.0)
    start = _limited_reactions(configuration, at_zero, base)
    slope = _limited_reactions(configuration, by_one, kilogram)
    start, slope = np.broadcast_arrays(start, slope)
    highs, lows = part_limits(design)
    spread = _spread(configuration, regular.shape)[..., :10]
    highs, lows = highs - spread, lows - spread
    smallest, largest = np.zeros(regular.shape), np.full(regular.shape, np.inf)
    for least, most in (
        _linear_range(start[..., :8], slope[..., :8], lows[..., :8], highs[..., :8]),
        _square_range(start[..., _ACROSS_2], slope[..., _ACROSS_2], highs[..., 8]),
        _square_range(start[..., _ACROSS_3], slope[..., _ACROSS_3], highs[..., 9]),
    ):
        smallest, largest = np.maximum(smallest, least), np.minimum(largest, most)
    return np.where(regular & (smallest <= largest), largest, 0.0)


def largest_accelerations(configuration: Configuration) -> FloatArray:
    """Return the largest accelerations from rest by the limit of each part, (..., 10), in m/s².

    The platform accelerates in every direction, without turning, so that all its points do so
    alike. It carries the design's payload, whose weight and force of any direction act besides;
    the legs count as weightless. To hold the payload a part needs a force −t · m (g − a), with t
    the velocity of the payload's centre for a unit rate of an actuator, so that the directions of
    ±t are the worst. The order is that of `part_limits`. Values are below zero where the payload
    is not held at rest, −∞ in a singular pose, and infinite for a part without a limit.
    """
    design = configuration.design
    held = payload_reactions(configuration)
    values = np.concatenate([held.actuators, held.bending, held.guide_force], axis=-1)
    regular = np.isfinite(values)
    values = np.where(regular, values, 0.0)
    highs, lows = part_limits(design)
    spare = np.minimum(highs - values, lows + values) - held.spread[..., :10]
    effect = _effect(configuration, regular.shape[:-1], design.payload.centre)
    by_one = design.payload.mass_kg * effect[..., :10]
    unloaded = np.where(regular & (spare >= 0.0), np.inf, -np.inf)
    return np.divide(spare, by_one, out=unloaded, where=by_one > 0.0)


def _limits(design: Design) -> FloatArray:
    """Return the largest and, with a minus, the least values of `LIMITED`, in N and N × unit."""
    newton_metre = 1e3 / design.unit_mm
    bending = design.struts.largest_moment * newton_metre
    guide = design.guide
    force = np.inf if guide.force_n is None else guide.force_n
    moment = np.inf if guide.moment_nm is None else guide.moment_nm * newton_metre
    rest = bending, bending, force, force, moment, moment
    return np.array([[*most, *rest] for most in design.actuators.limits])


def _limited_reactions(c: Configuration, forces: FloatArray, carried: Carried) -> FloatArray:
    """Return the limited reactions with their signs, linear in the load, shape (..., 12).

    They are the actuator forces, the moments at the carriages along the guide, and the (y, z)
    components of the forces of both carriages on the guide.
    """
    lengths, along = c.joints[..., STRUT_ROWS], forces[..., GUIDE_ROWS]
    regular = np.isfinite(along)
    finite = np.where(regular, along, 0.0)
    moments = np.where(regular, finite * lengths + carried.along_guide, np.inf)
    across: list[FloatArray] = []
    for leg, row in zip((1, 2), STRUT_ROWS, strict=True):
        radial = forces[..., row, None]
        # The weight of the leg acts on the guide, less what the platform carries of it.
        own = carried.legs[..., leg, 1:] - carried.at_joints[..., leg, 1:]
        ok, axis = np.isfinite(radial), c.leg_directions[..., leg, 1:]
        across.append(np.where(ok, own - np.where(ok, radial, 0.0) * axis, np.inf))
    return _join(forces.shape[:-1], forces, moments, *across)


def _spread(c: Configuration, batch: tuple[int, ...]) -> FloatArray:
    """Return the effect of the payload's force of any direction, see `Reactions`."""
    if not c.design.payload.force_n:
        return np.zeros((*batch, 12))
    return c.design.payload.force_n * _effect(c, batch, c.design.tool.position)


def _effect(c: Configuration, batch: tuple[int, ...], point: Triple) -> FloatArray:
    """Return the effect of a force of 1 N of any direction at a point of the platform."""
    # By the principle of virtual work, a force F at the point asks F · v of an actuator whose
    # unit rate moves the point by v.
    velocities = twists_of_actuators(c.with_tool(point))[..., :3, :]
    speeds = np.sqrt((velocities * velocities).sum(axis=-2))
    forces = np.where(np.isfinite(speeds), speeds, 0.0)
    bending = forces[..., GUIDE_ROWS] * c.joints[..., STRUT_ROWS]
    return _join(batch, forces, bending, forces[..., STRUT_ROWS], bending)


def _joint_forces(c: Configuration, forces: FloatArray, carried: Carried) -> FloatArray:
    finite = np.where(np.isfinite(forces), forces, 0.0)
    out = finite[..., LENGTH_ROWS, None] * c.leg_directions + carried.at_joints
    out[..., 1, 0] += finite[..., 1]
    out[..., 2, 0] += finite[..., 3]
    return np.where(np.isfinite(forces[..., 0, None, None]), out, np.inf)


def _join(batch: tuple[int, ...], *parts: FloatArray) -> FloatArray:
    return np.concatenate([np.broadcast_to(e, (*batch, e.shape[-1])) for e in parts], axis=-1)


def _linear_range(
    start: FloatArray, slope: FloatArray, lows: FloatArray, highs: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return the least and the largest m with −lows ≤ start + m slope ≤ highs, shapes (...)."""
    moves = slope != 0.0
    every = (start <= highs) & (start >= -lows)
    ends = np.stack(np.broadcast_arrays(-lows - start, highs - start))
    # A part that the mass does not load keeps its limits with every mass, or with none.
    bounds = np.stack([np.where(every, -np.inf, np.inf), np.where(every, np.inf, -np.inf)])
    np.divide(ends, slope, out=bounds, where=moves)
    is_possible = lows + highs >= 0.0
    least = np.where(moves, np.where(is_possible, bounds.min(axis=0), np.inf), bounds[0])
    most = np.where(moves, np.where(is_possible, bounds.max(axis=0), -np.inf), bounds[1])
    return least.max(axis=-1), most.min(axis=-1)


def _square_range(
    start: FloatArray, slope: FloatArray, limit: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return the least and the largest m with |start + m slope| ≤ limit, of vectors (..., 2)."""
    if np.isinf(limit).all():
        return np.full(start.shape[:-1], -np.inf), np.full(start.shape[:-1], np.inf)
    a, b, c = dot(slope, slope), dot(start, slope), limit**2 - dot(start, start)
    every = (c >= 0.0) & (limit >= 0.0)
    least, most = np.where(every, -np.inf, np.inf), np.where(every, np.inf, -np.inf)
    square = b * b + a * c
    crosses = (a > 0.0) & (square >= 0.0) & (limit >= 0.0)
    root = np.sqrt(np.where(crosses, square, 0.0))
    np.divide(-b - root, a, out=least, where=crosses)
    np.divide(root - b, a, out=most, where=crosses)
    return least, most
