"""Surfaces in bands of colour: by the proximity to singularities, or by what bounds them.

At one orientation margins are linear in the position, so that bands of the smallest margin are
exact on each facet: their edges bend only where another margin becomes the smallest, and by the
angle between facets, which the tolerance of the solid bounds. The condition number is not linear:
it is computed at the corners of small facets, and signed, so that it is smooth where it is zero.
"""

from __future__ import annotations

import itertools
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
from explorer.workspace.solids.solid import Solid

Measure = Literal["plain", "margin", "condition"]

PLAIN: Rgb = (110, 150, 196)
# Where legs begin to collide: what collides has this colour all over the page.
COLLIDING: Rgb = OUTLINE
# Longest edge of a coloured facet as a share of the reach, unless that takes too many facets.
COLOURED_EDGE = 0.05
# Most facets into which a surface is cut to be coloured.
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

    def shells(self, solid: Solid) -> tuple[tuple[Shell, ...], float | None]:
        """Return the parts of a surface, one for each colour, and its longest edge.

        The longest edge of a facet that is coloured by the condition number, in design units, is
        given if it is longer than usual, because the surface is large beside the reach; it is None
        otherwise.
        """
        if solid.is_empty:
            return (), None
        if self.measure == "plain":
            return _by_cause(solid), None
        coarse_edge = None
        if self.measure == "condition":
            rest, share, longest = self._conditioned(solid)
            coarse_edge = longest if longest > COLOURED_EDGE * self.design.reach else None
        else:
            rest = self._split_at_margins(solid.vertices[solid.faces])
            share = self.values(rest.reshape(-1, 3)).reshape(-1, 3)
        shells: list[Shell] = []
        for colour, edge in zip(band_colours(), (*BAND_EDGES[1:], np.inf), strict=True):
            band, rest, share = split_at(rest, share, edge)
            if len(band):
                corners = np.arange(3 * len(band), dtype=np.int32).reshape(-1, 3)
                shells.append(Shell(colour, band.reshape(-1, 3), corners))
        return tuple(shells), coarse_edge

    def _split_at_margins(self, triangles: FloatArray) -> FloatArray:
        """Return triangles (n, 3, 3) split where the smallest margin is not linear."""
        planes = planes_of_singularity(self.rotation)
        # Where two margins are equal, another one becomes the smallest.
        pairs = itertools.combinations(planes, 2)
        for normal in (*planes, *(a + sign * b for a, b in pairs for sign in (-1.0, 1.0))):
            low, high, _ = split_at(triangles, triangles @ normal, 0.0)
            triangles = np.concatenate([low, high])
        return triangles

    def _conditioned(self, solid: Solid) -> tuple[FloatArray, FloatArray, float]:
        """Return small triangles (n, 3, 3), their measure (n, 3), and their longest edge."""
        vertices, faces = cut_to_size(solid, COLOURED_EDGE * self.design.reach)
        # With the sign of the determinant the measure is smooth where it is zero.
        sign = np.where(margins(vertices, self.rotation).prod(axis=-1) < 0.0, -1.0, 1.0)
        triangles, signed = vertices[faces], (sign * self.values(vertices))[faces]
        _, positive, above = split_at(triangles, signed, 0.0)
        # A facet of which every position is singular is one of the positive ones.
        _, negative, below = split_at(triangles, -signed, np.nextafter(0.0, 1.0))
        return (
            np.concatenate([positive, negative]),
            np.concatenate([above, below]),
            float(edge_lengths(vertices, faces).max()),
        )


def cut_to_size(solid: Solid, edge: float) -> tuple[FloatArray, IntArray]:
    """Return the vertices and faces of a surface whose facets are cut until their edges are short.

    A surface that is large beside the edge keeps longer ones: halving goes on only as long as
    it makes at most `MOST_COLOURED` facets.

    Args:
        solid: Solid with the surface; not empty.
        edge: Longest edge to aim at, in design units.
    """
    from trimesh import remesh

    untyped: Any = remesh
    vertices, faces = solid.vertices, np.asarray(solid.faces, dtype=np.int64)
    while True:
        lengths = edge_lengths(vertices, faces)
        longest = float(lengths.max())
        shorter = max(edge, 0.5 * longest)
        # Each edge that is cut divides both facets beside it in two.
        if longest <= edge or len(faces) + int((lengths > shorter).sum()) > MOST_COLOURED:
            return vertices, faces
        subdivided = untyped.subdivide_to_size(vertices, faces, shorter, max_iter=12)
        vertices, faces = np.asarray(subdivided[0], dtype=np.float64), np.asarray(subdivided[1])


def edge_lengths(vertices: FloatArray, faces: IntArray) -> FloatArray:
    """Return the lengths of the three edges of each face, shape (m, 3)."""
    ends = vertices[faces]
    return np.linalg.norm(ends - np.roll(ends, -1, axis=1), axis=2)


def _by_cause(solid: Solid) -> tuple[Shell, ...]:
    """Return the surface along limits in one colour, and that along collisions in another."""
    pairs = [index for index, name in enumerate(solid.limits) if name in PAIR_NAMES]
    collide = np.isin(solid.limit_of_face, pairs)
    parts = ((PLAIN, solid.faces[~collide]), (COLLIDING, solid.faces[collide]))
    return tuple(Shell(colour, solid.vertices, faces) for colour, faces in parts if len(faces))


def split_at(
    triangles: FloatArray, values: FloatArray, level: float
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Split triangles along the line where a value, linear on each triangle, equals a level.

    Args:
        triangles: Corners of the triangles, shape (n, 3, 3).
        values: Values at the corners, shape (n, 3).
        level: Level at which to split.

    Returns:
        The triangles below, the triangles above, and the values of those above.
    """
    high = values >= level
    count = high.sum(axis=1)
    low_side, high_side = [triangles[count == 0]], [triangles[count == 3]]
    high_values = [values[count == 3]]
    for lone_is_high, mixed in ((True, count == 1), (False, count == 2)):
        if not mixed.any():
            continue
        t, v, h = triangles[mixed], values[mixed], high[mixed]
        # The corner that is alone on its side comes first.
        lone = np.argmax(h == lone_is_high, axis=1)
        order = (lone[:, None] + np.arange(3)) % 3
        t = np.take_along_axis(t, order[:, :, None], axis=1)
        v = np.take_along_axis(v, order, axis=1)
        share = ((level - v[:, :1]) / (v[:, 1:] - v[:, :1]))[:, :, None]
        cut = t[:, :1] + share * (t[:, 1:] - t[:, :1])
        tip = np.stack([t[:, 0], cut[:, 0], cut[:, 1]], axis=1)
        base = np.concatenate(
            [
                np.stack([cut[:, 0], t[:, 1], t[:, 2]], axis=1),
                np.stack([cut[:, 0], t[:, 2], cut[:, 1]], axis=1),
            ]
        )
        at = np.full(len(t), level)
        tip_values = np.stack([v[:, 0], at, at], axis=1)
        base_values = np.concatenate(
            [np.stack([at, v[:, 1], v[:, 2]], axis=1), np.stack([at, v[:, 2], at], axis=1)]
        )
        (high_side if lone_is_high else low_side).append(tip)
        (low_side if lone_is_high else high_side).append(base)
        high_values.append(tip_values if lone_is_high else base_values)
    return np.concatenate(low_side), np.concatenate(high_side), np.concatenate(high_values)
