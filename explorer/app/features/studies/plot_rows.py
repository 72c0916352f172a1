"""Rows and axes of a study that its plots show, limited to what a browser can draw."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from explorer.app.state.studies import Studies, within
from explorer.numerics.arrays import BoolArray, FloatArray, IntArray
from explorer.sweep.results import Results, costs

MOST_ROWS = 5000
"""Largest number of rows drawn; of more rows, the front and some of the others."""

# Statuses of designs that have measures.
MEASURED = ("done", "not converged")

# Least spread of an axis as a share of the size of its values; one with less is left out.
NO_SPREAD = 1e-9


@dataclass(frozen=True)
class PlotRows:
    """Rows and axes of the plots of a study.

    Attributes:
        results: All rows.
        front: Whether each row is on the Pareto front, shape (n,).
        inside: Whether each row lies within all brushes, shape (n,).
        studies: Open study, brushes, axes and pick.
        axes: Variables and measures that differ between rows.
        across, up: Axes of the scatter plot, from left to right and from bottom to top.
        colour: Axis that colours the plots.
        rows: Rows with values on both axes of the scatter plot, ascending.
        lines: Rows with values on all axes of the parallel lines, ascending.
        count: Number of rows with values on both axes of the scatter plot, drawn or not.
        lacking: Number of measured rows without a line, and the axes that they lack.
    """

    results: Results
    front: BoolArray
    inside: BoolArray
    studies: Studies
    axes: tuple[str, ...]
    across: str
    up: str
    colour: str
    rows: IntArray
    lines: IntArray
    count: int
    lacking: tuple[int, tuple[str, ...]]

    def column(self, name: str) -> FloatArray:
        """Return the values of all rows."""
        return np.asarray(self.results.columns[name], dtype=np.float64)

    @property
    def picked(self) -> IntArray:
        """The row of the picked design, none or one, shape (0 or 1,)."""
        return np.flatnonzero(_is_picked(self.results, self.studies))


def select_rows(results: Results, front: BoolArray, studies: Studies) -> PlotRows | None:
    """Return the rows and axes of the plots; None while there is nothing to draw.

    Args:
        results: All rows.
        front: Whether each row is on the Pareto front, shape (n,).
        studies: Open study, brushes, axes and pick.
    """
    columns, study = results.columns, results.study
    is_measured = np.isin(columns["status"].astype(str), MEASURED)
    has_value = {
        name: is_measured & np.isfinite(np.asarray(columns[name], dtype=np.float64))
        for name in (*study.varied, *study.measures)
    }
    axes = tuple(name for name, rows in has_value.items() if _has_spread(columns[name][rows]))
    if len(axes) < 2:
        return None
    # Without a choice: the first objectives, then measures, then variables.
    objectives = [objective.measure for objective in study.objectives]
    order = dict.fromkeys((*objectives, *study.measures, *study.varied))
    first, second = [name for name in order if name in axes][:2]
    across = studies.across if studies.across in axes else first
    up = studies.up if studies.up in axes else second
    on_lines = np.all([has_value[name] for name in axes], axis=0)
    points, lines = np.flatnonzero(has_value[across] & has_value[up]), np.flatnonzero(on_lines)
    keep = front | _is_picked(results, studies)
    return PlotRows(
        results,
        front,
        within(columns, studies.brushes),
        studies,
        axes,
        across,
        up,
        studies.colour if studies.colour in axes else first,
        thin_out(points, keep[points], MOST_ROWS),
        thin_out(lines, keep[lines], MOST_ROWS),
        len(points),
        (
            int((is_measured & ~on_lines).sum()),
            tuple(name for name in axes if (is_measured & ~has_value[name]).any()),
        ),
    )


def thin_out(rows: IntArray, keep: BoolArray, most: int) -> IntArray:
    """Return at most `most` rows, ascending, preferring those to keep.

    Args:
        rows: Rows, ascending, shape (n,).
        keep: Whether each is to stay, shape (n,); more than `most` are thin_out too.
        most: Largest number of rows returned.
    """
    if len(rows) <= most:
        return rows
    kept = _spread(rows[keep], most)
    others = _spread(rows[~keep], most - len(kept))
    return np.sort(np.concatenate([kept, others]))


def sort_front(results: Results, front: BoolArray) -> IntArray:
    """Return the rows on the front, the best in the first objective first.

    Args:
        results: All rows.
        front: Whether each row is on the front, shape (n,).
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


def _is_picked(results: Results, studies: Studies) -> BoolArray:
    return results.columns["index"] == (-1 if studies.picked is None else studies.picked)
