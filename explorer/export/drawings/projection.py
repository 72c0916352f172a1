"""Views of space on paper, fitted to a frame with y downwards, and labels that cover least."""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal, TypeAlias
from xml.etree.ElementTree import Element

import numpy as np

from explorer.export.drawings.markup import drawing_text
from explorer.numerics.arrays import FloatArray

ViewName = Literal["isometric", "front", "side", "top"]

# From the target towards the eye, as the page's camera.
_FROM = np.array([0.72, -1.0, 0.62])


def _axes(name: ViewName) -> FloatArray:
    """Return right, up and towards the eye, in rows, shape (3, 3)."""
    x, y, z = np.eye(3)
    if name == "isometric":
        toward = _FROM / np.linalg.norm(_FROM)
        right = np.cross(z, toward)
        right /= np.linalg.norm(right)
        return np.array([right, np.cross(toward, right), toward])
    right, up = {"top": (x, y), "front": (x, z), "side": (y, z)}[name]
    return np.array([right, up, np.cross(right, up)])


@dataclass(frozen=True)
class Projection:
    """A view, scaled and moved to its place on paper.

    Attributes:
        axes: Right, up and towards the eye, in rows, shape (3, 3).
        scale: Points of paper per design unit.
        offset: Position of the origin of space on paper, shape (2,).
    """

    axes: FloatArray
    scale: float
    offset: FloatArray

    def to(self, points: FloatArray) -> FloatArray:
        """Return points (..., 3) on paper, shape (..., 2)."""
        flat = points @ self.axes[:2].T * self.scale
        return flat * np.array([1.0, -1.0]) + self.offset

    def depth(self, points: FloatArray) -> FloatArray:
        """Return the nearness of points (..., 3) to the eye, in design units, shape (...)."""
        return np.asarray(points @ self.axes[2])

    @property
    def toward(self) -> FloatArray:
        """The direction to the eye, shape (3,)."""
        return np.array(self.axes[2])


def extents(name: ViewName, points: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return lows and highs of points (n, 3) to the right and up in a view, each (2,)."""
    flat = points @ _axes(name)[:2].T
    return flat.min(axis=0), flat.max(axis=0)


def fit_view(
    name: ViewName,
    points: FloatArray,
    frame: tuple[float, float, float, float],
    scale: float | None = None,
) -> Projection:
    """Return the view in which points (n, 3) fill a frame, in its middle.

    Args:
        name: Name of the view.
        points: Points to show, shape (n, 3).
        frame: Left, top, width and height on paper.
        scale: Points of paper per design unit; the largest that fits if None.
    """
    lows, highs = extents(name, points)
    left, top, width, height = frame
    # Points that coincide have no size to fit.
    spans = np.maximum(highs - lows, 1e-9 * float(np.abs(points).max()) or 1.0)
    size = min(width / float(spans[0]), height / float(spans[1])) if scale is None else scale
    middle = 0.5 * (lows + highs) * size * np.array([1.0, -1.0])
    return Projection(
        _axes(name), size, np.array([left + 0.5 * width, top + 0.5 * height]) - middle
    )


Box: TypeAlias = tuple[float, float, float, float]
Offset: TypeAlias = tuple[float, float]
"""The distance of a label from its point, and its direction in radians."""

# The size of a letter of a label, in points of paper.
LETTER, HEIGHT = 6.4, 12.0
_DIRECTIONS = tuple(math.radians(angle) for angle in (45, 135, -45, -135, 90, -90, 0, 180))
_DISTANCES = (13.0, 19.0, 26.0)
_ALONG = np.linspace(0.0, 1.0, 25)[:, None]


def labels(
    names: Sequence[tuple[str, FloatArray]],
    lines: Sequence[tuple[FloatArray, FloatArray]],
    within: Box,
) -> list[Element]:
    """Return labels of points.

    Args:
        names: Words of each label and its point, shape (2,).
        lines: Straight lines to keep clear, by their ends, each of shape (2,).
        within: Frame of the labels: left, top, right, bottom.
    """
    taken = [_box(point, 9.0, 9.0) for _, point in names]
    covered = np.concatenate([np.zeros((0, 2)), *(a + _ALONG * (b - a) for a, b in lines)])
    texts: list[Element] = []
    for name, point in names:
        width = LETTER * len(name) + 4.0

        def cost(offset: Offset, point: FloatArray = point, width: float = width) -> float:
            x0, y0, x1, y1 = box = _place_box(point, offset, width)
            inside = ((covered > (x0, y0)) & (covered < (x1, y1))).all(axis=1)
            outside = max(0.0, within[0] - x0, x1 - within[2], within[1] - y0, y1 - within[3])
            overlap = sum(_overlap(box, other) for other in taken)
            return overlap + 4.0 * float(inside.sum()) + 50.0 * outside + 0.4 * offset[0]

        best = min(itertools.product(_DISTANCES, _DIRECTIONS), key=cost)
        box = _place_box(point, best, width)
        taken.append(box)
        texts.append(drawing_text(name, 0.5 * (box[0] + box[2]), box[3] - 2.5, class_="label"))
    return texts


def _place_box(point: FloatArray, offset: Offset, width: float) -> Box:
    distance, angle = offset
    x, y = point.tolist()
    off_x = math.cos(angle) * (distance + 0.5 * width - 4.0)
    return _box(np.array([x + off_x, y - math.sin(angle) * distance]), width, HEIGHT)


def _box(middle: FloatArray, width: float, height: float) -> Box:
    x, y = middle.tolist()
    return x - 0.5 * width, y - 0.5 * height, x + 0.5 * width, y + 0.5 * height


def _overlap(one: Box, other: Box) -> float:
    wide = min(one[2], other[2]) - max(one[0], other[0])
    high = min(one[3], other[3]) - max(one[1], other[1])
    return max(0.0, wide) * max(0.0, high)
