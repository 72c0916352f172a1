"""The least over all azimuths of the greatest tilts of a position."""

from __future__ import annotations

import math

import numpy as np

from explorer.numerics.arrays import FloatArray, IntArray
from explorer.numerics.compiled import helper, kernel
from explorer.numerics.vectors import Vector, along_axis
from explorer.workspace.limits.quantities import A3, D1, HIGH, L1, LOW, QUANTITY, X
from explorer.workspace.orientations.turns import NO_LIMIT, SCRATCH, TurnSearch, arm_of, first_limit

# Share of a bracket that the search by the golden section keeps.
GOLDEN_SECTION = 0.5 * (math.sqrt(5.0) - 1.0)
# Widths of the bracket at which the search ends, in radians: about an azimuth of the row, and about
# a worst azimuth, where the dip may be narrow.
AZIMUTH_WIDTH, NARROW_WIDTH = 1e-4, 1e-6
# Largest number of worst azimuths: two each of l1 and l4, three each of d2 and d4, two for each
# carriage, and six of the box.
WORST = 20


@helper
def write_tilt(azimuth: float, torsion: float, turn: FloatArray) -> None:
    """Write the turn from tilt zero in an azimuth, angles in radians, see `first_limit`."""
    c, s = math.cos(azimuth), math.sin(azimuth)
    a, b = math.cos(torsion - azimuth), math.sin(torsion - azimuth)
    # R = still + level cos θ + upright sin θ.
    for column in range(3):
        across, along = (b, a) if column == 0 else ((a, -b) if column == 1 else (0.0, 0.0))
        for i in range(3):
            if column == 2:
                still = 0.0
                level = 1.0 if i == 2 else 0.0
                upright = c if i == 0 else (s if i == 1 else 0.0)
            else:
                still = -across * s if i == 0 else (across * c if i == 1 else 0.0)
                level = along * c if i == 0 else (along * s if i == 1 else 0.0)
                upright = -along if i == 2 else 0.0
            turn[i, column, 0] = still + level
            turn[i, column, 1] = 2.0 * upright
            turn[i, column, 2] = still - level


@helper
def tilt_in(search: TurnSearch, azimuth: float, torsion: float) -> tuple[float, int]:
    """Return the greatest tilt of a position in one azimuth and its limit, in radians."""
    write_tilt(azimuth, torsion, search.turn)
    return first_limit(search)


@helper
def lowest_about(
    search: TurnSearch, torsion: float, bracket: tuple[float, float, float], width: float
) -> tuple[float, float, int]:
    """Return the least of the greatest tilts about an azimuth, its own azimuth and its limit.

    The bracket is a low end, the azimuth and a high end, in radians. The search by the golden
    section keeps the lowest azimuth that it knows within it, until it is as narrow as a width.
    """
    low, first, high = bracket
    second = first + (1.0 - GOLDEN_SECTION) * (high - first)
    at_first, limit_first = tilt_in(search, first, torsion)
    at_second, limit_second = tilt_in(search, second, torsion)
    while high - low > width:
        if at_first <= at_second:
            high, second, at_second, limit_second = second, first, at_first, limit_first
            first = GOLDEN_SECTION * second + (1.0 - GOLDEN_SECTION) * low
            at_first, limit_first = tilt_in(search, first, torsion)
        else:
            low, first, at_first, limit_first = first, second, at_second, limit_second
            second = GOLDEN_SECTION * first + (1.0 - GOLDEN_SECTION) * high
            at_second, limit_second = tilt_in(search, second, torsion)
    if at_first <= at_second:
        return at_first, first, limit_first
    return at_second, second, limit_second


@helper
def azimuth_towards(v: Vector, w: Vector) -> float:
    """Return the azimuth of the tilt that takes a vector v to a vector w as long.

    The axis of a tilt is horizontal and keeps what v has along it, so it is perpendicular to the
    horizontal part of the difference of v and w.
    """
    x, y = v[0] - w[0], v[1] - w[1]
    # The tilt is less than half a turn, from the axis z towards its azimuth.
    rise = w[2]
    if v[2] != 0.0:
        rise = w[2] * (x * v[0] + y * v[1]) - v[2] * (x * w[0] + y * w[1])
    sign = -1.0 if rise > 0.0 else 1.0
    return math.atan2(sign * y, sign * x)


@helper
def bounds_of(demands: FloatArray, kind: int) -> tuple[float, float]:
    """Return the least and the largest value that demands allow of a quantity."""
    low, high = -math.inf, math.inf
    for index in range(demands.shape[0]):
        if int(demands[index, QUANTITY]) == kind:
            low, high = max(low, demands[index, LOW]), min(high, demands[index, HIGH])
    return low, high


@helper
def write_worst_azimuths(search: TurnSearch, torsion: float, worst: FloatArray) -> int:
    """Write the azimuths of tilts to which lengths, carriages and b4 in the box are at extremes.

    Only those that violate a bound count. Beyond such a bound the region of tilts may be small, so
    that azimuths at equal distances pass by it. Return their number, `WORST` at most.
    """
    row, demands, p, tool = search.row, search.demands, search.p, search.tool
    count = 0
    c, s = math.cos(torsion), math.sin(torsion)
    for leg in range(4):
        bx, by, bz = arm_of(row, leg, tool)
        arm = math.hypot(math.hypot(bx, by), bz)
        if leg == 3 and arm == 0.0:
            continue
        v = (c * bx - s * by, s * bx + c * by, bz)
        on_guide = 0 < leg < 3
        shortest, longest = bounds_of(demands, L1 + leg)
        # b1 turns to the line through a1, b4 to that through a3, b2 and b3 to the plane across the
        # guide.
        x = 0.0 if on_guide else p[0]
        y, z = p[1], p[2]
        if leg == 3:
            x, y = p[0] - row[A3], p[1] - row[A3 + 1]
        far = math.hypot(y, z) if on_guide else math.sqrt(x * x + y * y + z * z)
        if far > 0.0 and far + arm > longest:
            share = arm / far
            worst[count] = azimuth_towards(v, (share * x, share * y, share * z))
            count += 1
        if on_guide and arm > far and shortest > 0.0:
            # The leg's end can lie on the guide, at one of two places.
            along = math.sqrt(arm * arm - far * far)
            worst[count] = azimuth_towards(v, (along, -p[1], -p[2]))
            worst[count + 1] = azimuth_towards(v, (-along, -p[1], -p[2]))
            count += 2
        elif far > 0.0 and abs(far - arm) < shortest:
            share = -arm / far
            worst[count] = azimuth_towards(v, (share * x, share * y, share * z))
            count += 1
        if on_guide:
            least, most = bounds_of(demands, D1 + leg - 1)
            if p[0] + arm > most:
                worst[count] = azimuth_towards(v, (arm, 0.0, 0.0))
                count += 1
            if p[0] - arm < least:
                worst[count] = azimuth_towards(v, (-arm, 0.0, 0.0))
                count += 1
        if leg < 3:
            continue
        for i in range(3):
            least, most = bounds_of(demands, X + i)
            for sign in (-1.0, 1.0):
                bound = most if sign > 0.0 else -least
                if sign * p[i] + arm > bound:
                    worst[count] = azimuth_towards(v, along_axis(i, sign * arm))
                    count += 1
    return count


@kernel(
    "void(f8[::1], f8[:,::1], f8[:,::1], f8[::1], f8[::1], f8[::1], f8[::1], f8[::1], f8[::1],"
    " i8[::1])"
)
def least_tilt_rows(
    row: FloatArray,
    demands: FloatArray,
    positions: FloatArray,
    tool: FloatArray,
    torsions: FloatArray,
    azimuths: FloatArray,
    tilts: FloatArray,
    least: FloatArray,
    towards: FloatArray,
    limits: IntArray,
) -> None:
    """Write the least of the greatest tilts over all azimuths, of n positions, in radians.

    Azimuths are at equal distances once around, and `tilts` is a scratch array, (m,) each. Written
    are least tilts, negative where tilt zero violates a limit, their azimuths and limits, (n,)
    each.
    """
    scratch, turn, worst = np.zeros(SCRATCH), np.zeros((3, 3, 3)), np.zeros(WORST)
    count = azimuths.shape[0]
    step = 2.0 * math.pi / count
    for index in range(positions.shape[0]):
        search = TurnSearch(row, demands, positions[index], tool, turn, scratch)
        torsion = torsions[index]
        best, towards[index], limits[index] = math.pi, 0.0, NO_LIMIT
        for k in range(count):
            tilts[k], limit = tilt_in(search, azimuths[k], torsion)
            if tilts[k] < best:
                best, towards[index], limits[index] = tilts[k], azimuths[k], limit
            if best < 0.0:
                break
        if best <= 0.0:
            least[index] = best
            continue
        for k in range(count):
            before, after = tilts[k - 1], tilts[(k + 1) % count]
            # Where limits meet, the first of them counts, so a minimum is one of a single smooth
            # limit. That of a parabola is lower than the azimuth by an eighth of the rise to its
            # neighbours at most; a quarter leaves room for other limits.
            rise = max(before, after) - tilts[k]
            is_lowest = tilts[k] <= before and tilts[k] <= after and rise > 0.0
            if not is_lowest or tilts[k] - 0.25 * rise > best:
                continue
            bracket = (azimuths[k] - step, azimuths[k], azimuths[k] + step)
            found, azimuth, limit = lowest_about(search, torsion, bracket, AZIMUTH_WIDTH)
            if found < best:
                best, towards[index], limits[index] = found, azimuth, limit
        for k in range(write_worst_azimuths(search, torsion, worst)):
            place = (worst[k] - azimuths[0]) % (2.0 * math.pi)
            left = int(place / step) % count
            tilt, _ = tilt_in(search, worst[k], torsion)
            if not (tilt < tilts[left] and tilt < tilts[(left + 1) % count]):
                continue
            low = worst[k] - (place - left * step)
            bracket = (low, worst[k], low + step)
            found, azimuth, limit = lowest_about(search, torsion, bracket, NARROW_WIDTH)
            if found < best:
                best, towards[index], limits[index] = found, azimuth, limit
        least[index] = best


@kernel("void(f8[::1], f8[:,::1], f8[::1], f8[::1], f8, f8[::1], f8[::1], i8[::1])")
def tilt_rows(
    row: FloatArray,
    demands: FloatArray,
    p: FloatArray,
    tool: FloatArray,
    torsion: float,
    azimuths: FloatArray,
    tilts: FloatArray,
    limits: IntArray,
) -> None:
    """Write the greatest tilts of a position in m azimuths, shape (m,), angles in radians."""
    search = TurnSearch(row, demands, p, tool, np.zeros((3, 3, 3)), np.zeros(SCRATCH))
    for k in range(azimuths.shape[0]):
        tilts[k], limits[k] = tilt_in(search, azimuths[k], torsion)
