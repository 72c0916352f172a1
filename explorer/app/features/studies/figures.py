"""The two plots of a study as HTML, and the designs and ranges at a place on them.

All designs of one colour are one path of SVG, which the browser draws at once. The drawing is
stretched to the room that there is; words stand beside it. A place on a plot is given in shares of
its width and height, from its lower left corner.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from functools import partial
from html import escape
from typing import Literal
from xml.etree.ElementTree import Element

import msgspec
import numpy as np

from explorer.app.features.studies import state
from explorer.app.widgets.markup import by_theme, reading
from explorer.export.drawings.markup import element, page_picture
from explorer.export.drawings.mechanism import round_length
from explorer.numerics.arrays import BoolArray, FloatArray, IntArray
from explorer.numerics.number_text import Unit, format_number
from explorer.sweep.results import Results, unit_of

PlotName = Literal["lines", "points"]
"""Name of a plot: each design as a line over all axes, or as a point over two of them."""

MOST_ROWS: dict[PlotName, int] = {"lines": 500, "points": 2000}
"""Largest number of designs in each plot; of more, the front and some of the others. More would
cover one another."""

# Least spread of an axis as a share of the size of its values; one with less is left out.
NO_SPREAD = 1e-9

FRONT, PICKED = "#c2185b", "#0a9d6c"
SCALE = tuple(
    by_theme(*colours)
    for colours in (
        ("#b9cbe0", "#3a5878"),
        ("#86a9ce", "#4a7fb0"),
        ("#4a7fb5", "#7aabd6"),
        ("#1f4f86", "#cbe2f6"),
    )
)
"""Colours of the designs that are not on the front, from the least to the greatest value."""
# Colours of points without the value that colours the others, and of those outside the brushes.
PLAIN, LEFT_OUT = "rgb(128 136 148 / 60%)", "rgb(128 136 148 / 22%)"
# Units of the drawing along its sides, and the share of a side before the first value of an axis
# and after the last one.
SIDE, RIM = 10_000, 0.04
# Pixels from a design within which a place is on it.
NEAR = 8.0
# Width of a brush on an axis of the lines, as a share of the distance of the axes.
BRUSH = 0.24
# Widths of lines, and of points, which are lines without a length, in pixels.
WIDTHS: dict[PlotName, dict[str, float]] = {
    "lines": {"": 0.8, "grid": 0.8, "front": 1, "picked": 3, "near": 3, "core": 0},
    "points": {"": 5, "grid": 1, "step": 1, "front": 8, "picked": 15, "near": 9, "core": 9},
}
HINTS: dict[PlotName, str] = {
    "lines": "Drag along an axis to filter, double-click to free the axes; click a design to open "
    "it.",
    "points": "Drag a box to filter, double-click to free both axes; click a design to open it.",
}

Place = tuple[float, float]


@dataclass(frozen=True)
class PlotRows:
    """Rows and axes of the plots of a study.

    Attributes:
        front: Whether each row is on the Pareto front, shape (n,).
        inside: Whether each row lies within all brushes, shape (n,).
        axes: Variables and measures that differ between rows.
        across, up: Axes of the points, from left to right and from bottom to top.
        colour: Axis that colours the plots.
        rows: Rows of each plot, with values on all of its axes, ascending.
        count: Number of rows with values on both axes of the points, drawn or not.
        lacking: Number of measured rows without a line, and the axes that they lack.
        picked: Row of the picked design, none or one, shape (0 or 1,).
        ends: Least and greatest value on each axis.
    """

    results: Results
    lengths: Unit
    front: BoolArray
    inside: BoolArray
    studies: state.Studies
    axes: tuple[str, ...]
    across: str
    up: str
    colour: str
    rows: Mapping[PlotName, IntArray]
    count: int
    lacking: tuple[int, tuple[str, ...]]
    picked: IntArray
    ends: Mapping[str, state.Range]

    def is_logarithmic(self, name: str) -> bool:
        """Whether an axis is one of logarithms: as chosen, where all values are positive."""
        return self.studies.logarithmic and self.ends[name][0] > 0.0

    def place_of(self, name: str, values: FloatArray) -> FloatArray:
        """Return the places of values along an axis."""
        low, high = self.ends[name]
        if self.is_logarithmic(name):
            values, low, high = np.log(values), math.log(low), math.log(high)
        return RIM + (1.0 - 2.0 * RIM) * (values - low) / (high - low)

    def value_at(self, name: str, place: float) -> float:
        """Return the value at a place along an axis."""
        low, high = self.ends[name]
        share = (place - RIM) / (1.0 - 2.0 * RIM)
        if self.is_logarithmic(name):
            return low * (high / low) ** share
        return low + share * (high - low)

    def axes_of(self, plot: PlotName) -> tuple[str, ...]:
        """Return the axes of a plot."""
        return self.axes if plot == "lines" else (self.across, self.up)

    def places(self, plot: PlotName, rows: IntArray) -> FloatArray:
        """Return the corners of the lines of rows, or their points, shape (n, k, 2)."""
        along = np.column_stack(
            [self.place_of(name, self.column(name)[rows]) for name in self.axes_of(plot)]
        )
        if plot == "points":
            return along[:, None]
        return np.stack([np.broadcast_to(self.middles(), along.shape), along], axis=-1)

    def middles(self) -> FloatArray:
        """Return the places of the axes of the lines from left to right, each within its column."""
        return (np.arange(len(self.axes)) + 0.5) / len(self.axes)

    def column(self, name: str) -> FloatArray:
        """Return the values of all rows."""
        return np.asarray(self.results.columns[name], dtype=np.float64)

    def title_of(self, name: str) -> str:
        """Return the title of an axis as HTML."""
        return f'<span class="title">{escape(state.title_of(name, self.lengths))}</span>'


def select_rows(
    results: Results, lengths: Unit, front: BoolArray, studies: state.Studies
) -> PlotRows | None:
    """Return the rows and axes of the plots; None while there is nothing to draw.

    `front` tells of each row whether it is on the Pareto front, shape (n,).
    """
    columns, study = results.columns, results.study
    is_measured = columns["status"] == "done"
    has_value = {
        name: is_measured & np.isfinite(np.asarray(columns[name], dtype=np.float64))
        for name in (*study.variables, *study.measures)
    }
    axes = tuple(name for name, rows in has_value.items() if _has_spread(columns[name][rows]))
    if len(axes) < 2:
        return None
    # Without a choice: the first objectives, then measures, then variables.
    objectives = [objective.measure for objective in study.objectives]
    order = dict.fromkeys((*objectives, *study.measures, *study.variables))
    first, second = [name for name in order if name in axes][:2]
    across = studies.across if studies.across in axes else first
    up = studies.up if studies.up in axes else second
    on_lines = np.all([has_value[name] for name in axes], axis=0)
    shown = front if studies.front_only else np.ones_like(front)
    points = np.flatnonzero(has_value[across] & has_value[up] & shown)
    lines = np.flatnonzero(on_lines & shown)
    picked = np.flatnonzero(columns["index"] == (-1 if studies.picked is None else studies.picked))
    keep = front.copy()
    keep[picked] = True
    return PlotRows(
        results,
        lengths,
        front,
        state.within(columns, studies.brushes),
        studies,
        axes,
        across,
        up,
        studies.colour if studies.colour in axes else first,
        {
            "lines": thin_out(lines, keep[lines], MOST_ROWS["lines"]),
            "points": thin_out(points, keep[points], MOST_ROWS["points"]),
        },
        len(points),
        (
            int((is_measured & ~on_lines).sum()),
            tuple(name for name in axes if (is_measured & ~has_value[name]).any()),
        ),
        picked,
        {name: _ends(columns[name][has_value[name]]) for name in axes},
    )


def thin_out(rows: IntArray, keep: BoolArray, most: int) -> IntArray:
    """Return at most `most` of some ascending rows (n,), those to keep first, thinned evenly."""
    if len(rows) <= most:
        return rows
    kept = _spread(rows[keep], most)
    others = _spread(rows[~keep], most - len(kept))
    return np.sort(np.concatenate([kept, others]))


def _spread(rows: IntArray, most: int) -> IntArray:
    """Return at most so many of some rows, evenly from the first to the last."""
    if len(rows) <= most:
        return rows
    return rows[np.linspace(0, len(rows) - 1, max(most, 0)).round().astype(np.int64)]


def _has_spread(values: FloatArray) -> bool:
    low, high = _ends(values)
    return len(values) > 0 and high - low > NO_SPREAD * max(abs(low), abs(high))


def row_at(plotted: PlotRows, plot: PlotName, place: Place, size: Place) -> int | None:
    """Return the row drawn nearest to a place on a plot, sized in pixels; None if none is near."""
    rows = plotted.rows[plot]
    corners, at = plotted.places(plot, rows) * size, np.multiply(place, size)
    start = corners[:, :-1] if plot == "lines" else corners
    way = np.diff(corners, axis=1) if plot == "lines" else np.zeros_like(corners)
    square = np.maximum((way**2).sum(axis=-1), 1e-12)
    share = np.clip(((at - start) * way).sum(axis=-1) / square, 0.0, 1.0)
    away = np.linalg.norm(start + share[..., None] * way - at, axis=-1).min(axis=1, initial=NEAR)
    return int(rows[away.argmin()]) if len(rows) and away.min() < NEAR else None


def brushes_in(plotted: PlotRows, plot: PlotName, corner: Place, other: Place) -> list[state.Brush]:
    """Return the brushes of a box between two corners: of the axes in it, or of the nearest one."""
    (left, right), (low, high) = map(sorted, zip(corner, other, strict=True))
    if plot == "points":
        ends = {plotted.across: (left, right), plotted.up: (low, high)}
    else:
        middles = plotted.middles()
        is_in = (middles >= left) & (middles <= right)
        is_in[np.abs(middles - 0.5 * (left + right)).argmin()] = True
        ends = {
            name: (low, high) for name, chosen in zip(plotted.axes, is_in, strict=True) if chosen
        }
    return [
        state.Brush(name, ((plotted.value_at(name, least), plotted.value_at(name, most)),))
        for name, (least, most) in ends.items()
    ]


def reading_of(plotted: PlotRows, plot: PlotName, row: int | None) -> tuple[str, str]:
    """Return the reading at a row of a plot and its path, both "" for none."""
    if row is None:
        return "", ""
    values = [(name, float(plotted.column(name)[row])) for name in plotted.axes_of(plot)]
    words = ", ".join(
        f"{state.label_of(name)} {unit_of(name, plotted.lengths).text(value)}"
        for name, value in values
    )
    index = plotted.results.columns["index"][row]
    return f"Design {index}: {words}", path_of(plotted.places(plot, np.array([row])))


def path_of(places: FloatArray) -> str:
    """Return lines or points, shape (n, k, 2), as the data of an SVG path."""
    scaled = np.rint(places * (SIDE, -SIDE) + (0.0, SIDE)).astype(np.int64).tolist()
    return "".join(f"M{' '.join(f'{x},{y}' for x, y in each)}h0" for each in scaled)


def ticks_of(plotted: PlotRows, name: str) -> FloatArray:
    """Return the values of an axis within its ends that are round in its unit, ascending."""
    factor = unit_of(name, plotted.lengths).factor
    low, high = (end * factor for end in plotted.ends[name])
    if plotted.is_logarithmic(name) and high > 10.0 * low:
        powers = np.arange(math.floor(math.log10(low)), math.ceil(math.log10(high)))
        ticks = np.outer(np.power(10.0, powers), (1.0, 2.0, 5.0)).ravel()
    else:
        step = round_length(0.3 * (high - low))
        ticks = step * np.arange(math.ceil(low / step), math.floor(high / step) + 1)
    return np.array(ticks[(ticks >= low) & (ticks <= high)] / factor, dtype=np.float64)


def lines_html(plotted: PlotRows) -> str:
    """Return the plot with an axis for each variable and measure, and a line for each design."""
    names, middles = plotted.axes, plotted.middles()
    grid = [[(x, RIM), (x, 1.0 - RIM)] for x in middles]
    half = 0.5 * BRUSH / len(names)
    boxes = [
        _box((x - half, x + half), ends)
        for x, name in zip(middles.tolist(), names, strict=True)
        for ends in _ranges(plotted, name)
    ]
    titles = "".join(map(plotted.title_of, names))
    least, most = (
        "".join(
            f"<span>{unit_of(name, plotted.lengths).number(plotted.ends[name][end], 3)}</span>"
            for name in names
        )
        for end in (0, 1)
    )
    drawing = _drawing(plotted, "lines", np.array(grid), boxes)
    return (
        f'<div class="ex-plot is-lines ex-dim ex-small" style="--columns:{len(names)}">'
        f"{titles}{most}{drawing}{least}</div>{reading(HINTS['lines'])}"
    )


def points_html(plotted: PlotRows) -> str:
    """Return the plot of two variables or measures, with a point for each design."""
    across, up = (ticks_of(plotted, name) for name in (plotted.across, plotted.up))
    onward, upward = unit_of(plotted.across, plotted.lengths), unit_of(plotted.up, plotted.lengths)
    x, y = plotted.place_of(plotted.across, across), plotted.place_of(plotted.up, up)
    grid = [[(at, 0.0), (at, 1.0)] for at in x] + [[(0.0, at), (1.0, at)] for at in y]
    columns, rows = _ranges(plotted, plotted.across), _ranges(plotted, plotted.up)
    free = [(0.0, 1.0)]
    boxes = [_box(x, y) for x in columns or free for y in rows or free if columns or rows]
    drawing = _drawing(plotted, "points", np.reshape(grid, (-1, 2, 2)), boxes)
    return (
        '<div class="ex-plot is-points ex-dim ex-small">'
        f"{plotted.title_of(plotted.up)}{_values('up', 'top', 1.0 - y, up * upward.factor)}"
        f"{drawing}{_values('across', 'left', x, across * onward.factor)}"
        f"{plotted.title_of(plotted.across)}</div>{reading(HINTS['points'])}"
    )


def _drawing(plotted: PlotRows, plot: PlotName, grid: FloatArray, boxes: list[Element]) -> str:
    """Return the designs of a plot as SVG, over lines and boxes."""
    rows = plotted.rows[plot]
    places, picked = plotted.places(plot, rows), np.isin(rows, plotted.picked)
    inside, front = plotted.inside[rows], plotted.front[rows]
    shares = plotted.place_of(plotted.colour, plotted.column(plotted.colour)[rows])
    is_coloured, others = np.isfinite(shares), inside & ~front
    level = (np.nan_to_num(shares) * len(SCALE)).astype(np.int64)
    best = inside & front
    path = partial(_path, WIDTHS[plot])
    pieces = [
        path("grid", grid),
        *boxes,
        path("", places[~inside], LEFT_OUT),
        path("", places[others & ~is_coloured], PLAIN),
        *(
            path("", places[others & is_coloured & (level == k)], colour)
            for k, colour in enumerate(SCALE)
        ),
    ]
    objectives = sorted(objective.measure for objective in plotted.results.study.objectives)
    if plot == "points" and objectives == sorted((plotted.across, plotted.up)):
        # The front from left to right, in a line.
        order = np.argsort(places[best][:, 0, 0], kind="stable")
        pieces.append(path("step", places[best][order].reshape(1, -1, 2), FRONT))
    pieces += [
        path("front", places[best], FRONT),
        path("picked", places[picked], PICKED),
        path("core", places[picked]),
    ]
    return page_picture(
        None,
        f"Plot of {len(rows)} designs as {plot}",
        *pieces,
        element("path", class_="near", stroke_width=WIDTHS[plot]["near"]),
        element("rect", class_="drag"),
        viewBox=f"0 0 {SIDE} {SIDE}",
        preserveAspectRatio="none",
        data_plot=msgspec.json.encode({"study": plotted.studies.name, "plot": plot}).decode(),
    )


def _path(
    widths: dict[str, float], look: str, places: FloatArray, colour: str = ""
) -> Element | None:
    if not places.size:
        return None
    style, data = f"stroke:{colour}" if colour else None, path_of(places)
    return element("path", class_=look or None, style=style, d=data, stroke_width=widths[look])


def _ranges(plotted: PlotRows, name: str) -> list[state.Range]:
    """Return the places of the ends of the brushes of an axis."""
    ranges = np.reshape(plotted.studies.ranges_of(name), (-1, 2))
    low, high = plotted.place_of(name, np.clip(ranges, *plotted.ends[name])).T.tolist()
    return list(zip(low, high, strict=True))


def _box(x: state.Range, y: state.Range) -> Element:
    """Return the box of a brush, from its ends on both axes."""
    left, right, top, bottom = (round(SIDE * each) for each in (*x, 1.0 - y[1], 1.0 - y[0]))
    sides = {"width": right - left, "height": bottom - top}
    return element("rect", class_="brush", x=left, y=top, **sides)


def _values(look: str, side: str, places: FloatArray, values: FloatArray) -> str:
    """Return values beside an axis, each at its place from one side."""
    texts = "".join(
        f'<span style="--{side}:{100.0 * place:.2f}%">{format_number(value, 5)}</span>'
        for place, value in zip(places.tolist(), values.tolist(), strict=True)
    )
    return f'<span class="values is-{look}">{texts}</span>'


def _ends(values: FloatArray) -> state.Range:
    if not len(values):
        return 0.0, 1.0
    return float(values.min()), float(values.max())
