"""The largest values of functions over a box, by bounds over cells.

Of each cell, values that are attained in it and upper bounds of all its values are computed. Cells
of which a bound exceeds what is asked, or the largest value found, are halved along every axis, or
along the one that lowers the bounds most.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from explorer.numerics.arrays import FloatArray, IntArray

# Cells that are measured at once, and the most cells of a search.
BATCH, MOST = 4096, 200_000
# Share by which the bound of an excess may exceed the largest one attained.
LOOSE = 1e-3
# Cells with which an axis is chosen, and excess of a bound from which on all count as the same.
TRIES, FAR = 8, 10.0


class CellValues(NamedTuple):
    """Values of m functions in n cells of a box with k axes, or in the one of the whole box.

    Attributes:
        values: Largest values attained, shape (n, m).
        places: Where they are attained, shape (n, m, k).
        bounds: Upper bounds, shape (n, m); infinite where none is known.
    """

    values: FloatArray
    places: FloatArray
    bounds: FloatArray

    def merged(self, other: CellValues) -> CellValues:
        """Return the larger values with their places, and the larger bounds, of two boxes."""
        is_less = self.values < other.values
        return CellValues(
            np.where(is_less, other.values, self.values),
            np.where(is_less[..., None], other.places, self.places),
            np.maximum(self.bounds, other.bounds),
        )


def corners_of_cells(lows: FloatArray, highs: FloatArray) -> FloatArray:
    """Return the corners of n cells given by their lows and highs (n, k), shape (n, 2^k, k)."""
    shares = np.array([*itertools.product((0.0, 1.0), repeat=lows.shape[1])])
    return np.asarray(np.where(shares == 1.0, highs[:, None], lows[:, None]))


def largest_values(
    measure: Callable[[FloatArray, FloatArray], CellValues],
    lows: FloatArray,
    highs: FloatArray,
    enough: float = 0.0,
    most: int = MOST,
    *,
    along_one: bool = False,
    resolves: bool = True,
) -> CellValues:
    """Return the largest values of m functions over a box, without the axis of the cells.

    Bounds are loose where too many cells would have to be divided.

    Args:
        measure: Function that measures cells given by their lows and highs, shape (n, k) each.
        lows: Low ends of the box, shape (k,).
        highs: High ends of the box; an axis may have no length.
        enough: Level up to which no value is resolved: the search only proves that none is above
            it. Above, it ends where the bound exceeds the level by little more than the largest
            value does.
        most: Largest number of cells.
        along_one: Whether cells are halved along one axis at a time, which saves cells where they
            have many axes, rather than along all of them.
        resolves: Whether cells are divided for values above the level, too.
    """
    size, low, left = highs - lows, lows[None], most
    found, least = None, np.zeros(0)
    while found is None or len(low):
        axes = np.flatnonzero(size)
        if along_one and found is not None:
            axes = axes[[_best_axis(measure, low, size, axes, least)]]
        half = size.copy()
        half[axes] *= 0.5
        for axis in axes:
            low = np.concatenate([low, low + np.where(np.arange(len(size)) == axis, half, 0.0)])
        size = half
        batches = np.array_split(low, 1 + len(low) // BATCH)
        measured = [measure(each, np.minimum(each + size, highs)) for each in batches]
        cells = CellValues(*map(np.concatenate, zip(*measured, strict=True)))
        rows = cells.values.argmax(axis=0)
        columns = np.arange(len(rows))
        none = np.full(len(rows), -np.inf)
        worst = CellValues(cells.values[rows, columns], cells.places[rows, columns], none)
        worst = worst if found is None else found.merged(worst)
        best = worst.values
        least = enough + (1.0 + LOOSE) * np.maximum(best - enough, 0.0)
        if not resolves:
            least[best > enough] = np.inf
        divides, left = np.any(cells.bounds > least, axis=1), left - len(low)
        parts = 2 if along_one else 2 ** len(axes)
        divides &= size.any() and parts * np.count_nonzero(divides) <= left
        bounds = np.where(divides[:, None], -np.inf, cells.bounds).max(axis=0)
        bounds = np.maximum(worst.bounds, bounds)
        found, low = worst._replace(bounds=np.maximum(bounds, best)), low[divides]
    return found


def _best_axis(
    measure: Callable[[FloatArray, FloatArray], CellValues],
    low: FloatArray,
    size: FloatArray,
    axes: IntArray,
    least: FloatArray,
) -> int:
    """Return which of some axes lowers the bounds of a few cells most towards levels (m,)."""
    few = low[:: 1 + len(low) // TRIES]
    lows, highs = list[FloatArray](), list[FloatArray]()
    for axis in axes:
        half = np.where(np.arange(len(size)) == axis, 0.5 * size, 0.0)
        lows += [few, few + half]
        highs += [few + size - half, few + size]
    bounds = measure(np.concatenate(lows), np.concatenate(highs)).bounds
    above = np.where(bounds > least, np.minimum(bounds - least, FAR), 0.0)
    return int(above.reshape(len(axes), -1).sum(axis=1).argmin())
