"""Slices at constant x of regions bounded by spheres, cylinders along x, and planes.

A slice is bounded by circles and lines only, so Green's theorem gives its area in closed form, arc
by arc. The lengths and moments of the arcs give the gradient: a boundary that moves sweeps area at
the rate of its length.

Breaks are the values of x at which slices gain or lose an arc; between two of them the area is
analytic. A break is at a pole of a sphere, where two curves of the slices touch, or at a vertex
(`explorer.workspace.slices.vertices`). Only points on the boundary of the region count. Rounding
may move a point off the surfaces that it was computed from, so it may violate limits by a slack,
which is wide: one break too many costs time and one too few makes the volume wrong.

Circles and planes are rows of `explorer.workspace.limits.region`, no two of the same surface.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from explorer.numerics.arrays import FloatArray, IntArray
from explorer.numerics.compiled import helper
from explorer.workspace.limits.region import IS_BALL, OFFSET, RADIUS, SIDE, X, Y, Z
from explorer.workspace.slices.polynomials import real_roots

TWO_PI = 2.0 * math.pi
# Columns of a forbidden arc: angles on a circle, or lengths along a line.
START, END = 0, 1
# Columns of the moments of a boundary. Of a circle: its angle, and the integrals of the cosine
# and the sine over that angle. Of a line: its length, and the integrals of y and z over it.
LENGTH, MOMENT_Y, MOMENT_Z = 0, 1, 2
# Entries of a span: the ends of a part of a line, a point on the line and its direction.
LOW, HIGH, POINT_Y, POINT_Z, ALONG_Y, ALONG_Z = range(6)
# Lines whose directions differ by less than this angle are parallel.
PARALLEL = 1e-12


class Slicer(NamedTuple):
    """The surfaces of a region, with the arrays that slices of it are computed in.

    Attributes:
        circles, planes: Rows, shapes (n, 6) and (m, 4).
        bearings: Directions to each centre from the others, then of the planes' normals, in
            radians, shape (n, n + m).
        radii: Radii of the circles in the slice, shape (n,).
        arcs, span: Forbidden arcs of one boundary, and span of one line, see `LOW`.
        moments: Moments of the boundaries, circles first; see `LENGTH`, shape (n + m, 3).
    """

    circles: FloatArray
    planes: FloatArray
    bearings: FloatArray
    radii: FloatArray
    arcs: FloatArray
    span: FloatArray
    moments: FloatArray


@helper
def write_radii(circles: FloatArray, x: float, radii: FloatArray) -> bool:
    """Write the radii of the circles in the slice at x, 0 where a surface does not reach it.

    Return whether the slice can have an area: it cannot if it misses a surface that holds the
    region.
    """
    for k in range(circles.shape[0]):
        off = x - circles[k, X]
        square = circles[k, RADIUS] * circles[k, RADIUS] - circles[k, IS_BALL] * off * off
        radii[k] = math.sqrt(square) if square > 0.0 else 0.0
        if square <= 0.0 and circles[k, SIDE] > 0.0:
            return False
    return True


@helper
def add_arc(arcs: FloatArray, count: int, start: float, width: float) -> int:
    """Add the forbidden arc [start, start + width] and return the count of arcs."""
    start -= TWO_PI * math.floor(start / TWO_PI)
    end = start + width
    arcs[count, START], arcs[count, END] = start, min(end, TWO_PI)
    count += 1
    if end > TWO_PI:
        arcs[count, START], arcs[count, END] = 0.0, end - TWO_PI
        count += 1
    return count


@helper
def sort_arcs(arcs: FloatArray, count: int) -> None:
    """Sort the first `count` arcs by their starts, by insertion since they are few."""
    for i in range(1, count):
        start, end = arcs[i, START], arcs[i, END]
        j = i - 1
        while j >= 0 and arcs[j, START] > start:
            arcs[j + 1, START], arcs[j + 1, END] = arcs[j, START], arcs[j, END]
            j -= 1
        arcs[j + 1, START], arcs[j + 1, END] = start, end


@helper
def collect_forbidden_on_circle(k: int, x: float, slicer: Slicer) -> int:
    """Collect the arcs of circle k that other surfaces forbid, sorted by their starts.

    Return their count; -1 if all of the circle is forbidden.
    """
    circles, planes, radii, arcs = slicer.circles, slicer.planes, slicer.radii, slicer.arcs
    bearings, count = slicer.bearings, 0
    r, y, z = radii[k], circles[k, Y], circles[k, Z]
    circle_count = circles.shape[0]
    for j in range(circle_count):
        if j == k:
            continue
        other_radius, side = radii[j], circles[j, SIDE]
        if other_radius == 0.0:
            continue
        dy, dz = y - circles[j, Y], z - circles[j, Z]
        distance = math.sqrt(dy * dy + dz * dz)
        # A point at the angle phi is inside j where cos(phi - bearing) <= q.
        rest = other_radius * other_radius - r * r - distance * distance
        amplitude = 2.0 * r * distance
        if rest >= amplitude:
            if side < 0.0:
                return -1
            continue
        if rest < -amplitude:
            if side > 0.0:
                return -1
            continue
        half = math.acos(rest / amplitude)
        if side > 0.0:
            count = add_arc(arcs, count, bearings[k, j] - half, 2.0 * half)
        else:
            count = add_arc(arcs, count, bearings[k, j] + half, TWO_PI - 2.0 * half)
    for j in range(planes.shape[0]):
        ay, az = planes[j, Y], planes[j, Z]
        amplitude = r * math.sqrt(ay * ay + az * az)
        rest = planes[j, OFFSET] - planes[j, X] * x - ay * y - az * z
        if rest >= amplitude:
            continue
        if rest < -amplitude:
            return -1
        half = math.acos(rest / amplitude)
        count = add_arc(arcs, count, bearings[k, circle_count + j] - half, 2.0 * half)
    sort_arcs(arcs, count)
    return count


@helper
def collect_forbidden_on_line(k: int, x: float, slicer: Slicer) -> int:
    """Write the span of line k within the other half-planes and discs; collect its forbidden parts.

    Return the count of parts that holes forbid, collected in `arcs`; -1 if all of the line is.
    """
    circles, planes, radii, arcs = slicer.circles, slicer.planes, slicer.radii, slicer.arcs
    ay, az = planes[k, Y], planes[k, Z]
    norm = math.sqrt(ay * ay + az * az)
    level = (planes[k, OFFSET] - planes[k, X] * x) / norm
    # The region lies to the left of the direction (-az, ay).
    qy, qz, ty, tz = level * ay / norm, level * az / norm, -az / norm, ay / norm
    low, high = -math.inf, math.inf
    count = 0
    circle_count = circles.shape[0]
    for j in range(planes.shape[0]):
        if j == k:
            continue
        slope = planes[j, Y] * ty + planes[j, Z] * tz
        rest = planes[j, OFFSET] - planes[j, X] * x - planes[j, Y] * qy - planes[j, Z] * qz
        other_norm = math.sqrt(planes[j, Y] * planes[j, Y] + planes[j, Z] * planes[j, Z])
        if abs(slope) <= PARALLEL * other_norm:
            if rest < 0.0:
                return -1
        elif slope > 0.0:
            high = min(high, rest / slope)
        else:
            low = max(low, rest / slope)
    for j in range(circle_count):
        if radii[j] == 0.0:
            continue
        dy, dz = circles[j, Y] - qy, circles[j, Z] - qz
        middle = dy * ty + dz * tz
        off = dy * tz - dz * ty
        square = radii[j] * radii[j] - off * off
        if square <= 0.0:
            if circles[j, SIDE] > 0.0:
                return -1
            continue
        half = math.sqrt(square)
        if circles[j, SIDE] > 0.0:
            low, high = max(low, middle - half), min(high, middle + half)
        else:
            arcs[count, START], arcs[count, END] = middle - half, middle + half
            count += 1
    if low >= high:
        return -1
    span = slicer.span
    span[LOW], span[HIGH] = low, high
    span[POINT_Y], span[POINT_Z], span[ALONG_Y], span[ALONG_Z] = qy, qz, ty, tz
    sort_arcs(arcs, count)
    return count


@helper
def slice_area(x: float, slicer: Slicer) -> tuple[float, float]:
    """Return the area of the slice at x, and the sum of the absolute values of its terms.

    The moments of each boundary are written to the slicer.
    """
    circles, radii, arcs, moments = slicer.circles, slicer.radii, slicer.arcs, slicer.moments
    area, magnitude, span = 0.0, 0.0, slicer.span
    moments[:, :] = 0.0
    if not write_radii(circles, x, radii):
        return 0.0, 0.0
    circle_count = circles.shape[0]
    for k in range(circle_count):
        r = radii[k]
        if r == 0.0:
            continue
        count = collect_forbidden_on_circle(k, x, slicer)
        if count < 0:
            continue
        y, z, side = circles[k, Y], circles[k, Z], circles[k, SIDE]
        angle, along_y, along_z = 0.0, 0.0, 0.0
        # The boundary runs from the end of one forbidden arc to the start of the next.
        covered = 0.0
        for i in range(count + 1):
            start = arcs[i, START] if i < count else TWO_PI
            if start > covered:
                # Ends at 0 and 2 pi are not corners, so their sine and cosine must be exact.
                first = 0.0 if covered == 0.0 else math.sin(covered)
                first_cos = 1.0 if covered == 0.0 else math.cos(covered)
                last = 0.0 if start == TWO_PI else math.sin(start)
                last_cos = 1.0 if start == TWO_PI else math.cos(start)
                angle += start - covered
                along_y += last - first
                along_z += first_cos - last_cos
            if i < count and arcs[i, END] > covered:
                covered = arcs[i, END]
        moments[k, LENGTH], moments[k, MOMENT_Y], moments[k, MOMENT_Z] = angle, along_y, along_z
        area += side * 0.5 * r * (r * angle + y * along_y + z * along_z)
        magnitude += 0.5 * r * (r * angle + abs(y * along_y) + abs(z * along_z))
    for k in range(slicer.planes.shape[0]):
        count = collect_forbidden_on_line(k, x, slicer)
        if count < 0:
            continue
        covered = span[LOW]
        qy, qz, ty, tz = span[POINT_Y], span[POINT_Z], span[ALONG_Y], span[ALONG_Z]
        row = circle_count + k
        for i in range(count + 1):
            start = min(arcs[i, START], span[HIGH]) if i < count else span[HIGH]
            if start > covered:
                length, middle = start - covered, 0.5 * (start + covered)
                part = 0.5 * length * (qy * tz - qz * ty)
                area += part
                magnitude += abs(part)
                moments[row, LENGTH] += length
                moments[row, MOMENT_Y] += length * (qy + middle * ty)
                moments[row, MOMENT_Z] += length * (qz + middle * tz)
            if i < count and arcs[i, END] > covered:
                covered = arcs[i, END]
            if covered >= span[HIGH]:
                break
    return area, magnitude


# A point that violates a limit by less than this share of the region's size may lie on it.
NEAR = 1e-7
# The slack grows where surfaces meet at an angle whose sine is smaller than this.
BLURRED = 1e-6


class Boundary(NamedTuple):
    """The surfaces of a region and the breaks found on them.

    Attributes:
        circles, planes: Rows, shapes (n, 6) and (m, 4).
        size: Bound of the region's size, see `region_size`.
        breaks, number: Breaks, the first two at the ends of the x-range, and their number, (1,).
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
