"""Drawings of several slices at one scale, with axes and a legend of their colours."""

from __future__ import annotations

import math
from collections.abc import Sequence
from xml.etree.ElementTree import Element

from explorer.export.drawings.markup import coordinate, drawing_text, element
from explorer.export.drawings.mechanism import WIDTH, round_length, svg_drawing
from explorer.export.drawings.slices import Slices, in_plane
from explorer.numerics.number_text import format_number
from explorer.singularity.colours import OUTLINE, css
from explorer.workspace.position_bands import MEASURE_WORDS
from explorer.workspace.slices.outline import AXES

# The space around a map that has ticks, and between maps.
LEFT, RIGHT, TOP, BOTTOM = 42.0, 12.0, 26.0, 38.0
MOST_HEIGHT = 290.0
_TICKS = 5


def slices_through(slices: Slices, position: Sequence[float], name: str = "slice") -> Element:
    """Return the three maps of the slices through a position, side by side at one scale.

    Args:
        slices: The slices.
        position: The position, shape (3,), in design units.
        name: First part of the names of the maps, unique in the document.
    """
    spans = slices.highs - slices.lows
    wide = float(2.0 * spans[0] + spans[1])
    high = float(max(spans[1], spans[2]))
    scale = min((WIDTH - 3.0 * (LEFT + RIGHT)) / wide, MOST_HEIGHT / high)
    height = TOP + BOTTOM + scale * high
    maps: list[Element] = []
    left = 0.5 * (WIDTH - 3.0 * (LEFT + RIGHT) - scale * wide)
    for axis in ("z", "y", "x"):
        first, second = in_plane(axis)
        level = float(position[AXES.index(axis)])
        width, tall = (float(scale * spans[k]) for k in (first, second))
        x, y = left + LEFT, TOP + tall
        maps.append(_place(slices, axis, level, x, y, scale, f"{name}-{axis}"))
        for k, low, across in ((first, x, y), (second, y, x)):
            ends = float(slices.lows[k]), float(slices.highs[k])
            maps.append(ruler(AXES[k], ends, low, scale, across=across, up=k == second))
        home_u, home_v = (float(position[k] - slices.lows[k]) * scale for k in (first, second))
        maps.extend(cross(x + home_u, y - home_v))
        title = f"{axis} = {format_number(level, 4)}"
        maps.append(element("text", title, x=x, y=y - tall - 10.0, class_="title"))
        left += LEFT + width + RIGHT
    return svg_drawing(height, "Three slices of the workspace", *maps)


def slice_strip(
    slices: Slices, axis: str, many: int = 6
) -> tuple[Element, list[tuple[float, float | None]]]:
    """Return maps of slices at even steps along an axis, and the level and area of each."""
    cut = AXES.index(axis)
    first, second = in_plane(axis)
    spans = slices.highs - slices.lows
    room = 10.0
    scale = min((WIDTH / many - room) / float(spans[first]), 200.0 / float(spans[second]))
    tall = scale * float(spans[second])
    maps: list[Element] = []
    areas: list[tuple[float, float | None]] = []
    for index in range(many):
        level = float(slices.lows[cut] + spans[cut] * (index + 0.5) / many)
        left = (index + 0.5) * WIDTH / many - 0.5 * scale * float(spans[first])
        maps.append(_place(slices, axis, level, left, TOP + tall, scale, f"strip-{index}"))
        middle = (index + 0.5) * WIDTH / many
        title = f"{axis} = {format_number(level, 4)}"
        maps.append(drawing_text(title, middle, 16.0, class_="title"))
        areas.append((level, slices.area(axis, level)))
    return svg_drawing(TOP + tall + 6.0, f"Slices along {axis}", *maps), areas


def legend(slices: Slices, unit_mm: float) -> Element:
    """Return the legend of the colours of maps, of the smallest margin or of another measure."""
    bands, step, left, pieces = slices.bands, 46.0, 130.0, list[Element]()
    colours, levels = bands.colours, bands.levels
    title, rows = "smallest margin", [("units", 1.0), ("mm", unit_mm)]
    words = MEASURE_WORDS.get(bands.measure)
    if words is not None:
        title, rows = words[0], [words[1:]]
        # Of these, less is better; the last band goes on without end.
        colours, levels = colours[::-1], (0.0, *levels[:0:-1])
        left += 30.0
    pieces.append(drawing_text(title, left - 12.0, 15.0, anchor="end"))
    for row, (unit, factor) in enumerate(rows):
        y = 33.0 + 14.0 * row
        pieces.append(drawing_text(unit, left - 12.0, y, anchor="end"))
        for index, level in enumerate(levels):
            pieces.append(drawing_text(format_number(level * factor, 3), left + step * index, y))
    for index, colour in enumerate(colours):
        x = left + step * index
        pieces.append(element("rect", x=x, y=4.0, width=step, height=14.0, fill=css(colour)))
    if any(slices.design.limits.leg_radii):
        x = left + step * len(colours) + 18.0
        pieces.append(element("rect", x=x, y=4.0, width=14.0, height=14.0, fill=css(OUTLINE)))
        pieces.append(element("text", "legs collide", x=x + 19.0, y=15.0, class_="small"))
    return svg_drawing(24.0 + 14.0 * len(rows), "The colours of the maps", *pieces)


def _place(
    slices: Slices, axis: str, level: float, x: float, y: float, scale: float, name: str
) -> Element:
    """Return a map with its lows at (x, y) on paper, at a scale in points per design unit."""
    group = slices.map(axis, level, name)
    group.set("transform", placing(scale / slices.own_scale, x, y))
    return group


def placing(size: float, x: float, y: float) -> str:
    """Return the transform that puts a map's lows at (x, y), at a size in points per own point."""
    return f"matrix({size:.6g} 0 0 {-size:.6g} {x:.6g} {y:.6g})"


def cross(x: float, y: float) -> tuple[Element, Element]:
    """Return a cross with its middle at (x, y), over its own light rim."""
    data = f"M{coordinate(x - 5)},{coordinate(y)}h10m-5,-5v10"
    return (
        element("path", d=data, class_="cross casing"),
        element("path", d=data, class_="cross"),
    )


def ruler(
    title: str,
    ends: tuple[float, float],
    start: float,
    scale: float,
    *,
    across: float,
    up: bool,
) -> Element:
    """Return an axis with ticks at round numbers, below a map or to its left.

    Args:
        title: Words beside the axis.
        ends: Coordinates of the map's lowest and highest end, in design units.
        start: Place of the lowest end on paper, along the axis.
        scale: Points of paper per design unit.
        across: Place of the axis on paper, across it.
        up: Whether the axis goes up, at the left of the map.
    """
    low, high = ends
    step = round_length((high - low) / _TICKS * 1.6)
    axis = element("g", class_="ruler")
    way = -1.0 if up else 1.0
    end = start + way * scale * (high - low)
    ticks = range(math.ceil(low / step - 1e-9), math.floor(high / step + 1e-9) + 1)
    line = (across, start, across, end) if up else (start, across, end, across)
    axis.append(element("line", **dict(zip(("x1", "y1", "x2", "y2"), line, strict=True))))
    for tick in ticks:
        at = start + way * scale * (tick * step - low)
        x1, y1, x2, y2 = (across, at, across - 4.0, at) if up else (at, across, at, across + 4.0)
        axis.append(element("line", x1=x1, y1=y1, x2=x2, y2=y2))
        words = format_number(tick * step, 4)
        if up:
            axis.append(drawing_text(words, across - 7.0, at + 3.5, anchor="end"))
        else:
            axis.append(drawing_text(words, at, across + 15.0))
    middle = 0.5 * (start + end)
    x, y = (across - 30.0, middle + 3.5) if up else (middle, across + 30.0)
    axis.append(drawing_text(title, x, y, class_="axis"))
    return axis
