"""Solids: closed meshes, such as those of workspaces, with the limit of each face."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from explorer.numerics.arrays import FloatArray, IntArray, dot


@dataclass(frozen=True)
class Solid:
    """A closed mesh, in design units.

    Attributes:
        vertices: Positions of the vertices, shape (n, 3).
        faces: Indices of vertices, counter-clockwise from outside, shape (m, 3).
        limit_of_face: Index in `limits` of the limit of each face, shape (m,). It is -1 for a face
            that comes from no limit, which only a mesh that does not agree has.
        limits: Names of limits, such as "l1 maximum".
        tolerance: Largest distance of the faces from the true surface.
        empty_because: Names of the limits that empty the workspace, see
            `explorer.workspace.slices.volume.Volume`; () if the solid is not empty.
        agrees: Whether the volume agrees with the exact one, see
            `explorer.workspace.solids.solids`. A part or hull takes the value of the whole.
            None if no exact volume is known.
    """

    vertices: FloatArray
    faces: NDArray[np.int32]
    limit_of_face: IntArray
    limits: tuple[str, ...]
    tolerance: float
    empty_because: tuple[str, ...] = ()
    agrees: bool | None = None

    def shifted(self, offset: FloatArray) -> Solid:
        """Return the solid moved by a vector in design units, shape (3,).

        A constant-orientation workspace moved by `offset_of` the tool is that of the tool point.
        """
        return replace(self, vertices=self.vertices + offset)

    @property
    def is_empty(self) -> bool:
        """Whether the mesh has no face, as a workspace thinner than the tolerance may have."""
        return len(self.faces) == 0

    @property
    def ends(self) -> tuple[FloatArray, FloatArray]:
        """(lows, highs) of the vertices, each (3,), of a mesh that is not empty."""
        return self.vertices.min(axis=0), self.vertices.max(axis=0)

    @cached_property
    def volume(self) -> float:
        """The volume within the mesh, in cubed design units."""
        if self.is_empty:
            return 0.0
        lows, highs = self.ends
        middle = 0.5 * (lows + highs)
        a, b, c = ((self.vertices - middle)[self.faces[:, k]] for k in range(3))
        return float(np.einsum("ij,ij->", a, np.cross(b, c))) / 6.0

    @cached_property
    def area(self) -> float:
        """The area of the faces, in squared design units."""
        a, b, c = (self.vertices[self.faces[:, k]] for k in range(3))
        return 0.5 * float(np.linalg.norm(np.cross(b - a, c - a), axis=1).sum())

    @cached_property
    def is_watertight(self) -> bool:
        """Whether each edge is used exactly twice, in opposite directions."""
        if self.is_empty:
            return False
        edges = self.faces.astype(np.int64)[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2)
        count = len(self.vertices)
        there, back = np.sort(edges @ [count, 1]), np.sort(edges @ [1, count])
        return bool((np.diff(there) > 0).all() and (there == back).all())

    def winding(self, point: FloatArray) -> float:
        """Return the winding number of the faces about a point (3,): 1 inside, 0 outside.

        It is the sum of the solid angles of the faces (A. Van Oosterom and J. Strackee, 1983).
        """
        if self.is_empty:
            return 0.0
        a, b, c = ((self.vertices - point)[self.faces[:, k]] for k in range(3))
        x, y, z = (np.linalg.norm(v, axis=1) for v in (a, b, c))
        over = np.einsum("ij,ij->i", a, np.cross(b, c))
        under = x * y * z + dot(a, b) * z + dot(b, c) * x + dot(c, a) * y
        return float(np.arctan2(over, under).sum()) / (2.0 * np.pi)
