"""Exact volumes of regions bounded by spheres, cylinders along x, and planes.

The area of the slices is integrated along x, piece by piece between its breaks, by
Gauss-Legendre quadrature. It converges to rounding, since the area is analytic on each piece. The
rate of convergence depends on singularities just beyond the piece, so the piece with the largest
error is halved until the estimated error of all pieces is rounding. Circles and planes are rows
of `explorer.workspace.limits.region`.
"""

from __future__ import annotations

import math
from functools import cache

import numpy as np

from explorer.errors import InputError
from explorer.numerics.arrays import FloatArray
from explorer.numerics.compiled import MANY_ROWS, helper, kernel
from explorer.workspace.limits.region import IS_BALL, OFFSET, RADIUS, SIDE, Region, X, Y, Z
from explorer.workspace.slices.arcs import (
    LENGTH,
    MOMENT_Y,
    MOMENT_Z,
    Slicer,
    region_size,
    slice_area,
)
from explorer.workspace.slices.vertices import find_breaks

# Gauss-Legendre nodes per piece; with fewer nodes more pieces have to be halved.
NODES = 20
# The most breaks of one region, and the most pieces.
MOST_BREAKS, MOST_PIECES = 1000, 1100
# The most arcs that other curves forbid on one curve; an arc through angle zero counts twice.
MOST_ARCS = 64
# Largest number of surfaces of a region, each of which covers a circle in two arcs at most.
MOST_SURFACES = MOST_ARCS // 2
# The most circles of a design, of two for each leg.
FEW_CIRCLES = 8
# The count of slices from which on no piece is halved.
MOST_SLICES = 2000
# Pieces are halved down to these errors, as shares of the volume and of the surface.
VOLUME_TOLERANCE, SURFACE_TOLERANCE = 1e-13, 1e-9
# If halving leaves more than this share of an error this many times, the error is rounding.
STALLED, MOST_STALLS = 0.8, 3
# The fastest decay over four coefficients that is extrapolated.
FASTEST = 0.3
# Rounding error, as a share of the summed terms and of the size of the region's coordinates.
ROUNDING = 2.0**-48
# Rows of the quadrature: nodes, weights, and from the third on factors that give coefficients.
NODE, WEIGHT, COEFFICIENTS = 0, 1, 2
# Columns of a piece: its ends, how often halving did not help, its volume and weighted surface,
# the errors of both, and the summed absolute terms of its areas. From RATES on, derivatives follow.
START, END, STALLS, VOLUME, SURFACE, VOLUME_ERROR, SURFACE_ERROR, TERMS, RATES = range(9)
# Entries of the result of `integrate_slices`.
TOTAL, AREA_AT_LOW, AREA_AT_HIGH, SLICES, PIECES, TOTAL_ERROR, RESULTS = range(7)


@helper
def largest(values: FloatArray, start: int) -> float:
    """Return the largest absolute value among four from an index on."""
    size = 0.0
    for k in range(start, start + 4):
        size = max(size, abs(values[k]))
    return size


@helper
def quadrature_error(last: FloatArray, nodes: int) -> float:
    """Return the estimated error of a quadrature with a number of nodes.

    The Legendre coefficients of an analytic integrand decay geometrically. The decay is taken
    from the last eight of them, and the error from the degree of twice the number of nodes.
    """
    earlier, later = largest(last, 0), largest(last, 4)
    decay = min(1.0, max(FASTEST, later / earlier)) if earlier > 0.0 else 1.0
    return later * decay ** (0.25 * nodes)


@helper
def integrate_piece(piece: FloatArray, slicer: Slicer, quadrature: FloatArray) -> int:
    """Integrate over one piece, from its start to its end; return the count of slices computed."""
    circles, planes, moments = slicer.circles, slicer.planes, slicer.moments
    n, m, g = circles.shape[0], planes.shape[0], quadrature.shape[1]
    a, b = piece[START], piece[END]
    for k in range(VOLUME, piece.shape[0]):
        piece[k] = 0.0
    area_coefficients, surface_coefficients = np.zeros(8), np.zeros(8)
    for i in range(g):
        t = quadrature[NODE, i]
        # This substitution makes powers of 3/2, as which areas begin at both ends, smooth.
        x = a + (b - a) * t * t * (3.0 - 2.0 * t)
        rate = quadrature[WEIGHT, i] * (b - a) * 6.0 * t * (1.0 - t)
        area, terms = slice_area(x, slicer)
        if i == 0 and terms == 0.0:
            # A piece whose middle slice is empty is empty.
            return 1
        # The sum of two faces may be smooth where one replaces the other. Distinct weights, from
        # one to two, keep such a change visible.
        surface = 0.0
        for k in range(n):
            column = RATES + 4 * k
            angle, r = rate * circles[k, SIDE] * moments[k, LENGTH], slicer.radii[k]
            piece[column + X] += angle * circles[k, IS_BALL] * (x - circles[k, X])
            piece[column + Y] += rate * circles[k, SIDE] * r * moments[k, MOMENT_Y]
            piece[column + Z] += rate * circles[k, SIDE] * r * moments[k, MOMENT_Z]
            piece[column + RADIUS] += angle * circles[k, RADIUS]
            surface += (1.0 + k / (n + m)) * moments[k, LENGTH] * circles[k, RADIUS]
        for k in range(m):
            column = RATES + 4 * (n + k)
            square = planes[k, Y] * planes[k, Y] + planes[k, Z] * planes[k, Z]
            per = rate / math.sqrt(square)
            piece[column + X] -= per * moments[n + k, LENGTH] * x
            piece[column + Y] -= per * moments[n + k, MOMENT_Y]
            piece[column + Z] -= per * moments[n + k, MOMENT_Z]
            piece[column + OFFSET] += per * moments[n + k, LENGTH]
            tilt = math.sqrt(1.0 + planes[k, X] * planes[k, X] / square)
            surface += (1.0 + (n + k) / (n + m)) * moments[n + k, LENGTH] * tilt
        piece[VOLUME] += rate * area
        piece[SURFACE] += rate * surface
        piece[TERMS] += rate * terms
        for k in range(8):
            area_coefficients[k] += rate * quadrature[COEFFICIENTS + k, i] * area
            surface_coefficients[k] += rate * quadrature[COEFFICIENTS + k, i] * surface
    piece[VOLUME_ERROR] = quadrature_error(area_coefficients, g)
    # Faces begin as square roots, whose coefficients need not decay geometrically.
    piece[SURFACE_ERROR] = largest(surface_coefficients, 4)
    return g


@helper
def excess(piece: FloatArray, volume_error: float, surface_error: float) -> float:
    """Return the larger of a piece's two errors, each over the allowed one."""
    return max(piece[VOLUME_ERROR] / volume_error, piece[SURFACE_ERROR] / surface_error)


@helper
def worst_piece(pieces: FloatArray, count: int, volume_error: float, surface_error: float) -> int:
    """Return the piece to halve next, or -1 if the errors that halving can reduce are allowed."""
    worst, largest_excess, volume_sum, surface_sum = -1, 0.0, 0.0, 0.0
    for i in range(count):
        start, end = pieces[i, START], pieces[i, END]
        if pieces[i, STALLS] >= MOST_STALLS or not start < 0.5 * (start + end) < end:
            continue
        volume_sum += pieces[i, VOLUME_ERROR]
        surface_sum += pieces[i, SURFACE_ERROR]
        piece_excess = excess(pieces[i], volume_error, surface_error)
        if piece_excess > largest_excess:
            worst, largest_excess = i, piece_excess
    return worst if volume_sum > volume_error or surface_sum > surface_error else -1


@kernel("void(f8[:,::1], f8[:,::1], f8, f8, f8[:,::1], f8[::1], f8[:,::1])")
def integrate_slices(
    circles: FloatArray,
    planes: FloatArray,
    low: float,
    high: float,
    quadrature: FloatArray,
    result: FloatArray,
    rates: FloatArray,
) -> None:
    """Integrate the area of the slices from low to high, and its derivatives.

    The quadrature has g nodes on [0, 1] with the middle first, their weights, and the factors that
    give the last eight Legendre coefficients of an integrand, shape (10, g). No plane is
    perpendicular to x. Written are the results, see `TOTAL`, and the derivatives by (x, y, z,
    radius) of each circle, then by (x, y, z, offset) of each plane, shape (n + m, 4).
    """
    n, m = circles.shape[0], planes.shape[0]
    bearings = np.zeros((n, n + m))
    for k in range(n):
        for j in range(n):
            bearings[k, j] = math.atan2(
                circles[k, Z] - circles[j, Z], circles[k, Y] - circles[j, Y]
            )
        for j in range(m):
            bearings[k, n + j] = math.atan2(planes[j, Z], planes[j, Y])
    arcs, span, moments = np.zeros((MOST_ARCS, 2)), np.zeros(6), np.zeros((n + m, 3))
    slicer = Slicer(circles, planes, bearings, np.zeros(n), arcs, span, moments)
    breaks = np.zeros(MOST_BREAKS)
    count = find_breaks(circles, planes, low, high, breaks) - 1
    pieces = np.zeros((MOST_PIECES, RATES + 4 * (n + m)))
    slices = 0
    for i in range(count):
        pieces[i, START], pieces[i, END] = breaks[i], breaks[i + 1]
        slices += integrate_piece(pieces[i], slicer, quadrature)
    size = region_size(circles)
    total = np.zeros(RATES)
    while True:
        for k in range(VOLUME, RATES):
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
            slices += integrate_piece(pieces[i], slicer, quadrature)
            after += excess(pieces[i], allowed, SURFACE_TOLERANCE * total[SURFACE])
        if after > STALLED * before:
            stalls += 1.0
        pieces[worst, STALLS] = pieces[count, STALLS] = stalls
        count += 1
    for k in range(4 * (n + m)):
        rate = 0.0
        for i in range(count):
            rate += pieces[i, RATES + k]
        rates[k // 4, k % 4] = rate
    result[TOTAL], result[SLICES], result[PIECES] = total[VOLUME], slices, count
    result[AREA_AT_LOW], _ = slice_area(low, slicer)
    result[AREA_AT_HIGH], _ = slice_area(high, slicer)
    result[TOTAL_ERROR] = total[VOLUME_ERROR] + rounding


@cache
def quadrature() -> FloatArray:
    """Return the quadrature as `integrate_slices` takes it, shape (10, NODES)."""
    abscissae, weights = np.polynomial.legendre.leggauss(NODES)
    # The middle node comes first: a piece that is empty there is empty everywhere.
    order = np.argsort(np.abs(abscissae), kind="stable")
    abscissae, weights = abscissae[order], weights[order]
    degrees = np.arange(NODES - 8, NODES)
    values = (2.0 * degrees + 1.0) * np.polynomial.legendre.legvander(abscissae, NODES - 1)[:, -8:]
    return np.stack([0.5 * (abscissae + 1.0), 0.5 * weights, *values.T])


def volume_of_slices(region: Region) -> tuple[float, float, dict[str, float]]:
    """Return the volume of a region without cones, its error, and its derivatives by parameter.

    Raises:
        InputError: The region has too many surfaces.
    """
    if region.box is None:
        return 0.0, 0.0, {}
    surfaces = (*region.circle_limits, *region.plane_limits)
    if len(surfaces) > MOST_SURFACES:
        raise InputError(
            f"a volume takes at most {MOST_SURFACES} surfaces; the region has {len(surfaces)}"
        )
    result, rates = np.zeros(RESULTS), np.zeros((len(surfaces), 4))
    ends = region.low, region.high
    # With the twelve balls of six legs it takes seconds if it is not compiled.
    rows = MANY_ROWS if len(region.circles) > FEW_CIRCLES else 1
    integrate_slices(rows, region.circles, region.planes, *ends, quadrature(), result, rates)
    # An end that moves by dx sweeps the area of its slice; its normal is along x.
    areas = (region.low_limit, result[AREA_AT_LOW]), (region.high_limit, result[AREA_AT_HIGH])
    of_ends = [
        (end, np.array([0.0, 0.0, 0.0, area / abs(float(end.normal[0]))]))
        for end, area in areas
        if end is not None
    ]
    gradient: dict[str, float] = {}
    for limit, volume_rate in (*zip(surfaces, rates, strict=True), *of_ends):
        for name, rate in limit.rates.items():
            gradient[name] = gradient.get(name, 0.0) + float(volume_rate @ rate)
    return float(result[TOTAL]), float(result[TOTAL_ERROR]), gradient
