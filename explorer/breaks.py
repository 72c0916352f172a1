"""Where, along x, the slices of a region gain or lose an arc: the breaks of their area.

Between two breaks the area is analytic. Most have closed forms: a sphere's ends, two
curves that touch, and a sphere that passes over a crossing which is fixed in all slices
or which runs on a line. What is left (two spheres and a cylinder, or a line that moves)
`explorer.slice_volume` finds by bisection. Rows of circles and planes as in `slices`.
"""

from __future__ import annotations

import math

import numpy as np

from explorer.arrays import FloatArray
from explorer.compiled import helper


@helper
def add_roots(a: float, b: float, c: float, breaks: FloatArray, count: int) -> int:
    """Add the real roots of a x² + b x + c to the breaks and return how many there are."""
    if a == 0.0:
        if b != 0.0 and count < breaks.shape[0]:
            breaks[count] = -c / b
            count += 1
        return count
    square = b * b - 4.0 * a * c
    if square < 0.0:
        return count
    # The form without cancellation.
    q = -0.5 * (b + math.copysign(math.sqrt(square), b))
    if count + 1 < breaks.shape[0]:
        breaks[count] = q / a
        count += 1
        if q != 0.0:
            breaks[count] = c / q
            count += 1
    return count


@helper
def breaks_of_circle(
    circles: FloatArray, k: int, square: float, breaks: FloatArray, count: int
) -> int:
    """Add where sphere k has a slice of this squared radius."""
    rest = circles[k, 3] * circles[k, 3] - square
    if circles[k, 4] > 0.0 and rest >= 0.0 and count + 1 < breaks.shape[0]:
        half = math.sqrt(rest)
        breaks[count], breaks[count + 1] = circles[k, 0] - half, circles[k, 0] + half
        count += 2
    return count


@helper
def breaks_of_pair(circles: FloatArray, j: int, k: int, breaks: FloatArray, count: int) -> int:
    """Add where the circles j and k touch."""
    dy, dz = circles[j, 1] - circles[k, 1], circles[j, 2] - circles[k, 2]
    distance = math.sqrt(dy * dy + dz * dz)
    if circles[j, 4] == 0.0 and circles[k, 4] == 0.0:
        return count
    if circles[j, 4] == 0.0 or circles[k, 4] == 0.0:
        ball, tube = (j, k) if circles[j, 4] > 0.0 else (k, j)
        near, far = distance - circles[tube, 3], distance + circles[tube, 3]
        count = breaks_of_circle(circles, ball, near * near, breaks, count)
        return breaks_of_circle(circles, ball, far * far, breaks, count)
    # The squared radii of two spheres differ by alpha + beta x.
    beta = 2.0 * (circles[j, 0] - circles[k, 0])
    alpha = (
        circles[j, 3] * circles[j, 3]
        - circles[k, 3] * circles[k, 3]
        - circles[j, 0] * circles[j, 0]
        + circles[k, 0] * circles[k, 0]
    )
    if distance == 0.0:
        return add_roots(0.0, beta, alpha, breaks, count)
    # Touching: r_j = |d² + alpha + beta x| / 2d.
    per = 1.0 / (4.0 * distance * distance)
    shifted = distance * distance + alpha
    return add_roots(
        beta * beta * per + 1.0,
        2.0 * shifted * beta * per - 2.0 * circles[j, 0],
        shifted * shifted * per + circles[j, 0] * circles[j, 0] - circles[j, 3] * circles[j, 3],
        breaks,
        count,
    )


@helper
def breaks_at_point(
    circles: FloatArray, planes: FloatArray, y: float, z: float, breaks: FloatArray, count: int
) -> int:
    """Add where spheres and moving lines pass over a point that is fixed in the slices."""
    for k in range(circles.shape[0]):
        dy, dz = circles[k, 1] - y, circles[k, 2] - z
        count = breaks_of_circle(circles, k, dy * dy + dz * dz, breaks, count)
    for k in range(planes.shape[0]):
        if planes[k, 0] != 0.0:
            rest = planes[k, 3] - planes[k, 1] * y - planes[k, 2] * z
            count = add_roots(0.0, planes[k, 0], -rest, breaks, count)
    return count


@helper
def breaks_at_fixed_points(
    circles: FloatArray, planes: FloatArray, breaks: FloatArray, count: int
) -> int:
    """Add the breaks at crossings of cylinders and planes along x, which stay in all slices."""
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
            along = 0.5 * (square + rj * rj - circles[k, 3] * circles[k, 3]) / square
            rest = rj * rj / square - along * along
            if rest >= 0.0:
                up = math.sqrt(rest)
                for sign in (-up, up):
                    y, z = yj + along * dy - sign * dz, zj + along * dz + sign * dy
                    count = breaks_at_point(circles, planes, y, z, breaks, count)
        for k in range(m):
            if planes[k, 0] != 0.0:
                continue
            ay, az = planes[k, 1], planes[k, 2]
            square = ay * ay + az * az
            level = (planes[k, 3] - ay * yj - az * zj) / square
            rest = rj * rj / square - level * level
            if rest >= 0.0:
                up = math.sqrt(rest)
                for sign in (-up, up):
                    y, z = yj + level * ay - sign * az, zj + level * az + sign * ay
                    count = breaks_at_point(circles, planes, y, z, breaks, count)
    for j in range(m):
        for k in range(j + 1, m):
            cross = planes[j, 1] * planes[k, 2] - planes[j, 2] * planes[k, 1]
            if planes[j, 0] != 0.0 or planes[k, 0] != 0.0 or cross == 0.0:
                continue
            y = (planes[j, 3] * planes[k, 2] - planes[k, 3] * planes[j, 2]) / cross
            z = (planes[j, 1] * planes[k, 3] - planes[k, 1] * planes[j, 3]) / cross
            count = breaks_at_point(circles, planes, y, z, breaks, count)
    return count


@helper
def breaks_of_line(
    circles: FloatArray, planes: FloatArray, k: int, breaks: FloatArray, count: int
) -> int:
    """Add where line k touches circles, and where it passes a crossing of two spheres."""
    n = circles.shape[0]
    ax, ay, az, c = planes[k, 0], planes[k, 1], planes[k, 2], planes[k, 3]
    norm = math.sqrt(ay * ay + az * az)
    for j in range(n):
        # Its distance from the centre is the radius: (rest - ax x)² = |a|² r².
        rest = c - ay * circles[j, 1] - az * circles[j, 2]
        x, r, ball = circles[j, 0], circles[j, 3], circles[j, 4]
        count = add_roots(
            ax * ax + norm * norm * ball,
            -2.0 * (rest * ax + norm * norm * ball * x),
            rest * rest - norm * norm * (r * r - ball * x * x),
            breaks,
            count,
        )
    if ax != 0.0:
        return count
    qy, qz, ty, tz = c * ay / (norm * norm), c * az / (norm * norm), -az / norm, ay / norm
    for i in range(n):
        for j in range(i + 1, n):
            if circles[i, 4] == 0.0 or circles[j, 4] == 0.0:
                continue
            # Of both spheres (x - xi)² + (t - ti)² = Ri²; their difference is linear.
            xi, xj = circles[i, 0], circles[j, 0]
            ti = (circles[i, 1] - qy) * ty + (circles[i, 2] - qz) * tz
            tj = (circles[j, 1] - qy) * ty + (circles[j, 2] - qz) * tz
            oi = (circles[i, 1] - qy) * tz - (circles[i, 2] - qz) * ty
            oj = (circles[j, 1] - qy) * tz - (circles[j, 2] - qz) * ty
            si = circles[i, 3] * circles[i, 3] - oi * oi
            sj = circles[j, 3] * circles[j, 3] - oj * oj
            dx, dt = xj - xi, tj - ti
            level = 0.5 * (si - sj + xj * xj - xi * xi + tj * tj - ti * ti)
            if dt == 0.0:
                count = add_roots(0.0, dx, -level, breaks, count)
            else:
                # t = (level - dx x) / dt in the first.
                off = level / dt - ti
                slope = dx / dt
                count = add_roots(
                    1.0 + slope * slope,
                    -2.0 * (xi + off * slope),
                    xi * xi + off * off - si,
                    breaks,
                    count,
                )
    return count


@helper
def find_breaks(
    circles: FloatArray, planes: FloatArray, low: float, high: float, breaks: FloatArray
) -> int:
    """Write low, high and the breaks between them that have closed forms, sorted; their count."""
    breaks[0], breaks[1] = low, high
    count = 2
    n = circles.shape[0]
    for j in range(n):
        count = breaks_of_circle(circles, j, 0.0, breaks, count)
        for k in range(j + 1, n):
            count = breaks_of_pair(circles, j, k, breaks, count)
    for k in range(planes.shape[0]):
        count = breaks_of_line(circles, planes, k, breaks, count)
    count = breaks_at_fixed_points(circles, planes, breaks, count)
    kept = np.sort(breaks[:count])
    room = 1e-13 * (high - low)
    breaks[0] = low
    found = 1
    for i in range(count):
        if breaks[found - 1] + room < kept[i] < high - room:
            breaks[found] = kept[i]
            found += 1
    breaks[found] = high
    return found + 1
