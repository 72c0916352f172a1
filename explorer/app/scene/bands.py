"""Surfaces in bands of colour: by the proximity to singularities, or by what bounds them.

At one orientation margins are linear in the position, so that bands of the smallest margin are
exact on each triangle. The condition number is not linear: bands of it end at points that are
found on the edges of small triangles. It is signed, so that it is smooth where it is zero.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from explorer.mechanism.design import Design
from explorer.mechanism.margins import margins
from explorer.numerics.arrays import FloatArray, IntArray
from explorer.singularity.colours import BAND_EDGES, OUTLINE, WARN_CONDITION, Rgb, band_colours
from explorer.singularity.ellipsoids import planes_of_singularity
from explorer.singularity.jacobian import inverse_condition, jacobian
from explorer.workspace.accessible.workspace import PAIR_NAMES
from explorer.workspace.faces.divide import divide, find_roots
from explorer.workspace.faces.faces import Faces

Measure = Literal["plain", "margin", "condition"]

PLAIN: Rgb = (110, 150, 196)
# Where legs begin to collide: what collides has this colour all over the page.
COLLIDING: Rgb = OUTLINE
# Longest edge of a triangle that is coloured by the condition number, as a share of the reach,
# unless that takes too many triangles.
COLOURED_EDGE = 0.06
# Largest error of a value at the end of a band.
BAND_ERROR = 1e-5
# Most triangles into which a surface is cut to be coloured.
MOST_COLOURED = 100_000


@dataclass(frozen=True)
class Shell:
    """A part of a surface in one colour: vertices (n, 3) in design units, faces (m, 3)."""

    colour: Rgb
    vertices: FloatArray
    faces: NDArray[np.int32]


@dataclass(frozen=True)
class Colouring:
    """A colouring of positions by a measure, at one orientation.

    Attributes:
        design: The manipulator.
        rotation: Rotation from platform to base, shape (3, 3).
        measure: Measure that gives the colours.
        warn_below: Length below which margins raise a warning, in design units.
    """

    design: Design
    rotation: FloatArray
    measure: Measure
    warn_below: float

    def values(self, points: FloatArray) -> FloatArray:
        """Return the measure at points (n, 3), as multiples of its value for a warning."""
        if self.measure != "condition":
            return np.abs(margins(points, self.rotation)).min(axis=-1) / self.warn_below
        rates = jacobian(self.design, points, self.rotation)
        return inverse_condition(rates, self.design.reach) / WARN_CONDITION

    def shells(self, faces: Faces) -> tuple[tuple[Shell, ...], float | None]:
        """Return the parts of a surface, one for each colour, and its longest edge.

        The longest edge of a triangle that is coloured by the condition number, in design units,
        is given if it is longer than usual, because the surface is large beside the reach; it is
        None otherwise.
        """
        if not len(faces.triangles):
            return (), None
        if self.measure == "plain":
            return _by_cause(faces), None
        coarse_edge = None
        if self.measure == "condition":
            vertices, triangles = cut_to_size(
                faces.vertices, faces.triangles, COLOURED_EDGE * self.design.reach
            )
            longest = float(edge_lengths(vertices, triangles).max())
            coarse_edge = longest if longest > COLOURED_EDGE * self.design.reach else None
            bands = _Bands(vertices, triangles, self._signed(vertices), self._signed)
            levels = (*(-edge for edge in BAND_EDGES[:0:-1]), *BAND_EDGES)
        else:
            vertices, triangles = self._split_at_margins(faces.vertices, faces.triangles)
            bands = _Bands(vertices, triangles, self.values(vertices), None)
            levels = BAND_EDGES[1:]
        for level in levels:
            bands.split(level)
        return bands.shells(), coarse_edge

    def _signed(self, points: FloatArray) -> FloatArray:
        """Return the measure at points (n, 3) with the sign of the determinant."""
        sign = np.where(margins(points, self.rotation).prod(axis=-1) < 0.0, -1.0, 1.0)
        return sign * self.values(points)

    def _split_at_margins(
        self, vertices: FloatArray, triangles: IntArray
    ) -> tuple[FloatArray, IntArray]:
        """Return vertices and triangles, split where the smallest margin is not linear."""
        planes = planes_of_singularity(self.rotation)
        # Where two margins are equal, another one becomes the smallest.
        pairs = itertools.combinations(planes, 2)
        for normal in (*planes, *(a + sign * b for a, b in pairs for sign in (-1.0, 1.0))):
            parts = _Bands(vertices, triangles, vertices @ normal, None)
            parts.split(0.0)
            vertices, triangles = parts.vertices, parts.triangles
        return vertices, triangles


class _Bands:
    """Triangles that are split at levels of a value.

    Args:
        vertices: Positions, shape (n, 3).
        triangles: Indices of vertices, shape (m, 3).
        values: Values at the vertices, shape (n,).
        value: Function from points (n, 3) to values (n,); None if it is linear on each triangle.
    """

    def __init__(
        self,
        vertices: FloatArray,
        triangles: IntArray,
        values: FloatArray,
        value: Callable[[FloatArray], FloatArray] | None,
    ) -> None:
        self.vertices, self.triangles = vertices, triangles
        self._values, self._value = values, value

    def split(self, level: float) -> None:
        """Split all triangles along the line where the value equals a level."""
        off = self._values - level
        high = off >= 0.0
        if high.all() or not high.any():
            return
        division = divide(self.triangles, high)
        a, b = division.ends.T
        start, span = self.vertices[a], self.vertices[b] - self.vertices[a]
        share = -off[a] / (off[b] - off[a])
        value = self._value
        if value is not None:
            share = find_roots(
                lambda at: value(start + at[:, None] * span) - level, off[a], off[b], BAND_ERROR
            )
        self.vertices = np.concatenate([self.vertices, start + share[:, None] * span])
        self._values = np.concatenate([self._values, np.full(len(a), level)])
        self.triangles = division.faces

    def shells(self) -> tuple[Shell, ...]:
        """Return the bands of colour of the values' sizes."""
        middle = np.abs(self._values[self.triangles].mean(axis=1))
        band: IntArray = (middle[:, None] >= BAND_EDGES[1:]).sum(axis=1)
        return tuple(
            _shell(colour, self.vertices, self.triangles[band == index])
            for index, colour in enumerate(band_colours())
            if (band == index).any()
        )


def _shell(colour: Rgb, vertices: FloatArray, triangles: IntArray) -> Shell:
    """Return triangles with the vertices that they have."""
    used, corners = np.unique(triangles, return_inverse=True)
    return Shell(colour, vertices[used], corners.reshape(-1, 3).astype(np.int32))


def cut_to_size(
    vertices: FloatArray, triangles: IntArray, edge: float
) -> tuple[FloatArray, IntArray]:
    """Return the vertices and triangles of a surface, cut until their edges are short.

    A surface that is large beside the edge keeps longer ones: halving goes on only as long as
    it makes at most `MOST_COLOURED` triangles.

    Args:
        vertices: Positions, shape (n, 3).
        triangles: Indices of vertices, shape (m, 3).
        edge: Longest edge to aim at, in design units.
    """
    while True:
        lengths = edge_lengths(vertices, triangles)
        longest = float(lengths.max())
        shorter = max(edge, 0.5 * longest)
        # Each edge that is cut divides both triangles beside it in two.
        if longest <= edge or len(triangles) + int((lengths > shorter).sum()) > MOST_COLOURED:
            return vertices, triangles
        from trimesh import remesh

        untyped: Any = remesh
        subdivided = untyped.subdivide_to_size(vertices, triangles, shorter, max_iter=12)
        vertices, triangles = np.asarray(subdivided[0], dtype=np.float64), np.asarray(subdivided[1])


def edge_lengths(vertices: FloatArray, faces: IntArray) -> FloatArray:
    """Return the lengths of the three edges of each face, shape (m, 3)."""
    ends = vertices[faces]
    return np.linalg.norm(ends - np.roll(ends, -1, axis=1), axis=2)


def _by_cause(faces: Faces) -> tuple[Shell, ...]:
    """Return the surface along limits in one colour, and that along collisions in another."""
    pairs = [index for index, name in enumerate(faces.limits) if name in PAIR_NAMES]
    collide = np.isin(faces.limit_of_triangle, pairs)
    parts = ((PLAIN, faces.triangles[~collide]), (COLLIDING, faces.triangles[collide]))
    return tuple(_shell(colour, faces.vertices, part) for colour, part in parts if len(part))
