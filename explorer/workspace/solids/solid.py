"""Solids: closed meshes, such as those of workspaces, with the limit of each face.

Parts of a solid, its convex hull and unions of bodies are booleans of manifold3d. Each face of a
body has an id, which booleans preserve.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from explorer.errors import ExplorerError
from explorer.numerics.arrays import FloatArray, IntArray, dot, triple
from explorer.numerics.isosurface import surface_below_zero
from explorer.workspace.limits.constraints import HalfSpace
from explorer.workspace.solids.facets import Facets, TessellationFrame, frame_around

if TYPE_CHECKING:
    from manifold3d import Manifold


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

    def shift(self, offset: FloatArray) -> Solid:
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
        a, b, c = ((self.vertices - 0.5 * (lows + highs))[self.faces[:, k]] for k in range(3))
        return float(np.einsum("ij,ij->", a, np.cross(b, c))) / 6.0

    @cached_property
    def areas(self) -> FloatArray:
        """The areas of the faces, in squared design units, shape (m,)."""
        a, b, c = (self.vertices[self.faces[:, k]] for k in range(3))
        return 0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=1)

    @cached_property
    def is_watertight(self) -> bool:
        """Whether each edge is used exactly twice, in opposite directions."""
        edges = self.faces.astype(np.int64)[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2)
        count = len(self.vertices)
        there, back = np.sort(edges @ [count, 1]), np.sort(edges @ [1, count])
        return bool(len(there) and (np.diff(there) > 0).all() and (there == back).all())

    def winding(self, point: FloatArray) -> float:
        """Return the winding number of the faces about a point (3,): 1 inside, 0 outside.

        It is the sum of the solid angles of the faces (A. Van Oosterom and J. Strackee, 1983).
        """
        a, b, c = ((self.vertices - point)[self.faces[:, k]] for k in range(3))
        x, y, z = (np.linalg.norm(v, axis=1) for v in (a, b, c))
        over = np.einsum("ij,ij->i", a, np.cross(b, c))
        under = x * y * z + dot(a, b) * z + dot(b, c) * x + dot(c, a) * y
        return float(np.arctan2(over, under).sum()) / (2.0 * np.pi)


# Cells beyond the bounding box of a body at which what a surface removes from it is closed.
AROUND = 2
# Digits of coordinates, in the frame of a mesh, to which the corners of a hull are told apart.
HULL_DIGITS = 12
HULL = "convex hull"
"""The name in `Solid.limits` for the faces of a convex hull."""


def manifold_of(shape: Facets, ids: tuple[int, ...], counts: tuple[int, ...]) -> Manifold:
    """Return a mesh as a body whose consecutive faces have ids, each a number of them."""
    from manifold3d import Manifold, Mesh64

    vertices, faces = shape
    return Manifold(
        Mesh64(
            np.ascontiguousarray(vertices),
            faces.astype(np.uint64),
            run_index=np.cumsum([0, *counts], dtype=np.uint64) * np.uint64(3),
            run_original_id=np.array(ids, dtype=np.uint32),
        )
    )


def mesh_of(body: Manifold) -> tuple[FloatArray, NDArray[np.int32], NDArray[np.uint32]]:
    """Return the vertices, faces and ids of the faces of a body.

    Raises:
        ExplorerError: A boolean failed.
    """
    from manifold3d import Error

    status = body.status()
    if status != Error.NoError:
        raise ExplorerError(f"the solid could not be made: manifold3d reports {status.name}")
    mesh: Any = body.to_mesh64()
    faces = np.asarray(mesh.tri_verts, dtype=np.int32)
    if len(mesh.merge_from_vert):
        merged = np.arange(len(mesh.vert_properties), dtype=np.int32)
        merged[mesh.merge_from_vert] = mesh.merge_to_vert
        faces = merged[faces]
    runs = np.diff(np.asarray(mesh.run_index, dtype=np.int64)) // 3
    ids = np.repeat(np.asarray(mesh.run_original_id), runs)
    return np.array(mesh.vert_properties[:, :3]), faces, ids


def union(bodies: Sequence[Manifold]) -> Manifold:
    """Return the union of bodies: of pairs first, then of pairs of pairs.

    Each boolean cuts surfaces that bodies share along their other surfaces. After `as_original`
    the cuts can be simplified away; otherwise the union of 64 bodies has millions of faces.
    """
    while len(bodies) > 1:
        pairs = zip(bodies[::2], bodies[1::2], strict=False)
        unpaired = bodies[len(bodies) // 2 * 2 :]
        bodies = [*((one + other).as_original().simplify(0.0) for one, other in pairs), *unpaired]
    return bodies[0]


@dataclass(frozen=True)
class Surface:
    """The zero level of a function that is known on a grid of positions.

    Attributes:
        values: Values at the nodes, shape (nx, ny, nz); the set below zero is removed.
        lows, step: First node and distance of nodes on each axis, in design units, shape (3,).
        project: Function of points on the interpolated surface and of the remaining end of the edge
            of each, both of shape (n, 3), that returns points on the true surface.
        names: Names in `Solid.limits` for faces of the surface.
        name_of: Function of points (n, 3) that returns the indices of their names, shape (n,);
            None if there is one name.
    """

    values: FloatArray
    lows: FloatArray
    step: FloatArray
    project: Callable[[FloatArray, FloatArray], FloatArray]
    names: tuple[str, ...]
    name_of: Callable[[FloatArray], IntArray] | None = None


def carved_solid(
    whole: Solid, surfaces: Iterable[Surface], seed: FloatArray | None = None
) -> Solid:
    """Return a workspace less what surfaces remove: the part with a seed (3,), or all parts.

    Raises:
        ExplorerError: A boolean fails.
    """
    from manifold3d import Manifold

    if whole.is_empty:
        return whole
    body, frame, origins = _body_of(whole)
    carved: list[Surface] = []
    for surface in surfaces:
        face_id = Manifold.reserve_ids(1)
        origins[face_id] = len(whole.limits) + len(carved)
        carved.append(surface)
        body = body - _below_zero(surface, frame, face_id, body)
    names = tuple(dict.fromkeys((*whole.limits, *(n for s in carved for n in s.names))))
    pieces = [body] if seed is None else body.decompose() or [body]
    parts = [replace(solid_of(part, origins, frame, names), agrees=whole.agrees) for part in pieces]
    at = np.zeros(3) if seed is None else seed

    def nearness(part: Solid) -> tuple[float, float]:
        # Rounding may put the seed on the surface or outside; the nearest vertex then decides.
        return round(part.winding(at), 1), -float(np.linalg.norm(part.vertices - at, axis=1).min())

    solid = max(parts, key=nearness) if len(parts) > 1 else parts[0]
    limit_of_face = solid.limit_of_face.copy()
    for index, surface in enumerate(carved, len(whole.limits)):
        faces = np.flatnonzero(solid.limit_of_face == index)
        centres = solid.vertices[solid.faces[faces]].mean(axis=1)
        own = surface.name_of(centres) if surface.name_of else np.zeros(len(faces), dtype=np.int64)
        limit_of_face[faces] = np.array([names.index(name) for name in surface.names])[own]
    return replace(solid, limit_of_face=limit_of_face)


def _below_zero(
    surface: Surface, frame: TessellationFrame, face_id: int, near: Manifold
) -> Manifold:
    """Return the set below zero of a surface as a body in a frame, with one id for its faces.

    It is closed a little beyond the bounding box of the body that it is removed from.
    """
    from manifold3d import Manifold

    if near.is_empty():
        return Manifold()
    untyped: Any = near
    ends = frame.to_design(np.reshape(untyped.bounding_box(), (2, 3)))
    nodes = (ends - surface.lows) / surface.step
    first = np.maximum(np.floor(nodes[0]).astype(np.int64) - AROUND, 0)
    end = np.ceil(nodes[1]).astype(np.int64) + AROUND + 1
    values = surface.values[tuple(map(slice, first, end))].copy()
    negative = np.argwhere(values < 0.0)
    if not len(negative):
        return Manifold()
    highest = -float(values.min())
    for axis in range(3):
        of_ends = np.moveaxis(values, axis, 0)[[0, -1]]
        np.moveaxis(values, axis, 0)[[0, -1]] = np.where(of_ends < 0.0, highest, of_ends)
    start = np.maximum(negative.min(axis=0) - 1, 0)
    values = values[tuple(map(slice, start, negative.max(axis=0) + 2))]
    if not (values < 0.0).any():
        return Manifold()
    lows = surface.lows + (first + start) * surface.step
    grid_points, faces = surface_below_zero(values)
    # Each point lies on an edge of the grid, one end of which remains.
    one, other = np.floor(grid_points).astype(np.int64), np.ceil(grid_points).astype(np.int64)
    remains = values[one[:, 0], one[:, 1], one[:, 2]] >= 0.0
    beside = np.where(remains[:, None], one, other)
    points = surface.project(lows + grid_points * surface.step, lows + beside * surface.step)
    return manifold_of((frame.to_frame(points), faces), (face_id,), (len(faces),))


def cut_solid(solid: Solid, half_space: HalfSpace) -> Solid:
    """Return the part of a mesh in a half-space; the limit of faces in its plane is its name."""
    if solid.is_empty:
        return solid
    body, frame, origins = _body_of(solid)
    length = float(np.linalg.norm(half_space.normal))
    offset = (half_space.offset - float(half_space.normal @ frame.middle)) / (length * frame.scale)
    names = tuple(dict.fromkeys((*solid.limits, half_space.name)))
    trimmed = body.trim_by_plane(triple(-half_space.normal / length), -offset)
    part = solid_of(trimmed, origins, frame, names)
    of_cut = names.index(half_space.name)
    limit_of_face = np.where(part.limit_of_face < 0, of_cut, part.limit_of_face)
    return replace(part, limit_of_face=limit_of_face, agrees=solid.agrees)


def convex_hull(solid: Solid) -> Solid:
    """Return the convex hull of a mesh; the limit of all its faces is `HULL`."""
    from manifold3d import Manifold

    if solid.is_empty:
        return solid
    frame = frame_around(*solid.ends, solid.tolerance)
    untyped: Any = Manifold
    # Of vertices that all but coincide the hull may have a fold.
    corners = np.unique(np.round(frame.to_frame(solid.vertices), HULL_DIGITS), axis=0)
    vertices, faces, _ = mesh_of(untyped.hull_points(corners))
    limit_of_face, points = np.zeros(len(faces), dtype=np.int64), frame.to_design(vertices)
    faces = _in_order(faces)
    return Solid(points, faces, limit_of_face, (HULL,), solid.tolerance, agrees=solid.agrees)


def _in_order(faces: NDArray[np.int32]) -> NDArray[np.int32]:
    """Return faces by their corners, the first of each face first.

    The threads of manifold3d leave those of a hull in any order, and each with any corner first.
    """
    turns = faces.argmin(axis=1)[:, None] + np.arange(3)
    turned = np.take_along_axis(faces, turns % 3, axis=1)
    return turned[np.lexsort(turned.T[::-1])]


def _body_of(solid: Solid) -> tuple[Manifold, TessellationFrame, dict[int, int]]:
    """Return a mesh as a body, its frame, and the indices of limits by the ids of faces."""
    from manifold3d import Manifold

    frame = frame_around(*solid.ends, solid.tolerance)
    order = np.argsort(solid.limit_of_face, kind="stable")
    used, counts = np.unique(solid.limit_of_face, return_counts=True)
    first = Manifold.reserve_ids(len(used))
    shape = frame.to_frame(solid.vertices), solid.faces[order].astype(np.int64)
    ids = tuple(range(first, first + len(used)))
    body = manifold_of(shape, ids, tuple(counts.tolist()))
    return body, frame, dict(zip(ids, used.tolist(), strict=True))


def solid_of(
    body: Manifold, origins: dict[int, int], frame: TessellationFrame, names: tuple[str, ...]
) -> Solid:
    """Return a body in a frame as a solid, with the indices of limits by the ids of faces."""
    vertices, faces, ids = mesh_of(body)
    distinct, inverse = np.unique(ids, return_inverse=True)
    limit_of_id = np.array([origins.get(int(face_id), -1) for face_id in distinct], dtype=np.int64)
    return Solid(frame.to_design(vertices), faces, limit_of_id[inverse], names, frame.tolerance)
