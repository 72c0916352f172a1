"""Lower bounds of the distance between two legs over a whole interval of a move.

Two bounds, of which the better counts. First, the distance of two segments changes no more
than the farthest that an end of one moves relative to an end of the other. Second, for any
direction n the distance is at least the least n·(X − Y)/|n| over the ends X and Y of the
two: with the n of the closest points, turning with the legs to first order, it falls short
of the truth by the square of the interval only.
"""

from __future__ import annotations

import math

import numpy as np

from explorer.legs.segments import Vector, closest_shares, dot3, minus, square_at
from explorer.numerics.arrays import FloatArray
from explorer.numerics.compiled import helper, kernel

# Of a move, looked at first.
SAMPLES = 8
# Intervals that wait are at most as many as halvings.
DEEPEST = 60


@helper
def end_at(
    leg: int,
    t: float,
    start: FloatArray,
    step: FloatArray,
    angle: float,
    parts: FloatArray,
) -> tuple[Vector, Vector]:
    """Return where a leg's platform end is at t, and how fast it moves."""
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
def base_of(leg: int, end: Vector, velocity: Vector, a3: FloatArray) -> tuple[Vector, Vector]:
    """Return the base end of a leg whose platform end is here, and how fast it moves."""
    if leg == 0:
        return (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)
    if leg == 3:
        return (a3[0], a3[1], a3[2]), (0.0, 0.0, 0.0)
    return (end[0], 0.0, 0.0), (velocity[0], 0.0, 0.0)


@helper
def bend(leg: int, half: float, angle: float, parts: FloatArray) -> float:
    """Return how far an end may get from its tangent within half an interval."""
    x, y, z = parts[leg, 1, 0], parts[leg, 1, 1], parts[leg, 1, 2]
    turn = angle * half
    return 0.5 * turn * turn * math.sqrt(x * x + y * y + z * z)


@helper
def turning(n: Vector, u: Vector, du: Vector, v: Vector, dv: Vector, s: float, t: float) -> Vector:
    """Return how a direction has to turn to stay perpendicular to the segments.

    Only to those in whose interior the closest point lies, at s along u and t along v.
    """
    uu, vv, uv = dot3(u, u), dot3(v, v), dot3(u, v)
    a, b = 0.0, 0.0
    inner_u, inner_v = 0.0 < s < 1.0 and uu > 0.0, 0.0 < t < 1.0 and vv > 0.0
    determinant = uu * vv - uv * uv
    if inner_u and inner_v:
        # Nearly parallel ones have no common perpendicular that lasts.
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
    """Return the least (n + t m)·(w + t dw) for |t| up to half."""
    a, b, c = dot3(n, w), dot3(n, dw) + dot3(m, w), dot3(m, dw)
    least = a - abs(b) * half + c * half * half
    if c > 0.0 and abs(b) < 2.0 * c * half:
        least = a - b * b / (4.0 * c)
    return least


@helper
def look(
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
    """Return the distance of two legs in the middle of an interval and a bound over all of it."""
    p, dp = end_at(i, middle, start, step, angle, parts)
    q, dq = end_at(j, middle, start, step, angle, parts)
    a, da = base_of(i, p, dp, a3)
    b, db = base_of(j, q, dq, a3)
    u, v, r = minus(p, a), minus(q, b), minus(a, b)
    s, t = closest_shares(u, v, r)
    distance = math.sqrt(square_at(s, t, u, v, r))
    bends = bend(i, half, angle, parts) + bend(j, half, angle, parts)
    d0, d1, d2, d3 = minus(da, db), minus(dp, db), minus(da, dq), minus(dp, dq)
    fastest = math.sqrt(max(dot3(d0, d0), dot3(d1, d1), dot3(d2, d2), dot3(d3, d3)))
    bound = distance - half * fastest
    if distance > 0.0:
        n = (
            (r[0] + s * u[0] - t * v[0]) / distance,
            (r[1] + s * u[1] - t * v[1]) / distance,
            (r[2] + s * u[2] - t * v[2]) / distance,
        )
        m = turning(n, u, minus(dp, da), v, minus(dq, db), s, t)
        least = min(
            least_on_axis(n, m, r, d0, half),
            least_on_axis(n, m, minus(p, b), d1, half),
            least_on_axis(n, m, minus(a, q), d2, half),
            least_on_axis(n, m, minus(p, q), d3, half),
        )
        length = math.sqrt(1.0 + half * (2.0 * abs(dot3(n, m)) + half * dot3(m, m)))
        if least > 0.0:
            bound = max(bound, least / length)
    return distance, max(0.0, bound - bends)


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
    """Write for each move and each pair of legs the least distance and a bound of it.

    Args:
        start: Of b4, shape (n, 3).
        step: By which it goes, shape (n, 3).
        angle: By which the platform turns, shape (n,).
        parts: Of each leg's platform end, see `explorer.legs.moves`, shape (n, 4, 3, 3).
        a3: Shape (3,).
        tolerance: Within which the bound is to be, shape (n,).
        target: A distance for each pair, shape (6,); all that is asked is whether there is
            more. NaN where more is asked, −inf to leave a pair out.
        bound: Written but for pairs left out, shape (n, 6).
        least: Likewise, the least distance found, shape (n, 6).
        share: Likewise, how far into the move that is, shape (n, 6).
    """
    middles, halves = np.zeros(DEEPEST), np.zeros(DEEPEST)
    for row in range(start.shape[0]):
        pair = -1
        for i in range(3):
            for j in range(i + 1, 4):
                pair += 1
                enough = target[pair]
                if enough == -math.inf:
                    continue
                best, where, lowest = math.inf, 0.0, math.inf
                # To find the least, a good guess saves halvings; to decide, it does not.
                for k in range(SAMPLES + 1 if math.isnan(enough) else 0):
                    t = k / SAMPLES
                    distance, _ = look(
                        i, j, t, 0.0, start[row], step[row], angle[row], parts[row], a3
                    )
                    if distance < best:
                        best, where = distance, t
                middles[0], halves[0] = 0.5, 0.5
                waiting = 1
                while waiting > 0:
                    waiting -= 1
                    t, half = middles[waiting], halves[waiting]
                    distance, low = look(
                        i, j, t, half, start[row], step[row], angle[row], parts[row], a3
                    )
                    if distance < best:
                        best, where = distance, t
                    if best <= enough:
                        # It is known that there is no more: the rest has no bound.
                        lowest = 0.0
                        break
                    if low >= best - tolerance[row] or low > enough or waiting + 2 > DEEPEST:
                        lowest = min(lowest, low)
                        continue
                    half *= 0.5
                    # That beside the least so far comes first.
                    near = half if where > t else -half
                    middles[waiting], halves[waiting] = t - near, half
                    middles[waiting + 1], halves[waiting + 1] = t + near, half
                    waiting += 2
                bound[row, pair] = min(lowest, best)
                least[row, pair] = best
                share[row, pair] = where
