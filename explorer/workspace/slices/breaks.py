"""Breaks of a region: values of x at which its slices gain or lose an arc.

Between two breaks the area of the slices is analytic. A break is at a pole of a sphere, where
two curves of the slices touch, or at a vertex (`explorer.workspace.slices.vertices`). Only points
on the boundary of the region count; elsewhere surfaces may meet without effect. Rounding may move a
point off the surfaces that it was computed from, so it may violate limits by a slack. The slack is
wide, since one break too many costs time and one too few makes the volume wrong. Circles and planes
are rows of `explorer.workspace.limits.region`.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from explorer.numerics.arrays import FloatArray, IntArray
from explorer.numerics.compiled import helper
from explorer.workspace.limits.region import IS_BALL, OFFSET, RADIUS, SIDE, X, Y, Z

# A point that violates a limit by less than this share of the region's size may lie on it.
NEAR = 1e-7
# The slack grows where surfaces meet at an angle whose sine is smaller than this.
BLURRED = 1e-6


class Boundary(NamedTuple):
    """The surfaces of a region and the breaks found on them.

    Attributes:
        circles: Rows, shape (n, 6).
        planes: Rows, shape (m, 4).
        size: Bound of the region's size, see `region_size`.
        breaks: Breaks; the first two are the ends of the x-range.
        number: Number of breaks, shape (1,).
    """

    circles: FloatArray
    planes: FloatArray
    size: float
    breaks: FloatArray
    number: IntArray


@helper
def region_size(circles: FloatArray) -> float:
    """Return the largest |coordinate| plus radius of a region's circles: a bound of its size."""
    size = 0.0
    for k in range(circles.shape[0]):
        for axis in range(3):
            size = max(size, abs(circles[k, axis]) + circles[k, RADIUS])
    return size


@helper
def slack_at(boundary: Boundary, sine: float) -> float:
    """Return the slack of a point where surfaces meet at an angle with the given sine."""
    return NEAR * boundary.size * (1.0 + BLURRED / sine) if sine > 0.0 else math.inf


@helper
def add_break(boundary: Boundary, x: float, y: float, z: float, slack: float) -> None:
    """Add a break at x if (x, y, z) satisfies all limits to within a slack."""
    circles, planes, breaks = boundary.circles, boundary.planes, boundary.breaks
    count = boundary.number[0]
    if count + 1 == breaks.shape[0] or not breaks[0] < x < breaks[1]:
        return
    for k in range(circles.shape[0]):
        dx, dy, dz = circles[k, IS_BALL] * (x - circles[k, X]), y - circles[k, Y], z - circles[k, Z]
        excess = math.sqrt(dx * dx + dy * dy + dz * dz) - circles[k, RADIUS]
        if circles[k, SIDE] * excess > slack:
            return
    for k in range(planes.shape[0]):
        ax, ay, az = planes[k, X], planes[k, Y], planes[k, Z]
        excess = ax * x + ay * y + az * z - planes[k, OFFSET]
        if excess > slack * math.sqrt(ax * ax + ay * ay + az * az):
            return
    breaks[count] = x
    boundary.number[0] = count + 1


@helper
def real_roots(a: float, b: float, c: float) -> tuple[float, float]:
    """Return the real roots of a x² + b x + c, nan in place of each missing one."""
    if a == 0.0:
        return (-c / b if b != 0.0 else math.nan), math.nan
    square = b * b - 4.0 * a * c
    if square < 0.0:
        return math.nan, math.nan
    # This form avoids cancellation.
    q = -0.5 * (b + math.copysign(math.sqrt(square), b))
    return q / a, (c / q if q != 0.0 else math.nan)


@helper
def add_breaks_at_height(boundary: Boundary, ball: int, y: float, z: float, slack: float) -> None:
    """Add breaks where the line along x through (y, z) meets a sphere."""
    circles = boundary.circles
    dy, dz = y - circles[ball, Y], z - circles[ball, Z]
    square = circles[ball, RADIUS] * circles[ball, RADIUS] - dy * dy - dz * dz
    if square >= 0.0:
        half = math.sqrt(square)
        x = circles[ball, X]
        add_break(boundary, x - half, y, z, slack)
        add_break(boundary, x + half, y, z, slack)


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
            ax * ax + ball, -2.0 * (rest * ax + ball * x), rest * rest - r * r + ball * x * x
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
