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
from explorer.sweep.results import Results

Figure: TypeAlias = dict[str, Any]

MOST_ROWS = 5000
"""Largest number of rows drawn; of more rows, the front and some of the others."""

# Statuses of designs that have measures.
MEASURED = ("done", "not converged")

# Least spread of an axis as a share of the size of its values; one with less is left out.
NO_SPREAD = 1e-9

# With more points than this the graphics processor draws the scatter plot.
MOST_AS_SVG = 1500

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
# Ends of the scale of the parallel lines: the other designs, the front, the picked one.
OTHERS, ON_FRONT, ON_PICKED = 0.8, 0.9, 1.0
# Largest number of axes with level titles, and the tilt of titles with more axes, in degrees.
MOST_LEVEL, TILT = 7, 24
# Widths of a character of a title and of a scroll bar, in pixels.
CHARACTER, SCROLL_BAR = 6.2, 14


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
    points, lines = np.flatnonzero(has_value[across] & has_value[up]), np.flatnonzero(on_lines)
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
        thin_out(lines, keep[lines], MOST_ROWS),
        len(points),
        (
            int((is_measured & ~on_lines).sum()),
            tuple(name for name in axes if (is_measured & ~has_value[name]).any()),
        ),
        picked,
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

    Args:
        plotted: Rows and axes to draw.
        revision: Number that differs from the last plot's, so that Plotly resets its brushes.
        dark: Whether the page is dark.
    """
    level = OTHERS * _shares(plotted.column(plotted.colour)[plotted.lines])
    level[plotted.front[plotted.lines]] = ON_FRONT
    level[np.isin(plotted.lines, plotted.picked)] = ON_PICKED
    line = {
        "color": pack(level),
        "cmin": 0.0,
        "cmax": 1.0,
        "showscale": False,
        "colorscale": [
            *([OTHERS * k / 3, colour] for k, colour in enumerate(SCALE[dark])),
            [OTHERS + 0.05, FRONT],
            [ON_FRONT + 0.04, FRONT],
            [ON_FRONT + 0.06, PICKED],
            [ON_PICKED, PICKED],
        ],
    }
    dimensions: list[dict[str, Any]] = []
    for name in plotted.axes:
        column = plotted.column(name)[plotted.lines]
        dimension: dict[str, Any] = {
            "name": name,
            "label": state.short_title_of(name),
            "values": pack(column),
            "range": _with_room(column),
            "tickformat": ",~g",
            "multiselect": True,
        }
        ranges = plotted.studies.ranges_of(name)
        if ranges:
            dimension["constraintrange"] = [[*ends] for ends in ranges]
        dimensions.append(dimension)
    is_tilted = len(plotted.axes) > MOST_LEVEL
    trace = {
        "type": "parcoords",
        "dimensions": dimensions,
        "line": line,
        "unselected": {"line": {"color": LEFT_OUT, "opacity": 0.25}},
        "labelangle": -TILT if is_tilted else 0,
        "tickfont": {"size": 11},
        # The ends are ticks like others; their own digits would run into one another.
        "rangefont": {"size": 1, "color": "rgba(0,0,0,0)"},
        "uirevision": revision,
    }
    # Titles have their middle above their axes; a scroll bar may cover the edge of the plot.
    left, right = (
        math.ceil(0.5 * CHARACTER * len(state.short_title_of(plotted.axes[end]))) for end in (0, -1)
    )
    margin = {
        "l": max(34, left),
        "r": max(44, SCROLL_BAR + right),
        "t": 64 if is_tilted else 40,
        "b": 12,
    }
    figure = _figure(plotted, "parallel", [trace], margin, dark=dark)
    # Lines carry no data that could name their designs.
    designs = plotted.results.columns["index"][plotted.lines].tolist()
    figure["layout"]["meta"]["designs"] = designs
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
        "xaxis": _axis(plotted.across),
        "yaxis": _axis(plotted.up),
        "showlegend": False,
        "dragmode": "select",
        "hovermode": "closest",
        "selections": [],
        "selectionrevision": revision,
        "shapes": _boxes(plotted),
    }
    return figure


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
        "type": "scatter" if len(plotted.rows) <= MOST_AS_SVG else "scattergl",
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
        {
            "type": "rect",
            "layer": "below",
            "xref": f"x{x_domain}",
            "yref": f"y{y_domain}",
            "x0": x[0],
            "x1": x[1],
            "y0": y[0],
            "y1": y[1],
            "fillcolor": "rgba(34,104,212,0.08)",
            "line": {"width": 1, "color": "rgba(34,104,212,0.55)"},
        }
        for x, x_domain in columns
        for y, y_domain in rows
    ]


def _axis(name: str) -> dict[str, Any]:
    return {
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


def _with_room(values: FloatArray) -> list[float]:
    low, high = _ends(values)
    room = 0.02 * (high - low)
    return [low - room, high + room]


def _shares(values: FloatArray) -> FloatArray:
    low, high = _ends(values)
    # All of a few lines may have the same value.
    return (values - low) / (high - low) if high > low else np.zeros(len(values))
