"""The two plots of a study as plain data for Plotly, limited to what a browser can draw.

They are made without Plotly itself. Numbers go as pack arrays (`bdata`), which is a tenth of the
work of text.
"""

from __future__ import annotations

import base64
import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from explorer.app.features.studies import state
from explorer.numerics.arrays import BoolArray, FloatArray, IntArray
from explorer.numerics.number_text import format_number
from explorer.sweep.results import Results

Figure: TypeAlias = dict[str, Any]

MOST_ROWS, MOST_LINES = 2000, 500
"""Largest numbers of rows drawn as points and as lines; of more rows, the front and some of the
others. More would cover one another, and without a graphics card would stop the page."""

# Statuses of designs that have measures.
MEASURED = ("done", "not converged")

# Least spread of an axis as a share of the size of its values; one with less is left out.
NO_SPREAD = 1e-9

FRONT, PICKED = "#c2185b", "#0a9d6c"
# Colours of the other designs from the least to the greatest value, by whether the page is dark.
SCALE = {
    False: ("#c9d6e6", "#8fb0d2", "#4a7fb5", "#1f4f86"),
    True: ("#34506f", "#4477a6", "#7aabd6", "#cbe2f6"),
}
# Colours of points without the value that colours the others, and of those outside the brushes.
PLAIN = "rgba(128,136,148,0.6)"
LEFT_OUT = "rgba(128,136,148,0.22)"
TEXT = "#7d8794"
GRID = "rgba(128,136,148,0.22)"
# Background of the plots, by theme; digits have a rim of this colour.
PAPER = {False: "#ffffff", True: "#242424"}
# Colour of the values on the axes, by theme.
INK = {False: "#1f2328", True: "#f0f2f4"}
# Half the width of a brush on an axis of the parallel lines, as a share of their distance.
BRUSH = 0.06
# Tilt of the titles of the parallel lines, in degrees.
TILT = 24


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
        picked: Row of the picked design, none or one, shape (0 or 1,).
        ends: Least and greatest value on each axis.
    """

    results: Results
    front: BoolArray
    inside: BoolArray
    studies: state.Studies
    axes: tuple[str, ...]
    across: str
    up: str
    colour: str
    rows: IntArray
    lines: IntArray
    count: int
    lacking: tuple[int, tuple[str, ...]]
    picked: IntArray
    ends: Mapping[str, state.Range]

    def is_logarithmic(self, name: str) -> bool:
        """Whether an axis is one of logarithms: as chosen, where all values are positive."""
        return self.studies.logarithmic and self.ends[name][0] > 0.0

    def share_of(self, name: str, values: FloatArray) -> FloatArray:
        """Return the heights of values on an axis of the parallel lines, from 0 to 1."""
        low, high = self.ends[name]
        if self.is_logarithmic(name):
            return np.log(values / low) / math.log(high / low)
        return (values - low) / (high - low)

    def value_at(self, name: str, share: float) -> float:
        """Return the value at a height of an axis of the parallel lines."""
        low, high = self.ends[name]
        if self.is_logarithmic(name):
            return low * (high / low) ** share
        return low + share * (high - low)

    def column(self, name: str) -> FloatArray:
        """Return the values of all rows."""
        return np.asarray(self.results.columns[name], dtype=np.float64)


def select_rows(results: Results, front: BoolArray, studies: state.Studies) -> PlotRows | None:
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
    shown = front if studies.front_only else np.ones_like(front)
    points = np.flatnonzero(has_value[across] & has_value[up] & shown)
    lines = np.flatnonzero(on_lines & shown)
    picked = np.flatnonzero(columns["index"] == (-1 if studies.picked is None else studies.picked))
    keep = front.copy()
    keep[picked] = True
    return PlotRows(
        results,
        front,
        state.within(columns, studies.brushes),
        studies,
        axes,
        across,
        up,
        studies.colour if studies.colour in axes else first,
        thin_out(points, keep[points], MOST_ROWS),
        thin_out(lines, keep[lines], MOST_LINES),
        len(points),
        (
            int((is_measured & ~on_lines).sum()),
            tuple(name for name in axes if (is_measured & ~has_value[name]).any()),
        ),
        picked,
        {name: _ends(columns[name][has_value[name]]) for name in axes},
    )


def thin_out(rows: IntArray, keep: BoolArray, most: int) -> IntArray:
    """Return at most `most` rows, ascending, preferring those to keep.

    Args:
        rows: Rows, ascending, shape (n,).
        keep: Whether each is to stay, shape (n,); they are thinned out too if more than `most`.
        most: Largest number of rows returned.
    """
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


def parallel(plotted: PlotRows, revision: int, *, dark: bool) -> Figure:
    """Return the plot with an axis for each variable and measure, and a line for each design.

    The lines of one colour are one path of the page, which takes a thousandth of the time that
    Plotly's own plot of this kind takes without a graphics card.

    Args:
        plotted: Rows and axes to draw.
        revision: Number that differs from the last plot's, so that Plotly forgets its boxes.
        dark: Whether the page is dark.
    """
    rows, names = plotted.lines, plotted.axes
    inside, front = plotted.inside[rows], plotted.front[rows]
    heights = np.column_stack(
        [plotted.share_of(name, plotted.column(name)[rows]) for name in names]
    )
    level = heights[:, names.index(plotted.colour)]
    bin_of = np.minimum(level * len(SCALE[dark]), len(SCALE[dark]) - 1).astype(np.int64)
    others = inside & ~front
    groups = [
        (~inside, LEFT_OUT, 0.7),
        *((others & (bin_of == k), colour, 0.8) for k, colour in enumerate(SCALE[dark])),
        (inside & front, FRONT, 1.0),
        (np.isin(rows, plotted.picked), PICKED, 3.0),
    ]
    gap = np.array([math.nan])
    traces: list[Figure] = [
        {
            "type": "scatter",
            "mode": "lines",
            "x": pack(np.tile(np.append(np.arange(len(names)), gap), int(which.sum()))),
            "y": pack(np.column_stack([heights[which], np.repeat(gap, which.sum())]).ravel()),
            "customdata": pack(plotted.results.columns["index"][rows[which]], "i4"),
            "line": {"color": colour, "width": width},
            "hoverinfo": "skip",
        }
        for which, colour, width in groups
        if which.any()
    ]
    marks = [(k, share) for k in range(len(names)) for share in (0.0, 0.5, 1.0)]
    traces.append(
        {
            "type": "scatter",
            "mode": "text",
            "x": [k for k, _ in marks],
            "y": [share for _, share in marks],
            "text": [format_number(plotted.value_at(names[k], share), 3) for k, share in marks],
            "textposition": "middle right",
            "textfont": {"size": 10, "color": INK[dark]},
            "cliponaxis": False,
            "hoverinfo": "skip",
        }
    )
    margin = {"l": 34, "r": 104, "t": 70, "b": 12}
    figure = _figure(plotted, "parallel", traces, margin, dark=dark)
    figure["layout"]["meta"] |= {
        "axes": names,
        "ends": [[*plotted.ends[name], plotted.is_logarithmic(name)] for name in names],
    }
    figure["layout"] |= {
        "xaxis": {
            "tickvals": [*range(len(names))],
            "ticktext": [*map(state.short_title_of, names)],
            "tickangle": -TILT,
            "ticklabeloverflow": "allow",
            "side": "top",
            "range": [-0.1, len(names) - 0.9],
            "gridcolor": GRID,
            "zeroline": False,
            "fixedrange": True,
        },
        "yaxis": {"visible": False, "range": [-0.05, 1.05], "fixedrange": True},
        "hovermode": False,
        "selectdirection": "d",
        "shapes": [
            _box(
                (k - BRUSH, k + BRUSH),
                plotted.share_of(name, np.clip(ends, *plotted.ends[name])).tolist(),
            )
            for k, name in enumerate(names)
            for ends in plotted.studies.ranges_of(name)
        ],
        **_selecting(revision),
    }
    return figure


def scatter(plotted: PlotRows, revision: int, *, dark: bool) -> Figure:
    """Return the plot of two measures with a point for each design; see `parallel`."""
    front, inside = plotted.front[plotted.rows], plotted.inside[plotted.rows]
    is_picked = np.isin(plotted.rows, plotted.picked)
    colours = plotted.column(plotted.colour)[plotted.rows]
    is_coloured = np.isfinite(colours)
    low, high = _ends(colours[is_coloured])
    gradient = {
        "colorscale": [[k / 3, colour] for k, colour in enumerate(SCALE[dark])],
        "cmin": low,
        "cmax": high,
        "colorbar": {
            "title": {
                "text": state.title_of(plotted.colour),
                "side": "right",
                "font": {"size": 11},
            },
            "thickness": 9,
            "outlinewidth": 0,
            "nticks": 5,
        },
    }
    others = inside & ~front
    coloured = {"size": 6, "color": pack(colours[others & is_coloured]), **gradient}
    disc = {"size": 8, "color": FRONT, "line": {"width": 1, "color": PAPER[dark]}}
    ring: Figure = {"size": 15, "symbol": "circle-open", "color": PICKED}
    ring["line"] = {"width": 3, "color": PICKED}
    traces = [
        _points(plotted, ~inside & ~front, {"size": 5, "color": LEFT_OUT}),
        _points(plotted, others & is_coloured, coloured),
        _points(plotted, ~inside & front, {"size": 6, "color": FRONT, "opacity": 0.25}),
    ]
    if not is_coloured.all():
        traces.append(_points(plotted, others & ~is_coloured, {"size": 6, "color": PLAIN}))
    on_front = _points(plotted, inside & front, disc)
    objectives = [objective.measure for objective in plotted.results.study.objectives]
    if sorted(objectives) == sorted((plotted.across, plotted.up)):
        # The front's points from left to right, in a line.
        on_front |= {"mode": "lines+markers", "line": {"color": FRONT, "width": 1.5}}
    traces += [on_front, _points(plotted, is_picked, ring)]
    figure = _figure(plotted, "scatter", traces, {"l": 62, "r": 10, "t": 12, "b": 42}, dark=dark)
    figure["layout"] |= {
        "xaxis": _axis(plotted, plotted.across),
        "yaxis": _axis(plotted, plotted.up),
        "hovermode": "closest",
        "shapes": _boxes(plotted),
        **_selecting(revision),
    }
    return figure


def _selecting(revision: int) -> Figure:
    """Return the part of a layout by which a drag selects a box, forgotten at a new revision."""
    return {"dragmode": "select", "selections": (), "selectionrevision": revision}


def pack(values: NDArray[Any], kind: str = "f4") -> dict[str, str]:
    """Return numbers as Plotly takes them in one piece: "f4" or "i4"."""
    data = np.ascontiguousarray(values, dtype=f"<{kind}").tobytes()
    return {"dtype": kind, "bdata": base64.b64encode(data).decode()}


def _points(plotted: PlotRows, which: BoolArray, marker: Mapping[str, Any]) -> Figure:
    rows = plotted.rows[which]
    rows = rows[np.argsort(plotted.column(plotted.across)[rows], kind="stable")]
    x, y = (
        f"{state.label_of(name)} %{{{axis}:,.5~r}} {state.unit_of(name)}".replace(" °", "°")
        for axis, name in (("x", plotted.across), ("y", plotted.up))
    )
    return {
        "type": "scatter",
        "mode": "markers",
        "x": pack(plotted.column(plotted.across)[rows]),
        "y": pack(plotted.column(plotted.up)[rows]),
        "customdata": pack(plotted.results.columns["index"][rows], "i4"),
        "hovertemplate": f"<b>design %{{customdata}}</b><br>{x}<br>{y}<extra></extra>",
        "marker": dict(marker),
        # The server draws the points outside the brushes.
        "unselected": {"marker": {"opacity": marker.get("opacity", 1.0)}},
    }


def _boxes(plotted: PlotRows) -> list[dict[str, Any]]:
    """Return the brushes of the two axes as boxes, or as bands where one is free."""
    across = plotted.studies.ranges_of(plotted.across)
    up = plotted.studies.ranges_of(plotted.up)
    if not across and not up:
        return []
    free: tuple[tuple[state.Range, str], ...] = (((0.0, 1.0), " domain"),)
    columns = tuple((ends, "") for ends in across) or free
    rows = tuple((ends, "") for ends in up) or free
    return [
        {**_box(x, y), "xref": f"x{x_domain}", "yref": f"y{y_domain}"}
        for x, x_domain in columns
        for y, y_domain in rows
    ]


def _box(x: state.Range, y: state.Range) -> Figure:
    """Return a box over points and lines, from its ends on both axes."""
    return {
        "type": "rect",
        "x0": x[0],
        "x1": x[1],
        "y0": y[0],
        "y1": y[1],
        "fillcolor": "rgba(34,104,212,0.12)",
        "line": {"width": 1, "color": "rgba(34,104,212,0.55)"},
    }


def _axis(plotted: PlotRows, name: str) -> dict[str, Any]:
    return {
        "type": "log" if plotted.is_logarithmic(name) else "linear",
        "title": {"text": state.title_of(name), "standoff": 6, "font": {"size": 11}},
        "gridcolor": GRID,
        "zeroline": False,
        "nticks": 7,
        "separatethousands": True,
        # A zoom stays as long as the axis is the same.
        "uirevision": name,
    }


def _figure(
    plotted: PlotRows, plot: str, data: list[Figure], margin: Mapping[str, int], *, dark: bool
) -> Figure:
    layout = {
        "showlegend": False,
        "paper_bgcolor": PAPER[dark],
        "plot_bgcolor": "rgba(0,0,0,0)",
        "font": {"color": TEXT if not dark else "#aeb6c0", "family": "inherit", "size": 11},
        "margin": dict(margin),
        "hoverlabel": {"font": {"size": 11}},
        "separators": ".,",
        "meta": {
            "explorer": plot,
            "study": plotted.studies.name,
            "axes": [plotted.across, plotted.up],
        },
    }
    config = {"displayModeBar": False, "doubleClick": "reset", "responsive": False}
    return {"data": data, "layout": layout, "config": config}


def _ends(values: FloatArray) -> state.Range:
    if not len(values):
        return 0.0, 1.0
    return float(values.min()), float(values.max())
