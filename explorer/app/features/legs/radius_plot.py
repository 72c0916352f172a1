"""The reachable volume against one radius of all four legs, as a chart and in words."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np
import viser
from numpy.typing import NDArray
from viser import uplot

from explorer.app.features.legs.feed import RadiusFeed
from explorer.app.state.frame import Frame
from explorer.app.widgets.assigning import Update
from explorer.app.widgets.charts import BLUE, ORANGE, TEAL, VIOLET, axis
from explorer.app.widgets.colours import Rgb, css
from explorer.app.widgets.markup import DIM, alert, format_number
from explorer.app.widgets.under_way import UnderWay, problem, progress
from explorer.legs.clearance import PAIRS
from explorer.mechanism.design import Design
from explorer.numerics.arrays import FloatArray
from explorer.workspace.accessible.radii import RadiusCurve

# Of the volume without radii: what is left of it is told too.
SHARE = 0.99
# How far the chart goes beyond the radius at which nothing is left, or beyond the present one.
BEYOND_LAST, BEYOND_PRESENT = 1.15, 1.05
HEIGHT = 190
BLANK = np.zeros(2)
BOX = (
    '<div style="padding:2px 12px 8px;font-size:12.5px;line-height:1.45;'
    'font-variant-numeric:tabular-nums">'
)


class Mark(NamedTuple):
    """A radius that is marked on the curve.

    Attributes:
        label: What it is.
        colour: Of its point.
        size: Of its point, in pixels.
        radius: None if it is not marked.
    """

    label: str
    colour: Rgb
    size: int
    radius: float | None


class RadiusPlot:
    """Chart and words; both are hidden and nothing is computed until they are asked for."""

    def __init__(self, gui: viser.GuiApi) -> None:
        self._chart = gui.add_uplot(
            (BLANK,) * 5,
            _series(marks_of(None, None)),
            scales=_scales(1.0, 1.0),
            axes=(
                axis("radius of all four legs (units)", label_size=20, size=28),
                axis("reachable volume (units³)", label_size=18, size=46),
            ),
            legend={"show": False},
            cursor={"drag": {"x": False, "y": False}},
            height=HEIGHT,
            padding=(8, 14, 0, 0),
            visible=False,
        )
        self._words = gui.add_html("", visible=False)
        self._under_way = UnderWay(gui, "curve")
        self._plotted: tuple[RadiusCurve, float | None] | None = None
        self._data: tuple[NDArray[Any], ...] = (BLANK,) * 5

    def updates(self, frame: Frame, feed: RadiusFeed) -> Iterator[Update]:
        """Yield what makes them show the frame."""
        shown = frame.state.view.radius_curve
        drawing = feed.drawing if shown else None
        yield from self._under_way.updates(feed)
        yield self._words, "visible", shown
        if shown:
            yield self._words, "content", radius_words(frame, feed)
        curve = None if drawing is None else drawing.curve
        has_chart = curve is not None and float(curve.radii[-1]) > 0.0
        yield self._chart, "visible", has_chart
        if curve is None or not has_chart:
            return
        radius = common_radius(frame.state.design)
        if self._plotted is None or self._plotted[0] is not curve or self._plotted[1] != radius:
            self._plotted = curve, radius
            self._data = chart_of(curve, radius)
        yield self._chart, "scales", _scales(float(self._data[0][-1]), float(curve.volumes[0]))
        yield self._chart, "data", self._data


def common_radius(design: Design) -> float | None:
    """Return the radius of all four legs, None if they differ."""
    radii = set(design.limits.leg_radii)
    return radii.pop() if len(radii) == 1 else None


def marks_of(curve: RadiusCurve | None, radius: float | None) -> tuple[Mark, Mark, Mark]:
    """Return the marks of a curve, in the order in which they are told."""
    return (
        Mark("present radius", ORANGE, 10, radius),
        Mark("99 % left up to", TEAL, 8, None if curve is None else curve.radius_at(SHARE)),
        Mark("harmless up to", VIOLET, 8, None if curve is None else curve.harmless),
    )


def volume_at(curve: RadiusCurve, radius: float) -> float:
    """Return the reachable volume at a radius, 0 beyond that at which nothing is left."""
    return float(np.interp(radius, *_before_the_fall(curve), right=0.0))


def _before_the_fall(curve: RadiusCurve) -> tuple[FloatArray, FloatArray]:
    """Return radii, each once, and volumes: at the last radius what it leaves, not nothing."""
    first = np.append(True, np.diff(curve.radii) > 0.0)
    return curve.radii[first], curve.volumes[first]


def chart_of(curve: RadiusCurve, radius: float | None) -> tuple[FloatArray, ...]:
    """Return the columns of the chart: radii, volumes, and the three marks.

    Beyond the last radius the curve falls to nothing at once.
    """
    marks = marks_of(curve, radius)
    marked = [mark.radius for mark in marks if mark.radius is not None]
    last = float(curve.radii[-1])
    end = max(BEYOND_LAST * last, BEYOND_PRESENT * max(marked))
    radii, volumes = _before_the_fall(curve)
    inner = np.unique([*radii, *(each for each in marked if each <= last)])
    outer = np.unique([last, *(each for each in marked if each > last), end])
    x = np.concatenate([inner, outer])
    y = np.concatenate([np.interp(inner, radii, volumes), np.zeros(len(outer))])
    columns = [x, y]
    for mark in marks:
        column = np.full(len(x), np.nan)
        if mark.radius is not None:
            column[np.searchsorted(x, mark.radius)] = volume_at(curve, mark.radius)
        columns.append(column)
    return tuple(columns)


def radius_words(frame: Frame, feed: RadiusFeed) -> str:
    """Return what the chart tells as HTML, or why there is none."""
    if feed.problem is not None:
        return problem(feed, "The curve could not be drawn", "Compute the curve")
    drawing = feed.drawing
    if drawing is None:
        return f'{BOX}<div style="{DIM}">{progress(feed).capitalize()}</div></div>'
    waits = f' <span style="{DIM};font-size:11.5px">{progress(feed)}</span>'
    note = "" if feed.is_current else waits
    if drawing.curve is None:
        reason = "" if drawing.trouble is None else drawing.trouble.reason
        text = f"{reason[:1].upper()}{reason[1:]}."
        return alert("Nothing can be reached, even without radii", text) + note
    curve = drawing.curve
    if float(curve.volumes[0]) <= 0.0:
        return f'{BOX}<div style="{DIM}">The workspace is empty.{note}</div></div>'
    design = frame.state.design
    marks = marks_of(curve, common_radius(design))
    rows = "".join(_row(mark, curve, design.unit_mm) for mark in marks)
    return (
        f'{BOX}<div style="display:flex;justify-content:space-between;margin-bottom:2px">'
        f"<b>Reachable volume</b>{note}</div>"
        f'<table style="width:100%;border-collapse:collapse">{rows}</table>'
        f'<div style="{DIM};margin-top:4px">{where_legs_meet(curve, design.reach)}</div></div>'
    )


def where_legs_meet(curve: RadiusCurve, reach: float) -> str:
    """Return in words which legs are the first to meet as they grow, and where."""
    least = curve.least
    closest = float(least.clearance.min())
    if not np.isfinite(closest):
        return "No two legs can meet."
    first = np.flatnonzero(least.clearance <= closest)
    meetings = [
        f"legs {i} and {j} at {_shown(least.position[pair])}"
        for pair, (i, j) in ((int(each), PAIRS[each]) for each in first)
    ]
    if closest > 0.0:
        return f"The first to collide within the limits: {'; '.join(meetings)}."
    on_base = np.abs(least.position[first, 2]).max() <= 1e-6 * reach
    where = ", where z = 0" if on_base else ""
    return f"Even without radii these touch within the limits{where}: {'; '.join(meetings)}."


def _row(mark: Mark, curve: RadiusCurve, unit_mm: float) -> str:
    swatch = (
        f'<span style="display:inline-block;width:9px;height:9px;border-radius:5px;'
        f'background:{css(mark.colour)};margin-right:6px"></span>'
    )
    if mark.radius is None:
        value, left = "they differ", ""
    else:
        share = 100.0 * volume_at(curve, mark.radius) / float(curve.volumes[0])
        value = format_number(mark.radius, 3)
        left = f"{share:.3g} %" if mark.label == "present radius" else _length(mark, unit_mm)
    return (
        f'<tr><td style="padding:1px 0">{swatch}{mark.label}</td>'
        f'<td style="text-align:right">{value}</td>'
        f'<td style="text-align:right;{DIM}">{left}</td></tr>'
    )


def _length(mark: Mark, unit_mm: float) -> str:
    return f"{format_number((mark.radius or 0.0) * unit_mm, 3)} mm"


def _shown(position: FloatArray) -> str:
    rounded = np.round(position, 6) + 0.0
    return "(" + ", ".join(format_number(float(x), 3) for x in rounded) + ")"


def _series(marks: tuple[Mark, ...]) -> tuple[uplot.Series, ...]:
    line: uplot.Series = {
        "label": "volume",
        "stroke": css(BLUE),
        "width": 2.0,
        "points": {"show": False},
    }
    points: list[uplot.Series] = [
        {
            "label": mark.label,
            "stroke": css(mark.colour),
            "width": 0.0,
            "points": {"show": True, "size": mark.size, "fill": css(mark.colour)},
        }
        for mark in marks
    ]
    return ({"label": "radius"}, line, *points)


def _scales(last: float, volume: float) -> dict[str, uplot.Scale]:
    return {
        "x": {"time": False, "range": (0.0, last)},
        "y": {"range": (0.0, 1.08 * volume)},
    }
