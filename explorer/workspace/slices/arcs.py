"""Slices of regions bounded by spheres, cylinders along x, and planes: their exact area.

A slice at constant x is bounded by circles and lines only, so Green's theorem gives its
area in closed form, arc by arc. The lengths and moments of the arcs carry the gradient:
a boundary that moves sweeps area at the rate of its length.

A circle is a row (x, y, z, radius, is_sphere, side): a sphere or a cylinder along x, with
the region inside (side +1) or outside (side -1). A plane is a row (ax, ay, az, c): a·p <= c.
No two rows may describe the same surface.
"""

from __future__ import annotations

import math

from explorer.numerics.arrays import FloatArray
from explorer.numerics.compiled import helper

TWO_PI = 2.0 * math.pi
# Lines whose directions differ by less than this angle are parallel.
PARALLEL = 1e-12


@helper
def circle_radii(circles: FloatArray, x: float, radii: FloatArray) -> bool:
    """Write the radii of the circles in the slice at x, 0 for none; whether it is not empty."""
    for k in range(circles.shape[0]):
        off = x - circles[k, 0]
        square = circles[k, 3] * circles[k, 3] - circles[k, 4] * off * off
        radii[k] = math.sqrt(square) if square > 0.0 else 0.0
        if square <= 0.0 and circles[k, 5] > 0.0:
            return False
    return True


@helper
def forbid(arcs: FloatArray, count: int, start: float, width: float) -> int:
    """Add the forbidden arc [start, start + width] and return how many there are now."""
    start -= TWO_PI * math.floor(start / TWO_PI)
    end = start + width
    arcs[count, 0], arcs[count, 1] = start, min(end, TWO_PI)
    count += 1
    if end > TWO_PI:
        arcs[count, 0], arcs[count, 1] = 0.0, end - TWO_PI
        count += 1
    return count


@helper
def sort_arcs(arcs: FloatArray, count: int) -> None:
    """Sort the first arcs by where they start; there are few, so by insertion."""
    for i in range(1, count):
        start, end = arcs[i, 0], arcs[i, 1]
        j = i - 1
        while j >= 0 and arcs[j, 0] > start:
            arcs[j + 1, 0], arcs[j + 1, 1] = arcs[j, 0], arcs[j, 1]
            j -= 1
        arcs[j + 1, 0], arcs[j + 1, 1] = start, end


@helper
def forbidden_on_circle(
    k: int,
    x: float,
    circles: FloatArray,
    planes: FloatArray,
    radii: FloatArray,
    bearings: FloatArray,
    arcs: FloatArray,
) -> int:
    """Collect the arcs of circle k that the others forbid; their count, -1 for all of it."""
    count = 0
    r, y, z = radii[k], circles[k, 1], circles[k, 2]
    circle_count = circles.shape[0]
    for j in range(circle_count):
        if j == k:
            continue
        other, side = radii[j], circles[j, 5]
        if other == 0.0:
            continue
        dy, dz = y - circles[j, 1], z - circles[j, 2]
        distance = math.sqrt(dy * dy + dz * dz)
        # A point at the angle phi is inside j where cos(phi - bearing) <= q.
        rest = other * other - r * r - distance * distance
        reach = 2.0 * r * distance
        if rest >= reach:
            if side < 0.0:
                return -1
            continue
        if rest < -reach:
            if side > 0.0:
                return -1
            continue
        half = math.acos(rest / reach)
        if side > 0.0:
            count = forbid(arcs, count, bearings[k, j] - half, 2.0 * half)
        else:
            count = forbid(arcs, count, bearings[k, j] + half, TWO_PI - 2.0 * half)
    for j in range(planes.shape[0]):
        ay, az = planes[j, 1], planes[j, 2]
        reach = r * math.sqrt(ay * ay + az * az)
        rest = planes[j, 3] - planes[j, 0] * x - ay * y - az * z
        if rest >= reach:
            continue
        if rest < -reach:
            return -1
        half = math.acos(rest / reach)
        count = forbid(arcs, count, bearings[k, circle_count + j] - half, 2.0 * half)
    sort_arcs(arcs, count)
    return count


@helper
def forbidden_on_line(
    k: int,
    x: float,
    circles: FloatArray,
    planes: FloatArray,
    radii: FloatArray,
    arcs: FloatArray,
    span: FloatArray,
) -> int:
    """Write the part of line k that lines and discs leave, as (low, high), and the line.

    Returns:
        How many parts of it the holes forbid, collected in `arcs`; -1 for all of it.
    """
    ay, az = planes[k, 1], planes[k, 2]
    norm = math.sqrt(ay * ay + az * az)
    level = (planes[k, 3] - planes[k, 0] * x) / norm
    # The region lies to the left of the direction (-az, ay).
    qy, qz, ty, tz = level * ay / norm, level * az / norm, -az / norm, ay / norm
    low, high = -math.inf, math.inf
    count = 0
    circle_count = circles.shape[0]
    for j in range(planes.shape[0]):
        if j == k:
            continue
        slope = planes[j, 1] * ty + planes[j, 2] * tz
        rest = planes[j, 3] - planes[j, 0] * x - planes[j, 1] * qy - planes[j, 2] * qz
        steep = math.sqrt(planes[j, 1] * planes[j, 1] + planes[j, 2] * planes[j, 2])
        if abs(slope) <= PARALLEL * steep:
            if rest < 0.0:
                return -1
        elif slope > 0.0:
            high = min(high, rest / slope)
        else:
            low = max(low, rest / slope)
    for j in range(circle_count):
        if radii[j] == 0.0:
            continue
        dy, dz = circles[j, 1] - qy, circles[j, 2] - qz
        middle = dy * ty + dz * tz
        off = dy * tz - dz * ty
        square = radii[j] * radii[j] - off * off
        if square <= 0.0:
            if circles[j, 5] > 0.0:
                return -1
            continue
        half = math.sqrt(square)
        if circles[j, 5] > 0.0:
            low, high = max(low, middle - half), min(high, middle + half)
        else:
            arcs[count, 0], arcs[count, 1] = middle - half, middle + half
            count += 1
    if low >= high:
        return -1
    span[0], span[1] = low, high
    span[2], span[3], span[4], span[5] = qy, qz, ty, tz
    sort_arcs(arcs, count)
    return count


@helper
def slice_area(
    x: float,
    circles: FloatArray,
    planes: FloatArray,
    bearings: FloatArray,
    radii: FloatArray,
    arcs: FloatArray,
    span: FloatArray,
    moments: FloatArray,
) -> tuple[float, float]:
    """Return the area of the slice at x, and the sum of the sizes of the terms that it sums.

    Writes the moments of each boundary, circles first: of a circle (angle, ∮cos, ∮sin),
    of a line (length, ∮y, ∮z).
    """
    area, terms = 0.0, 0.0
    moments[:, :] = 0.0
    if not circle_radii(circles, x, radii):
        return 0.0, 0.0
    circle_count = circles.shape[0]
    for k in range(circle_count):
        r = radii[k]
        if r == 0.0:
            continue
        count = forbidden_on_circle(k, x, circles, planes, radii, bearings, arcs)
        if count < 0:
            continue
        y, z, side = circles[k, 1], circles[k, 2], circles[k, 5]
        angle, along_y, along_z = 0.0, 0.0, 0.0
        # What no forbidden arc covers is kept, from the end of one to the start of the next.
        reached = 0.0
        for i in range(count + 1):
            start = arcs[i, 0] if i < count else TWO_PI
            if start > reached:
                # Ends at 0 and 2 pi are no corners, only where counting starts.
                first = 0.0 if reached == 0.0 else math.sin(reached)
                first_cos = 1.0 if reached == 0.0 else math.cos(reached)
                last = 0.0 if start == TWO_PI else math.sin(start)
                last_cos = 1.0 if start == TWO_PI else math.cos(start)
                angle += start - reached
                along_y += last - first
                along_z += first_cos - last_cos
            if i < count and arcs[i, 1] > reached:
                reached = arcs[i, 1]
        moments[k, 0], moments[k, 1], moments[k, 2] = angle, along_y, along_z
        area += side * 0.5 * r * (r * angle + y * along_y + z * along_z)
        terms += 0.5 * r * (r * angle + abs(y * along_y) + abs(z * along_z))
    for k in range(planes.shape[0]):
        count = forbidden_on_line(k, x, circles, planes, radii, arcs, span)
        if count < 0:
            continue
        reached = span[0]
        qy, qz, ty, tz = span[2], span[3], span[4], span[5]
        row = circle_count + k
        for i in range(count + 1):
            start = min(arcs[i, 0], span[1]) if i < count else span[1]
            if start > reached:
                length, middle = start - reached, 0.5 * (start + reached)
                part = 0.5 * length * (qy * tz - qz * ty)
                area += part
                terms += abs(part)
                moments[row, 0] += length
                moments[row, 1] += length * (qy + middle * ty)
                moments[row, 2] += length * (qz + middle * tz)
            if i < count and arcs[i, 1] > reached:
                reached = arcs[i, 1]
            if reached >= span[1]:
                break
    return area, terms
