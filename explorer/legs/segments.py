"""Closest points of two line segments, as functions that kernels call.

Parallel, touching, crossing and zero-length segments need no special case. The least distance
is that of the two lines, if their closest points lie within both segments, or else that of an
end of one segment from the other. See V. J. Lumelsky, "On fast computation of distance
between line segments" (1985).
"""

from __future__ import annotations

import math

from explorer.numerics.arrays import FloatArray
from explorer.numerics.compiled import helper
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
