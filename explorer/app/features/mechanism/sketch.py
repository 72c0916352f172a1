"""The sketch above the design variables: base and platform seen from above, with dimension lines.

Each of the two figures is a triangle with two corners on a horizontal axis, and has a scale of its
own. Dimensions from the axis to the third corner stand in a column at the left, dimensions along
the axis in rows: those of points on the axis on the side away from the third corner. Rows and the
column keep texts apart whatever the design.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Literal
from xml.etree.ElementTree import Element

import numpy as np

from explorer.export.drawings.markup import (
    circle,
    drawing_text,
    element,
    line,
    page_picture,
    path_of,
)
from explorer.mechanism.design import Design

Xy = tuple[float, float]
Anchor = Literal["start", "middle", "end"]

# Width of the sketch and of each figure, and height, in pixels; the sketch is not scaled, so that
# its type keeps its size.
WIDTH, FIGURE_WIDTH, HEIGHT = 290, 143, 136
# Height of a row of text, and room at both sides of the points of a figure.
ROW, LEFT, RIGHT = 14.0, 32.0, 18.0
# Room between the axis and the names of points on it, and between a point and its name.
OFF_AXIS, BESIDE = 9.0, 5.0
# Width of a character, and that of the shortest dimension line with its text on it.
CHARACTER, SHORTEST = 6.4, 28.0
# Half the length of a tick at the end of a dimension line.
TICK = 3.0


def sketch(design: Design) -> str:
    """Return the sketch of a design as SVG."""
    base = {"a1": 0.0, "a2": design.reach}
    platform = {"b4": 0.0, "b2": design.b2, "b3": design.b3}
    return page_picture(
        "ex-sketch",
        "Base and platform from above, with the design variables",
        *_figure(("Base", 0.0), base, (), ("a3", design.a3)),
        *_figure(("Platform", WIDTH - FIGURE_WIDTH), platform, ("b2", "b3"), ("b1", design.b1)),
        width=WIDTH,
        height=HEIGHT,
    )


def _dimension(
    name: str, at: Xy, anchor: Anchor, ends: tuple[Xy, Xy], measured: tuple[Xy, Xy]
) -> Element:
    """Return a dimension line with ticks and text, and thin lines from what it measures."""
    thin = (line(pair, "is-thin") for pair in zip(measured, ends, strict=True))
    ticks = (line(((x - TICK, y + TICK), (x + TICK, y - TICK))) for x, y in ends)
    word = drawing_text(name, *at, None, anchor=anchor)
    return element("g", *thin, line(ends), *ticks, word, data_variable=name)


def _figure(
    caption: tuple[str, float],
    on_axis: Mapping[str, float],
    along: tuple[str, ...],
    apex: tuple[str, Xy],
) -> Iterator[Element]:
    """Yield a figure, with points on an axis, the origin first, and a triangle's apex.

    Its caption comes with its left end; the points `along` the axis have dimensions. The last two
    points on the axis are the other corners of the triangle.
    """
    name, (apex_x, apex_y) = apex
    title, left = caption
    # Without dimensions on the axis, the row for the third corner's x is on the side away from it.
    apex_is_away = not along
    xs = (*on_axis.values(), apex_x)
    # On each side of the axis there are rows: of names, and of dimensions.
    away = OFF_AXIS + ROW * (0.5 + len(along) + apex_is_away)
    beyond = OFF_AXIS + ROW * (0.5 + (not apex_is_away))
    room_x = FIGURE_WIDTH - LEFT - RIGHT
    room_y = HEIGHT - ROW - away - beyond
    scale = min(room_x / (max(xs) - min(xs)), room_y / abs(apex_y))
    up = -1.0 if apex_y > 0.0 else 1.0
    height = scale * abs(apex_y)
    spare = 0.5 * (room_y - height)
    axis_y = HEIGHT - spare - away if up < 0.0 else ROW + spare + away
    first_x = left + LEFT + 0.5 * (room_x - scale * (max(xs) - min(xs)))

    def place(x: float, y: float = 0.0) -> Xy:
        return first_x + scale * (x - min(xs)), axis_y - scale * y

    origin, tip = place(0.0), place(apex_x, apex_y)
    points = {each: place(x) for each, x in on_axis.items()}
    dimensions: list[Element] = []
    rows = sorted(along, key=lambda each: abs(on_axis[each]))
    for index, each in enumerate(rows):
        row_y = axis_y - up * (OFF_AXIS + ROW * (1.0 + index))
        dimensions.append(_along(each, origin, points[each], row_y, left))
    tip_row = (
        axis_y - up * (OFF_AXIS + ROW * (1.0 + len(rows)))
        if apex_is_away
        else tip[1] + up * (OFF_AXIS + ROW)
    )
    dimensions.append(_along(f"{name}x", origin, tip, tip_row, left))
    column = left + LEFT - BESIDE - 1.0
    middle = axis_y + up * max(0.5 * height, 0.5 * ROW)
    ends = (column, axis_y), (column, tip[1])
    measured = place(min(xs)), tip
    dimensions.append(_dimension(f"{name}y", (column - BESIDE, middle), "end", ends, measured))
    name_y = axis_y - up * OFF_AXIS
    names = {each: at[0] - (BESIDE - 1.0) * (each == "a1") for each, at in points.items()}
    corners = np.array([tip, *list(points.values())[-2:]])
    yield element("path", d=path_of(corners))
    stations = sorted((origin[0], *(x for x, _ in points.values())))
    yield line(((stations[0], axis_y), (stations[-1], axis_y)), "is-axis")
    yield from (circle(at, 2.2) for at in (*points.values(), tip))
    yield from dimensions
    yield drawing_text(title, left, 0.5 * ROW, None, anchor="start")
    for each, x in _spread(names, left).items():
        yield drawing_text(each, x, name_y, "is-point", anchor="middle")
    yield drawing_text(name, tip[0], tip[1] + up * OFF_AXIS, "is-point", anchor="middle")


def _along(name: str, origin: Xy, end: Xy, row_y: float, left: float) -> Element:
    """Return a dimension along the axis, in a row."""
    low, high = sorted((origin[0], end[0]))
    x, anchor, width = 0.5 * (low + high), "middle", CHARACTER * len(name)
    if high - low < SHORTEST:
        # There is no room on the line: the text stands beside it, at the right if it fits.
        x, anchor = high + BESIDE, "start"
        if x + width > left + FIGURE_WIDTH:
            x, anchor = low - BESIDE, "end"
    ends = (origin[0], row_y), (end[0], row_y)
    return _dimension(name, (x, row_y), anchor, ends, (origin, end))


def _spread(names: Mapping[str, float], left: float) -> dict[str, float]:
    """Return the places of names in one row, moved along it until none overlaps, in their order."""
    order = sorted(names, key=names.__getitem__)
    step = CHARACTER * len(order[0]) + 2.0
    xs = [names[each] for each in order]
    for after in range(1, len(xs)):
        xs[after] = max(xs[after], xs[after - 1] + step)
    last = left + FIGURE_WIDTH - 0.5 * step
    for after in reversed(range(len(xs))):
        xs[after] = min(xs[after], last)
        last = xs[after] - step
    return dict(zip(order, xs, strict=True))
