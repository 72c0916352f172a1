"""Exact volumes of regions bounded by spheres, cylinders along x, and planes.

The area of the slices is integrated along x, piece by piece between its breaks, by
Gauss-Legendre quadrature, which converges to rounding since the pieces are analytic.
Rows of circles and planes as in `explorer.slices`.
"""

from __future__ import annotations

import math

import numpy as np

from explorer.arrays import FloatArray
from explorer.breaks import find_breaks
from explorer.compiled import kernel
from explorer.slices import slice_area

# Pieces that the x-range of one region is cut into at the most.
PIECES = 400
# Arcs that the other curves may forbid on one curve, each twice if it passes angle zero.
MOST = 64
# A break need only be known to this share of a piece: the error is of a higher power.
BISECTED = 1e-6
# A cut this near to an end of a piece, as a share of it, is that end.
SLIVER = 1e-5


@kernel("void(f8[:,::1], f8[:,::1], f8, f8, f8[::1], f8[::1], f8[::1], f8[:,::1], f8[:,::1])")
def integrate_slices(
    circles: FloatArray,
    planes: FloatArray,
    low: float,
    high: float,
    nodes: FloatArray,
    weights: FloatArray,
    result: FloatArray,
    by_circle: FloatArray,
    by_plane: FloatArray,
) -> None:
    """Integrate the area of the slices from low to high, and its derivatives.

    Args:
        circles: Shape (n, 6), see the module; the region is bounded by one at least.
        planes: Shape (m, 4), see the module, none of them perpendicular to x.
        low: Where the region starts along x.
        high: Where it ends.
        nodes: Of the quadrature on [0, 1], shape (g,).
        weights: Of the quadrature on [0, 1], shape (g,).
        result: Written: volume, area at low, area at high, slices computed, pieces.
        by_circle: Written: derivatives by (x, y, z, radius), shape (n, 4).
        by_plane: Written: derivatives by (ax, ay, az, c), shape (m, 4).
    """
    n, m = circles.shape[0], planes.shape[0]
    radii, span = np.zeros(n), np.zeros(8)
    arcs, names = np.zeros((MOST, 2)), np.zeros(MOST, dtype=np.int64)
    moments, bearings = np.zeros((n + m, 3)), np.zeros((n, n + m))
    for k in range(n):
        for j in range(n):
            bearings[k, j] = math.atan2(
                circles[k, 2] - circles[j, 2], circles[k, 1] - circles[j, 1]
            )
        for j in range(m):
            bearings[k, n + j] = math.atan2(planes[j, 2], planes[j, 1])
    breaks = np.zeros(PIECES)
    pieces = find_breaks(circles, planes, low, high, breaks) - 1
    # A stack of pieces, since bisection may cut one into several.
    todo = np.zeros((2 * PIECES + 2, 2))
    for i in range(pieces):
        todo[pieces - 1 - i, 0], todo[pieces - 1 - i, 1] = breaks[i], breaks[i + 1]
    waiting, g = pieces, nodes.shape[0]
    cuts, slices = 0, 0
    marks = np.zeros(g, dtype=np.int64)
    xs, rates, areas = np.zeros(g), np.zeros(g), np.zeros(g)
    kept = np.zeros((g, n + m, 3))
    by_circle[:, :] = 0.0
    by_plane[:, :] = 0.0
    volume = 0.0
    while waiting > 0:
        waiting -= 1
        a, b = todo[waiting, 0], todo[waiting, 1]
        split = -1
        for i in range(g):
            t = nodes[i]
            # Smooth to both ends, where areas begin as powers of 3/2.
            xs[i] = a + (b - a) * t * t * (3.0 - 2.0 * t)
            rates[i] = weights[i] * (b - a) * 6.0 * t * (1.0 - t)
            areas[i], marks[i] = slice_area(
                xs[i], circles, planes, bearings, radii, arcs, names, span, moments
            )
            kept[i] = moments
            if i > 0 and split < 0 and marks[i] != marks[i - 1]:
                split = i
        slices += g
        if split > 0 and cuts < PIECES:
            lower, upper = xs[split - 1], xs[split]
            while upper - lower > BISECTED * (b - a):
                middle = 0.5 * (lower + upper)
                if not lower < middle < upper:
                    # Neighbouring numbers, in a piece far narrower than where it lies.
                    break
                _, mark = slice_area(
                    middle, circles, planes, bearings, radii, arcs, names, span, moments
                )
                slices += 1
                if mark == marks[split - 1]:
                    lower = middle
                else:
                    upper = middle
            cut = 0.5 * (lower + upper)
            # A sliver at an end of the piece is what rounding makes of a known break.
            if cut - a > SLIVER * (b - a) and b - cut > SLIVER * (b - a):
                cuts += 1
                todo[waiting, 0], todo[waiting, 1] = cut, b
                todo[waiting + 1, 0], todo[waiting + 1, 1] = a, cut
                waiting += 2
                continue
        for i in range(g):
            volume += rates[i] * areas[i]
            for k in range(n):
                angle = rates[i] * circles[k, 5] * kept[i, k, 0]
                off = xs[i] - circles[k, 0]
                square = circles[k, 3] * circles[k, 3] - circles[k, 4] * off * off
                r = math.sqrt(max(0.0, square))
                by_circle[k, 0] += angle * circles[k, 4] * off
                by_circle[k, 1] += rates[i] * circles[k, 5] * r * kept[i, k, 1]
                by_circle[k, 2] += rates[i] * circles[k, 5] * r * kept[i, k, 2]
                by_circle[k, 3] += angle * circles[k, 3]
            for k in range(m):
                norm = math.sqrt(planes[k, 1] * planes[k, 1] + planes[k, 2] * planes[k, 2])
                per = rates[i] / norm
                by_plane[k, 0] -= per * kept[i, n + k, 0] * xs[i]
                by_plane[k, 1] -= per * kept[i, n + k, 1]
                by_plane[k, 2] -= per * kept[i, n + k, 2]
                by_plane[k, 3] += per * kept[i, n + k, 0]
    result[0] = volume
    result[1], _ = slice_area(low, circles, planes, bearings, radii, arcs, names, span, moments)
    result[2], _ = slice_area(high, circles, planes, bearings, radii, arcs, names, span, moments)
    result[3], result[4] = slices, pieces + cuts
