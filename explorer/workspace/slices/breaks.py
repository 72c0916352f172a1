"""Breaks of a region: values of x at which its slices gain or lose an arc.

Between two breaks the area of the slices is analytic. A break is at a pole of a sphere, where
two curves of the slices touch, or at a vertex, where three surfaces meet. Circles and planes are
rows of `explorer.workspace.limits.region`.
"""

from __future__ import annotations

import math

import numpy as np

from explorer.numerics.arrays import FloatArray
from explorer.numerics.compiled import helper
from explorer.workspace.limits.region import IS_BALL, OFFSET, RADIUS, X, Y, Z
from explorer.workspace.slices.break_points import (
    Boundary,
    add_break,
    add_breaks_at_height,
    real_roots,
    region_size,
    slack_at,
)
from explorer.workspace.slices.vertices import add_breaks_at_vertices

# Breaks closer together than this share of the x-range are merged.
SAME_BREAK = 1e-13


@helper
def add_breaks_of_pair(boundary: Boundary, j: int, k: int) -> None:
    """Add breaks where the circles j and k touch."""
    circles = boundary.circles
    if circles[j, IS_BALL] == 0.0 and circles[k, IS_BALL] == 0.0:
        return
    dy, dz = circles[k, Y] - circles[j, Y], circles[k, Z] - circles[j, Z]
    distance = math.sqrt(dy * dy + dz * dz)
    slack = slack_at(boundary, distance / boundary.size)
    # Concentric circles touch at every point, so any direction serves.
    ty, tz = (dy / distance, dz / distance) if distance > 0.0 else (1.0, 0.0)
    if circles[j, IS_BALL] == 0.0 or circles[k, IS_BALL] == 0.0:
        ball, cylinder = (j, k) if circles[j, IS_BALL] > 0.0 else (k, j)
        for radius in (-circles[cylinder, RADIUS], circles[cylinder, RADIUS]):
            y, z = circles[cylinder, Y] + radius * ty, circles[cylinder, Z] + radius * tz
            add_breaks_at_height(boundary, ball, y, z, slack)
        return
    xj, rj, xk, rk = circles[j, X], circles[j, RADIUS], circles[k, X], circles[k, RADIUS]
    # The squared radii of the two circles differ by alpha + beta x.
    beta = 2.0 * (xj - xk)
    alpha = (rj - rk) * (rj + rk) - (xj - xk) * (xj + xk)
    if distance == 0.0:
        x, _ = real_roots(0.0, beta, alpha)
        add_break(boundary, x, circles[j, Y], circles[j, Z], slack)
        return
    # They touch where r_j = |d² + alpha + beta x| / 2d, the distance of the point from centre j.
    per = 1.0 / (4.0 * distance * distance)
    shifted = distance * distance + alpha
    for x in real_roots(
        beta * beta * per + 1.0,
        2.0 * shifted * beta * per - 2.0 * xj,
        shifted * shifted * per + xj * xj - rj * rj,
    ):
        along = 0.5 * (shifted + beta * x) / distance
        y, z = circles[j, Y] + along * ty, circles[j, Z] + along * tz
        add_break(boundary, x, y, z, slack)


@helper
def add_breaks_of_line(boundary: Boundary, k: int) -> None:
    """Add breaks where line k touches circles."""
    circles, planes = boundary.circles, boundary.planes
    slack = slack_at(boundary, 1.0)
    ax, ay, az = planes[k, X], planes[k, Y], planes[k, Z]
    norm = math.sqrt(ay * ay + az * az)
    ax, ay, az = ax / norm, ay / norm, az / norm
    for j in range(circles.shape[0]):
        # The line touches where its distance from the centre is the radius: (rest - ax x)² = r².
        rest = planes[k, OFFSET] / norm - ay * circles[j, Y] - az * circles[j, Z]
        x, r, ball = circles[j, X], circles[j, RADIUS], circles[j, IS_BALL]
        for root in real_roots(
            ax * ax + ball,
            -2.0 * (rest * ax + ball * x),
            rest * rest - r * r + ball * x * x,
        ):
            along = rest - ax * root
            y, z = circles[j, Y] + along * ay, circles[j, Z] + along * az
            add_break(boundary, root, y, z, slack)


@helper
def add_breaks_at_tangencies(boundary: Boundary) -> None:
    """Add breaks at the poles of spheres, and where circles and lines touch circles."""
    circles, n = boundary.circles, boundary.circles.shape[0]
    for j in range(n):
        if circles[j, IS_BALL] > 0.0:
            y, z, slack = circles[j, Y], circles[j, Z], slack_at(boundary, 1.0)
            add_breaks_at_height(boundary, j, y, z, slack)
        for k in range(j + 1, n):
            add_breaks_of_pair(boundary, j, k)
    for k in range(boundary.planes.shape[0]):
        add_breaks_of_line(boundary, k)


@helper
def find_breaks(
    circles: FloatArray, planes: FloatArray, low: float, high: float, breaks: FloatArray
) -> int:
    """Write low, the breaks in between and high, in ascending order; return the count."""
    breaks[0], breaks[1] = low, high
    number = np.full(1, 2)
    boundary = Boundary(circles, planes, region_size(circles), breaks, number)
    add_breaks_at_tangencies(boundary)
    add_breaks_at_vertices(boundary)
    count = number[0]
    for i in range(2, count):
        x, j = breaks[i], i - 1
        while breaks[j] > x:
            breaks[j + 1] = breaks[j]
            j -= 1
        breaks[j + 1] = x
    tolerance = SAME_BREAK * (high - low)
    distinct = 1
    for i in range(1, count - 1):
        if breaks[distinct - 1] + tolerance < breaks[i] < high - tolerance:
            breaks[distinct] = breaks[i]
            distinct += 1
    breaks[distinct] = high
    return distinct + 1
