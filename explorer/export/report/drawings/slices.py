"""Maps of slices as drawings: exact outlines, filled in bands by the smallest margin.

At one orientation each margin is linear in the position, so the positions of a slice at which
every margin is at least a level are polygons: the bands are as exact as the outline.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any
from xml.etree.ElementTree import Element

import numpy as np
from numpy.typing import ArrayLike

from explorer.export.report.drawings.mechanism import path_of, round_length
from explorer.export.report.markup import coordinate, element
from explorer.legs.clearance import leg_clearances
from explorer.mechanism.design import Design, Swing
from explorer.numerics.arrays import BoolArray, FloatArray
from explorer.singularity.colours import BAND_EDGES, OUTLINE, WARN_SHARE, band_colours, css
from explorer.singularity.ellipsoids import planes_of_singularity
from explorer.workspace.limits.constraints import constraints
from explorer.workspace.limits.region import region_of
from explorer.workspace.slices.axes import AXES
from explorer.workspace.slices.fields import slice_field
from explorer.workspace.slices.outline import Edge, Outline, slice_outline
from explorer.workspace.slices.volume import bounds

# The longer side of a workspace in the drawing's own coordinates.
OWN_SIZE = 1000.0
# Cells on the longer side, where a slice has no exact outline and where legs collide.
CELLS = 240
COLLISION_CELLS = 160
# More contours than a workspace can have.
CONTOURS = 60


@dataclass(frozen=True)
class Slices:
    """Slices of the workspace of a design at one orientation.

    Attributes:
        design: The manipulator.
        rotation: Rotation from platform to base, shape (3, 3).
        lows, highs: Corners of a box that holds the workspace, each of shape (3,).
    """

    design: Design
    rotation: FloatArray
    lows: FloatArray
    highs: FloatArray

    @staticmethod
    def of(design: Design, rotation: FloatArray, extent: tuple[FloatArray, FloatArray]) -> Slices:
        """Return the slices of a workspace that is not empty, of known extent."""
        lows, highs = bounds(region_of(constraints(design, rotation)))
        return Slices(design, rotation, np.maximum(lows, extent[0]), np.minimum(highs, extent[1]))

    @property
    def warn_below(self) -> float:
        """The warning length of margins, in design units."""
        return WARN_SHARE * self.design.reach

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
        return self.design.limits.swing == Swing()

    def area(self, axis: str, level: float) -> float | None:
        """Return the exact area of a slice, in squared design units; None with cones."""
        outline = self.outline(axis, level)
        return None if outline is None else outline.area

    def outline(self, axis: str, level: float) -> Outline | None:
        """Return the exact outline of a slice; None with cones."""
        return slice_outline(self.design, self.rotation, axis, level)

    def map(self, axis: str, level: float, name: str) -> Element:
        """Return the map of a slice, in its own coordinates: scaled, from the lows, y upwards.

        Args:
            axis: Axis that the slice is normal to.
            level: Coordinate of the slice on that axis, in design units.
            name: Identifier of the outline, unique in the document.
        """
        outline = self.outline(axis, level)
        to_map = _ToMap(self.lows[in_plane(axis)], self.own_scale)
        if outline is None:
            extent = (self.lows, self.highs)
            places: dict[str, Any] = {"axis": axis, "level": level, "extent": extent}
            field = slice_field(self.design, self.rotation, "margin", steps=CELLS, **places)
            data, edge = _runs(field.inside, to_map(_ends(field.columns, field.rows))), None
        else:
            data = "".join(_loop(loop, to_map) for loop in outline.loops)
            edge = element("path", d=data, class_="edge") if data else None
        if not data:
            return element("g")
        filled = element("g", clip_path=f"url(#{name})")

        def add(share: float, **look: str) -> None:
            polygons = [path_of(to_map(polygon)) for polygon in self._beyond(axis, level, share)]
            if polygons:
                filled.append(element("path", d="".join(polygons), **look))

        first, *others = band_colours()
        filled.append(element("path", d=path_of(to_map(self._corners(axis))), fill=css(first)))
        for share, colour in zip(BAND_EDGES[1:], others, strict=True):
            add(share, fill=css(colour))
        for number in range(1, CONTOURS):
            share = number * self.contour_step / self.warn_below
            if share > BAND_EDGES[-1]:
                add(share, class_="contour")
        if any(self.design.limits.leg_radii):
            filled.append(self._collisions(axis, level, to_map))
        clip = element("clipPath", element("path", d=data, clip_rule="evenodd"), id=name)
        return element("g", clip, filled, edge)

    def _corners(self, axis: str) -> FloatArray:
        (u0, v0), (u1, v1) = self.lows[in_plane(axis)], self.highs[in_plane(axis)]
        return np.array([[u0, v0], [u1, v0], [u1, v1], [u0, v1]])

    def _beyond(self, axis: str, level: float, share: float) -> Iterator[FloatArray]:
        """Yield the polygons in which every margin is at least a share of the warning length."""
        gradients = planes_of_singularity(self.rotation)
        for signs in itertools.product((-1.0, 1.0), repeat=3):
            polygon = self._corners(axis)
            for sign, gradient in zip(signs, gradients, strict=True):
                beyond = float(gradient[AXES.index(axis)]) * level
                least = share * self.warn_below - sign * beyond
                polygon = _clipped(polygon, sign * (polygon @ gradient[in_plane(axis)]) - least)
                if not len(polygon):
                    break
            else:
                yield polygon

    def _collisions(self, axis: str, level: float, to_map: _ToMap) -> Element:
        lows, sides = self.lows[in_plane(axis)], (self.highs - self.lows)[in_plane(axis)]
        many = np.maximum(1.0, np.rint(COLLISION_CELLS * sides / sides.max())).astype(int)
        columns, rows = (
            low + side / n * (np.arange(n, dtype=np.float64) + 0.5)
            for low, side, n in zip(lows.tolist(), sides.tolist(), many.tolist(), strict=True)
        )
        points = np.full((len(rows), len(columns), 3), level)
        first, second = in_plane(axis)
        points[..., first], points[..., second] = columns, rows[:, None]
        collide = leg_clearances(self.design, points, self.rotation).clearance.min(axis=-1) <= 0.0
        return element("path", d=_runs(collide, to_map(_ends(columns, rows))), fill=css(OUTLINE))


def in_plane(axis: str) -> list[int]:
    """Return the indices of the two axes of a slice that is normal to a third."""
    return [index for index, name in enumerate(AXES) if name != axis]


@dataclass(frozen=True)
class _ToMap:
    """The conversion from design units to the own coordinates of a map."""

    lows: FloatArray
    scale: float

    def __call__(self, points: FloatArray) -> FloatArray:
        return (points - self.lows) * self.scale

    def text(self, point: ArrayLike) -> str:
        """Return a point as coordinates of a path."""
        x, y = self(np.asarray(point)).tolist()
        return f"{coordinate(x)},{coordinate(y)}"


def _loop(loop: tuple[Edge, ...], to_map: _ToMap) -> str:
    """Return a closed loop of edges as the data of a path."""
    data = [f"M{to_map.text(loop[0].start)}"]
    for edge in loop:
        if edge.centre is None:
            data.append(f"L{to_map.text(edge.end)}")
            continue
        radius = coordinate(edge.radius * to_map.scale)
        arc = f"A{radius},{radius} 0 0 {int(edge.turn > 0.0)}"
        if abs(edge.turn) > math.pi - 1e-6:
            # An arc of a path must be less than a whole circle: two halves are plain.
            data.append(f"{arc} {to_map.text(_middle(edge))}")
        data.append(f"{arc} {to_map.text(edge.end)}")
    return "".join((*data, "Z"))


def _middle(edge: Edge) -> FloatArray:
    centre = np.array(edge.centre)
    x, y = np.array(edge.start) - centre
    c, s = math.cos(0.5 * edge.turn), math.sin(0.5 * edge.turn)
    return centre + np.array([c * x - s * y, s * x + c * y])


def _clipped(polygon: FloatArray, values: FloatArray) -> FloatArray:
    """Return the part of a convex polygon (n, 2) where a linear value is not negative."""
    corners: list[FloatArray] = []
    for k in range(len(polygon)):
        a, b = values[k - 1], values[k]
        if (a >= 0.0) != (b >= 0.0):
            corners.append(polygon[k - 1] + a / (a - b) * (polygon[k] - polygon[k - 1]))
        if b >= 0.0:
            corners.append(polygon[k])
    return np.array(corners) if len(corners) > 2 else np.zeros((0, 2))


def _ends(columns: FloatArray, rows: FloatArray) -> FloatArray:
    """Return the edges of cells about columns and rows, as points (n + 1, 2), NaN-padded."""
    many = max(len(columns), len(rows)) + 1
    ends = np.full((many, 2), np.nan)
    for k, middles in enumerate((columns, rows)):
        step = float(middles[1] - middles[0]) if len(middles) > 1 else 1.0
        ends[: len(middles) + 1, k] = middles[0] + step * (np.arange(len(middles) + 1) - 0.5)
    return ends


def _runs(cells: BoolArray, ends: FloatArray) -> str:
    """Return the set cells as the data of a path, one rectangle for a run in a row."""
    data: list[str] = []
    for row, flags in enumerate(cells):
        jumps = np.flatnonzero(np.diff(np.concatenate([[False], flags, [False]]).astype(int)))
        low, high = float(ends[row, 1]), float(ends[row + 1, 1])
        for first, last in jumps.reshape(-1, 2).tolist():
            left, right = float(ends[first, 0]), float(ends[last, 0])
            data.append(
                f"M{coordinate(left)},{coordinate(low)}H{coordinate(right)}"
                f"V{coordinate(high)}H{coordinate(left)}Z"
            )
    return "".join(data)
