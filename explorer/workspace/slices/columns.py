"""Volumes of regions by columns along x, each of exact length, and of the part that holds a load.

Along such a column δ2, δ3, the lengths of struts 2 and 3 and the force of leg 4 over its length are
constant, and forces times δ1 are polynomials. Each limit of a part so forbids the intervals in
which a polynomial is negative, of degree two, or four with a force of any direction. The lengths of
columns are integrated along z and then along y by Simpson's rule; the panels are halved where
third differences are largest. The sum of their sizes is the stated error.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cache
from typing import NamedTuple

import numpy as np

from explorer.numerics.arrays import FloatArray, for_kernel
from explorer.numerics.compiled import MANY_ROWS, helper, kernel
from explorer.statics.load_cases import FORCE, INWARD, LIMITS, PARTS, forces_at
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
    Region,
    X,
    Y,
    Z,
    add_crossings,
    is_within,
    sort_ends,
)
from explorer.workspace.slices.arcs import END, START, real_roots, sort_arcs

# Forces of the actuators, and the largest number of forbidden intervals of a column.
FORCES, MOST_GAPS = 6, 256
# Steps and accuracy of the roots of a polynomial on [-1, 1].
ROOT_STEPS, ROOT_ERROR = 60, 1e-10
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

# Panels along y, and along z of each slice, at first. To find a box about what is not empty: steps
# between columns beside it, its growth on a side where what is not empty may go on, the share that
# is left of the last box, and rounds at most.
PANELS, BESIDE, GROWTH, SETTLED, ROUNDS = 16, 6.0, 0.5, 0.4, 12
# Share of the tolerance that is left to slices, slices at most, and share of a box that is nothing.
OF_SLICES, MOST_SLICES, NOTHING = 0.15, 1500, 1e-12
# Factor of the error: differences vanish by chance where a value bends twice.
SAFETY = 2.0
# Places of new slices over the width of half a panel.
QUARTERS = np.array([0.25, 0.75, 1.25, 1.75])
# Weights of Simpson's rule with five points, times 12, and of the two third differences of these.
# The sum of their sizes exceeds the error wherever in a panel a value leaps or bends.
FIVE = np.array([1.0, 4.0, 2.0, 4.0, 1.0])
CUBIC = np.array([[-1.0, 0.0], [3.0, -1.0], [-3.0, 3.0], [1.0, -3.0], [0.0, 1.0]])


class Column(NamedTuple):
    """What bounds columns, with the arrays that they are computed in.

    Attributes:
        circles, planes, cones: Rows of a region.
        bounds: Ends of columns, see `LOW_X`.
        case: Row of a load as of `explorer.statics.load_cases.load_case`; empty without one.
        r: Platform to base, shape (3, 3).
        rule: Places on [-1, 1] at which polynomials are computed, and what gives their coefficients
            from the values there: of powers, and of Bernstein, shape (2 n + 1, n).
        gaps: Forbidden intervals, shape (`MOST_GAPS`, 2).
        forces: Forces, their spreads, the distance from δ1 = 0, d2 and d4 at the places, (n, 15).
        values: Values of a polynomial, its coefficients, those of a derivative, and its roots,
            shape (4, n).
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
def polynomial_at(powers: FloatArray, degree: int, s: float) -> float:
    """Return a polynomial by its coefficients, the constant first."""
    value = powers[degree]
    for k in range(degree - 1, -1, -1):
        value = value * s + powers[k]
    return value


@helper
def root_between(powers: FloatArray, degree: int, low: float, high: float) -> float:
    """Return the root of a polynomial between places of distinct signs (Illinois method)."""
    at_low, at_high = polynomial_at(powers, degree, low), polynomial_at(powers, degree, high)
    root, kept = low, 0
    for _ in range(ROOT_STEPS):
        before, root = root, (low * at_high - high * at_low) / (at_high - at_low)
        value = polynomial_at(powers, degree, root)
        if value == 0.0 or abs(root - before) <= ROOT_ERROR:
            break
        # An end that stays twice counts half.
        if (value < 0.0) == (at_low < 0.0):
            low, at_low = root, value
            at_high *= 0.5 if kept == 1 else 1.0
            kept = 1
        else:
            high, at_high = root, value
            at_low *= 0.5 if kept == -1 else 1.0
            kept = -1
    return root


@helper
def write_roots(powers: FloatArray, derivative: FloatArray, roots: FloatArray) -> int:
    """Write the roots of a polynomial on [-1, 1] in order; return their count.

    Between two roots of the derivative there is one at most, so those of all derivatives are found
    one after the other, from the quadratic one on.
    """
    most, count = powers.shape[0] - 1, 0
    for degree in range(2, most + 1):
        order = most - degree
        for k in range(degree + 1):
            derivative[k] = powers[k + order]
            for j in range(1, order + 1):
                derivative[k] *= k + j
        if degree == 2:
            first, second = real_roots(derivative[2], derivative[1], derivative[0])
            for root in (min(first, second), max(first, second)):
                if -1.0 < root < 1.0:
                    roots[count] = root
                    count += 1
            continue
        low, found = -1.0, 0
        at_low = polynomial_at(derivative, degree, low)
        for i in range(count + 1):
            high = roots[i] if i < count else 1.0
            at_high = polynomial_at(derivative, degree, high)
            if (at_low < 0.0) != (at_high < 0.0):
                roots[found] = root_between(derivative, degree, low, high)
                found += 1
            low, at_low = high, at_high
        count = found
    return count


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
    cones, ends = c.cones, c.values[3]
    free, dy, dz = 1.0 - cones[k, IS_FLAT], y - cones[k, Y], z - cones[k, Z]
    along = dy * cones[k, AXIS_Y] + dz * cones[k, AXIS_Z]
    square = cones[k, COSINE] * cones[k, COSINE]
    # (off·axis)² = cos² |off|², as a polynomial in x - xc.
    a = free * (cones[k, AXIS_X] * cones[k, AXIS_X] - square)
    b, rest = free * along * cones[k, AXIS_X], along * along - square * (dy * dy + dz * dz)
    found = add_crossings(a, b, rest, ends, 0)
    sort_ends(ends, found)
    start = low
    for i in range(found + 1):
        end = min(max(ends[i] + cones[k, X], start), high) if i < found else high
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


@cache
def polynomial_rule(count: int) -> FloatArray:
    """Return the rule of a `Column` for polynomials with a number of coefficients."""
    places = np.cos(np.pi * (np.arange(count) + 0.5) / count)
    degree = np.arange(count)
    x = 0.5 * (1.0 + places[:, None])
    choices = np.array([math.comb(count - 1, int(k)) for k in degree])
    bernstein = choices * x**degree * (1.0 - x) ** degree[::-1]
    powers = np.linalg.inv(np.vander(places, increasing=True))
    return np.vstack([places, powers, np.linalg.inv(bernstein)], dtype=np.float64)


class ColumnVolume(NamedTuple):
    """A volume by columns.

    Attributes:
        volume: Volume, in cubed design units.
        error: Sum of the sizes of third differences of all panels, with a factor. What lies between
            the columns of the first panels does not count.
        box: (lows, highs) of a box about the columns that are not empty, shape (2, 3).
    """

    volume: float
    error: float
    box: FloatArray


def volume_of_columns(
    region: Region,
    tolerance: float,
    case: FloatArray | None = None,
    rotation: FloatArray | None = None,
    about: FloatArray | None = None,
) -> ColumnVolume:
    """Return the volume of a region, or of the part of it that holds a load.

    Args:
        region: The region; with a load it must keep the signs of home.
        tolerance: Largest stated error, as a share of the volume.
        case: Row of the load, see `explorer.statics.load_cases.load_case`; None without one.
        rotation: Platform to base, shape (3, 3), with a load.
        about: A position near to which columns are not empty, if it is known, shape (3,).
    """
    if region.box is None:
        return ColumnVolume(0.0, 0.0, np.array(region.ends))
    load = np.empty(0) if case is None else case
    slices = _Slices(region, load, np.eye(3) if rotation is None else for_kernel(rotation))
    box, estimate = slices.find_box(about)
    if estimate <= NOTHING * float(np.prod(np.subtract(*region.ends[::-1]))):
        return ColumnVolume(0.0, 0.0, box)
    allowed = OF_SLICES * tolerance
    errors = allowed, allowed * estimate / float(box[1, 1] - box[0, 1])
    y = evenly(box)
    rows = slices.at(y, box, errors)
    first = np.arange(0, len(y) - 1, 4)
    panels = rows[first[:, None] + np.arange(5)]
    starts, widths, count = y[first], np.full(len(first), 4.0 * (y[1] - y[0])), len(y)
    while True:
        areas = panels[..., AREA]
        own = widths * np.abs(areas @ CUBIC).sum(axis=-1) / 12.0
        volume = float(widths @ (areas @ FIVE)) / 12.0
        of_slices = float(widths @ (panels[..., AREA_ERROR] @ FIVE)) / 12.0
        error = SAFETY * (float(own.sum()) + of_slices)
        if error <= tolerance * volume or count >= MOST_SLICES:
            break
        # The worst panels, of half the error.
        order = np.argsort(-own)
        rest = np.cumsum(own[order])
        worst = order[: 1 + int(np.count_nonzero(rest < 0.5 * rest[-1]))]
        old, half = panels[worst], 0.5 * widths[worst]
        between = np.repeat(starts[worst], 4) + np.kron(half, QUARTERS)
        new = slices.at(between, box, errors).reshape(-1, 4, SLICE)
        count += 4 * len(worst)
        halves = np.stack([old[:, 0], new[:, 0], old[:, 1], new[:, 1], old[:, 2]], axis=1)
        others = np.stack([old[:, 2], new[:, 2], old[:, 3], new[:, 3], old[:, 4]], axis=1)
        panels[worst], widths[worst] = halves, half
        panels = np.concatenate([panels, others])
        starts = np.concatenate([starts, starts[worst] + half])
        widths = np.concatenate([widths, half])
    return ColumnVolume(volume, error, box)


@dataclass(frozen=True)
class _Slices:
    """Slices across y of a region, or of the part of it that holds a load.

    Attributes:
        region: The region.
        case: Row of the load; empty without one.
        rotation: Platform to base, shape (3, 3).
    """

    region: Region
    case: FloatArray
    rotation: FloatArray

    def at(self, y: FloatArray, box: FloatArray, errors: tuple[float, float]) -> FloatArray:
        """Return the rows of slices at y, shape (n,), within the z-range of a box, (n, `SLICE`).

        The errors of an area that are allowed are given as a share of it and as an area.
        """
        out = np.empty((len(y), SLICE))
        bounds = np.array([self.region.low, self.region.high, *box[:, 2], *errors])
        rule = polynomial_rule(5 if len(self.case) and self.case[FORCE] > 0.0 else 3)
        rows = bounds, self.case, self.rotation, rule, PANELS, y, out
        integrate_columns(MANY_ROWS, *self.region.rows, *rows)
        return out

    def find_box(self, about: FloatArray | None) -> tuple[FloatArray, float]:
        """Return a box about the columns that are not empty, shape (2, 3), and a rough volume."""
        widest = np.array(self.region.ends)
        box: FloatArray = widest
        estimate = 0.0
        if about is not None:
            step = BESIDE * (widest[1] - widest[0]) / (4 * PANELS)
            box = np.clip(np.array([about - step, about + step]), *widest)
        for _ in range(ROUNDS):
            y = evenly(box)
            rows = self.at(y, box, (0.0, math.inf))
            rows, y = rows[rows[:, FILLED] > 0.0], y[rows[:, FILLED] > 0.0]
            if not len(y):
                break
            step = (box[1] - box[0]) / (4 * PANELS)
            estimate = float(rows[:, AREA].sum() * step[1])
            low = np.array([rows[:, LOW_X].min(), y[0], rows[:, LOW_Z].min()])
            high = np.array([rows[:, HIGH_X].max(), y[-1], rows[:, HIGH_Z].max()])
            near = np.array([low - BESIDE * step, high + BESIDE * step])
            # What is not empty next to a side may go on beyond it.
            goes_on = np.array([low - step < box[0], high + step > box[1]])
            near += np.where(goes_on, GROWTH * np.array([box[0] - box[1], box[1] - box[0]]), 0.0)
            near = np.clip(near, *widest)
            left: FloatArray = (near[1] - near[0]) / (box[1] - box[0])
            grows = goes_on & np.array([near[0] < box[0], near[1] > box[1]])
            box = near
            if left[1] * left[2] >= SETTLED and not grows[:, 1:].any():
                break
        return box, estimate


def evenly(box: FloatArray) -> FloatArray:
    """Return evenly spaced y of the first panels in a box, those at its ends a little within."""
    low, high = float(box[0, 1]), float(box[1, 1])
    inset = EDGE * (high - low)
    return np.linspace(low + inset, high - inset, 4 * PANELS + 1, dtype=np.float64)
