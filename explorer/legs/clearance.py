"""Clearances of the four legs in a pose, and the closest points of two line segments.

A leg is a capsule about its axis, from its base end (a1, the carriages on the guide at d1 and d3,
a3) to its platform end (b1, b2, b3, b4). The clearance of a pair is the distance of the axes less
both radii; a pair with a negative clearance collides.

Parallel, touching, crossing and zero-length segments need no special case. The least distance is
that of the two lines, if their closest points lie within both segments, or else that of an end of
one segment from the other. See V. J. Lumelsky, "On fast computation of distance between line
segments" (1985).
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import NamedTuple

import numpy as np

from explorer.mechanism.configuration import Configuration, computed_once
from explorer.mechanism.design import DEGENERATE_RATIO, Design
from explorer.numerics.arrays import BoolArray, FloatArray, IntArray
from explorer.numerics.compiled import helper, kernel
from explorer.numerics.vectors import Vector, cross3, dot3, minus


@helper
def clamp_ratio(value: float, over: float) -> float:
    """Return value / over clamped to [0, 1]; 0 where `over` is not positive."""
    if value <= 0.0 or over <= 0.0:
        return 0.0
    if value >= over:
        return 1.0
    return value / over


@helper
def square_at(s: float, t: float, u: Vector, v: Vector, r: Vector) -> float:
    """Return |r + s u − t v|²."""
    x = r[0] + s * u[0] - t * v[0]
    y = r[1] + s * u[1] - t * v[1]
    z = r[2] + s * u[2] - t * v[2]
    return x * x + y * y + z * z


@helper
def closest_shares(u: Vector, v: Vector, r: Vector) -> tuple[float, float]:
    """Return the shares s and t, 0 to 1, of two segments u and v at which |r + s u − t v| is least.

    r leads from the start of the second segment to the start of the first.
    """
    uu, vv, uv, ur, vr = dot3(u, u), dot3(v, v), dot3(u, v), dot3(u, r), dot3(v, r)
    # The distances of the four ends from the other segment.
    best_s, best_t = 0.0, clamp_ratio(vr, vv)
    best = square_at(best_s, best_t, u, v, r)
    s, t = 1.0, clamp_ratio(uv + vr, vv)
    square = square_at(s, t, u, v, r)
    if square < best:
        best_s, best_t, best = s, t, square
    s, t = clamp_ratio(-ur, uu), 0.0
    square = square_at(s, t, u, v, r)
    if square < best:
        best_s, best_t, best = s, t, square
    s, t = clamp_ratio(uv - ur, uu), 1.0
    square = square_at(s, t, u, v, r)
    if square < best:
        best_s, best_t, best = s, t, square
    # The common perpendicular. Cross products keep it accurate for nearly parallel lines,
    # where uu vv − uv² would lose twice the digits.
    n = cross3(u, v)
    nn = dot3(n, n)
    s, t = dot3(n, cross3(v, r)), dot3(n, cross3(u, r))
    if 0.0 < s < nn and 0.0 < t < nn:
        s = s / nn
        t = clamp_ratio(uv * s + vr, vv)
        if square_at(s, t, u, v, r) < best:
            best_s, best_t = s, t
    return best_s, best_t


@helper
def write_closest(first: FloatArray, second: FloatArray, points: FloatArray) -> float:
    """Write the closest points of two segments of shape (2, 3), and return their distance."""
    a, b = (first[0, 0], first[0, 1], first[0, 2]), (second[0, 0], second[0, 1], second[0, 2])
    u = minus((first[1, 0], first[1, 1], first[1, 2]), a)
    v = minus((second[1, 0], second[1, 1], second[1, 2]), b)
    r = minus(a, b)
    s, t = closest_shares(u, v, r)
    for axis in range(3):
        points[0, axis] = a[axis] + s * u[axis]
        points[1, axis] = b[axis] + t * v[axis]
    return math.sqrt(square_at(s, t, u, v, r))


PAIRS = ((1, 2), (1, 3), (1, 4), (2, 3), (2, 4), (3, 4))
"""Pairs of legs, in the order of every array axis of length six."""


def pair_name(pair: tuple[int, int]) -> str:
    """Return the name of a pair of legs, such as "1–2"."""
    return f"{pair[0]}–{pair[1]}"


def legs_of(pairs: Iterable[bool]) -> list[bool]:
    """Return which of the four legs are in one of some pairs, given as truths as in `PAIRS`."""
    chosen = [pair for pair, is_in in zip(PAIRS, pairs, strict=True) if is_in]
    return [any(leg in pair for pair in chosen) for leg in (1, 2, 3, 4)]


class LegClearances(NamedTuple):
    """The clearances of all pairs of legs, in the order of `PAIRS`.

    A pair that shares a joint (see `joined_pairs`) touches by construction: its clearance
    and distance are infinite, and both its points are the joint.

    Attributes:
        clearance: Distance less both radii, in design units, shape (..., 6); negative in
            collision.
        distance: Distance of the two axes, in design units, shape (..., 6).
        points: Closest points of the two axes, on the pair's first leg, then on its second,
            in the base frame, shape (..., 6, 2, 3).
    """

    clearance: FloatArray
    distance: FloatArray
    points: FloatArray

    @property
    def closest(self) -> IntArray:
        """Index into `PAIRS` of the pair with the least clearance, shape (...)."""
        return np.asarray(self.clearance.argmin(axis=-1), dtype=np.int64)


def joined_pairs(design: Design) -> BoolArray:
    """Return which pairs of legs share a joint, shape (6,), in the order of `PAIRS`.

    Leg 2 or 3 ends in b4, as leg 4 does, if b2 or b3 is zero to rounding. All tests leave such
    a pair out.
    """
    least = DEGENERATE_RATIO * max(map(abs, design.variables))
    distances = {(2, 4): abs(design.b2), (3, 4): abs(design.b3)}
    return np.array([distances.get(pair, math.inf) <= least for pair in PAIRS])


def radii_of_pairs(design: Design) -> FloatArray:
    """Return the sum of both radii of each pair, shape (6,)."""
    radii = design.limits.leg_radii
    return np.array([radii[first - 1] + radii[second - 1] for first, second in PAIRS])


@computed_once
def leg_axes(configuration: Configuration) -> FloatArray:
    """Return the axes of the four legs, base end and platform end, shape (..., 4, 2, 3)."""
    points = configuration.points
    axes = np.zeros((*configuration.batch, 4, 2, 3))
    axes[..., 1, 0, 0], axes[..., 2, 0, 0] = points.b2[..., 0], points.b3[..., 0]
    axes[..., 3, 0, :] = points.a3
    for leg, end in enumerate((points.b1, points.b2, points.b3, points.b4)):
        axes[..., leg, 1, :] = end
    return axes


@computed_once
def leg_clearances(configuration: Configuration) -> LegClearances:
    """Return the clearances of all six pairs of legs; the limits of the design hold the radii."""
    design, axes = configuration.design, leg_axes(configuration)
    batch = axes.shape[:-3]
    rows = axes.reshape(-1, 4, 2, 3)
    distance, points = np.empty((len(rows), 6)), np.empty((len(rows), 6, 2, 3))
    pair_rows(len(rows), rows, distance, points)
    joined = joined_pairs(design)
    distance[:, joined] = math.inf
    points[:, joined] = rows[:, 3, None, 1, None, :]
    return LegClearances(
        (distance - radii_of_pairs(design)).reshape(*batch, 6),
        distance.reshape(*batch, 6),
        points.reshape(*batch, 6, 2, 3),
    )


def distance_gradients(configuration: Configuration) -> FloatArray:
    """Return the gradients of all pairs' distances by the position, shape (..., 6, 3).

    The gradient is zero for a pair that shares a joint. It is also set to zero where the axes of a
    pair cross, since the distance is not differentiable there.
    """
    clearances = leg_clearances(configuration)
    offset = clearances.points[..., 0, :] - clearances.points[..., 1, :]
    length = np.linalg.norm(offset, axis=-1, keepdims=True)
    normal = offset / np.where(length > 0.0, length, 1.0)
    return normal * point_rates(leg_axes(configuration), clearances.points)


def point_rates(axes: FloatArray, points: FloatArray) -> FloatArray:
    """Return the derivatives, by the position, of the offset between points on two legs.

    A platform end moves as b4 does, a carriage along x only, so each Jacobian is diagonal.

    Args:
        axes: Axes of the legs, shape (..., 4, 2, 3).
        points: One point on each axis of a pair, shape (..., 6, 2, 3).

    Returns:
        Diagonals of the Jacobians of (first point − second point), shape (..., 6, 3).
    """
    sides: list[FloatArray] = []
    for side in (0, 1):
        legs = [pair[side] - 1 for pair in PAIRS]
        base, end = axes[..., legs, 0, :], axes[..., legs, 1, :]
        axis = end - base
        square = (axis * axis).sum(axis=-1)
        share = ((points[..., side, :] - base) * axis).sum(axis=-1)
        share = share / np.where(square > 0.0, square, 1.0)
        rates = np.repeat(share[..., None], 3, axis=-1)
        on_guide = [leg in (1, 2) for leg in legs]
        rates[..., on_guide, 0] = 1.0
        sides.append(rates)
    return sides[0] - sides[1]


@kernel("void(f8[:,:,:,::1], f8[:,::1], f8[:,:,:,::1])")
def pair_rows(axes: FloatArray, distance: FloatArray, points: FloatArray) -> None:
    """Write distances and closest points (n, 6, 2, 3) of the pairs of axes (n, 4, 2, 3)."""
    for row in range(axes.shape[0]):
        pair = 0
        for i in range(4):
            for j in range(i + 1, 4):
                distance[row, pair] = write_closest(axes[row, i], axes[row, j], points[row, pair])
                pair += 1
