"""Lower bounds of the distances of legs over cells of positions, of second order in their size.

At a fixed orientation all ends of legs are linear in the position. For any unit vector n the
distance of two legs is at least the least n·(X − Y) over the ends X and Y of the two, which are
four functions linear in the position. With n along the closest points at the middle of a cell, and
turning with the legs to first order, the error falls with the square of the cell.

Where a limit of the workspace keeps the legs from coming nearer, such a function is small only
beyond the limit. There it is bounded by duality: in the workspace a slack is not negative, so that
the function is at least itself less λ ≥ 0 times the slack, which is at most a linear function of
the position.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from explorer.legs.clearance import PAIRS, closest_shares, normal_rate
from explorer.numerics.arrays import BoolArray, FloatArray, IntArray
from explorer.numerics.compiled import helper, kernel
from explorer.numerics.vectors import Vector, along, along_axis, dot3, minus, norm3, vector
from explorer.workspace.limits.constraints import (
    ACROSS,
    BallOrCylinder,
    Cone,
    Constraint,
    HalfSpace,
    Never,
)

LEGS_OF_PAIRS = np.array(PAIRS, dtype=np.int64) - 1

# Most limits that bound one function together: as many meet in a vertex of a workspace.
MOST_LIMITS = 3


class SlackBounds(NamedTuple):
    """Upper bounds of the slacks of m limits in n cells: values + slopes · q, q from the middle.

    For a cone, whose slack is an angle, they bound the distance from a plane that touches it.

    Attributes:
        values: In the middles, shape (n, m); infinite where no bound is known.
        slopes: Derivatives by the position, shape (n, m, 3).
    """

    values: FloatArray
    slopes: FloatArray

    def largest(self, half: FloatArray) -> FloatArray:
        """Return bounds over whole cells with half edges (3,), shape (n, m)."""
        return np.asarray(self.values + np.abs(self.slopes) @ half)

    def of(self, cells: BoolArray) -> SlackBounds:
        """Return the bounds in some of the cells."""
        return SlackBounds(self.values[cells], self.slopes[cells])


def bound_slacks(
    limits: Sequence[Constraint], middles: FloatArray, half: FloatArray
) -> SlackBounds:
    """Return bounds of the slacks of limits in cells with middles (n, 3) and half edges (3,)."""
    values = np.full((len(middles), len(limits)), np.inf)
    slopes = np.zeros((*values.shape, 3))
    for index, limit in enumerate(limits):
        match limit:
            case HalfSpace():
                values[:, index], slopes[:, index] = limit.slack(middles), -limit.normal
            case BallOrCylinder():
                off = middles - limit.centre
                off[:, 0] *= limit.is_ball
                distance = np.linalg.norm(off, axis=-1)
                outwards = off / np.maximum(distance, np.finfo(float).tiny)[:, None]
                values[:, index] = limit.slack(middles)
                slopes[:, index] = -outwards if limit.inside else outwards
                if not limit.inside:
                    radius = float(np.linalg.norm(half[0 if limit.is_ball else 1 :]))
                    # The distance from a point or a line is convex.
                    with np.errstate(divide="ignore"):
                        values[:, index] += 0.5 * radius**2 / np.maximum(distance - radius, 0.0)
            case Never():
                values[:, index] = -np.inf
            case Cone():
                # A convex cone lies on one side of each plane that touches it.
                if limit.half_angle < 0.5 * math.pi:
                    leg, angle = limit.leg(middles), limit.half_angle
                    off = leg - (leg @ limit.axis)[:, None] * limit.axis
                    length = np.maximum(np.linalg.norm(off, axis=-1), np.finfo(float).tiny)
                    inwards = math.sin(angle) * limit.axis - math.cos(angle) * off / length[:, None]
                    values[:, index] = (inwards * leg).sum(axis=-1)
                    slopes[:, index] = inwards * (ACROSS if limit.flat else 1.0)
    return SlackBounds(values, slopes)


@helper
def least_over_cell(value: float, slope: Vector, half: FloatArray) -> float:
    """Return the least value of a linear function over a cell, given its value in the middle."""
    return value - (abs(slope[0]) * half[0] + abs(slope[1]) * half[1] + abs(slope[2]) * half[2])


@helper
def least_in_workspace(
    value: float, slope: Vector, half: FloatArray, slack: FloatArray, slack_slope: FloatArray
) -> float:
    """Return a lower bound of a linear function in a cell where no slack is negative.

    One limit after another is taken into account, with the λ that raises the bound most: there a
    component of the slope vanishes.
    """
    best = least_over_cell(value, slope, half)
    for _ in range(MOST_LIMITS):
        next_value, next_slope, has_grown = value, slope, False
        for limit in range(len(slack)):
            x, y, z = slack_slope[limit, 0], slack_slope[limit, 1], slack_slope[limit, 2]
            for axis in range(3):
                if slack_slope[limit, axis] * slope[axis] <= 0.0:
                    continue
                factor = slope[axis] / slack_slope[limit, axis]
                less = value - factor * slack[limit]
                left = (slope[0] - factor * x, slope[1] - factor * y, slope[2] - factor * z)
                least = least_over_cell(less, left, half)
                if least > best:
                    best, next_value, next_slope, has_grown = least, less, left, True
        if not has_grown:
            break
        value, slope = next_value, next_slope
    return best


@helper
def rate_along(leg: int, end: int, axis: int) -> float:
    """Return the rate at which an end of a leg, 0 at the base, moves with b4 along an axis."""
    # A carriage moves along x only.
    return 1.0 if end == 1 or (axis == 0 and 0 < leg < 3) else 0.0


@kernel("void(b1[:,::1], i8[:,::1], f8[:,:,:,::1], f8[::1], f8[:,::1], f8[:,:,::1], f8[:,::1])")
def raise_bounds(
    needed: BoolArray,
    legs: IntArray,
    axes: FloatArray,
    half: FloatArray,
    slack: FloatArray,
    slack_slopes: FloatArray,
    bounds: FloatArray,
) -> None:
    """Raise lower bounds of distances (n, 6), where needed, given the axes in the middles."""
    turns = np.empty((3, 3))
    for row, pair in np.ndindex(needed.shape):
        if not needed[row, pair]:
            continue
        first, second = legs[pair, 0], legs[pair, 1]
        one, other = axes[row, first], axes[row, second]
        a, b = vector(one, 0), vector(other, 0)
        u, v, r = minus(vector(one, 1), a), minus(vector(other, 1), b), minus(a, b)
        s, t = closest_shares(u, v, r)
        apart = minus(along(r, s, u), along((0.0, 0.0, 0.0), t, v))
        distance = norm3(apart)
        if distance <= 0.0:
            continue
        n = (apart[0] / distance, apart[1] / distance, apart[2] / distance)
        # n turns with the legs, at these rates by the position.
        turned = 0.0
        for axis in range(3):
            du = along_axis(axis, 1.0 - rate_along(first, 0, axis))
            dv = along_axis(axis, 1.0 - rate_along(second, 0, axis))
            turn = normal_rate(n, u, du, v, dv, s, t)
            turns[axis, 0], turns[axis, 1], turns[axis, 2] = turn
            turned += norm3(turn) * half[axis]
        least = np.inf
        for i in range(2):
            for j in range(2):
                w = minus(vector(one, i), vector(other, j))
                value, slope = dot3(n, w), (0.0, 0.0, 0.0)
                for axis in range(3):
                    rate = rate_along(first, i, axis) - rate_along(second, j, axis)
                    change = n[axis] * rate + dot3(vector(turns, axis), w)
                    slope = along(slope, 1.0, along_axis(axis, change))
                    for k in range(3):
                        value -= abs(turns[k, axis] * rate) * half[axis] * half[k]
                own = least_in_workspace(value, slope, half, slack[row], slack_slopes[row])
                least = min(least, own)
        # The direction is at right angles to its turns.
        if least > 0.0:
            least /= math.sqrt(1.0 + turned * turned)
        bounds[row, pair] = max(bounds[row, pair], least)
