"""Maps of slices as drawings, for the report and the page: exact outlines, filled in bands.

At one orientation each margin is linear in the position, so the positions of a slice at which
every margin is at least a level are polygons: these bands are as exact as the outline. Bands of
other measures, limits on swings and collisions of legs are outlined on a fine grid.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import NamedTuple, TypeAlias
from xml.etree.ElementTree import Element

import numpy as np
from numpy.typing import ArrayLike

from explorer.export.drawings.markup import coordinate, element
from explorer.export.drawings.mechanism import path_of, round_length
from explorer.legs.clearance import leg_clearances
from explorer.mechanism.configuration import Configuration
from explorer.mechanism.design import Design
from explorer.mechanism.margins import margins
from explorer.numerics.arrays import FloatArray
from explorer.singularity.colours import OUTLINE, WARN_SHARE, css
from explorer.singularity.ellipsoids import planes_of_singularity
from explorer.workspace.limits.constraints import constraints, slacks
from explorer.workspace.limits.region import region_of
from explorer.workspace.limits.table import bounds_angles
from explorer.workspace.position_bands import PositionBands, position_bands
from explorer.workspace.slices.level_loops import level_loops
from explorer.workspace.slices.outline import AXES, Edge, Outline, slice_outline

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
    """Slices of the workspace of a design at one orientation.

    Attributes:
        design: The manipulator.
        rotation: Rotation from platform to base, shape (3, 3).
        lows, highs: Corners of a box that holds the workspace, each of shape (3,).
        bands: The measure that is drawn, in bands.
    """

    design: Design
    rotation: FloatArray
    lows: FloatArray
    highs: FloatArray
    bands: PositionBands

    @staticmethod
    def of(
        design: Design,
        rotation: FloatArray,
        extent: tuple[FloatArray, FloatArray],
        bands: PositionBands | None = None,
    ) -> Slices:
        """Return the slices of a workspace that is not empty, of known extent.

        Without bands, those of the smallest margin on a new page are drawn.
        """
        if bands is None:
            warn_below = WARN_SHARE * design.reach
            bands = position_bands(design, rotation, "margin", warn_below=warn_below)
        lows, highs = region_of(constraints(design, rotation)).ends
        lows, highs = np.maximum(lows, extent[0]), np.minimum(highs, extent[1])
        return Slices(design, rotation, lows, highs, bands)

    @property
    def own_scale(self) -> float:
        """The drawing's own points per design unit."""
        return OWN_SIZE / float((self.highs - self.lows).max())

    @property
    def contour_step(self) -> float:
        """The step of the margin from one contour to the next, in design units."""
        return round_length(0.15 * float((self.highs - self.lows).max()))

    @property
    def are_exact(self) -> bool:
        """Whether outlines are arcs and lines, rather than those of a grid."""
        return not bounds_angles(self.design)

    def area(self, axis: str, level: float) -> float | None:
        """Return the exact area of a slice, in squared design units; None with cones."""
        outline = self.outline(axis, level)
        return None if outline is None else outline.area

    def outline(self, axis: str, level: float) -> Outline | None:
        """Return the exact outline of a slice; None with cones."""
        return slice_outline(self.design, self.rotation, axis, level)

    def map(
        self,
        axis: str,
        level: float,
        name: str,
        not_accessible: Sequence[FloatArray] = (),
    ) -> Element:
        """Return the map of a slice, in its own coordinates: scaled, from the lows, y upwards.

        Args:
            axis: Axis that the slice is normal to.
            level: Coordinate of the slice on that axis, in design units.
            name: Identifier of the outline, unique in the document.
            not_accessible: Polygons around the positions that are not accessible, each of shape
                (n, 2), filled by the even-odd rule; () to mark none.
        """
        lows, scale = self.lows[in_plane(axis)], self.own_scale

        def to_map(points: FloatArray) -> FloatArray:
            return (points - lows) * scale

        data = self._outline_data(axis, level, to_map)
        if not data:
            return element("g")
        filled = element("g", clip_path=f"url(#{name})")

        def add(polygons: Iterable[FloatArray], **look: str) -> None:
            paths = [path_of(to_map(polygon)) for polygon in polygons]
            if paths:
                filled.append(element("path", d="".join(paths), **look))

        first, *others = self.bands.colours
        add([self._corners(axis)], fill=css(first))
        beyond = self.beyond(axis, level)
        for edge, colour in zip(self.bands.edges[1:], others, strict=True):
            add(beyond(edge), fill=css(colour), fill_rule="evenodd")
        if self.bands.measure == "margin":
            last, furthest = self.bands.edges[-1], self.bands.levels[-1]
            for number in range(1, CONTOURS):
                level_of_margin = number * self.contour_step
                if level_of_margin > furthest:
                    add(beyond(last * level_of_margin / furthest), class_="contour")
        add(
            not_accessible,
            fill=css(NOT_ACCESSIBLE),
            fill_opacity=f"{NOT_ACCESSIBLE_OPACITY:g}",
            fill_rule="evenodd",
            class_="is-blocked",
        )
        if any(self.design.limits.leg_radii):
            grid = self._grid(axis, level, CELLS)
            clearance = leg_clearances(
                Configuration(self.design, grid.points, self.rotation)
            ).clearance
            add(
                level_loops(grid.columns, grid.rows, -clearance.min(axis=-1), 0.0),
                fill=css(OUTLINE),
                fill_rule="evenodd",
                class_="is-colliding",
            )
        clip = element("clipPath", element("path", d=data, clip_rule="evenodd"), id=name)
        return element("g", clip, filled, element("path", d=data, class_="edge"))

    def _outline_data(self, axis: str, level: float, to_map: ToMap) -> str:
        """Return the outline of a slice as the data of a path; "" if the slice is empty."""
        outline = self.outline(axis, level)
        if outline is not None:
            return "".join(_loop(loop, to_map, self.own_scale) for loop in outline.loops)
        grid = self._grid(axis, level, CELLS)
        slack = slacks(constraints(self.design, self.rotation), grid.points).min(axis=-1)
        return "".join(
            path_of(to_map(loop)) for loop in level_loops(grid.columns, grid.rows, slack, 0.0)
        )

    def _corners(self, axis: str) -> FloatArray:
        (u0, v0), (u1, v1) = self.lows[in_plane(axis)], self.highs[in_plane(axis)]
        return np.array([[u0, v0], [u1, v0], [u1, v1], [u0, v1]])

    def beyond(self, axis: str, level: float) -> Callable[[float], Iterable[FloatArray]]:
        """Return the function from values of the bands to the polygons of a slice beyond them.

        The polygons, each of shape (n, 2) in design units, are filled by the even-odd rule; they
        may go beyond the limits.
        """
        if self.bands.measure == "margin":
            unit = self.bands.levels[-1] / self.bands.edges[-1]
            return lambda value: self._beyond_margin(axis, level, value * unit)
        is_slow = self.bands.measure == "condition"
        grid = self._grid(axis, level, CONDITION_CELLS if is_slow else CELLS)
        field = self._signed(grid.points.reshape(-1, 3)).reshape(grid.points.shape[:2])
        index = AXES.index(axis)

        def loops(value: float, sign: float) -> list[FloatArray]:
            def field_at(points: FloatArray) -> FloatArray:
                return sign * self._signed(np.insert(points, index, level, axis=1))

            refine = None if is_slow else field_at
            return level_loops(grid.columns, grid.rows, sign * field, value, refine)

        return lambda value: [*loops(value, 1.0), *loops(value, -1.0)]

    def _signed(self, points: FloatArray) -> FloatArray:
        """Return the values of the bands at points (n, 3), smooth where they are zero.

        They have the sign of the determinant.
        """
        sign = np.where(margins(points, self.rotation).prod(axis=-1) < 0.0, -1.0, 1.0)
        return sign * self.bands.values(points)

    def _beyond_margin(self, axis: str, level: float, margin: float) -> Iterator[FloatArray]:
        gradients = planes_of_singularity(self.rotation)
        for signs in itertools.product((-1.0, 1.0), repeat=3):
            polygon = self._corners(axis)
            for sign, gradient in zip(signs, gradients, strict=True):
                beyond = float(gradient[AXES.index(axis)]) * level
                least = margin - sign * beyond
                polygon = _clip(polygon, sign * (polygon @ gradient[in_plane(axis)]) - least)
                if not len(polygon):
                    break
            else:
                yield polygon

    def _grid(self, axis: str, level: float, cells: int) -> _Grid:
        lows, sides = self.lows[in_plane(axis)], (self.highs - self.lows)[in_plane(axis)]
        many = np.maximum(2.0, np.rint(cells * sides / sides.max())).astype(int) + 1
        columns, rows = (
            np.linspace(low, low + side, n, dtype=np.float64)
            for low, side, n in zip(lows.tolist(), sides.tolist(), many.tolist(), strict=True)
        )
        points = np.full((len(rows), len(columns), 3), level)
        first, second = in_plane(axis)
        points[..., first], points[..., second] = columns, rows[:, None]
        return _Grid(columns, rows, points)


class _Grid(NamedTuple):
    """A grid of positions on a slice: columns (n,), rows (m,), points (m, n, 3), all ascending."""

    columns: FloatArray
    rows: FloatArray
    points: FloatArray


def in_plane(axis: str) -> list[int]:
    """Return the indices of the two axes of a slice that is normal to a third."""
    return [index for index, name in enumerate(AXES) if name != axis]


ToMap: TypeAlias = Callable[[FloatArray], FloatArray]
"""The conversion of points from design units to the own coordinates of a map."""


def _text(point: ArrayLike, to_map: ToMap) -> str:
    """Return a point as coordinates of a path."""
    x, y = to_map(np.asarray(point)).tolist()
    return f"{coordinate(x)},{coordinate(y)}"


def _loop(loop: tuple[Edge, ...], to_map: ToMap, scale: float) -> str:
    """Return a closed loop of edges as the data of a path."""
    data = [f"M{_text(loop[0].start, to_map)}"]
    for edge in loop:
        if edge.centre is None:
            data.append(f"L{_text(edge.end, to_map)}")
            continue
        radius = coordinate(edge.radius * scale)
        arc = f"A{radius},{radius} 0 0 {int(edge.turn > 0.0)}"
        if abs(edge.turn) > math.pi - 1e-6:
            # An arc of a path must be less than a whole circle: two halves are plain.
            data.append(f"{arc} {_text(_middle(edge), to_map)}")
        data.append(f"{arc} {_text(edge.end, to_map)}")
    return "".join((*data, "Z"))


def _middle(edge: Edge) -> FloatArray:
    centre = np.array(edge.centre)
    x, y = np.array(edge.start) - centre
    c, s = math.cos(0.5 * edge.turn), math.sin(0.5 * edge.turn)
    return centre + np.array([c * x - s * y, s * x + c * y])


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
