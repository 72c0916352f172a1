"""Lower bounds of the distance between two legs over a whole interval of a move.

The result is the greater of two bounds. First, the distance of two segments changes by no more
than the greatest relative motion of an end of one and an end of the other. Second, for any
direction n the distance is at least the minimum of n·(X − Y)/|n| over the ends X and Y of the two
segments. If n is the direction of the closest points and turns with the legs to first order, the
error of this bound falls with the square of the interval.
"""

from __future__ import annotations

import math

import numpy as np

from explorer.legs.clearance import closest_shares, square_at
from explorer.numerics.arrays import FloatArray
from explorer.numerics.compiled import helper, kernel
from explorer.numerics.vectors import Vector, dot3, minus

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
