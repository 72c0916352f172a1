"""Volumes of regions by columns along x, each of exact length, and of the part that holds a load.

The lengths of columns (`explorer.workspace.slices.columns`) are integrated along z and then along y
by Simpson's rule; the panels are halved where third differences are largest. The sum of their sizes
is the stated error.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cache
from typing import NamedTuple

import numpy as np

from explorer.numerics.arrays import FloatArray, for_kernel
from explorer.numerics.compiled import MANY_ROWS
from explorer.statics.load_cases import FORCE
from explorer.workspace.limits.region import Region
from explorer.workspace.slices.columns import (
    AREA,
    AREA_ERROR,
    EDGE,
    FILLED,
    HIGH_X,
    HIGH_Z,
    LOW_X,
    LOW_Z,
    SLICE,
    integrate_columns,
)

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
    """Slices across y of a region, or of the part of it that holds a load, if it has a case."""

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
