"""Kernels over single positions (node counts) and over columns of them (volumes within cones).

Circles, planes and cones are rows of `explorer.workspace.limits.region`.
"""

from __future__ import annotations

import math

import numpy as np

from explorer.numerics.arrays import BoolArray, FloatArray
from explorer.numerics.compiled import helper, kernel
from explorer.workspace.limits.region import (
    AXIS_X,
    AXIS_Y,
    AXIS_Z,
    COSINE,
    IS_BALL,
    IS_FLAT,
    OFFSET,
    RADIUS,
    SIDE,
    X,
    Y,
    Z,
)

# The most ends of z-intervals in one column: two for each surface and two of the column.
ENDS = 64
# A discriminant that is negative by less than this share of b² counts as zero.
DOUBLE_ROOT = 1e-12


@helper
def is_within(
    x: float,
    y: float,
    z: float,
    circles: FloatArray,
    planes: FloatArray,
    cones: FloatArray,
    slack: float,
) -> bool:
    """Return whether a position satisfies all limits, to within a slack in design units."""
    for k in range(circles.shape[0]):
        dy, dz = y - circles[k, Y], z - circles[k, Z]
        square = dy * dy + dz * dz
        if circles[k, IS_BALL] > 0.0:
            dx = x - circles[k, X]
            square += dx * dx
        edge = circles[k, RADIUS] + (slack if circles[k, SIDE] > 0.0 else -slack)
        if edge > 0.0 and (square - edge * edge) * circles[k, SIDE] > 0.0:
            return False
        if edge <= 0.0 and circles[k, SIDE] > 0.0:
            return False
    for k in range(planes.shape[0]):
        if planes[k, X] * x + planes[k, Y] * y + planes[k, Z] * z > planes[k, OFFSET] + slack:
            return False
    for k in range(cones.shape[0]):
        dx = 0.0 if cones[k, IS_FLAT] > 0.0 else x - cones[k, X]
        dy, dz = y - cones[k, Y], z - cones[k, Z]
        along = dx * cones[k, AXIS_X] + dy * cones[k, AXIS_Y] + dz * cones[k, AXIS_Z]
        if along < cones[k, COSINE] * math.sqrt(dx * dx + dy * dy + dz * dz) - slack:
            return False
    return True


@kernel("void(f8[:,::1], f8[:,::1], f8[:,::1], f8[::1], f8[::1], f8, b1[:,:,::1])")
def mark_nodes(
    circles: FloatArray,
    planes: FloatArray,
    cones: FloatArray,
    first: FloatArray,
    step: FloatArray,
    slack: float,
    within: BoolArray,
) -> None:
    """Write whether nodes satisfy all limits, to within a slack in design units, (nx, ny, nz).

    The first node and the step on each axis have the shape (3,).
    """
    for i in range(within.shape[0]):
        x = first[0] + i * step[0]
        for j in range(within.shape[1]):
            y = first[1] + j * step[1]
            for k in range(within.shape[2]):
                z = first[2] + k * step[2]
                within[i, j, k] = is_within(x, y, z, circles, planes, cones, slack)


@helper
def add_crossings(a: float, b: float, c: float, ends: FloatArray, count: int) -> int:
    """Add the real roots of a z² + 2 b z + c to the ends and return the count of ends."""
    if a == 0.0:
        if b != 0.0:
            ends[count] = -0.5 * c / b
            count += 1
        return count
    square = b * b - a * c
    # Rounding may hide a double root, which a cone of 90° has; a superfluous end does no harm.
    if square > -DOUBLE_ROOT * b * b:
        root = math.sqrt(max(0.0, square))
        ends[count], ends[count + 1] = (-b - root) / a, (-b + root) / a
        count += 2
    return count


@helper
def sort_ends(ends: FloatArray, count: int) -> None:
    """Sort the first few ends in place."""
    for i in range(1, count):
        end, j = ends[i], i
        while j > 0 and ends[j - 1] > end:
            ends[j] = ends[j - 1]
            j -= 1
        ends[j] = end


@kernel("void(f8[:,::1], f8[:,::1], f8[:,::1], f8[::1], f8[::1], i8, f8[::1])")
def column_lengths(
    circles: FloatArray,
    planes: FloatArray,
    cones: FloatArray,
    lows: FloatArray,
    highs: FloatArray,
    per_axis: int,
    total: FloatArray,
) -> None:
    """Add up the exact z-lengths of a region in columns at the centres of per_axis² cells.

    The cells are those of a box with the ends `lows` and `highs`, which holds the region.
    Written to `total`: the sum of the lengths, shape (1,).
    """
    ends = np.zeros(ENDS)
    total[0] = 0.0
    for i in range(per_axis):
        x = lows[0] + (highs[0] - lows[0]) * (i + 0.5) / per_axis
        for j in range(per_axis):
            y = lows[1] + (highs[1] - lows[1]) * (j + 0.5) / per_axis
            ends[0], ends[1] = lows[2], highs[2]
            count = 2
            for k in range(circles.shape[0]):
                dy, dx = y - circles[k, Y], circles[k, IS_BALL] * (x - circles[k, X])
                rest = dx * dx + dy * dy - circles[k, RADIUS] * circles[k, RADIUS]
                zc = circles[k, Z]
                count = add_crossings(1.0, -zc, zc * zc + rest, ends, count)
            for k in range(planes.shape[0]):
                rest = planes[k, X] * x + planes[k, Y] * y - planes[k, OFFSET]
                count = add_crossings(0.0, 0.5 * planes[k, Z], rest, ends, count)
            for k in range(cones.shape[0]):
                dx = 0.0 if cones[k, IS_FLAT] > 0.0 else x - cones[k, X]
                dy, zc = y - cones[k, Y], cones[k, Z]
                # (off·axis)² = cos² |off|², as a polynomial in z - zc.
                xy_along = dx * cones[k, AXIS_X] + dy * cones[k, AXIS_Y]
                square = cones[k, COSINE] * cones[k, COSINE]
                a = cones[k, AXIS_Z] * cones[k, AXIS_Z] - square
                b = xy_along * cones[k, AXIS_Z]
                c = xy_along * xy_along - square * (dx * dx + dy * dy)
                count = add_crossings(a, b - a * zc, a * zc * zc - 2.0 * b * zc + c, ends, count)
            sort_ends(ends, count)
            for k in range(count - 1):
                low, high = max(ends[k], lows[2]), min(ends[k + 1], highs[2])
                if high > low and is_within(x, y, 0.5 * (low + high), circles, planes, cones, 0.0):
                    total[0] += high - low
