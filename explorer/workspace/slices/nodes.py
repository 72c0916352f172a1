"""Kernels that look at positions one by one, or at columns of them: nodes and cones.

Rows of balls, cylinders, planes and cones as in `explorer.workspace.limits.region`.
"""

from __future__ import annotations

import math

import numpy as np

from explorer.numerics.arrays import FloatArray, IntArray
from explorer.numerics.compiled import helper, kernel

# Ends of z-intervals in one column: two a surface and two of the column.
ENDS = 64
DOUBLE_ROOT = 1e-12


@helper
def keeps_all(
    x: float,
    y: float,
    z: float,
    rounds: FloatArray,
    planes: FloatArray,
    cones: FloatArray,
    slack: float,
) -> bool:
    """Whether a position keeps all limits, to within a slack."""
    for k in range(rounds.shape[0]):
        dy, dz = y - rounds[k, 1], z - rounds[k, 2]
        square = dy * dy + dz * dz
        if rounds[k, 4] > 0.0:
            dx = x - rounds[k, 0]
            square += dx * dx
        edge = rounds[k, 3] + (slack if rounds[k, 5] > 0.0 else -slack)
        if edge > 0.0 and (square - edge * edge) * rounds[k, 5] > 0.0:
            return False
        if edge <= 0.0 and rounds[k, 5] > 0.0:
            return False
    for k in range(planes.shape[0]):
        if planes[k, 0] * x + planes[k, 1] * y + planes[k, 2] * z > planes[k, 3] + slack:
            return False
    for k in range(cones.shape[0]):
        dx = 0.0 if cones[k, 7] > 0.0 else x - cones[k, 0]
        dy, dz = y - cones[k, 1], z - cones[k, 2]
        along = dx * cones[k, 3] + dy * cones[k, 4] + dz * cones[k, 5]
        if along < cones[k, 6] * math.sqrt(dx * dx + dy * dy + dz * dz) - slack:
            return False
    return True


@kernel("void(f8[:,::1], f8[:,::1], f8[:,::1], f8[::1], f8, f8[::1], i8[::1], f8, i8[::1])")
def count_nodes(
    rounds: FloatArray,
    planes: FloatArray,
    cones: FloatArray,
    ends: FloatArray,
    slack: float,
    first: FloatArray,
    counts: IntArray,
    step: float,
    found: IntArray,
) -> None:
    """Count the nodes of a grid that keep all limits.

    Args:
        rounds: Shape (n, 6).
        planes: Shape (m, 4).
        cones: Shape (k, 8).
        ends: Of the x-range, shape (2,).
        slack: Within which a limit counts as kept.
        first: Index of the first node on each axis, shape (3,); a node is index times step.
        counts: Nodes on each axis, shape (3,).
        step: Of the grid.
        found: Written: their number, and the lowest and highest indices, shape (7,).
    """
    found[0] = 0
    for i in range(counts[0]):
        x = (first[0] + i) * step
        if x < ends[0] or x > ends[1]:
            continue
        for j in range(counts[1]):
            y = (first[1] + j) * step
            for k in range(counts[2]):
                z = (first[2] + k) * step
                if not keeps_all(x, y, z, rounds, planes, cones, slack):
                    continue
                at = (int(first[0]) + i, int(first[1]) + j, int(first[2]) + k)
                for axis in range(3):
                    if found[0] == 0 or at[axis] < found[1 + axis]:
                        found[1 + axis] = at[axis]
                    if found[0] == 0 or at[axis] > found[4 + axis]:
                        found[4 + axis] = at[axis]
                found[0] += 1


@helper
def add_crossings(a: float, b: float, c: float, ends: FloatArray, count: int) -> int:
    """Add the real roots of a z² + 2 b z + c to the ends and return how many there are."""
    if a == 0.0:
        if b != 0.0:
            ends[count] = -0.5 * c / b
            count += 1
        return count
    square = b * b - a * c
    # Rounding may hide a double root, which a cone of 90° has; one too many does no harm.
    if square > -DOUBLE_ROOT * b * b:
        root = math.sqrt(max(0.0, square))
        ends[count], ends[count + 1] = (-b - root) / a, (-b + root) / a
        count += 2
    return count


@kernel("void(f8[:,::1], f8[:,::1], f8[:,::1], f8[::1], f8[::1], i8, f8[::1])")
def column_lengths(
    rounds: FloatArray,
    planes: FloatArray,
    cones: FloatArray,
    lows: FloatArray,
    highs: FloatArray,
    many: int,
    total: FloatArray,
) -> None:
    """Add up the exact z-lengths of the region in columns at the centres of many² cells.

    Args:
        rounds: Shape (n, 6).
        planes: Shape (m, 4).
        cones: Shape (k, 8).
        lows: Of a box that holds the region, shape (3,).
        highs: Of that box, shape (3,).
        many: Cells on each of x and y.
        total: Written: the sum of the lengths, shape (1,).
    """
    ends = np.zeros(ENDS)
    total[0] = 0.0
    for i in range(many):
        x = lows[0] + (highs[0] - lows[0]) * (i + 0.5) / many
        for j in range(many):
            y = lows[1] + (highs[1] - lows[1]) * (j + 0.5) / many
            ends[0], ends[1] = lows[2], highs[2]
            count = 2
            for k in range(rounds.shape[0]):
                dy, dx = y - rounds[k, 1], rounds[k, 4] * (x - rounds[k, 0])
                rest = dx * dx + dy * dy - rounds[k, 3] * rounds[k, 3]
                zc = rounds[k, 2]
                count = add_crossings(1.0, -zc, zc * zc + rest, ends, count)
            for k in range(planes.shape[0]):
                rest = planes[k, 0] * x + planes[k, 1] * y - planes[k, 3]
                count = add_crossings(0.0, 0.5 * planes[k, 2], rest, ends, count)
            for k in range(cones.shape[0]):
                dx = 0.0 if cones[k, 7] > 0.0 else x - cones[k, 0]
                dy, zc = y - cones[k, 1], cones[k, 2]
                # (off·axis)² = cos² |off|², as a polynomial in z - zc.
                flat = dx * cones[k, 3] + dy * cones[k, 4]
                square = cones[k, 6] * cones[k, 6]
                a = cones[k, 5] * cones[k, 5] - square
                b = flat * cones[k, 5]
                c = flat * flat - square * (dx * dx + dy * dy)
                count = add_crossings(a, b - a * zc, a * zc * zc - 2.0 * b * zc + c, ends, count)
            kept = np.sort(ends[:count])
            for k in range(count - 1):
                low, high = max(kept[k], lows[2]), min(kept[k + 1], highs[2])
                if high > low and keeps_all(x, y, 0.5 * (low + high), rounds, planes, cones, 0.0):
                    total[0] += high - low
