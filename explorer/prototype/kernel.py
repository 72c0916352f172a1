"""The operations that shape parts: by manifold3d as meshes, or as exact solids for STEP."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple, Protocol, TypeAlias

from explorer.mechanism.pose import Triple

Shape: TypeAlias = Any
"""A body: `+`, `-` and `^` are union, difference and intersection; it has the methods
`translate`, `rotate` (degrees about x, y and z in turn), `mirror` (normal to an axis) and
`transform` (a matrix of three rows and four columns)."""


class Circle(NamedTuple):
    """A circle in a plane normal to z."""

    radius: float
    x: float = 0.0
    y: float = 0.0


class Kernel(Protocol):
    """A maker of bodies, in millimetres."""

    def disc(self, circle: Circle, low: float, high: float) -> Shape:
        """Return a cylinder along z between two heights."""
        ...

    def hole(self, circle: Circle, low: float, high: float) -> Shape:
        """Return the tool that cuts a round hole; its chords lie outside the circle."""
        ...

    def ball(self, radius: float) -> Shape:
        """Return a ball about the origin."""
        ...

    def cavity(self, radius: float) -> Shape:
        """Return the tool that cuts a seat for a ball about the origin."""
        ...

    def box(self, low: Triple, high: Triple) -> Shape:
        """Return a box between two corners."""
        ...

    def union(self, shapes: Sequence[Shape]) -> Shape:
        """Return the union of shapes."""
        ...

    def hull(self, circles: Sequence[Circle], low: float, high: float) -> Shape:
        """Return a plate between two heights, whose outline is the convex hull of circles."""
        ...
