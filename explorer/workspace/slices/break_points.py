"""Points where the boundary of a region changes along x, counted only where they bound it.

A point that breaks a limit bounds nothing, whichever surfaces meet there. Rounding may put a
point off the surfaces that it was computed from, so it may break limits by a slack, which is
wide: a break too many costs time, one too few costs the volume. Rows as in
    `explorer.workspace.slices.arcs`.
"""

from __future__ import annotations

import math

from explorer.numerics.arrays import FloatArray
from explorer.numerics.compiled import helper

# A point that breaks a limit by less than this share of the region's size may lie on it.
NEAR = 1e-7
# The sine of an angle below which rounding moves the point where surfaces meet by more.
BLURRED = 1e-6


@helper
def region_size(circles: FloatArray) -> float:
    """Return the size of the numbers that a region is computed from: its farthest surface."""
    size = 0.0
    for k in range(circles.shape[0]):
        for axis in range(3):
            size = max(size, abs(circles[k, axis]) + circles[k, 3])
    return size


@helper
def slack_at(size: float, sine: float) -> float:
    """Return by how much a point may break limits that is known as well as a sine allows."""
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
    """Add a break at a point that keeps all limits to within a slack, and return their count.

    The first two breaks are the ends of the x-range.
    """
    if count + 1 == breaks.shape[0] or not breaks[0] < x < breaks[1]:
        return count
    for k in range(circles.shape[0]):
        dx, dy, dz = circles[k, 4] * (x - circles[k, 0]), y - circles[k, 1], z - circles[k, 2]
        beyond = math.sqrt(dx * dx + dy * dy + dz * dz) - circles[k, 3]
        if circles[k, 5] * beyond > slack:
            return count
    for k in range(planes.shape[0]):
        ax, ay, az = planes[k, 0], planes[k, 1], planes[k, 2]
        beyond = ax * x + ay * y + az * z - planes[k, 3]
        if beyond > slack * math.sqrt(ax * ax + ay * ay + az * az):
            return count
    breaks[count] = x
    return count + 1


@helper
def real_roots(a: float, b: float, c: float) -> tuple[float, float]:
    """Return the real roots of a x² + b x + c, nan for each that there is not."""
    if a == 0.0:
        return (-c / b if b != 0.0 else math.nan), math.nan
    square = b * b - 4.0 * a * c
    if square < 0.0:
        return math.nan, math.nan
    # The form without cancellation.
    q = -0.5 * (b + math.copysign(math.sqrt(square), b))
    return q / a, (c / q if q != 0.0 else math.nan)


@helper
def breaks_at_height(
    circles: FloatArray,
    planes: FloatArray,
    ball: int,
    y: float,
    z: float,
    slack: float,
    breaks: FloatArray,
    count: int,
) -> int:
    """Add where a line along x through (y, z) meets a ball."""
    dy, dz = y - circles[ball, 1], z - circles[ball, 2]
    square = circles[ball, 3] * circles[ball, 3] - dy * dy - dz * dz
    if square >= 0.0:
        half = math.sqrt(square)
        x = circles[ball, 0]
        count = add_break(circles, planes, x - half, y, z, slack, breaks, count)
        count = add_break(circles, planes, x + half, y, z, slack, breaks, count)
    return count
