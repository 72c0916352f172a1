"""Maps of slices as drawings, for the report and the page: exact outlines, filled in bands.

At one orientation each margin is linear in the position, so the positions of a slice at which
every margin is at least a level are polygons: these bands are as exact as the outline. Bands of
other measures, limits on swings and collisions of legs are outlined on a fine grid.
"""

from __future__ import annotations

import cmath
import itertools
import math
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from xml.etree.ElementTree import Element

import numpy as np

from explorer.export.drawings.markup import coordinate, drawing_text, element, line, path_of
from explorer.export.drawings.mechanism import WIDTH, round_length, svg_drawing
from explorer.legs.clearance import leg_clearances
from explorer.measures.position_bands import MEASURE_WORDS, PositionBands, position_bands
from explorer.mechanism.margins import margins, planes_of_singularity
from explorer.mechanism.rgb import OUTLINE, css
from explorer.numerics.arrays import FloatArray
from explorer.numerics.level_loops import level_loops
from explorer.numerics.number_text import format_number
from explorer.singularity.colours import WARN_SHARE
from explorer.workspace.slices.outline import AXES, Edge, slice_outline
from explorer.workspace.workspace import Workspace

# The space around a map that has ticks, and between maps.
LEFT, RIGHT, TOP, BOTTOM = 42.0, 12.0, 26.0, 38.0
MOST_HEIGHT = 290.0
_TICKS = 5
# The longer side of a workspace in the drawing's own coordinates.
OWN_SIZE = 1000.0
# Cells of a grid on the longer side; those of the condition number take long.
CELLS, CONDITION_CELLS = 160, 100
# More contours than a workspace can have.
CONTOURS = 60
# Colour and opacity of positions within the limits that are not accessible.
NOT_ACCESSIBLE, NOT_ACCESSIBLE_OPACITY = OUTLINE, 0.38


@dataclass(frozen=True)
class Slices:
    """Slices of a workspace within a box (lows and highs, (3,)), with the bands to draw."""

    workspace: Workspace
    lows: FloatArray
    highs: FloatArray
    bands: PositionBands

    @staticmethod
    def of(
        workspace: Workspace,
        extent: tuple[FloatArray, FloatArray],
        bands: PositionBands | None = None,
    ) -> Slices:
        """Return the slices of a workspace of known extent, with bands of the margin if None."""
        if bands is None:
            warn_below = WARN_SHARE * workspace.design.reach
            bands = position_bands(workspace, "margin", warn_below=warn_below)
        lows, highs = workspace.region.ends
        lows, highs = np.maximum(lows, extent[0]), np.minimum(highs, extent[1])
        return Slices(workspace, lows, highs, bands)

    @property
    def own_scale(self) -> float:
        """The drawing's own points per design unit."""
        return OWN_SIZE / float((self.highs - self.lows).max())

    @property
    def contour_step(self) -> float:
        """The step of the margin from one contour to the next, in design units."""
        return round_length(0.15 * float((self.highs - self.lows).max()))

    def map(
        self, axis: str, level: float, name: str, not_accessible: Sequence[FloatArray] = ()
    ) -> Element:
        """Return the map of a slice, in its own coordinates: scaled, from the lows, y upwards.

        The slice is normal to an axis, at a level in design units; its outline has a name in the
        document. Polygons (n, 2) around what is not accessible are filled by the even-odd rule.
        """
        lows, scale = self.lows[in_plane(axis)], self.own_scale
        data = self._outline_data(axis, level)
        if not data:
            return element("g")
        filled = element("g", clip_path=f"url(#{name})")

        def add(polygons: Iterable[FloatArray], **look: str) -> None:
            paths = "".join(path_of((polygon - lows) * scale) for polygon in polygons)
            if paths:
                filled.append(element("path", d=paths, **look))

        first, *others = self.bands.colours
        add([self._corners(axis)], fill=css(first))
        beyond = self.beyond(axis, level)
        for edge, colour in zip(self.bands.edges[1:], others, strict=True):
            add(beyond(edge), fill=css(colour), fill_rule="evenodd")
        if self.bands.measure == "margin":
            last, furthest = self.bands.edges[-1], self.bands.levels[-1]
            for margin in self.contour_step * np.arange(1.0, CONTOURS):
                if margin > furthest:
                    add(beyond(last * float(margin) / furthest), class_="contour")
        add(
            not_accessible,
            fill=css(NOT_ACCESSIBLE),
            fill_opacity=f"{NOT_ACCESSIBLE_OPACITY:g}",
            fill_rule="evenodd",
            class_="is-blocked",
        )
        if any(self.workspace.design.limits.leg_radii):
            columns, rows, points = self._grid(axis, level, CELLS)
            least = leg_clearances(self.workspace.at(points)).clearance.min(axis=-1)
            add(
                level_loops(columns, rows, -least, 0.0),
                fill=css(OUTLINE),
                fill_rule="evenodd",
                class_="is-colliding",
            )
        clip = element("clipPath", element("path", d=data, clip_rule="evenodd"), id=name)
        return element("g", clip, filled, element("path", d=data, class_="edge"))

    def _outline_data(self, axis: str, level: float) -> str:
        """Return the outline of a slice as the data of a path; "" if the slice is empty."""
        lows, scale = self.lows[in_plane(axis)], self.own_scale
        outline = slice_outline(self.workspace, axis, level)
        if outline is not None:
            return "".join(_loop_data(loop, lows, scale) for loop in outline)
        columns, rows, points = self._grid(axis, level, CELLS)
        slack = self.workspace.slacks(points).min(axis=-1)
        loops = level_loops(columns, rows, slack, 0.0)
        return "".join(path_of((loop - lows) * scale) for loop in loops)

    def _corners(self, axis: str) -> FloatArray:
        (u0, v0), (u1, v1) = self.lows[in_plane(axis)], self.highs[in_plane(axis)]
        return np.array([[u0, v0], [u1, v0], [u1, v1], [u0, v1]])

    def beyond(self, axis: str, level: float) -> Callable[[float], Iterable[FloatArray]]:
        """Return the function from values of the bands to the polygons of a slice beyond them.

        The polygons (n, 2), in design units, are filled by the even-odd rule, also beyond limits.
        """
        if self.bands.measure == "margin":
            unit = self.bands.levels[-1] / self.bands.edges[-1]
            return lambda value: self._beyond_margin(axis, level, value * unit)
        is_slow = self.bands.measure == "condition"
        columns, rows, points = self._grid(axis, level, CONDITION_CELLS if is_slow else CELLS)
        field = self._signed(points.reshape(-1, 3)).reshape(points.shape[:2])
        index = AXES.index(axis)

        def loops(value: float, sign: float) -> list[FloatArray]:
            def field_at(points: FloatArray) -> FloatArray:
                return sign * self._signed(np.insert(points, index, level, axis=1))

            refine = None if is_slow else field_at
            return level_loops(columns, rows, sign * field, value, refine)

        return lambda value: [*loops(value, 1.0), *loops(value, -1.0)]

    def _signed(self, points: FloatArray) -> FloatArray:
        """Return values of the bands at points (n, 3) with the sign of det J, smooth at zero."""
        sign = np.where(margins(points, self.workspace.rotation).prod(axis=-1) < 0.0, -1.0, 1.0)
        return sign * self.bands.values(points)

    def _beyond_margin(self, axis: str, level: float, margin: float) -> Iterator[FloatArray]:
        gradients = planes_of_singularity(self.workspace.rotation)
        for signs in itertools.product((-1.0, 1.0), repeat=3):
            polygon = self._corners(axis)
            for sign, gradient in zip(signs, gradients, strict=True):
                least = margin - sign * (float(gradient[AXES.index(axis)]) * level)
                polygon = _clip(polygon, sign * (polygon @ gradient[in_plane(axis)]) - least)
                if not len(polygon):
                    break
            else:
                yield polygon

    def _grid(
        self, axis: str, level: float, cells: int
    ) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return columns (n,), rows (m,) and points (m, n, 3) of a grid, all ascending."""
        lows, sides = self.lows[in_plane(axis)], (self.highs - self.lows)[in_plane(axis)]
        many = np.maximum(2.0, np.rint(cells * sides / sides.max())).astype(int) + 1
        columns, rows = (
            np.linspace(low, low + side, n, dtype=np.float64)
            for low, side, n in zip(lows.tolist(), sides.tolist(), many.tolist(), strict=True)
        )
        points = np.full((len(rows), len(columns), 3), level)
        first, second = in_plane(axis)
        points[..., first], points[..., second] = columns, rows[:, None]
        return columns, rows, points


def in_plane(axis: str) -> list[int]:
    """Return the indices of the two axes of a slice that is normal to a third."""
    return [index for index, name in enumerate(AXES) if name != axis]


def _loop_data(loop: tuple[Edge, ...], lows: FloatArray, scale: float) -> str:
    """Return a closed loop of edges as the data of a path, scaled from the lows of a map."""

    def text(point: tuple[float, float]) -> str:
        x, y = ((np.array(point) - lows) * scale).tolist()
        return f"{coordinate(x)},{coordinate(y)}"

    data = [f"M{text(loop[0].start)}"]
    for edge in loop:
        if edge.centre is None:
            data.append(f"L{text(edge.end)}")
            continue
        radius = coordinate(edge.radius * scale)
        arc = f"A{radius},{radius} 0 0 {int(edge.turn > 0.0)}"
        if abs(edge.turn) > math.pi - 1e-6:
            # An arc of a path must be less than a whole circle: two halves are plain.
            centre, start = complex(*edge.centre), complex(*edge.start)
            middle = centre + (start - centre) * cmath.exp(0.5j * edge.turn)
            data.append(f"{arc} {text((middle.real, middle.imag))}")
        data.append(f"{arc} {text(edge.end)}")
    return "".join((*data, "Z"))


def _clip(polygon: FloatArray, values: FloatArray) -> FloatArray:
    """Return the part of a convex polygon (n, 2) where a linear value is not negative."""
    corners: list[FloatArray] = []
    for k in range(len(polygon)):
        a, b = values[k - 1], values[k]
        if (a >= 0.0) != (b >= 0.0):
            corners.append(polygon[k - 1] + a / (a - b) * (polygon[k] - polygon[k - 1]))
        if b >= 0.0:
            corners.append(polygon[k])
    return np.array(corners) if len(corners) > 2 else np.zeros((0, 2))


def slices_through(slices: Slices, position: Sequence[float], name: str = "slice") -> Element:
    """Return the maps of the slices through a position, (3,) in design units, side by side.

    The names of the maps, unique in the document, begin with the given one.
    """
    spans = (slices.highs - slices.lows).tolist()
    wide, high = 2.0 * spans[0] + spans[1], max(spans[1], spans[2])
    scale = min((WIDTH - 3.0 * (LEFT + RIGHT)) / wide, MOST_HEIGHT / high)
    maps: list[Element] = []
    left = 0.5 * (WIDTH - 3.0 * (LEFT + RIGHT) - scale * wide)
    for axis in ("z", "y", "x"):
        first, second = in_plane(axis)
        level = float(position[AXES.index(axis)])
        x, y = left + LEFT, TOP + scale * spans[second]
        drawn = slices.map(axis, level, f"{name}-{axis}")
        drawn.set("transform", map_transform(scale / slices.own_scale, x, y))
        maps.append(drawn)
        for k, low, across in ((first, x, y), (second, y, x)):
            ends = float(slices.lows[k]), float(slices.highs[k])
            maps.append(ruler(AXES[k], ends, low, scale, across=across, up=k == second))
        u, v = (float(position[k] - slices.lows[k]) * scale for k in (first, second))
        maps.extend(cross(x + u, y - v))
        title = f"{axis} = {format_number(level, 4)}"
        maps.append(drawing_text(title, x, TOP - 10.0, "title"))
        left += LEFT + scale * spans[first] + RIGHT
    return svg_drawing(TOP + BOTTOM + scale * high, "Three slices of the workspace", *maps)


def legend(slices: Slices, unit_mm: float) -> Element:
    """Return the legend of the colours of maps, of the smallest margin or of another measure."""
    bands, step, left, pieces = slices.bands, 46.0, 130.0, list[Element]()
    colours, levels = bands.colours, bands.levels
    title, rows = "smallest margin", [("units", 1.0)] * (unit_mm != 1.0) + [("mm", unit_mm)]
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
            number = format_number(level * factor, 3)
            pieces.append(drawing_text(number, left + step * index, y, anchor="middle"))
    for index, colour in enumerate(colours):
        x = left + step * index
        pieces.append(element("rect", x=x, y=4.0, width=step, height=14.0, fill=css(colour)))
    if any(slices.workspace.design.limits.leg_radii):
        x = left + step * len(colours) + 18.0
        pieces.append(element("rect", x=x, y=4.0, width=14.0, height=14.0, fill=css(OUTLINE)))
        pieces.append(drawing_text("legs collide", x + 19.0, 15.0))
    return svg_drawing(24.0 + 14.0 * len(rows), "The colours of the maps", *pieces)


def map_transform(size: float, x: float, y: float) -> str:
    """Return the transform that puts a map's lows at (x, y), at a size in points per own point."""
    return f"matrix({size:.6g} 0 0 {-size:.6g} {x:.6g} {y:.6g})"


def cross(x: float, y: float) -> tuple[Element, Element]:
    """Return a cross with its middle at (x, y), over its own light rim."""
    data = f"M{coordinate(x - 5)},{coordinate(y)}h10m-5,-5v10"
    rim, sign = (element("path", d=data, class_=look) for look in ("cross casing", "cross"))
    return rim, sign


def ruler(
    title: str,
    ends: tuple[float, float],
    start: float,
    scale: float,
    *,
    across: float,
    up: bool,
    whole: bool = False,
    grid: float = 0.0,
    words: Callable[[float], str] = lambda value: format_number(value, 5),
) -> Element:
    """Return an axis with ticks at round numbers, below a map or, if it goes up, to its left.

    The values at its ends are given, the place of the lowest one on paper along the axis, points of
    paper per unit of the values, and the place of the axis across it. Ticks may be at whole numbers
    only, with lines of the length `grid` across the map, and words for their values.
    """
    low, high = ends
    step = round_length((high - low) / _TICKS * 1.6)
    if whole:
        step = max(1.0, float(math.ceil(step)))
    axis = element("g", class_="ruler")
    way = -1.0 if up else 1.0

    def put(along: float, off: float) -> tuple[float, float]:
        return (across - off, along) if up else (along, across + off)

    end = start + way * scale * (high - low)
    axis.append(line((put(start, 0.0), put(end, 0.0))))
    for tick in range(math.ceil(low / step - 1e-9), math.floor(high / step + 1e-9) + 1):
        at = start + way * scale * (tick * step - low)
        if grid:
            axis.append(line((put(at, 0.0), put(at, -grid)), "grid"))
        axis.append(line((put(at, 0.0), put(at, 4.0))))
        place = put(at + 3.5, 7.0) if up else put(at, 15.0)
        axis.append(drawing_text(words(tick * step), *place, anchor="end" if up else "middle"))
    place = put(0.5 * (start + end) + (3.5 if up else 0.0), 30.0)
    if title:
        axis.append(drawing_text(title, *place, "axis", anchor="middle"))
    return axis
