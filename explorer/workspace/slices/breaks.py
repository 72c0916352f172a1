"""Where, along x, the slices of a region gain or lose an arc: the breaks of their area.

Between two breaks the area is analytic. A break is where a ball begins or ends, where two
curves of the slices touch, or a vertex, where three surfaces meet. Rows as in
`explorer.workspace.slices.arcs`.
"""

from __future__ import annotations

import math

from explorer.numerics.arrays import FloatArray
from explorer.numerics.compiled import helper
from explorer.workspace.slices.break_points import (
    add_break,
    breaks_at_height,
    real_roots,
    region_size,
    slack_at,
)
from explorer.workspace.slices.vertices import breaks_at_vertices

# Breaks nearer to each other than this share of the x-range are one.
SAME_BREAK = 1e-13


@helper
def breaks_of_pair(
    circles: FloatArray,
    planes: FloatArray,
    j: int,
    k: int,
    size: float,
    breaks: FloatArray,
    count: int,
) -> int:
    """Add where the circles j and k touch."""
    if circles[j, 4] == 0.0 and circles[k, 4] == 0.0:
        return count
    dy, dz = circles[k, 1] - circles[j, 1], circles[k, 2] - circles[j, 2]
    distance = math.sqrt(dy * dy + dz * dz)
    slack = slack_at(size, distance / size)
    # Circles about one centre touch all around, and any direction will do.
    ty, tz = (dy / distance, dz / distance) if distance > 0.0 else (1.0, 0.0)
    if circles[j, 4] == 0.0 or circles[k, 4] == 0.0:
        ball, tube = (j, k) if circles[j, 4] > 0.0 else (k, j)
        for radius in (-circles[tube, 3], circles[tube, 3]):
            y, z = circles[tube, 1] + radius * ty, circles[tube, 2] + radius * tz
            count = breaks_at_height(circles, planes, ball, y, z, slack, breaks, count)
        return count
    # The squared radii of two balls differ by alpha + beta x.
    beta = 2.0 * (circles[j, 0] - circles[k, 0])
    alpha = (circles[j, 3] - circles[k, 3]) * (circles[j, 3] + circles[k, 3]) - (
        circles[j, 0] - circles[k, 0]
    ) * (circles[j, 0] + circles[k, 0])
    if distance == 0.0:
        x, _ = real_roots(0.0, beta, alpha)
        return add_break(circles, planes, x, circles[j, 1], circles[j, 2], slack, breaks, count)
    # Touching: r_j = |d² + alpha + beta x| / 2d, which is how far the point is from j.
    per = 1.0 / (4.0 * distance * distance)
    shifted = distance * distance + alpha
    for x in real_roots(
        beta * beta * per + 1.0,
        2.0 * shifted * beta * per - 2.0 * circles[j, 0],
        shifted * shifted * per + circles[j, 0] * circles[j, 0] - circles[j, 3] * circles[j, 3],
    ):
        along = 0.5 * (shifted + beta * x) / distance
        y, z = circles[j, 1] + along * ty, circles[j, 2] + along * tz
        count = add_break(circles, planes, x, y, z, slack, breaks, count)
    return count


@helper
def breaks_of_line(
    circles: FloatArray, planes: FloatArray, k: int, size: float, breaks: FloatArray, count: int
) -> int:
    """Add where line k touches circles."""
    slack = slack_at(size, 1.0)
    ax, ay, az = planes[k, 0], planes[k, 1], planes[k, 2]
    norm = math.sqrt(ay * ay + az * az)
    ax, ay, az = ax / norm, ay / norm, az / norm
    for j in range(circles.shape[0]):
        # Its distance from the centre is the radius: (rest - ax x)² = r².
        rest = planes[k, 3] / norm - ay * circles[j, 1] - az * circles[j, 2]
        x, r, ball = circles[j, 0], circles[j, 3], circles[j, 4]
        for root in real_roots(
            ax * ax + ball,
            -2.0 * (rest * ax + ball * x),
            rest * rest - r * r + ball * x * x,
        ):
            along = rest - ax * root
            y, z = circles[j, 1] + along * ay, circles[j, 2] + along * az
            count = add_break(circles, planes, root, y, z, slack, breaks, count)
    return count


@helper
def breaks_at_tangencies(
    circles: FloatArray, planes: FloatArray, size: float, breaks: FloatArray, count: int
) -> int:
    """Add the poles of balls, and where circles and lines touch circles."""
    n = circles.shape[0]
    for j in range(n):
        if circles[j, 4] > 0.0:
            y, z, slack = circles[j, 1], circles[j, 2], slack_at(size, 1.0)
            count = breaks_at_height(circles, planes, j, y, z, slack, breaks, count)
        for k in range(j + 1, n):
            count = breaks_of_pair(circles, planes, j, k, size, breaks, count)
    for k in range(planes.shape[0]):
        count = breaks_of_line(circles, planes, k, size, breaks, count)
    return count


@helper
def find_breaks(
    circles: FloatArray, planes: FloatArray, low: float, high: float, breaks: FloatArray
) -> int:
    """Write low, high and the breaks between them, sorted, and return their count."""
    size = region_size(circles)
    breaks[0], breaks[1] = low, high
    count = breaks_at_tangencies(circles, planes, size, breaks, 2)
    count = breaks_at_vertices(circles, planes, size, breaks, count)
    for i in range(2, count):
        x, j = breaks[i], i - 1
        while breaks[j] > x:
            breaks[j + 1] = breaks[j]
            j -= 1
        breaks[j + 1] = x
    room = SAME_BREAK * (high - low)
    found = 1
    for i in range(1, count - 1):
        if breaks[found - 1] + room < breaks[i] < high - room:
            breaks[found] = breaks[i]
            found += 1
    breaks[found] = high
    return found + 1
