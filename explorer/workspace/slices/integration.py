"""Exact volumes of regions bounded by spheres, cylinders along x, and planes.

The area of the slices is integrated along x, piece by piece between its breaks, by
Gauss-Legendre quadrature, which converges to rounding since the pieces are analytic. How fast
depends on what the curves do just beyond a piece, so the worst piece is halved until the
estimated error of all is rounding. Rows of circles and planes as in
`explorer.workspace.slices.arcs`.
"""

from __future__ import annotations

import math

import numpy as np

from explorer.numerics.arrays import FloatArray
from explorer.numerics.compiled import helper, kernel
from explorer.workspace.slices.arcs import slice_area
from explorer.workspace.slices.break_points import region_size
from explorer.workspace.slices.breaks import find_breaks

# Breaks that one region has at the most, and pieces.
MOST_BREAKS, MOST_PIECES = 1000, 1100
# Arcs that the other curves may forbid on one curve, each twice if it passes angle zero.
MOST_ARCS = 64
# Slices from which on no piece is halved.
MOST_SLICES = 2000
# Errors, as shares of the volume and of the surface, down to which pieces are halved.
VOLUME_TOLERANCE, SURFACE_TOLERANCE = 1e-13, 1e-9
# Where halving leaves more than this share of an error, so many times, it is rounding.
STALLED, MOST_STALLS = 0.8, 3
# The fastest decay of four coefficients that is extrapolated.
FASTEST = 0.3
# Rounding, as a share of the terms of a sum, and of the size by which surfaces are displaced.
ROUNDING = 2.0**-48
# What the row of a piece begins with: its ends, how often halving it has not helped, its volume
# and weighted surface, the errors of both, and the sizes of the terms that its areas sum.
START, END, STALLS, VOLUME, SURFACE, VOLUME_ERROR, SURFACE_ERROR, TERMS, HEAD = range(9)


@helper
def largest(values: FloatArray, start: int) -> float:
    """Return the largest size among four values."""
    found = 0.0
    for k in range(start, start + 4):
        found = max(found, abs(values[k]))
    return found


@helper
def quadrature_error(last: FloatArray, many: int) -> float:
    """Return what a quadrature of so many nodes misses, from its last eight coefficients.

    The coefficients of an analytic integrand decay geometrically on the whole, four by four;
    the quadrature misses those of twice as many degrees as it has nodes.
    """
    before, after = largest(last, 0), largest(last, 4)
    decay = min(1.0, max(FASTEST, after / before)) if before > 0.0 else 1.0
    return after * decay ** (0.25 * many)


@helper
def integrate_piece(
    piece: FloatArray,
    circles: FloatArray,
    planes: FloatArray,
    bearings: FloatArray,
    quadrature: FloatArray,
    radii: FloatArray,
    arcs: FloatArray,
    span: FloatArray,
    moments: FloatArray,
) -> int:
    """Integrate over one piece, from its start to its end, and return the slices computed."""
    n, m, g = circles.shape[0], planes.shape[0], quadrature.shape[1]
    a, b = piece[START], piece[END]
    for k in range(VOLUME, piece.shape[0]):
        piece[k] = 0.0
    of_area, of_surface = np.zeros(8), np.zeros(8)
    for i in range(g):
        t = quadrature[0, i]
        # Smooth to both ends, where areas begin as powers of 3/2.
        x = a + (b - a) * t * t * (3.0 - 2.0 * t)
        rate = quadrature[1, i] * (b - a) * 6.0 * t * (1.0 - t)
        area, terms = slice_area(x, circles, planes, bearings, radii, arcs, span, moments)
        if i == 0 and terms == 0.0:
            # What is empty in the middle of a piece is empty.
            return 1
        # Where one face begins to take the place of another, their sum hides it: each has a
        # weight of its own, from one to two.
        surface = 0.0
        for k in range(n):
            at = HEAD + 4 * k
            angle, r = rate * circles[k, 5] * moments[k, 0], radii[k]
            piece[at] += angle * circles[k, 4] * (x - circles[k, 0])
            piece[at + 1] += rate * circles[k, 5] * r * moments[k, 1]
            piece[at + 2] += rate * circles[k, 5] * r * moments[k, 2]
            piece[at + 3] += angle * circles[k, 3]
            surface += (1.0 + k / (n + m)) * moments[k, 0] * circles[k, 3]
        for k in range(m):
            at = HEAD + 4 * (n + k)
            square = planes[k, 1] * planes[k, 1] + planes[k, 2] * planes[k, 2]
            per = rate / math.sqrt(square)
            piece[at] -= per * moments[n + k, 0] * x
            piece[at + 1] -= per * moments[n + k, 1]
            piece[at + 2] -= per * moments[n + k, 2]
            piece[at + 3] += per * moments[n + k, 0]
            tilt = math.sqrt(1.0 + planes[k, 0] * planes[k, 0] / square)
            surface += (1.0 + (n + k) / (n + m)) * moments[n + k, 0] * tilt
        piece[VOLUME] += rate * area
        piece[SURFACE] += rate * surface
        piece[TERMS] += rate * terms
        for k in range(8):
            of_area[k] += rate * quadrature[2 + k, i] * area
            of_surface[k] += rate * quadrature[2 + k, i] * surface
    piece[VOLUME_ERROR] = quadrature_error(of_area, g)
    # Faces begin as square roots, whose coefficients need not go on as they have decayed.
    piece[SURFACE_ERROR] = largest(of_surface, 4)
    return g


@helper
def excess(piece: FloatArray, volume_error: float, surface_error: float) -> float:
    """Return the errors of a piece over those that are allowed, whichever is larger."""
    return max(piece[VOLUME_ERROR] / volume_error, piece[SURFACE_ERROR] / surface_error)


@helper
def worst_piece(pieces: FloatArray, count: int, volume_error: float, surface_error: float) -> int:
    """Return the piece to halve next, -1 if what can be mended of all is within the errors."""
    worst, most, of_volume, of_surface = -1, 0.0, 0.0, 0.0
    for i in range(count):
        start, end = pieces[i, START], pieces[i, END]
        if pieces[i, STALLS] >= MOST_STALLS or not start < 0.5 * (start + end) < end:
            continue
        of_volume += pieces[i, VOLUME_ERROR]
        of_surface += pieces[i, SURFACE_ERROR]
        beyond = excess(pieces[i], volume_error, surface_error)
        if beyond > most:
            worst, most = i, beyond
    return worst if of_volume > volume_error or of_surface > surface_error else -1


@kernel("void(f8[:,::1], f8[:,::1], f8, f8, f8[:,::1], f8[::1], f8[:,::1], f8[:,::1])")
def integrate_slices(
    circles: FloatArray,
    planes: FloatArray,
    low: float,
    high: float,
    quadrature: FloatArray,
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
        quadrature: Of g nodes on [0, 1], the middle first: nodes, weights, and the factors that
            give the last eight Legendre coefficients of an integrand, shape (10, g).
        result: Written: volume, area at low, area at high, slices computed, pieces, and an
            estimate of the error of the volume, rounding included; shape (6,).
        by_circle: Written: derivatives by (x, y, z, radius), shape (n, 4).
        by_plane: Written: derivatives by (ax, ay, az, c), shape (m, 4).
    """
    n, m = circles.shape[0], planes.shape[0]
    radii, span = np.zeros(n), np.zeros(6)
    arcs = np.zeros((MOST_ARCS, 2))
    moments, bearings = np.zeros((n + m, 3)), np.zeros((n, n + m))
    for k in range(n):
        for j in range(n):
            bearings[k, j] = math.atan2(
                circles[k, 2] - circles[j, 2], circles[k, 1] - circles[j, 1]
            )
        for j in range(m):
            bearings[k, n + j] = math.atan2(planes[j, 2], planes[j, 1])
    breaks = np.zeros(MOST_BREAKS)
    count = find_breaks(circles, planes, low, high, breaks) - 1
    pieces = np.zeros((MOST_PIECES, HEAD + 4 * (n + m)))
    slices = 0
    for i in range(count):
        pieces[i, START], pieces[i, END] = breaks[i], breaks[i + 1]
        slices += integrate_piece(
            pieces[i], circles, planes, bearings, quadrature, radii, arcs, span, moments
        )
    size = region_size(circles)
    total = np.zeros(HEAD + 4 * (n + m))
    while True:
        for k in range(VOLUME, HEAD):
            total[k] = 0.0
            for i in range(count):
                total[k] += pieces[i, k]
        rounding = ROUNDING * (total[TERMS] + size * total[SURFACE])
        if slices >= MOST_SLICES or count >= MOST_PIECES or total[VOLUME] <= rounding:
            break
        allowed = max(VOLUME_TOLERANCE * total[VOLUME], rounding)
        worst = worst_piece(pieces, count, allowed, SURFACE_TOLERANCE * total[SURFACE])
        if worst < 0:
            break
        start, end = pieces[worst, START], pieces[worst, END]
        middle, stalls = 0.5 * (start + end), pieces[worst, STALLS]
        before = excess(pieces[worst], allowed, SURFACE_TOLERANCE * total[SURFACE])
        pieces[worst, END] = pieces[count, START] = middle
        pieces[count, END] = end
        after = 0.0
        for i in (worst, count):
            slices += integrate_piece(
                pieces[i], circles, planes, bearings, quadrature, radii, arcs, span, moments
            )
            after += excess(pieces[i], allowed, SURFACE_TOLERANCE * total[SURFACE])
        if after > STALLED * before:
            stalls += 1.0
        pieces[worst, STALLS] = pieces[count, STALLS] = stalls
        count += 1
    for k in range(4 * (n + m)):
        for i in range(count):
            total[HEAD + k] += pieces[i, HEAD + k]
        if k < 4 * n:
            by_circle[k // 4, k % 4] = total[HEAD + k]
        else:
            by_plane[k // 4 - n, k % 4] = total[HEAD + k]
    result[0], result[3], result[4] = total[VOLUME], slices, count
    result[1], _ = slice_area(low, circles, planes, bearings, radii, arcs, span, moments)
    result[2], _ = slice_area(high, circles, planes, bearings, radii, arcs, span, moments)
    result[5] = total[VOLUME_ERROR] + rounding
