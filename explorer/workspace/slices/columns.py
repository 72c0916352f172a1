"""Lengths of columns along x of a region, or of the part of it that holds a load, and their slices.

Along such a column δ2, δ3, the lengths of struts 2 and 3 and the force of leg 4 over its length are
constant, and forces times δ1 are polynomials. Each limit of a part so forbids the intervals in
which a polynomial is negative, of degree two, or four with a force of any direction. The areas of
slices across y are integrals of the lengths along z.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from explorer.numerics.arrays import FloatArray
from explorer.numerics.compiled import helper, kernel
from explorer.statics.load_cases import INWARD, LIMITS, PARTS, forces_at
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
    is_within,
)
from explorer.workspace.slices.arcs import END, START, sort_arcs
from explorer.workspace.slices.polynomials import polynomial_at, write_roots

# Forces of the actuators, and the largest number of forbidden intervals of a column.
FORCES, MOST_GAPS = 6, 256
# Share of the length of a column, or of its coordinates, that is nothing.
SHORTEST = 1e-12
# Share of the width of a slice by which its outermost columns lie within it.
EDGE = 1e-9
# Columns of a panel: its start, its width, and its values at five places.
FROM, WIDTH, VALUES, PANEL = 0, 1, 2, 7
# Panels and columns of a slice at most.
MOST_PANELS = 400
# Entries of the bounds of slices: ends along x and z, and the error of an area that is allowed,
# as a share of it or as an area.
LOW_X, HIGH_X, LOW_Z, HIGH_Z, RELATIVE, ABSOLUTE, BOUNDS = range(7)
# Entries of a slice: after its ends along x and z, its area and the error of that.
AREA, AREA_ERROR, FILLED, SLICE = 4, 5, 6, 7


class Column(NamedTuple):
    """The bounds of columns, with the arrays in which their lengths are computed.

    Attributes:
        circles, planes, cones: Rows of a region.
        bounds: Ends of columns, see `LOW_X`.
        case: Row of a load as of `explorer.statics.load_cases.load_case`; empty without one.
        r: Platform to base, shape (3, 3).
        rule: Places on [-1, 1] at which polynomials are computed, and what gives their coefficients
            from the values there: of powers, and of Bernstein, shape (2 n + 1, n).
        gaps: Forbidden intervals, shape (`MOST_GAPS`, 2).
        forces: Forces, their spreads, the distance from δ1 = 0, d2 and d4 at the places, (n, 15).
        values: Values of a polynomial, its coefficients, those of a derivative, its roots, and the
            values of a second polynomial, shape (5, n).
        at: Position, shape (3,).
        ends: The lowest and the highest end of the last column, shape (2,).
    """

    circles: FloatArray
    planes: FloatArray
    cones: FloatArray
    bounds: FloatArray
    case: FloatArray
    r: FloatArray
    rule: FloatArray
    gaps: FloatArray
    forces: FloatArray
    values: FloatArray
    at: FloatArray
    ends: FloatArray


@helper
def write_products(matrix: FloatArray, values: FloatArray, out: FloatArray) -> None:
    """Write the product of a matrix (n, n) and values (n,)."""
    for k in range(out.shape[0]):
        out[k] = 0.0
        for j in range(out.shape[0]):
            out[k] += matrix[k, j] * values[j]


@helper
def forbid_negative(c: Column, low: float, high: float, count: int) -> int:
    """Add the intervals in which a polynomial, or a linear one besides, is negative.

    Where the polynomial is positive the linear one, whose values come after it, has no root.
    Return the count of forbidden intervals, -1 if all of the column is forbidden.
    """
    n = c.forces.shape[0]
    powers, derivative, roots, room = c.values[1], c.values[2], c.values[3], c.values[4]
    # A polynomial lies between the least and the largest of its coefficients by Bernstein.
    write_products(c.rule[1 + n :], c.values[0], powers)
    least, most = math.inf, -math.inf
    for k in range(n):
        least, most = min(least, powers[k]), max(most, powers[k])
    if most < 0.0:
        return -1
    if least >= 0.0 and room[0] >= 0.0:
        return count
    write_products(c.rule[1 : 1 + n], c.values[0], powers)
    found = write_roots(powers, derivative, roots)
    write_products(c.rule[1 : 1 + n], room, derivative)
    middle, half, start = 0.5 * (low + high), 0.5 * (high - low), -1.0
    for i in range(found + 1):
        end = roots[i] if i < found else 1.0
        s = 0.5 * (start + end)
        if polynomial_at(powers, n - 1, s) < 0.0 or polynomial_at(derivative, n - 1, s) < 0.0:
            c.gaps[count, START], c.gaps[count, END] = middle + half * start, middle + half * end
            count += 1
        start = end
    return count


@helper
def forbid_by_cone(
    k: int, y: float, z: float, c: Column, low: float, high: float, count: int
) -> int:
    """Add the intervals of a column outside a cone; return the count of forbidden intervals."""
    cones, first, second = c.cones, math.inf, math.inf
    free, dy, dz = 1.0 - cones[k, IS_FLAT], y - cones[k, Y], z - cones[k, Z]
    along = dy * cones[k, AXIS_Y] + dz * cones[k, AXIS_Z]
    square = cones[k, COSINE] * cones[k, COSINE]
    # (off·axis)² = cos² |off|², as a polynomial in x - xc.
    a = free * (cones[k, AXIS_X] * cones[k, AXIS_X] - square)
    b, rest = free * along * cones[k, AXIS_X], along * along - square * (dy * dy + dz * dz)
    if a != 0.0:
        # Rounding may hide a double root, which a cone of 90° has; a superfluous end does no harm.
        root = math.sqrt(max(0.0, b * b - a * rest)) / a
        first, second = min(-b / a - root, -b / a + root), max(-b / a - root, -b / a + root)
    elif b != 0.0:
        first = -0.5 * rest / b
    start = low
    for root in (first, second, math.inf):
        end = min(max(root + cones[k, X], start), high)
        middle = 0.5 * (start + end)
        if end > start and not is_within(
            middle, y, z, c.circles[:0], c.planes[:0], cones[k : k + 1], 0.0
        ):
            c.gaps[count, START], c.gaps[count, END] = start, end
            count += 1
        start = end
    return count


@helper
def forbid_by_force(
    c: Column, force: int, side: float, most: float, low: float, high: float, count: int
) -> int:
    """Add the intervals in which a force to one side, with its spread, exceeds its limit.

    Return the count of forbidden intervals, -1 if all of the column is forbidden.
    """
    values, room = c.values[0], c.values[4]
    for j in range(c.forces.shape[0]):
        row = c.forces[j]
        value, spread, distance = side * row[force], row[FORCES + force], row[2 * FORCES]
        room[j] = 1.0
        if force in (0, FORCES - 1):
            # The force over the length of its leg is constant, or is so times δ1.
            if value + spread <= 0.0:
                return count
            scale = distance if force == 0 else 1.0
            values[j] = (most - value - spread) * (most + value + spread) * scale * scale
        elif spread == 0.0:
            values[j] = (most - value) * distance
        else:
            room[j] = (most - value) * distance
            values[j] = (most - value - spread) * (most - value + spread) * distance * distance
    return forbid_negative(c, low, high, count)


@helper
def forbid_by_load(y: float, z: float, c: Column, low: float, high: float, count: int) -> int:
    """Add the intervals of a column in which a load is not held.

    Return the count of forbidden intervals, -1 if all of the column is forbidden.
    """
    case, at, middle, half = c.case, c.at, 0.5 * (low + high), 0.5 * (high - low)
    at[1], at[2] = y, z
    d2, d4 = 0.0, 0.0
    for j in range(c.forces.shape[0]):
        at[0] = middle + half * c.rule[0, j]
        f, e, d2, d4 = forces_at(case, c.r, at)
        for i in range(FORCES):
            c.forces[j, i], c.forces[j, FORCES + i] = f[i], e[i]
        c.forces[j, 2 * FORCES] = case[INWARD] * at[0] + case[INWARD + 1] * y + case[INWARD + 2] * z
    for side in (1.0, -1.0):
        first = LIMITS if side > 0.0 else LIMITS + PARTS
        for i in range(FORCES):
            most = case[first + i]
            if i == 1:
                most = min(most, case[first + 6] / d2)
            elif i == 2:
                most = min(most, case[first + 8])
            elif i == 3:
                most = min(most, case[first + 7] / d4)
            elif i == 4:
                most = min(most, case[first + 9])
            if most < math.inf:
                count = forbid_by_force(c, i, side, most, low, high, count)
                if count < 0:
                    return -1
    return count


@helper
def length_between(c: Column, low: float, high: float, count: int) -> float:
    """Return the length that a number of forbidden intervals leave, and write its ends."""
    gaps, covered, length = c.gaps, low, 0.0
    sort_arcs(gaps, count)
    for i in range(count + 1):
        start = min(gaps[i, START], high) if i < count else high
        if start > covered:
            c.ends[0] = covered if length == 0.0 else c.ends[0]
            c.ends[1] = start
            length += start - covered
        if i < count:
            covered = max(covered, gaps[i, END])
    return length


@helper
def column_length(y: float, z: float, c: Column) -> float:
    """Return the length of the region along x at (y, z), and write its ends."""
    circles, planes, gaps = c.circles, c.planes, c.gaps
    low, high, count = c.bounds[LOW_X], c.bounds[HIGH_X], 0
    for k in range(circles.shape[0]):
        dy, dz = y - circles[k, Y], z - circles[k, Z]
        square = circles[k, RADIUS] * circles[k, RADIUS] - dy * dy - dz * dz
        if circles[k, IS_BALL] == 0.0:
            if square * circles[k, SIDE] < 0.0:
                return 0.0
            continue
        half, x = math.sqrt(max(0.0, square)), circles[k, X]
        if circles[k, SIDE] > 0.0:
            low, high = max(low, x - half), min(high, x + half)
        elif half > 0.0:
            gaps[count, START], gaps[count, END] = x - half, x + half
            count += 1
    for k in range(planes.shape[0]):
        rest = planes[k, OFFSET] - planes[k, Y] * y - planes[k, Z] * z
        if planes[k, X] == 0.0:
            if rest < 0.0:
                return 0.0
        elif planes[k, X] > 0.0:
            high = min(high, rest / planes[k, X])
        else:
            low = max(low, rest / planes[k, X])
    if high - low <= SHORTEST * (abs(low) + abs(high)):
        return 0.0
    for k in range(c.cones.shape[0]):
        count = forbid_by_cone(k, y, z, c, low, high, count)
    if c.case.shape[0] > 0:
        count = forbid_by_load(y, z, c, low, high, count)
        if count < 0:
            return 0.0
    return length_between(c, low, high, count)


@helper
def panel_error(panel: FloatArray) -> float:
    """Return the error of Simpson's rule with five points, see `CUBIC`."""
    p = panel[VALUES:]
    one, other = p[3] - p[0] + 3.0 * (p[1] - p[2]), p[4] - p[1] + 3.0 * (p[2] - p[3])
    return panel[WIDTH] * (abs(one) + abs(other)) / 12.0


@helper
def length_in_slice(y: float, z: float, c: Column, out: FloatArray) -> float:
    """Return the length of a column, and extend the ends of the slice by it."""
    length = column_length(y, z, c)
    if length > 0.0:
        out[LOW_X], out[HIGH_X] = min(out[LOW_X], c.ends[0]), max(out[HIGH_X], c.ends[1])
        out[LOW_Z], out[HIGH_Z] = min(out[LOW_Z], z), max(out[HIGH_Z], z)
        out[FILLED] += 1.0
    return length


@helper
def range_of_z(y: float, c: Column) -> tuple[float, float]:
    """Return the ends along z of what balls, cylinders and planes along x leave of a slice."""
    low, high = c.bounds[LOW_Z], c.bounds[HIGH_Z]
    for k in range(c.circles.shape[0]):
        if c.circles[k, SIDE] > 0.0:
            dy = y - c.circles[k, Y]
            half = math.sqrt(max(0.0, c.circles[k, RADIUS] * c.circles[k, RADIUS] - dy * dy))
            low, high = max(low, c.circles[k, Z] - half), min(high, c.circles[k, Z] + half)
    for k in range(c.planes.shape[0]):
        if c.planes[k, X] == 0.0 and c.planes[k, Z] != 0.0:
            end = (c.planes[k, OFFSET] - c.planes[k, Y] * y) / c.planes[k, Z]
            if c.planes[k, Z] > 0.0:
                high = min(high, end)
            else:
                low = max(low, end)
    return low, high


@helper
def integrate_slice(y: float, c: Column, first: int, panels: FloatArray, out: FloatArray) -> None:
    """Write the area of a slice across y, beginning with a number of panels; see `AREA`."""
    out[LOW_X], out[LOW_Z], out[HIGH_X], out[HIGH_Z] = math.inf, math.inf, -math.inf, -math.inf
    out[AREA], out[AREA_ERROR], out[FILLED] = 0.0, 0.0, 0.0
    low, high = range_of_z(y, c)
    if low >= high:
        return
    # At an end itself forces may be infinite, and a column touches a surface.
    inset = EDGE * (high - low)
    low, high = low + inset, high - inset
    width, count = (high - low) / first, first
    for i in range(first):
        panels[i, FROM], panels[i, WIDTH] = low + i * width, width
        for k in range(5):
            if k == 0 and i > 0:
                panels[i, VALUES] = panels[i - 1, VALUES + 4]
            else:
                z = low + (i + 0.25 * k) * width
                panels[i, VALUES + k] = length_in_slice(y, z, c, out)
    while True:
        area, error, worst, largest = 0.0, 0.0, 0, -1.0
        for i in range(count):
            p = panels[i, VALUES:]
            area += panels[i, WIDTH] * (p[0] + 4.0 * p[1] + 2.0 * p[2] + 4.0 * p[3] + p[4]) / 12.0
            own = panel_error(panels[i])
            error += own
            if own > largest:
                worst, largest = i, own
        allowed = max(c.bounds[RELATIVE] * area, c.bounds[ABSOLUTE])
        if error <= allowed or count >= panels.shape[0]:
            break
        a, b, half = panels[worst], panels[count], 0.5 * panels[worst, WIDTH]
        b[FROM], a[WIDTH], b[WIDTH] = a[FROM] + half, half, half
        b[VALUES], b[VALUES + 2], b[VALUES + 4] = a[VALUES + 2], a[VALUES + 3], a[VALUES + 4]
        a[VALUES + 4], a[VALUES + 2] = a[VALUES + 2], a[VALUES + 1]
        for k in (1, 3):
            a[VALUES + k] = length_in_slice(y, a[FROM] + 0.25 * k * half, c, out)
            b[VALUES + k] = length_in_slice(y, b[FROM] + 0.25 * k * half, c, out)
        count += 1
    out[AREA], out[AREA_ERROR] = area, error


@kernel(
    "void(f8[:,::1], f8[:,::1], f8[:,::1], f8[::1], f8[::1], f8[:,::1], f8[:,::1], i8, f8[::1],"
    " f8[:,::1])"
)
def integrate_columns(
    circles: FloatArray,
    planes: FloatArray,
    cones: FloatArray,
    bounds: FloatArray,
    case: FloatArray,
    r: FloatArray,
    rule: FloatArray,
    panels: int,
    y: FloatArray,
    out: FloatArray,
) -> None:
    """Write n slices across y, shape (n, `SLICE`), each begun with a number of panels along z."""
    n = rule.shape[1]
    gaps, forces, values = np.zeros((MOST_GAPS, 2)), np.zeros((n, 2 * FORCES + 1)), np.zeros((5, n))
    at, ends, work = np.zeros(3), np.zeros(2), np.zeros((panels + MOST_PANELS, PANEL))
    c = Column(circles, planes, cones, bounds, case, r, rule, gaps, forces, values, at, ends)
    for k in range(y.shape[0]):
        integrate_slice(y[k], c, panels, work, out[k])
