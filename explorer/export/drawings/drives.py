"""Charts of what a path asks of the actuators: over time, and force against speed, as SVG."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from xml.etree.ElementTree import Element

import numpy as np

from explorer.export.drawings.charts import Chart, ends_of
from explorer.export.drawings.markup import coordinate, drawing_text, element, path_of
from explorer.mechanism.design import JOINTS, Pair
from explorer.mechanism.machine import or_infinite
from explorer.mechanism.rgb import Rgb, css
from explorer.numerics.arrays import FloatArray
from explorer.paths.drives import PARTS, PathDrives

# The width of the charts, the height of one over time and of that of forces and speeds, and the
# room around each.
WIDTH, HEIGHT, TALL = 340.0, 84.0, 240.0
LEFT, RIGHT, ABOVE, BELOW, LEGEND = 46.0, 12.0, 24.0, 38.0, 16.0
# A colour for each leg; the actuator along the guide is dashed.
_LEGS: tuple[Rgb, ...] = ((46, 116, 208), (202, 112, 12), (22, 146, 118), (186, 64, 128))
_LOOKS = [
    {"stroke": css(_LEGS[leg]), "stroke_dasharray": "5 3" if d in (1, 3) else None, "fill": "none"}
    for d, leg in enumerate((0, 1, 1, 2, 2, 3))
]


def time_charts(drives: PathDrives) -> Element:
    """Return speeds, forces and powers of the actuators over time, one below the other."""
    pieces, top = [*_legend()], LEGEND
    charts = (
        ("speed (mm/s)", "", drives.speed),
        ("force (N)", "", drives.force),
        ("power (W)", "time (s)", drives.power),
    )
    for title, name, values in charts:
        rows = _drawn(values)
        curves = [np.stack([_drawn(drives.time), row], axis=-1) for row in rows.T]
        chart = _chart((0.0, drives.law.duration), ends_of([*rows.ravel(), 0.0]), top, HEIGHT)
        pieces += _draw(chart, title, name, curves)
        top += ABOVE + HEIGHT
    return _svg(top + BELOW, "Speeds, forces and powers of the actuators over time", pieces)


def force_speed_chart(drives: PathDrives) -> Element:
    """Return the forces of the actuators against their speeds, with the limits as a box."""
    push, pull = drives.design.actuators.limits
    speed = or_infinite(drives.design.actuators.speed_mm_s)
    # Lowest and highest values of both axes, shape (2, 2, 6).
    limits = np.array([[-speed, speed], [-pull, push]])
    both = np.stack([_drawn(drives.speed), _drawn(drives.force)])
    ends = [ends_of([*both[i].ravel(), *limits[i].ravel()]) for i in (0, 1)]
    chart = _chart(ends[0], ends[1], LEGEND, TALL)
    curves = [both[..., joint].T for joint in range(6)]
    pieces = [*_legend(), *_draw(chart, "force (N)", "speed (mm/s)", curves)]
    # A side without a limit lies at the end of its axis.
    sides = np.clip(limits, *np.transpose(ends)[..., None, None])
    boxes = np.unique(sides.reshape(4, 6), axis=1).T if np.isfinite(limits).any() else ()
    for x0, x1, y0, y1 in boxes:
        path = path_of(chart.place(np.array([(x0, y0), (x1, y0), (x1, y1), (x0, y1)])))
        look = {"stroke": "currentColor", "stroke_dasharray": "2 2.5", "fill": "none"}
        pieces.append(element("path", d=path, **look))
    title = "Forces of the actuators against their speeds"
    return _svg(LEGEND + ABOVE + TALL + BELOW, title, pieces)


def _svg(height: float, title: str, pieces: Iterable[Element]) -> Element:
    look = {"viewBox": f"0 0 {coordinate(WIDTH)} {coordinate(height)}", "role": "img"}
    pieces = element("title", title), *pieces
    return element("svg", *pieces, xmlns="http://www.w3.org/2000/svg", **look)


def _drawn(values: FloatArray) -> FloatArray:
    """Return those of values (n, ...) that are drawn: at both ends of each interval."""
    return np.delete(values, slice(1, None, len(PARTS)), axis=0)


def _legend() -> Iterator[Element]:
    for index, (name, look) in enumerate(zip(JOINTS, _LOOKS, strict=True)):
        x = LEFT + 48.0 * index
        yield element("line", x1=x, y1=8.0, x2=x + 20.0, y2=8.0, **look)
        yield drawing_text(name, x + 24.0, 12.0)


def _chart(across: Pair, up: Pair, top: float, height: float) -> Chart:
    return Chart(across, up, LEFT, WIDTH - LEFT - RIGHT, top + ABOVE, height)


def _draw(chart: Chart, title: str, name: str, curves: Iterable[FloatArray]) -> Iterator[Element]:
    """Yield axes and curves; the axis across has numbers if it has a name."""
    yield drawing_text(title, 4.0, chart.top - 8.0, "axis")
    yield from chart.axes(name, has_numbers=name != "")
    for curve, look in zip(curves, _LOOKS, strict=True):
        yield chart.curve(curve, **look)
