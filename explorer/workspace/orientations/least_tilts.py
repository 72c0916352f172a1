"""The least over all azimuths of the greatest tilts of a position."""

from __future__ import annotations

import math

import numpy as np

from explorer.numerics.arrays import FloatArray, IntArray
from explorer.numerics.compiled import helper, kernel
from explorer.workspace.orientations.turn_polynomials import SCRATCH, write_tilt
from explorer.workspace.orientations.turns import HALF_TURN, NO_LIMIT, first_limit

# Share of a bracket that the search by the golden section keeps, and the width at which it ends,
# in radians.
GOLDEN_SECTION = 0.5 * (math.sqrt(5.0) - 1.0)
AZIMUTH_WIDTH = 1e-4


@helper
def tilt_in(
    row: FloatArray,
    cones: FloatArray,
    p: FloatArray,
    azimuth: float,
    torsion: float,
    turn: FloatArray,
    scratch: FloatArray,
) -> tuple[float, int]:
    """Return the greatest tilt of a position in one azimuth and its limit, in radians."""
    write_tilt(azimuth, torsion, turn)
    return first_limit(row, cones, p, turn, HALF_TURN, scratch)


@helper
def lowest_between(
    row: FloatArray,
    cones: FloatArray,
    p: FloatArray,
    torsion: float,
    low: float,
    high: float,
    turn: FloatArray,
    scratch: FloatArray,
) -> tuple[float, float, int]:
    """Return the least of the greatest tilts between two azimuths, its azimuth and its limit.

    The search by the golden section narrows the bracket to `AZIMUTH_WIDTH`, at which the tilt of
    a smooth minimum is good to rounding.
    """
    span = GOLDEN_SECTION * (high - low)
    first, second = high - span, low + span
    at_first, limit_first = tilt_in(row, cones, p, first, torsion, turn, scratch)
    at_second, limit_second = tilt_in(row, cones, p, second, torsion, turn, scratch)
    while high - low > AZIMUTH_WIDTH:
        if at_first <= at_second:
            high, second, at_second, limit_second = second, first, at_first, limit_first
            first = high - GOLDEN_SECTION * (high - low)
            at_first, limit_first = tilt_in(row, cones, p, first, torsion, turn, scratch)
        else:
            low, first, at_first, limit_first = first, second, at_second, limit_second
            second = low + GOLDEN_SECTION * (high - low)
            at_second, limit_second = tilt_in(row, cones, p, second, torsion, turn, scratch)
    if at_first <= at_second:
        return at_first, first, limit_first
    return at_second, second, limit_second


@kernel("void(f8[::1], f8[:,::1], f8[:,::1], f8[::1], f8[::1], f8[::1], f8[::1], f8[::1], i8[::1])")
def least_tilt_rows(
    row: FloatArray,
    cones: FloatArray,
    positions: FloatArray,
    torsions: FloatArray,
    azimuths: FloatArray,
    tilts: FloatArray,
    least: FloatArray,
    towards: FloatArray,
    limits: IntArray,
) -> None:
    """Write the least of the greatest tilts over all azimuths, of n positions, in radians.

    Args:
        row: Row of `Rules`.
        cones: Cones of `Rules`.
        positions: Positions of b4, shape (n, 3).
        torsions: Torsion of each position in radians, shape (n,).
        azimuths: Azimuths in radians at equal distances once around, shape (m,).
        tilts: Scratch array, shape (m,).
        least: Least tilt of each position, negative where tilt zero violates a limit, shape (n,).
        towards: Azimuth of the least tilt, shape (n,).
        limits: Number of the limit that ends it, shape (n,).
    """
    scratch, turn = np.zeros(SCRATCH), np.zeros((3, 3, 3))
    count = azimuths.shape[0]
    step = 2.0 * math.pi / count
    for index in range(positions.shape[0]):
        p, torsion = positions[index], torsions[index]
        best, towards[index], limits[index] = HALF_TURN, 0.0, NO_LIMIT
        for k in range(count):
            tilts[k], limit = tilt_in(row, cones, p, azimuths[k], torsion, turn, scratch)
            if tilts[k] < best:
                best, towards[index], limits[index] = tilts[k], azimuths[k], limit
            if best < 0.0:
                break
        if best > 0.0:
            for k in range(count):
                before, after = tilts[k - 1], tilts[(k + 1) % count]
                # Between its neighbours a smooth minimum is lower by an eighth of the rise at most.
                rise = max(before, after) - tilts[k]
                is_lowest = tilts[k] <= before and tilts[k] <= after and rise > 0.0
                if not is_lowest or tilts[k] - 0.25 * rise > best:
                    continue
                found, azimuth, limit = lowest_between(
                    row,
                    cones,
                    p,
                    torsion,
                    azimuths[k] - step,
                    azimuths[k] + step,
                    turn,
                    scratch,
                )
                if found < best:
                    best, towards[index], limits[index] = found, azimuth, limit
        least[index] = best
