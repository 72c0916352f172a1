"""Charts of what a path asks of the actuators: over time, and force against speed, as SVG."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from xml.etree.ElementTree import Element

import numpy as np

from explorer.export.drawings.markup import coordinate, drawing_text, element, path_of
from explorer.export.drawings.slices import ruler
from explorer.mechanism.design import JOINTS
from explorer.mechanism.machine import or_infinite
from explorer.numerics.arrays import FloatArray
from explorer.numerics.number_text import format_number
from explorer.paths.drives import PLACES, Drives
from explorer.singularity.colours import Rgb, css

# The width of the charts, the height of one over time and of that of forces and speeds, and the
# room around each.
WIDTH, HEIGHT, TALL = 340.0, 84.0, 240.0
LEFT, RIGHT, ABOVE, BELOW, LEGEND = 46.0, 12.0, 24.0, 38.0, 16.0
# A colour for each leg; the actuator along the guide is dashed.
_LEGS: tuple[Rgb, ...] = ((46, 116, 208), (202, 112, 12), (22, 146, 118), (186, 64, 128))
_LOOKS: tuple[tuple[Rgb, str | None], ...] = (
    (_LEGS[0], None),
    *((_LEGS[1], "5 3"), (_LEGS[1], None)),
    *((_LEGS[2], "5 3"), (_LEGS[2], None)),
    (_LEGS[3], None),
)
# Room beyond the values of an axis, as a share of their span.
ROOM = 0.06


def time_charts(drives: Drives) -> Element:
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
        across, up = (0.0, drives.law.duration), _ends([*rows.ravel(), 0.0])
        pieces += _chart(title, name, across, up, curves, top, HEIGHT)
        top += ABOVE + HEIGHT
    return _svg(top + BELOW, "Speeds, forces and powers of the actuators over time", pieces)


def force_speed_chart(drives: Drives) -> Element:
    """Return the forces of the actuators against their speeds, with the limits as a box."""
    push, pull = drives.design.actuators.limits
    speed = or_infinite(drives.design.actuators.speed_mm_s)
    # Lowest and highest values of both axes, shape (2, 2, 6).
    limits = np.array([[-speed, speed], [-pull, push]])
    both = np.stack([_drawn(drives.speed), _drawn(drives.force)])
    across, up = (
        _ends([*values.ravel(), *most.ravel()]) for values, most in zip(both, limits, strict=True)
    )
    curves = [both[..., joint].T for joint in range(6)]
    pieces = [*_legend(), *_chart("force (N)", "speed (mm/s)", across, up, curves, LEGEND, TALL)]
    # A side without a limit lies at the end of its axis.
    sides = np.clip(limits, *np.transpose([across, up])[..., None, None])
    boxes = np.unique(sides.reshape(4, 6), axis=1).T if np.isfinite(limits).any() else ()
    for x0, x1, y0, y1 in boxes:
        corners = np.array([(x0, y0), (x1, y0), (x1, y1), (x0, y1)])
        path = path_of(_place(corners, across, up, LEGEND + ABOVE, TALL), "Z")
        pieces.append(element("path", d=path, class_="limit"))
    words = "Forces of the actuators against their speeds"
    return _svg(LEGEND + ABOVE + TALL + BELOW, words, pieces)


def _svg(height: float, title: str, pieces: Iterable[Element]) -> Element:
    view = f"0 0 {coordinate(WIDTH)} {coordinate(height)}"
    return element(
        *("svg", element("title", title), *pieces),
        class_="drives",
        viewBox=view,
        role="img",
        xmlns="http://www.w3.org/2000/svg",
    )


def _drawn(values: FloatArray) -> FloatArray:
    """Return those of values (n, ...) that are drawn: the first of each interval, and the last."""
    return np.concatenate([values[:: len(PLACES)], values[-1:]])


def _ends(values: Iterable[float]) -> tuple[float, float]:
    """Return the ends of an axis of some values, leaving out those that are not finite."""
    finite = [float(value) for value in values if np.isfinite(value)]
    low, high = min(finite), max(finite)
    room = ROOM * (high - low) or 1.0
    return low - room, high + room


def _legend() -> Iterator[Element]:
    for index, (name, (colour, dash)) in enumerate(zip(JOINTS, _LOOKS, strict=True)):
        x = LEFT + 48.0 * index
        look = {"stroke": css(colour), "stroke_dasharray": dash, "class_": "drive"}
        yield element("line", x1=x, y1=8.0, x2=x + 20.0, y2=8.0, **look)
        yield drawing_text(name, x + 24.0, 12.0)


def _place(
    points: FloatArray,
    across: tuple[float, float],
    up: tuple[float, float],
    top: float,
    height: float,
) -> FloatArray:
    """Return points (n, 2) of a chart as places in the drawing."""
    (x0, x1), (y0, y1) = across, up
    x = LEFT + (WIDTH - LEFT - RIGHT) * (points[:, 0] - x0) / (x1 - x0)
    return np.stack([x, top + height * (y1 - points[:, 1]) / (y1 - y0)], axis=-1)


def _chart(
    title: str,
    name: str,
    across: tuple[float, float],
    up: tuple[float, float],
    curves: Iterable[FloatArray],
    top: float,
    height: float,
) -> Iterator[Element]:
    """Yield a chart with the title of its upright axis; the other axis has numbers if named."""
    width, top = WIDTH - LEFT - RIGHT, top + ABOVE
    scales = width / (across[1] - across[0]), height / (up[1] - up[0])

    def words(value: float) -> str:
        return format_number(value, 5) if name else ""

    yield drawing_text(title, 4.0, top - 8.0, "axis")
    yield ruler(
        name, across, LEFT, scales[0], across=top + height, up=False, grid=height, words=words
    )
    yield ruler("", up, top + height, scales[1], across=LEFT, up=True, grid=width)
    for curve, (colour, dash) in zip(curves, _LOOKS, strict=True):
        path = path_of(_place(curve, across, up, top, height), "", decimals=1)
        yield element("path", d=path, stroke=css(colour), stroke_dasharray=dash, class_="drive")
