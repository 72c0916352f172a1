"""Breaks of a region: its vertices, where three surfaces meet, with those where curves touch.

Two planes meet in a line, and two cylinders, or a cylinder and a plane along x, in two lines
along x. Their intersections with a third surface have closed forms. Two spheres, or a sphere and
a plane, meet in a circle, whose intersections with a plane or a sphere have closed forms too, and
those with a cylinder are roots of a quartic. Circles and planes are rows of
`explorer.workspace.limits.region`; a line is (x, y, z, axis), a point and a unit direction.
"""

from __future__ import annotations

import math

import numpy as np

from explorer.numerics.arrays import FloatArray
from explorer.numerics.compiled import helper
from explorer.workspace.limits.region import IS_BALL, OFFSET, RADIUS, X, Y, Z
from explorer.workspace.slices.arcs import (
    Boundary,
    add_break,
    add_breaks_at_height,
    add_breaks_at_tangencies,
    region_size,
    slack_at,
)
from explorer.workspace.slices.polynomials import real_roots, write_roots

# Planes and lines at an angle with a smaller sine count as parallel.
PARALLEL = 1e-14
# Breaks closer together than this share of the x-range are merged.
SAME_BREAK = 1e-13
# Columns of the direction of a line.
DX, DY, DZ = 3, 4, 5


@helper
def add_breaks_of_fixed_line(boundary: Boundary, y: float, z: float, slack: float) -> None:
    """Add vertices where the line along x through (y, z) meets spheres."""
    for k in range(boundary.circles.shape[0]):
        if boundary.circles[k, IS_BALL] > 0.0:
            add_breaks_at_height(boundary, k, y, z, slack)


@helper
def add_breaks_on_cylinders(boundary: Boundary) -> None:
    """Add vertices on the lines along x in which a cylinder meets another, or a plane."""
    circles, planes = boundary.circles, boundary.planes
    n, m = circles.shape[0], planes.shape[0]
    for j in range(n):
        if circles[j, IS_BALL] > 0.0:
            continue
        yj, zj, rj = circles[j, Y], circles[j, Z], circles[j, RADIUS]
        for k in range(j + 1, n):
            if circles[k, IS_BALL] > 0.0:
                continue
            dy, dz = circles[k, Y] - yj, circles[k, Z] - zj
            square = dy * dy + dz * dz
            if square == 0.0:
                continue
            slack = slack_at(boundary, math.sqrt(square) / boundary.size)
            rk = circles[k, RADIUS]
            along = 0.5 * (square + (rj - rk) * (rj + rk)) / square
            rest = rj * rj / square - along * along
            if rest < 0.0:
                continue
            half_chord = math.sqrt(rest)
            for sign in (-half_chord, half_chord):
                y, z = yj + along * dy - sign * dz, zj + along * dz + sign * dy
                add_breaks_of_fixed_line(boundary, y, z, slack)
                for i in range(m):
                    if planes[i, X] != 0.0:
                        x = (planes[i, OFFSET] - planes[i, Y] * y - planes[i, Z] * z) / planes[i, X]
                        add_break(boundary, x, y, z, slack)
        for k in range(m):
            if planes[k, X] != 0.0:
                continue
            ay, az = planes[k, Y], planes[k, Z]
            square = ay * ay + az * az
            level = (planes[k, OFFSET] - ay * yj - az * zj) / square
            rest = rj * rj / square - level * level
            if rest < 0.0:
                continue
            half_chord, slack = math.sqrt(rest), slack_at(boundary, 1.0)
            for sign in (-half_chord, half_chord):
                y, z = yj + level * ay - sign * az, zj + level * az + sign * ay
                add_breaks_of_fixed_line(boundary, y, z, slack)


@helper
def write_line_of_planes(
    p: FloatArray, q: FloatArray, x: float, y: float, z: float, line: FloatArray
) -> float:
    """Write the line in which two planes with unit normals meet, as (point, unit direction).

    The point is the one nearest to (x, y, z). Return the sine of the angle between the planes, 0
    where they are parallel.
    """
    dx, dy = p[Y] * q[Z] - p[Z] * q[Y], p[Z] * q[X] - p[X] * q[Z]
    dz = p[X] * q[Y] - p[Y] * q[X]
    sine = math.sqrt(dx * dx + dy * dy + dz * dz)
    if sine <= PARALLEL:
        return 0.0
    cosine = p[X] * q[X] + p[Y] * q[Y] + p[Z] * q[Z]
    off_p = p[OFFSET] - p[X] * x - p[Y] * y - p[Z] * z
    off_q = q[OFFSET] - q[X] * x - q[Y] * y - q[Z] * z
    by_p = (off_p - cosine * off_q) / (sine * sine)
    by_q = (off_q - cosine * off_p) / (sine * sine)
    line[X] = x + by_p * p[X] + by_q * q[X]
    line[Y] = y + by_p * p[Y] + by_q * q[Y]
    line[Z] = z + by_p * p[Z] + by_q * q[Z]
    line[DX], line[DY], line[DZ] = dx / sine, dy / sine, dz / sine
    return sine


@helper
def add_breaks_on_line(boundary: Boundary, line: FloatArray, k: int, slack: float) -> None:
    """Add vertices where a line meets sphere or cylinder k."""
    circles, ball = boundary.circles, boundary.circles[k, IS_BALL]
    ox, oy, oz = ball * (line[X] - circles[k, X]), line[Y] - circles[k, Y], line[Z] - circles[k, Z]
    dx, dy, dz = ball * line[DX], line[DY], line[DZ]
    for t in real_roots(
        dx * dx + dy * dy + dz * dz,
        2.0 * (ox * dx + oy * dy + oz * dz),
        ox * ox + oy * oy + oz * oz - circles[k, RADIUS] * circles[k, RADIUS],
    ):
        x, y, z = line[X] + t * line[DX], line[Y] + t * line[DY], line[Z] + t * line[DZ]
        add_break(boundary, x, y, z, slack)


@helper
def add_breaks_of_planes(boundary: Boundary, cuts: FloatArray) -> None:
    """Add vertices on the lines in which two planes meet."""
    circles = boundary.circles
    n, m = circles.shape[0], boundary.planes.shape[0]
    line = np.zeros(6)
    for p in range(m):
        for q in range(p + 1, m):
            x, y, z = circles[0, X], circles[0, Y], circles[0, Z]
            sine = write_line_of_planes(cuts[p], cuts[q], x, y, z, line)
            if sine == 0.0:
                continue
            slack = slack_at(boundary, sine)
            if abs(line[DX]) <= PARALLEL:
                # The whole line lies in one slice.
                x, y, z = line[X], line[Y], line[Z]
                add_break(boundary, x, y, z, math.inf)
            for k in range(n):
                add_breaks_on_line(boundary, line, k, slack)
            for k in range(q + 1, m):
                slope = cuts[k, X] * line[DX] + cuts[k, Y] * line[DY] + cuts[k, Z] * line[DZ]
                if abs(slope) > PARALLEL:
                    rest = cuts[k, OFFSET] - (
                        cuts[k, X] * line[X] + cuts[k, Y] * line[Y] + cuts[k, Z] * line[Z]
                    )
                    t, vertex_slack = rest / slope, slack_at(boundary, sine * abs(slope))
                    x, y, z = line[X] + t * line[DX], line[Y] + t * line[DY], line[Z] + t * line[DZ]
                    add_break(boundary, x, y, z, vertex_slack)


@helper
def add_breaks_of_circle(boundary: Boundary, ball: int, cut: FloatArray, slack: float) -> None:
    """Add vertices where the circle in which a plane cuts a sphere meets cylinders."""
    circles = boundary.circles
    nx, ny, nz = cut[X], cut[Y], cut[Z]
    across = math.sqrt(ny * ny + nz * nz)
    level = cut[OFFSET] - nx * circles[ball, X] - ny * circles[ball, Y] - nz * circles[ball, Z]
    square = (circles[ball, RADIUS] - level) * (circles[ball, RADIUS] + level)
    if across <= PARALLEL or square <= 0.0:
        return
    r = math.sqrt(square)
    cx, cy = circles[ball, X] + level * nx, circles[ball, Y] + level * ny
    cz = circles[ball, Z] + level * nz
    # Seen along x it is an ellipse: r along e, and r |nx| along f.
    fy, fz = ny / across, nz / across
    ey, ez = fz, -fy
    a, derivative, roots = np.zeros(5), np.zeros(5), np.zeros(5)
    for k in range(circles.shape[0]):
        if circles[k, IS_BALL] > 0.0:
            continue
        dy, dz, radius = circles[k, Y] - cy, circles[k, Z] - cz, circles[k, RADIUS]
        u, v = dy * ey + dz * ez, dy * fy + dz * fz
        if abs(math.sqrt(u * u + v * v) - radius) > r:
            continue
        rest = u * u + v * v - radius * radius
        # Each half of the circle is (2t, 1 - t²) / (1 + t²), so that t stays within [-1, 1].
        for half in (-1.0, 1.0):
            semi_f = -half * nx * r
            a[0] = semi_f * semi_f - 2.0 * semi_f * v + rest
            a[4] = semi_f * semi_f + 2.0 * semi_f * v + rest
            a[2] = 4.0 * r * r - 2.0 * semi_f * semi_f + 2.0 * rest
            a[1] = a[3] = -4.0 * r * u
            for i in range(write_roots(a, derivative, roots)):
                t = roots[i]
                sine, cosine = 2.0 * t / (1.0 + t * t), half * (1.0 - t * t) / (1.0 + t * t)
                x = cx + r * across * cosine
                y = cy + r * (ey * sine - nx * fy * cosine)
                z = cz + r * (ez * sine - nx * fz * cosine)
                add_break(boundary, x, y, z, slack)


@helper
def add_breaks_on_spheres(boundary: Boundary, cuts: FloatArray) -> None:
    """Add vertices on the circles in which two spheres, or a sphere and a plane, meet."""
    circles, planes = boundary.circles, boundary.planes
    n, m = circles.shape[0], planes.shape[0]
    line = np.zeros(6)
    sines = np.ones(m + n)
    for i in range(n):
        if circles[i, IS_BALL] == 0.0:
            continue
        x, y, z = circles[i, X], circles[i, Y], circles[i, Z]
        for j in range(i + 1, n):
            # The plane of the circle in which two spheres meet.
            dx, dy, dz = circles[j, X] - x, circles[j, Y] - y, circles[j, Z] - z
            distance = math.sqrt(dx * dx + dy * dy + dz * dz)
            sines[m + j] = distance / boundary.size if circles[j, IS_BALL] > 0.0 else 0.0
            if sines[m + j] > 0.0:
                ri, rj, cut = circles[i, RADIUS], circles[j, RADIUS], cuts[m + j]
                cut[X], cut[Y], cut[Z] = dx / distance, dy / distance, dz / distance
                cut[OFFSET] = 0.5 * (distance + (ri - rj) * (ri + rj) / distance)
                cut[OFFSET] += cut[X] * x + cut[Y] * y + cut[Z] * z
        for p in range(m + n):
            if (p < m and planes[p, X] == 0.0) or m <= p <= m + i or sines[p] == 0.0:
                continue
            slack = slack_at(boundary, sines[p])
            add_breaks_of_circle(boundary, i, cuts[p], slack)
            if p < m:
                continue
            # The plane of the circle meets other planes, and those of circles with other spheres.
            for q in range(m + n):
                if m <= q <= p or sines[q] == 0.0:
                    continue
                sine = write_line_of_planes(cuts[p], cuts[q], x, y, z, line)
                if sine > 0.0:
                    vertex_slack = slack_at(boundary, sine * sines[p] * sines[q])
                    add_breaks_on_line(boundary, line, i, vertex_slack)


@helper
def add_breaks_at_vertices(boundary: Boundary) -> None:
    """Add breaks at the vertices of a region."""
    planes, n, m = boundary.planes, boundary.circles.shape[0], boundary.planes.shape[0]
    # Planes with unit normals, then the planes of the circles in which one sphere meets others.
    cuts = np.zeros((m + n, 4))
    for k in range(m):
        ax, ay, az = planes[k, X], planes[k, Y], planes[k, Z]
        norm = math.sqrt(ax * ax + ay * ay + az * az)
        cuts[k, X], cuts[k, Y], cuts[k, Z] = ax / norm, ay / norm, az / norm
        cuts[k, OFFSET] = planes[k, OFFSET] / norm
    add_breaks_on_cylinders(boundary)
    add_breaks_of_planes(boundary, cuts)
    add_breaks_on_spheres(boundary, cuts)


@helper
def find_breaks(
    circles: FloatArray, planes: FloatArray, low: float, high: float, breaks: FloatArray
) -> int:
    """Write low, the breaks in between and high, in ascending order; return the count."""
    breaks[0], breaks[1] = low, high
    number = np.full(1, 2)
    boundary = Boundary(circles, planes, region_size(circles), breaks, number)
    add_breaks_at_tangencies(boundary)
    add_breaks_at_vertices(boundary)
    count = number[0]
    for i in range(2, count):
        x, j = breaks[i], i - 1
        while breaks[j] > x:
            breaks[j + 1] = breaks[j]
            j -= 1
        breaks[j + 1] = x
    tolerance = SAME_BREAK * (high - low)
    distinct = 1
    for i in range(1, count - 1):
        if breaks[distinct - 1] + tolerance < breaks[i] < high - tolerance:
            breaks[distinct] = breaks[i]
            distinct += 1
    breaks[distinct] = high
    return distinct + 1
