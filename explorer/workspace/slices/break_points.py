"""Break points: values of x at which the boundary of a region changes.

Only points on the boundary of the region count; elsewhere surfaces may meet without effect.
Rounding may move a point off the surfaces that it was computed from, so it may violate limits by
a slack. The slack is wide, since one break too many costs time and one too few makes the volume
wrong. Circles and planes are rows of `explorer.workspace.limits.columns`.
"""

from __future__ import annotations

import math

from explorer.numerics.arrays import FloatArray
from explorer.numerics.compiled import helper
from explorer.workspace.limits.columns import IS_BALL, OFFSET, RADIUS, SIDE, X, Y, Z

# A point that violates a limit by less than this share of the region's size may lie on it.
NEAR = 1e-7
# The slack grows where surfaces meet at an angle whose sine is smaller than this.
BLURRED = 1e-6


@helper
def region_size(circles: FloatArray) -> float:
    """Return the largest |coordinate| plus radius of a region's circles: a bound of its size."""
    size = 0.0
    for k in range(circles.shape[0]):
        for axis in range(3):
            size = max(size, abs(circles[k, axis]) + circles[k, RADIUS])
    return size


@helper
def slack_at(size: float, sine: float) -> float:
    """Return the slack of a point where surfaces meet at an angle with the given sine."""
    return NEAR * size * (1.0 + BLURRED / sine) if sine > 0.0 else math.inf


@helper
def add_break(
    circles: FloatArray,
    planes: FloatArray,
    x: float,
    y: float,
    z: float,
    slack: float,
    breaks: FloatArray,
    count: int,
) -> int:
    """Add a break at x if (x, y, z) satisfies all limits to within a slack; return the count.

    The first two breaks are the ends of the x-range.
    """
    if count + 1 == breaks.shape[0] or not breaks[0] < x < breaks[1]:
        return count
    for k in range(circles.shape[0]):
        dx, dy, dz = circles[k, IS_BALL] * (x - circles[k, X]), y - circles[k, Y], z - circles[k, Z]
        beyond = math.sqrt(dx * dx + dy * dy + dz * dz) - circles[k, RADIUS]
        if circles[k, SIDE] * beyond > slack:
            return count
    for k in range(planes.shape[0]):
        ax, ay, az = planes[k, X], planes[k, Y], planes[k, Z]
        beyond = ax * x + ay * y + az * z - planes[k, OFFSET]
        if beyond > slack * math.sqrt(ax * ax + ay * ay + az * az):
            return count
    breaks[count] = x
    return count + 1


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
def add_breaks_at_height(
    circles: FloatArray,
    planes: FloatArray,
    ball: int,
    y: float,
    z: float,
    slack: float,
    breaks: FloatArray,
    count: int,
) -> int:
    """Add breaks where the line along x through (y, z) meets a sphere."""
    dy, dz = y - circles[ball, Y], z - circles[ball, Z]
    square = circles[ball, RADIUS] * circles[ball, RADIUS] - dy * dy - dz * dz
    if square >= 0.0:
        half = math.sqrt(square)
        x = circles[ball, X]
        count = add_break(circles, planes, x - half, y, z, slack, breaks, count)
        count = add_break(circles, planes, x + half, y, z, slack, breaks, count)
    return count
