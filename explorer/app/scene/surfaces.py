"""Surfaces as browsers draw them: in bands of colour, and with edges that look sharp.

At one orientation margins are linear in the position, so that bands of the smallest margin are
exact on each triangle. Other measures are not linear: their bands end at points that are found on
the edges of small triangles. These are split along the singular planes, where all measures are
zero and have a fold.

Browsers shade by the normals of vertices, each the mean over the faces about it. So vertices are
split where faces meet at a sharp edge, and shared elsewhere.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Literal, TypeAlias

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.sparse import csgraph

from explorer.measures.position_bands import PositionBands, PositionMeasure, position_bands
from explorer.mechanism.machine import NO_LOAD, Six
from explorer.mechanism.margins import planes_of_singularity
from explorer.mechanism.rgb import OUTLINE, Rgb, mix
from explorer.numerics.arrays import BoolArray, FloatArray, IntArray, dot
from explorer.numerics.roots import find_roots
from explorer.singularity.colours import SINGULAR, WARNED
from explorer.statics.reactions import PART_NAMES
from explorer.workspace.accessible.workspace import PAIR_NAMES
from explorer.workspace.faces.faces import Faces, divide
from explorer.workspace.solids.solid import Solid
from explorer.workspace.workspace import Workspace

Measure = Literal["plain"] | PositionMeasure

PLAIN: Rgb = (110, 150, 196)
# Where legs begin to collide: what collides has this colour all over the page.
COLLIDING: Rgb = OUTLINE
# Where a part takes its limit under the load.
AT_LIMIT: Rgb = mix(WARNED, SINGULAR, 0.4)
# Longest edge of a triangle whose measure is not linear, as a share of the reach, unless that
# takes too many triangles.
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
    """A colouring of the positions of a workspace by a measure.

    The length below which margins raise a warning is in design units. The load (F; M), besides the
    payload, acts at the tool point, along base axes, in N and N × unit.
    """

    workspace: Workspace
    measure: Measure
    warn_below: float
    load: Six = NO_LOAD

    @property
    def banded(self) -> PositionMeasure:
        """The measure of the bands: the smallest margin for one colour."""
        return "margin" if self.measure == "plain" else self.measure

    @property
    def bands(self) -> PositionBands:
        """The bands of that measure."""
        return position_bands(
            self.workspace, self.banded, warn_below=self.warn_below, load=self.load
        )

    def shells(self, faces: Faces, *, holds: bool = False) -> tuple[Shell, ...]:
        """Return the parts of a surface, one for each colour.

        If the surface is known to hold the load, no share on it counts as above the limit, which
        rounding and the flatness of facets would exceed.
        """
        if not len(faces.triangles):
            return ()
        if self.measure == "plain":
            return _by_cause(faces)
        bands, is_linear = self.bands, self.measure == "margin"
        vertices, triangles = faces.vertices, faces.triangles
        if not is_linear:
            longest = COLOURED_EDGE * self.workspace.design.reach
            vertices, triangles = cut_to_size(vertices, triangles, longest)
        vertices, triangles = self._split_at_folds(vertices, triangles)
        least = bands.edges[1] if holds and self.measure == "share" else 0.0

        def value(points: FloatArray) -> FloatArray:
            return np.maximum(bands.values(points), least)

        values = value(vertices)
        parts = _Bands(vertices, triangles, values, None if is_linear else value)
        for edge in bands.edges[1:]:
            parts.split(edge)
        return parts.shells(bands)

    def _split_at_folds(
        self, vertices: FloatArray, triangles: IntArray
    ) -> tuple[FloatArray, IntArray]:
        """Return vertices and triangles, split where the measure has a fold that is a plane."""
        planes = planes_of_singularity(self.workspace.rotation)
        folds = list(planes)
        if self.measure == "margin":
            # Where two margins are equal, another one becomes the smallest.
            pairs = itertools.combinations(planes, 2)
            folds += [a + sign * b for a, b in pairs for sign in (-1.0, 1.0)]
        for normal in folds:
            parts = _Bands(vertices, triangles, vertices @ normal)
            parts.split(0.0)
            vertices, triangles = parts.vertices, parts.triangles
        return vertices, triangles


@dataclass
class _Bands:
    """Triangles (m, 3) of vertices (n, 3) that are split at levels of a value.

    The vertices have values (n,); the function from points to values is None if it is linear on
    each triangle.
    """

    vertices: FloatArray
    triangles: IntArray
    values: FloatArray
    value: Callable[[FloatArray], FloatArray] | None = None

    def split(self, level: float) -> None:
        """Split all triangles along the line where the value equals a level."""
        off = self.values - level
        high = off >= 0.0
        if high.all() or not high.any():
            return
        ends, self.triangles, _ = divide(self.triangles, high)
        a, b = ends.T
        start, span = self.vertices[a], self.vertices[b] - self.vertices[a]
        share = -off[a] / (off[b] - off[a])
        value = self.value
        if value is not None:
            share = find_roots(
                lambda at: value(start + at[:, None] * span) - level, off[a], off[b], BAND_ERROR
            )
        self.vertices = np.concatenate([self.vertices, start + share[:, None] * span])
        self.values = np.concatenate([self.values, np.full(len(a), level)])

    def shells(self, bands: PositionBands) -> tuple[Shell, ...]:
        """Return the triangles in the colours of bands."""
        middle = self.values[self.triangles].mean(axis=1)
        band: IntArray = (middle[:, None] >= bands.edges[1:]).sum(axis=1)
        return tuple(
            _shell(colour, self.vertices, self.triangles[band == index])
            for index, colour in enumerate(bands.colours)
            if (band == index).any()
        )


def _shell(colour: Rgb, vertices: FloatArray, triangles: IntArray) -> Shell:
    """Return triangles with the vertices that they have."""
    used, corners = np.unique(triangles, return_inverse=True)
    return Shell(colour, vertices[used], corners.reshape(-1, 3).astype(np.int32))


def cut_to_size(
    vertices: FloatArray, triangles: IntArray, edge: float
) -> tuple[FloatArray, IntArray]:
    """Return vertices (n, 3) and triangles (m, 3) of a surface, cut until their edges are short.

    Halving goes on only as long as it makes at most `MOST_COLOURED` triangles.
    """
    while True:
        ends = vertices[triangles]
        lengths = np.linalg.norm(ends - np.roll(ends, -1, axis=1), axis=2)
        longest = float(lengths.max())
        shorter = max(edge, 0.5 * longest)
        # Each edge that is cut divides both triangles beside it in two.
        if longest <= edge or len(triangles) + int((lengths > shorter).sum()) > MOST_COLOURED:
            return vertices, triangles
        from trimesh import remesh

        untyped: Any = remesh
        subdivided = untyped.subdivide_to_size(vertices, triangles, shorter, max_iter=12)
        vertices, triangles = np.asarray(subdivided[0], dtype=np.float64), np.asarray(subdivided[1])


def _by_cause(faces: Faces) -> tuple[Shell, ...]:
    """Return the surface in colours: along limits, collisions of legs, and limits of a load."""
    causes = ((COLLIDING, PAIR_NAMES), (AT_LIMIT, PART_NAMES))
    parts: list[Shell] = []
    is_plain = np.ones(len(faces.triangles), dtype=np.bool_)
    for colour, names in causes:
        of_cause = [index for index, name in enumerate(faces.limits) if name in names]
        is_of_cause = np.isin(faces.limit_of_triangle, of_cause)
        is_plain &= ~is_of_cause
        if is_of_cause.any():
            parts.append(_shell(colour, faces.vertices, faces.triangles[is_of_cause]))
    if is_plain.any():
        parts.insert(0, _shell(PLAIN, faces.vertices, faces.triangles[is_plain]))
    return tuple(parts)


Drawn: TypeAlias = tuple[NDArray[np.float32], NDArray[np.uint32]]
"""Vertices (n, 3) and faces (m, 3)."""

# Faces at a larger angle meet at a sharp edge; neighbours on the parts' circles are 7.5° apart.
CREASE = math.radians(30.0)


def with_creases(vertices: FloatArray, faces: NDArray[np.int32]) -> Drawn:
    """Return a closed mesh whose faces on either side of a sharp edge share no vertices.

    Vertices have the shape (n, 3), faces (m, 3); each edge of them is shared by two.
    """
    first, second, _ = _neighbours(faces)
    smooth = _is_smooth(vertices, faces, first, second)
    shared, indices = _split(vertices, faces, first[smooth], second[smooth])
    return shared.astype(np.float32), indices.astype(np.uint32)


def creased_faces(solid: Solid) -> Faces:
    """Return the faces of a solid, one for each limit.

    Surfaces along which legs begin to collide are one face wherever they meet smoothly, and so are
    those where parts take their limits under a load.
    """
    faces = solid.faces.astype(np.int64)
    first, second, sides = _neighbours(faces)
    owner = solid.limit_of_face
    names = (*PAIR_NAMES, *PART_NAMES)
    is_found = np.array([name in names for name in solid.limits], dtype=np.bool_)[owner]
    both = is_found[first] & is_found[second]
    same = owner[first] == owner[second]
    joined = same | (both & _is_smooth(solid.vertices, faces, first, second))
    vertices, triangles = _split(solid.vertices, faces, first[joined], second[joined])
    return Faces(vertices, triangles, owner, solid.limits, solid.vertices[sides[~same & ~both]])


def _neighbours(faces: NDArray[Any]) -> tuple[IntArray, IntArray, IntArray]:
    """Return the two faces at each edge, each (k,), and the ends of the edges, shape (k, 2)."""
    edges = np.stack([faces, np.roll(faces, -1, axis=1)], axis=-1).reshape(-1, 2)
    edges = np.sort(edges.astype(np.int64), axis=-1)
    owners = np.repeat(np.arange(len(faces)), 3)
    order = np.lexsort((edges[:, 1], edges[:, 0]))
    return owners[order[::2]], owners[order[1::2]], edges[order[::2]]


def _is_smooth(
    vertices: FloatArray, faces: NDArray[Any], first: IntArray, second: IntArray
) -> BoolArray:
    """Return whether neighbouring faces meet at a small angle."""
    corners = vertices[faces]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-300)
    return dot(normals[first], normals[second]) > math.cos(CREASE)


def _split(
    vertices: FloatArray, faces: NDArray[Any], first: IntArray, second: IntArray
) -> tuple[FloatArray, IntArray]:
    """Return vertices and faces, of which those share vertices that chains of neighbours join."""
    count = len(faces)
    links = (np.ones(len(first)), (first, second))
    _, patches = csgraph.connected_components(sparse.coo_matrix(links, shape=(count, count)))
    keys = faces.astype(np.int64) * count + patches[:, None]
    unique, indices = np.unique(keys.ravel(), return_inverse=True)
    return vertices[unique // count], indices.reshape(-1, 3)
