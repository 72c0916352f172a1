"""Views of space on paper: parallel projections, fitted to a frame, with y downwards."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

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
