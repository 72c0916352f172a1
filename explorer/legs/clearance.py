"""Clearances of the four legs in a pose, and the closest points of two line segments.

A leg is a capsule about its axis, from its base end (a1, the carriages on the guide at d1 and d3,
a3) to its platform end (b1, b2, b3, b4). The clearance of a pair is the distance of the axes less
both radii; a pair with a negative clearance collides. The distance of two segments is that of the
two lines, if their closest points lie within both, or else that of an end of one from the other
(V. J. Lumelsky, "On fast computation of distance between line segments", 1985).

Over a whole interval of a move the distance of two legs is at least the greater of two bounds.
First, it changes by no more than the greatest relative motion of an end of one and an end of the
other. Second, for any direction n it is at least the minimum of n·(X − Y)/|n| over the ends X and Y
of the two. If n is the direction of the closest points and turns with the legs to first order, the
error of this bound falls with the square of the interval.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import NamedTuple

import numpy as np

from explorer.mechanism.configuration import Configuration
from explorer.mechanism.design import DEGENERATE_RATIO, Design
from explorer.numerics.arrays import BoolArray, FloatArray, IntArray
from explorer.numerics.compiled import helper, kernel
from explorer.numerics.computed_once import computed_once
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
        clearance: Distance less both radii, in design units, (..., 6); negative in collision.
        distance: Distance of the two axes, in design units, shape (..., 6).
        points: Closest points of the axes of the pair's first and second leg, (..., 6, 2, 3).
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
    axes[..., 1, :] = np.stack(points[3:], axis=-2)
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

    They are zero for a pair that shares a joint, and where axes cross, which has no derivative.
    """
    clearances = leg_clearances(configuration)
    offset = clearances.points[..., 0, :] - clearances.points[..., 1, :]
    length = np.linalg.norm(offset, axis=-1, keepdims=True)
    normal = offset / np.where(length > 0.0, length, 1.0)
    return normal * point_rates(leg_axes(configuration), clearances.points)


def point_rates(axes: FloatArray, points: FloatArray) -> FloatArray:
    """Return the derivatives, by the position, of (first − second point) of pairs of legs.

    A platform end moves as b4 does, a carriage along x only, so each Jacobian is diagonal; the
    diagonals have the shape (..., 6, 3), the axes (..., 4, 2, 3) and the points (..., 6, 2, 3).
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


# Number of intervals of a move whose ends give the first estimate of the least distance.
SAMPLES = 8
# Largest number of intervals in the queue: one for each halving.
DEEPEST = 60


@helper
def platform_end(
    leg: int,
    t: float,
    start: FloatArray,
    step: FloatArray,
    angle: float,
    parts: FloatArray,
) -> tuple[Vector, Vector]:
    """Return a leg's platform end at t, and its velocity."""
    c, s = math.cos(angle * t), math.sin(angle * t)
    x, y, z = (
        start[0] + t * step[0] + parts[leg, 0, 0] + c * parts[leg, 1, 0] + s * parts[leg, 2, 0],
        start[1] + t * step[1] + parts[leg, 0, 1] + c * parts[leg, 1, 1] + s * parts[leg, 2, 1],
        start[2] + t * step[2] + parts[leg, 0, 2] + c * parts[leg, 1, 2] + s * parts[leg, 2, 2],
    )
    c, s = angle * c, angle * s
    velocity = (
        step[0] - s * parts[leg, 1, 0] + c * parts[leg, 2, 0],
        step[1] - s * parts[leg, 1, 1] + c * parts[leg, 2, 1],
        step[2] - s * parts[leg, 1, 2] + c * parts[leg, 2, 2],
    )
    return (x, y, z), velocity


@helper
def base_end(leg: int, end: Vector, velocity: Vector, a3: FloatArray) -> tuple[Vector, Vector]:
    """Return a leg's base end, and its velocity, from those of its platform end."""
    if leg == 0:
        return (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)
    if leg == 3:
        return (a3[0], a3[1], a3[2]), (0.0, 0.0, 0.0)
    return (end[0], 0.0, 0.0), (velocity[0], 0.0, 0.0)


@helper
def tangent_error(leg: int, half: float, angle: float, parts: FloatArray) -> float:
    """Return the largest distance of an end from its tangent within half an interval."""
    x, y, z = parts[leg, 1, 0], parts[leg, 1, 1], parts[leg, 1, 2]
    turn = angle * half
    return 0.5 * turn * turn * math.sqrt(x * x + y * y + z * z)


@helper
def normal_rate(
    n: Vector, u: Vector, du: Vector, v: Vector, dv: Vector, s: float, t: float
) -> Vector:
    """Return the rate at which a direction n turns to stay perpendicular to the segments u and v.

    A segment counts if its closest point, at s or t, lies in its interior.
    """
    uu, vv, uv = dot3(u, u), dot3(v, v), dot3(u, v)
    a, b = 0.0, 0.0
    inner_u, inner_v = 0.0 < s < 1.0 and uu > 0.0, 0.0 < t < 1.0 and vv > 0.0
    determinant = uu * vv - uv * uv
    if inner_u and inner_v:
        # The common perpendicular of nearly parallel segments has no steady rate.
        if determinant > 1e-12 * uu * vv:
            f, g = -dot3(n, du), -dot3(n, dv)
            a, b = (f * vv - g * uv) / determinant, (g * uu - f * uv) / determinant
    elif inner_u:
        a = -dot3(n, du) / uu
    elif inner_v:
        b = -dot3(n, dv) / vv
    return (a * u[0] + b * v[0], a * u[1] + b * v[1], a * u[2] + b * v[2])


@helper
def least_on_axis(n: Vector, m: Vector, w: Vector, dw: Vector, half: float) -> float:
    """Return the minimum of (n + t m)·(w + t dw) for |t| up to half."""
    a, b, c = dot3(n, w), dot3(n, dw) + dot3(m, w), dot3(m, dw)
    least = a - abs(b) * half + c * half * half
    if c > 0.0 and abs(b) < 2.0 * c * half:
        least = a - b * b / (4.0 * c)
    return least


@helper
def bound_interval(
    i: int,
    j: int,
    middle: float,
    half: float,
    start: FloatArray,
    step: FloatArray,
    angle: float,
    parts: FloatArray,
    a3: FloatArray,
) -> tuple[float, float]:
    """Return the distance of two legs at the middle of an interval, and a lower bound over it."""
    p, dp = platform_end(i, middle, start, step, angle, parts)
    q, dq = platform_end(j, middle, start, step, angle, parts)
    a, da = base_end(i, p, dp, a3)
    b, db = base_end(j, q, dq, a3)
    u, v, r = minus(p, a), minus(q, b), minus(a, b)
    s, t = closest_shares(u, v, r)
    distance = math.sqrt(square_at(s, t, u, v, r))
    tangent_errors = tangent_error(i, half, angle, parts) + tangent_error(j, half, angle, parts)
    d0, d1, d2, d3 = minus(da, db), minus(dp, db), minus(da, dq), minus(dp, dq)
    fastest = math.sqrt(max(dot3(d0, d0), dot3(d1, d1), dot3(d2, d2), dot3(d3, d3)))
    bound = distance - half * fastest
    if distance > 0.0:
        n = (
            (r[0] + s * u[0] - t * v[0]) / distance,
            (r[1] + s * u[1] - t * v[1]) / distance,
            (r[2] + s * u[2] - t * v[2]) / distance,
        )
        m = normal_rate(n, u, minus(dp, da), v, minus(dq, db), s, t)
        least = min(
            least_on_axis(n, m, r, d0, half),
            least_on_axis(n, m, minus(p, b), d1, half),
            least_on_axis(n, m, minus(a, q), d2, half),
            least_on_axis(n, m, minus(p, q), d3, half),
        )
        length = math.sqrt(1.0 + half * (2.0 * abs(dot3(n, m)) + half * dot3(m, m)))
        if least > 0.0:
            bound = max(bound, least / length)
    return distance, max(0.0, bound - tangent_errors)


@kernel(
    "void(f8[:,::1], f8[:,::1], f8[::1], f8[:,:,:,::1], f8[::1], f8[::1], f8[::1],"
    " f8[:,::1], f8[:,::1], f8[:,::1])"
)
def least_rows(
    start: FloatArray,
    step: FloatArray,
    angle: FloatArray,
    parts: FloatArray,
    a3: FloatArray,
    tolerance: FloatArray,
    target: FloatArray,
    bound: FloatArray,
    least: FloatArray,
    share: FloatArray,
) -> None:
    """Write the least distance of each pair of legs over n moves, and a lower bound of it.

    A point starts at `start` (n, 3) and goes by `step` (n, 3) while the platform turns by `angle`
    (n,); `parts` (n, 4, 3, 3) are those of `explorer.legs.moves`. The search of a pair ends within
    the tolerance (n,), or once it is certain whether the least distance is greater than the target
    (6,): NaN for a search to the tolerance, −inf for a pair to leave out, of which nothing is
    written.
    """
    middles, halves = np.zeros(DEEPEST), np.zeros(DEEPEST)
    for row in range(start.shape[0]):
        pair = -1
        for i in range(3):
            for j in range(i + 1, 4):
                pair += 1
                pair_target = target[pair]
                if pair_target == -math.inf:
                    continue
                best, best_share, least_bound = math.inf, 0.0, math.inf
                # A good estimate saves halvings in the search for the least distance only.
                for k in range(SAMPLES + 1 if math.isnan(pair_target) else 0):
                    t = k / SAMPLES
                    distance, _ = bound_interval(
                        i, j, t, 0.0, start[row], step[row], angle[row], parts[row], a3
                    )
                    if distance < best:
                        best, best_share = distance, t
                middles[0], halves[0] = 0.5, 0.5
                queued = 1
                while queued > 0:
                    queued -= 1
                    t, half = middles[queued], halves[queued]
                    distance, low = bound_interval(
                        i, j, t, half, start[row], step[row], angle[row], parts[row], a3
                    )
                    if distance < best:
                        best, best_share = distance, t
                    if best <= pair_target:
                        # The least is not greater than the target: the rest needs no bound.
                        least_bound = 0.0
                        break
                    if low >= best - tolerance[row] or low > pair_target or queued + 2 > DEEPEST:
                        least_bound = min(least_bound, low)
                        continue
                    half *= 0.5
                    # The half nearer to the least so far comes first.
                    near = half if best_share > t else -half
                    middles[queued], halves[queued] = t - near, half
                    middles[queued + 1], halves[queued + 1] = t + near, half
                    queued += 2
                bound[row, pair] = min(least_bound, best)
                least[row, pair] = best
                share[row, pair] = best_share
