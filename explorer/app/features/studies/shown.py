"""What of a study is drawn: its rows, not more of them than a browser can, and its axes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from explorer.app.state.studies import Studies, within
from explorer.numerics.arrays import BoolArray, FloatArray, IntArray
from explorer.sweep.front import costs
from explorer.sweep.results import Results
from explorer.sweep.study import Study

MOST_ROWS = 5000
"""Of more rows the front and some of the others are drawn."""

# What became of designs that were measured; of others there is little or nothing to draw.
MEASURED = ("done", "not converged")

# Between two ends that are closer an axis has nothing to tell, as a share of their size.
NO_SPREAD = 1e-9


@dataclass(frozen=True)
class Shown:
    """What of a study is drawn.

    Attributes:
        results: All rows.
        front: Which are on the Pareto front, shape (n,).
        inside: Which lie within all brushes, shape (n,).
        studies: How it is looked at.
        axes: Variables and measures that differ between rows.
        rows: Those that are points of the scatter plot, ascending: they have both its axes.
        lines: Those that are lines of the parallel axes, ascending: they have all of these.
        count: How many could be points.
        lacking: How many rows that were measured have no line, and which axes they lack.
    """

    results: Results
    front: BoolArray
    inside: BoolArray
    studies: Studies
    axes: tuple[str, ...]
    rows: IntArray
    lines: IntArray
    count: int
    lacking: tuple[int, tuple[str, ...]]

    @property
    def across(self) -> str:
        """What the scatter plot shows from left to right."""
        return _chosen(self.results.study, self.axes, self.studies.across, 0)

    @property
    def up(self) -> str:
        """What it shows from bottom to top."""
        return _chosen(self.results.study, self.axes, self.studies.up, 1)

    @property
    def colour(self) -> str:
        """What colours the plots."""
        return _chosen(self.results.study, self.axes, self.studies.colour, 0)

    def column(self, name: str) -> FloatArray:
        """Return the values of all rows."""
        return np.asarray(self.results.columns[name], dtype=np.float64)

    @property
    def picked(self) -> IntArray:
        """The row that was picked last, none or one."""
        return np.flatnonzero(self.results.columns["index"] == _index(self.studies.picked))


def shown(results: Results, front: BoolArray, studies: Studies) -> Shown | None:
    """Return what of a study is drawn; None while there is nothing to draw.

    Args:
        results: All rows.
        front: Which are on the Pareto front, shape (n,).
        studies: How it is looked at.
    """
    columns, study = results.columns, results.study
    is_measured = np.isin(columns["status"].astype(str), MEASURED)
    known = {
        name: is_measured & np.isfinite(np.asarray(columns[name], dtype=np.float64))
        for name in (*study.varied, *study.measures)
    }
    axes = tuple(name for name, rows in known.items() if _has_spread(columns[name][rows]))
    if len(axes) < 2:
        return None
    across = _chosen(study, axes, studies.across, 0)
    up = _chosen(study, axes, studies.up, 1)
    on_lines = np.all([known[name] for name in axes], axis=0)
    points, lines = np.flatnonzero(known[across] & known[up]), np.flatnonzero(on_lines)
    keep = front | (columns["index"] == _index(studies.picked))
    return Shown(
        results,
        front,
        within(columns, studies.brushes),
        studies,
        axes,
        thinned(points, keep[points], MOST_ROWS),
        thinned(lines, keep[lines], MOST_ROWS),
        len(points),
        (
            int((is_measured & ~on_lines).sum()),
            tuple(name for name in axes if (is_measured & ~known[name]).any()),
        ),
    )


def thinned(rows: IntArray, keep: BoolArray, most: int) -> IntArray:
    """Return at most so many of some rows, ascending, those to keep first.

    Args:
        rows: Ascending, shape (n,).
        keep: Which of them must stay, shape (n,); of more than `most` some are left out too.
        most: How many.
    """
    if len(rows) <= most:
        return rows
    kept = _spread(rows[keep], most)
    others = _spread(rows[~keep], most - len(kept))
    return np.sort(np.concatenate([kept, others]))


def default_axes(study: Study, axes: Sequence[str]) -> tuple[str, str]:
    """Return two different axes: the first objectives, then measures, then variables."""
    wanted = [each.measure for each in study.objectives]
    order = dict.fromkeys((*wanted, *study.measures, *study.varied))
    first, second = [name for name in order if name in axes][:2]
    return first, second


def _chosen(study: Study, axes: Sequence[str], name: str | None, place: int) -> str:
    if name is not None and name in axes:
        return name
    return default_axes(study, axes)[place]


def ordered_front(results: Results, front: BoolArray) -> IntArray:
    """Return the rows on the front, the best in the first objective first.

    Args:
        results: All rows.
        front: Which are on the front, shape (n,).
    """
    rows = np.flatnonzero(front)
    if not len(rows):
        return rows
    first = costs(results.columns, results.study.objectives[:1])[rows, 0]
    return rows[np.argsort(first, kind="stable")]


def _spread(rows: IntArray, most: int) -> IntArray:
    """Return at most so many of some rows, evenly from the first to the last."""
    if len(rows) <= most:
        return rows
    return rows[np.linspace(0, len(rows) - 1, max(most, 0)).round().astype(np.int64)]


def _has_spread(values: NDArray[Any]) -> bool:
    if not len(values):
        return False
    low, high = float(values.min()), float(values.max())
    return high - low > NO_SPREAD * max(abs(low), abs(high))


def _index(picked: int | None) -> int:
    return -1 if picked is None else picked
