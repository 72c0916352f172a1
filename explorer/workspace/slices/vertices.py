"""Vertices of a region bounded by spheres, cylinders along x, and planes: three surfaces meet.

Two planes meet in a line, and two cylinders, or a cylinder and a plane along x, in two lines
along x; what crosses these lines has a closed form. Two balls, or a ball and a plane, meet in
a circle; where it crosses a plane or a ball has a closed form too, where it crosses a cylinder
is a quartic. Rows as in `explorer.workspace.slices.arcs`.
"""

from __future__ import annotations

import math

import numpy as np

from explorer.numerics.arrays import FloatArray
from explorer.numerics.compiled import helper
from explorer.workspace.slices.break_points import add_break, breaks_at_height, real_roots, slack_at

# Newton's method halves its interval wherever it leaves it, and then ends in so many steps.
STEPS = 100
# Planes and lines whose angle has a smaller sine are parallel.
PARALLEL = 1e-14


@helper
def breaks_of_fixed_line(
    circles: FloatArray,
    planes: FloatArray,
    y: float,
    z: float,
    slack: float,
    breaks: FloatArray,
    count: int,
) -> int:
    """Add where the line along x through (y, z) meets balls."""
    for k in range(circles.shape[0]):
        if circles[k, 4] > 0.0:
            count = breaks_at_height(circles, planes, k, y, z, slack, breaks, count)
    return count


@helper
def breaks_on_cylinders(
    circles: FloatArray, planes: FloatArray, size: float, breaks: FloatArray, count: int
) -> int:
    """Add the vertices on lines along x in which a cylinder meets another, or a plane."""
    n, m = circles.shape[0], planes.shape[0]
    for j in range(n):
        if circles[j, 4] > 0.0:
            continue
        yj, zj, rj = circles[j, 1], circles[j, 2], circles[j, 3]
        for k in range(j + 1, n):
            if circles[k, 4] > 0.0:
                continue
            dy, dz = circles[k, 1] - yj, circles[k, 2] - zj
            square = dy * dy + dz * dz
            if square == 0.0:
                continue
            slack = slack_at(size, math.sqrt(square) / size)
            rk = circles[k, 3]
            along = 0.5 * (square + (rj - rk) * (rj + rk)) / square
            rest = rj * rj / square - along * along
            if rest < 0.0:
                continue
            up = math.sqrt(rest)
            for sign in (-up, up):
                y, z = yj + along * dy - sign * dz, zj + along * dz + sign * dy
                count = breaks_of_fixed_line(circles, planes, y, z, slack, breaks, count)
                for i in range(m):
                    if planes[i, 0] != 0.0:
                        x = (planes[i, 3] - planes[i, 1] * y - planes[i, 2] * z) / planes[i, 0]
                        count = add_break(circles, planes, x, y, z, slack, breaks, count)
        for k in range(m):
            if planes[k, 0] != 0.0:
                continue
            ay, az = planes[k, 1], planes[k, 2]
            square = ay * ay + az * az
            level = (planes[k, 3] - ay * yj - az * zj) / square
            rest = rj * rj / square - level * level
            if rest < 0.0:
                continue
            up, slack = math.sqrt(rest), slack_at(size, 1.0)
            for sign in (-up, up):
                y, z = yj + level * ay - sign * az, zj + level * az + sign * ay
                count = breaks_of_fixed_line(circles, planes, y, z, slack, breaks, count)
    return count


@helper
def line_of_planes(
    p: FloatArray, q: FloatArray, x: float, y: float, z: float, line: FloatArray
) -> float:
    """Write the line in which two planes with unit normals meet, as (point, direction).

    The point is the one nearest to (x, y, z), the direction has unit length.

    Returns:
        The sine of the angle between the planes, 0 where they are parallel.
    """
    dx, dy = p[1] * q[2] - p[2] * q[1], p[2] * q[0] - p[0] * q[2]
    dz = p[0] * q[1] - p[1] * q[0]
    sine = math.sqrt(dx * dx + dy * dy + dz * dz)
    if sine <= PARALLEL:
        return 0.0
    cosine = p[0] * q[0] + p[1] * q[1] + p[2] * q[2]
    off_p = p[3] - p[0] * x - p[1] * y - p[2] * z
    off_q = q[3] - q[0] * x - q[1] * y - q[2] * z
    by_p = (off_p - cosine * off_q) / (sine * sine)
    by_q = (off_q - cosine * off_p) / (sine * sine)
    line[0] = x + by_p * p[0] + by_q * q[0]
    line[1] = y + by_p * p[1] + by_q * q[1]
    line[2] = z + by_p * p[2] + by_q * q[2]
    line[3], line[4], line[5] = dx / sine, dy / sine, dz / sine
    return sine


@helper
def breaks_on_line(
    circles: FloatArray,
    planes: FloatArray,
    line: FloatArray,
    k: int,
    slack: float,
    breaks: FloatArray,
    count: int,
) -> int:
    """Add where a line meets ball or cylinder k."""
    ball = circles[k, 4]
    ox, oy, oz = ball * (line[0] - circles[k, 0]), line[1] - circles[k, 1], line[2] - circles[k, 2]
    dx, dy, dz = ball * line[3], line[4], line[5]
    for t in real_roots(
        dx * dx + dy * dy + dz * dz,
        2.0 * (ox * dx + oy * dy + oz * dz),
        ox * ox + oy * oy + oz * oz - circles[k, 3] * circles[k, 3],
    ):
        x, y, z = line[0] + t * line[3], line[1] + t * line[4], line[2] + t * line[5]
        count = add_break(circles, planes, x, y, z, slack, breaks, count)
    return count


@helper
def breaks_of_planes(
    circles: FloatArray,
    planes: FloatArray,
    cuts: FloatArray,
    size: float,
    breaks: FloatArray,
    count: int,
) -> int:
    """Add the vertices on the lines in which two planes meet."""
    n, m = circles.shape[0], planes.shape[0]
    line = np.zeros(6)
    for p in range(m):
        for q in range(p + 1, m):
            x, y, z = circles[0, 0], circles[0, 1], circles[0, 2]
            sine = line_of_planes(cuts[p], cuts[q], x, y, z, line)
            if sine == 0.0:
                continue
            slack = slack_at(size, sine)
            if abs(line[3]) <= PARALLEL:
                # The whole line lies in one slice.
                x, y, z = line[0], line[1], line[2]
                count = add_break(circles, planes, x, y, z, math.inf, breaks, count)
            for k in range(n):
                count = breaks_on_line(circles, planes, line, k, slack, breaks, count)
            for k in range(q + 1, m):
                steep = cuts[k, 0] * line[3] + cuts[k, 1] * line[4] + cuts[k, 2] * line[5]
                if abs(steep) > PARALLEL:
                    rest = cuts[k, 3] - (
                        cuts[k, 0] * line[0] + cuts[k, 1] * line[1] + cuts[k, 2] * line[2]
                    )
                    t, near = rest / steep, slack_at(size, sine * abs(steep))
                    x, y, z = line[0] + t * line[3], line[1] + t * line[4], line[2] + t * line[5]
                    count = add_break(circles, planes, x, y, z, near, breaks, count)
    return count


@helper
def root_between(a: FloatArray, low: float, high: float) -> float:
    """Return the root of a polynomial (lowest power first) between ends of unlike signs."""
    rises = a[0] + high * (a[1] + high * (a[2] + high * (a[3] + high * a[4]))) > 0.0
    t = 0.5 * (low + high)
    for _ in range(STEPS):
        value = a[0] + t * (a[1] + t * (a[2] + t * (a[3] + t * a[4])))
        slope = a[1] + t * (2.0 * a[2] + t * (3.0 * a[3] + t * 4.0 * a[4]))
        if (value > 0.0) == rises:
            high = t
        else:
            low = t
        step = value / slope if slope != 0.0 else math.inf
        following = t - step
        if not low < following < high:
            following = 0.5 * (low + high)
        if abs(following - t) <= 1e-16 or not low < following < high:
            break
        t = following
    return t


@helper
def quartic_roots(a: FloatArray, roots: FloatArray) -> int:
    """Write the real roots of a quartic (lowest power first) in [-1, 1]; their count.

    Those of each derivative part those of the one before.
    """
    stops, derived = np.zeros(6), np.zeros((5, 5))
    for power in range(5):
        derived[0, power] = a[power]
    for k in range(1, 4):
        for power in range(4):
            derived[k, power] = (power + 1) * derived[k - 1, power + 1]
    stops[0], stops[1] = -1.0, 1.0
    many = 0
    for k in range(3, -1, -1):
        found = 0
        b = derived[k]
        before = b[0] - b[1] + b[2] - b[3] + b[4]
        for i in range(many + 1):
            low, high = stops[i], stops[i + 1]
            after = b[0] + high * (b[1] + high * (b[2] + high * (b[3] + high * b[4])))
            if (before > 0.0) != (after > 0.0):
                roots[found] = root_between(b, low, high)
                found += 1
            before = after
        many = found
        for i in range(many):
            stops[i + 1] = roots[i]
        stops[many + 1] = 1.0
    return many


@helper
def breaks_of_circle(
    circles: FloatArray,
    planes: FloatArray,
    ball: int,
    cut: FloatArray,
    slack: float,
    breaks: FloatArray,
    count: int,
) -> int:
    """Add where the circle in which a plane cuts a ball crosses cylinders."""
    nx, ny, nz = cut[0], cut[1], cut[2]
    across = math.sqrt(ny * ny + nz * nz)
    level = cut[3] - nx * circles[ball, 0] - ny * circles[ball, 1] - nz * circles[ball, 2]
    square = (circles[ball, 3] - level) * (circles[ball, 3] + level)
    if across <= PARALLEL or square <= 0.0:
        return count
    r = math.sqrt(square)
    cx, cy, cz = (
        circles[ball, 0] + level * nx,
        circles[ball, 1] + level * ny,
        circles[ball, 2] + level * nz,
    )
    # Seen along x it is an ellipse: r along e, and r |nx| along f.
    fy, fz = ny / across, nz / across
    ey, ez = fz, -fy
    a, roots = np.zeros(5), np.zeros(4)
    for k in range(circles.shape[0]):
        if circles[k, 4] > 0.0:
            continue
        dy, dz, radius = circles[k, 1] - cy, circles[k, 2] - cz, circles[k, 3]
        u, v = dy * ey + dz * ez, dy * fy + dz * fz
        if abs(math.sqrt(u * u + v * v) - radius) > r:
            continue
        rest = u * u + v * v - radius * radius
        # Half the circle each, as (2t, 1 - t²) / (1 + t²), so that t stays within one.
        for half in (-1.0, 1.0):
            tall = -half * nx * r
            a[0] = tall * tall - 2.0 * tall * v + rest
            a[4] = tall * tall + 2.0 * tall * v + rest
            a[2] = 4.0 * r * r - 2.0 * tall * tall + 2.0 * rest
            a[1] = a[3] = -4.0 * r * u
            for i in range(quartic_roots(a, roots)):
                t = roots[i]
                sine, cosine = 2.0 * t / (1.0 + t * t), half * (1.0 - t * t) / (1.0 + t * t)
                x = cx + r * across * cosine
                y = cy + r * (ey * sine - nx * fy * cosine)
                z = cz + r * (ez * sine - nx * fz * cosine)
                count = add_break(circles, planes, x, y, z, slack, breaks, count)
    return count


@helper
def breaks_on_balls(
    circles: FloatArray,
    planes: FloatArray,
    cuts: FloatArray,
    size: float,
    breaks: FloatArray,
    count: int,
) -> int:
    """Add the vertices on the circles in which two balls, or a ball and a plane, meet."""
    n, m = circles.shape[0], planes.shape[0]
    line = np.zeros(6)
    sines = np.ones(m + n)
    for i in range(n):
        if circles[i, 4] == 0.0:
            continue
        x, y, z = circles[i, 0], circles[i, 1], circles[i, 2]
        for j in range(i + 1, n):
            # The plane that holds the circle of two balls.
            dx, dy, dz = circles[j, 0] - x, circles[j, 1] - y, circles[j, 2] - z
            distance = math.sqrt(dx * dx + dy * dy + dz * dz)
            sines[m + j] = distance / size if circles[j, 4] > 0.0 else 0.0
            if sines[m + j] > 0.0:
                powers = (circles[i, 3] - circles[j, 3]) * (circles[i, 3] + circles[j, 3])
                cut = cuts[m + j]
                cut[0], cut[1], cut[2] = dx / distance, dy / distance, dz / distance
                cut[3] = 0.5 * (distance + powers / distance)
                cut[3] += cut[0] * x + cut[1] * y + cut[2] * z
        for p in range(m + n):
            if (p < m and planes[p, 0] == 0.0) or m <= p <= m + i or sines[p] == 0.0:
                continue
            slack = slack_at(size, sines[p])
            count = breaks_of_circle(circles, planes, i, cuts[p], slack, breaks, count)
            if p < m:
                continue
            # The planes through the circle with other planes, and with other balls.
            for q in range(m + n):
                if m <= q <= p or sines[q] == 0.0:
                    continue
                sine = line_of_planes(cuts[p], cuts[q], x, y, z, line)
                if sine > 0.0:
                    near = slack_at(size, sine * sines[p] * sines[q])
                    count = breaks_on_line(circles, planes, line, i, near, breaks, count)
    return count


@helper
def breaks_at_vertices(
    circles: FloatArray, planes: FloatArray, size: float, breaks: FloatArray, count: int
) -> int:
    """Add the vertices of a region and return how many breaks there are."""
    n, m = circles.shape[0], planes.shape[0]
    # Planes with unit normals, then those through the circles that one ball makes with others.
    cuts = np.zeros((m + n, 4))
    for k in range(m):
        ax, ay, az = planes[k, 0], planes[k, 1], planes[k, 2]
        norm = math.sqrt(ax * ax + ay * ay + az * az)
        cuts[k, 0], cuts[k, 1], cuts[k, 2] = ax / norm, ay / norm, az / norm
        cuts[k, 3] = planes[k, 3] / norm
    count = breaks_on_cylinders(circles, planes, size, breaks, count)
    count = breaks_of_planes(circles, planes, cuts, size, breaks, count)
    return breaks_on_balls(circles, planes, cuts, size, breaks, count)
