"""Workspaces as watertight meshes: the limits' primitive solids, combined by booleans.

The only module that uses manifold3d, but for `explorer.prototype.shapes`. Each face remembers
the limit that it comes from.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from explorer.arrays import FloatArray, IntArray
from explorer.constraints import Constraint, HalfSpace, constraints
from explorer.design import Design
from explorer.errors import ExplorerError, InputError
from explorer.facets import Facets
from explorer.isosurface import surface_below_zero
from explorer.pose import checked_rotation
from explorer.primitives import MOST_FACES, Frame, Piece, frame_of, pieces_of
from explorer.solid import Solid
from explorer.workspace import home_rotation, what_empties

if TYPE_CHECKING:
    from manifold3d import Manifold

CORNERS = np.array(list(itertools.product((0, 1), repeat=3)))

HULL = "convex hull"
"""What the faces of a convex hull come from."""


def workspace_solid(
    design: Design, rotation: ArrayLike | None = None, tolerance: float | None = None
) -> Solid:
    """Return the constant-orientation workspace as a mesh.

    Args:
        design: The manipulator.
        rotation: Platform to base, shape (3, 3); that of the home pose if None.
        tolerance: Largest distance of a face from the true surface, in design units; a
            500th of the reach, or of the workspace if that is smaller, if None.

    Raises:
        InputError: not a rotation, or a tolerance that is not positive or too small.
        ExplorerError: a boolean fails.
    """
    r = home_rotation(design) if rotation is None else checked_rotation(rotation)
    limits = constraints(design, r)
    solid = _common(design, limits, tolerance)
    return replace(solid, empty_because=what_empties(limits)) if solid.is_empty else solid


@dataclass(frozen=True)
class Surface:
    """Where a value on a grid of positions is zero; what is below zero is cut out.

    Attributes:
        values: At the nodes, shape (nx, ny, nz).
        lows: Of the first node, in design units, shape (3,).
        step: Between nodes on each axis, in design units, shape (3,).
        settle: Takes points of the interpolated surface and for each a kept node beside
            it, both of shape (n, 3), and returns the points on the true surface.
        names: What faces of it come from.
        name_of: Takes points (n, 3) and returns the indices of their names, shape (n,).
    """

    values: FloatArray
    lows: FloatArray
    step: FloatArray
    settle: Callable[[FloatArray, FloatArray], FloatArray]
    names: tuple[str, ...]
    name_of: Callable[[FloatArray], IntArray]


def carved_solid(
    design: Design,
    limits: Sequence[Constraint],
    surface: Surface | None,
    seed: FloatArray,
    tolerance: float | None = None,
) -> Solid:
    """Return the connected part that holds a position of what limits and a surface leave.

    Args:
        design: The manipulator.
        limits: Such as those of `explorer.constraints.constraints`.
        surface: What else bounds it, if anything.
        seed: The position, shape (3,).
        tolerance: As of `workspace_solid`; the surface keeps to its own grid.

    Raises:
        InputError: a tolerance that is not positive or too small.
        ExplorerError: a boolean fails.
    """
    from manifold3d import Manifold

    frame, names = frame_of([limits], design.reach, tolerance), _names([limits])
    bodies, origins = _bodies([limits], frame, names)
    body = bodies[0]
    if surface is not None:
        own = Manifold.reserve_ids(1)
        origins[own] = len(names)
        body = body - _below_zero(surface, frame, own)
    parts = [_solid(part, origins, frame, names) for part in body.decompose()]
    if not parts:
        return _solid(body, origins, frame, names)

    def nearness(part: Solid) -> tuple[float, float]:
        # A seed on the surface is half within; one off by rounding goes to the nearest.
        off = float(np.linalg.norm(part.vertices - seed, axis=1).min())
        return round(part.winding(seed), 1), -off

    solid = max(parts, key=nearness)
    if surface is None:
        return solid
    of_face = solid.limit_of_face.copy()
    cut = np.flatnonzero(of_face == len(names))
    centres = solid.vertices[solid.faces[cut]].mean(axis=1)
    of_face[cut] = len(names) + surface.name_of(centres)
    return replace(solid, limit_of_face=of_face, limits=(*names, *surface.names))


def _below_zero(surface: Surface, frame: Frame, own: int) -> Manifold:
    """Return what a surface cuts out, as a body in a frame with an id of its own."""
    from manifold3d import Manifold

    below = np.argwhere(surface.values < 0.0)
    if not len(below):
        return Manifold()
    first = np.maximum(below.min(axis=0) - 1, 0)
    beyond = np.minimum(below.max(axis=0) + 2, surface.values.shape)
    x, y, z = (slice(int(a), int(b)) for a, b in zip(first, beyond, strict=True))
    values, lows = surface.values[x, y, z], surface.lows + first * surface.step
    where, faces = surface_below_zero(values)
    most = np.array(values.shape) - 2
    corners = np.clip(np.floor(where), 0, most).astype(np.int64)[:, None, :] + CORNERS
    kept = values[corners[..., 0], corners[..., 1], corners[..., 2]].argmax(axis=1)
    beside = corners[np.arange(len(where)), kept]
    points = surface.settle(lows + where * surface.step, lows + beside * surface.step)
    return _manifold_of((frame.to(points), faces), (own,), (len(faces),))


def reachable_solid(design: Design, rotations: ArrayLike, tolerance: float | None = None) -> Solid:
    """Return the positions that the platform can have in some of the orientations, as a mesh.

    Args:
        design: The manipulator.
        rotations: Platform to base, shape (n, 3, 3).
        tolerance: As of `workspace_solid`.

    Raises:
        InputError: not rotations, or a tolerance that is not positive or too small.
        ExplorerError: a boolean fails.
    """
    families = _families(design, rotations)
    frame = frame_of(families, design.reach, tolerance)
    names = _names(families)
    bodies, _ = _bodies(families, frame, names)
    vertices, faces, _ = _mesh_of(_union(bodies))
    points = frame.back(vertices)
    limits = [limit for family in families for limit in family]
    solid = Solid(points, faces, _nearest(limits, points, faces, names), names, frame.tolerance)
    if not solid.is_empty:
        return solid
    because = dict.fromkeys(name for family in families for name in what_empties(family))
    return replace(solid, empty_because=tuple(because))


def dexterous_solid(design: Design, rotations: ArrayLike, tolerance: float | None = None) -> Solid:
    """Return the positions that the platform can have in all of the orientations, as a mesh.

    Args:
        design: The manipulator.
        rotations: Platform to base, shape (n, 3, 3).
        tolerance: As of `workspace_solid`.

    Raises:
        InputError: not rotations, or a tolerance that is not positive or too small.
        ExplorerError: a boolean fails.
    """
    limits = [limit for family in _families(design, rotations) for limit in family]
    solid = _common(design, limits, tolerance)
    if not solid.is_empty:
        return solid
    names = _names([limits])
    alone = tuple(
        name
        for name in names
        if not _common(design, [x for x in limits if x.name != name], tolerance).is_empty
    )
    return replace(solid, empty_because=alone or names)


def convex_hull(solid: Solid) -> Solid:
    """Return the convex hull of a mesh; every face of it comes from `HULL`.

    Raises:
        ExplorerError: the hull fails.
    """
    from manifold3d import Manifold

    if solid.is_empty:
        return solid
    lows, highs = solid.vertices.min(axis=0), solid.vertices.max(axis=0)
    middle, scale = 0.5 * (lows + highs), float((highs - lows).max())
    points = (solid.vertices - middle) / scale
    shapes: Any = Manifold
    vertices, faces, _ = _mesh_of(shapes.hull_points(points))
    origin = np.zeros(len(faces), dtype=np.int64)
    return Solid(vertices * scale + middle, faces, origin, (HULL,), solid.tolerance)


def cut_solid(solid: Solid, half_space: HalfSpace) -> Solid:
    """Return what of a mesh lies in a half-space; faces in its plane come from its name.

    Raises:
        ExplorerError: the boolean fails.
    """
    from manifold3d import Manifold

    if solid.is_empty:
        return solid
    lows, highs = solid.vertices.min(axis=0), solid.vertices.max(axis=0)
    middle, scale = 0.5 * (lows + highs), float((highs - lows).max())
    order = np.argsort(solid.limit_of_face, kind="stable")
    used, counts = np.unique(solid.limit_of_face, return_counts=True)
    first = Manifold.reserve_ids(len(used))
    shape = (solid.vertices - middle) / scale, solid.faces[order].astype(np.int64)
    body = _manifold_of(shape, tuple(range(first, first + len(used))), tuple(counts.tolist()))
    length = float(np.linalg.norm(half_space.normal))
    x, y, z = (-half_space.normal / length).tolist()
    offset = (half_space.offset - float(half_space.normal @ middle)) / (length * scale)
    vertices, faces, ids = _mesh_of(body.trim_by_plane((x, y, z), -offset))
    names = (*solid.limits, half_space.name)
    of_face = np.full(len(ids), len(solid.limits), dtype=np.int64)
    for index, limit in enumerate(used.tolist()):
        of_face[ids == first + index] = limit
    return Solid(vertices * scale + middle, faces, of_face, names, solid.tolerance)


def _families(design: Design, rotations: ArrayLike) -> list[tuple[Constraint, ...]]:
    matrices = checked_rotation(rotations)
    if matrices.ndim != 3 or not len(matrices):
        raise InputError(f"rotations must have the shape (n, 3, 3); got {matrices.shape}")
    return [constraints(design, r) for r in matrices]


def _names(families: Sequence[Sequence[Constraint]]) -> tuple[str, ...]:
    return tuple(dict.fromkeys(limit.name for limits in families for limit in limits))


def _common(design: Design, limits: Sequence[Constraint], tolerance: float | None) -> Solid:
    """Return what keeps all limits."""
    frame, names = frame_of([limits], design.reach, tolerance), _names([limits])
    bodies, origins = _bodies([limits], frame, names)
    return _solid(bodies[0], origins, frame, names)


def _bodies(
    families: Sequence[Sequence[Constraint]], frame: Frame, names: tuple[str, ...]
) -> tuple[list[Manifold], dict[int, int]]:
    """Return what keeps all limits of each family, and the limits by the ids of bodies."""
    everything = [pieces_of(limits, frame) for limits in families]
    faces = sum(piece.faces for pieces in everything for piece in pieces)
    if faces > MOST_FACES:
        # Faces of balls are as many as the tolerance is small, others fewer.
        least = frame.tolerance * faces / MOST_FACES
        fewer = ", or the orientations fewer" if len(families) > 1 else ""
        raise InputError(
            f"a tolerance of {frame.tolerance:g} takes about {faces:.2g} triangles; at most "
            f"{MOST_FACES:,} are made, so it must be at least about {least:.2g}{fewer}"
        )
    origins: dict[int, int] = {}
    return [_body(pieces, origins, names) for pieces in everything], origins


def _body(pieces: Sequence[Piece], origins: dict[int, int], names: tuple[str, ...]) -> Manifold:
    from manifold3d import Manifold, OpType

    if not pieces:
        return Manifold()
    kept: list[Manifold] = []
    cut: list[Manifold] = []
    for piece in pieces:
        own = Manifold.reserve_ids(1)
        if piece.name:
            origins[own] = names.index(piece.name)
        shape = piece.make()
        made = _manifold_of(shape, (own,), (len(shape[1]),))
        (cut if piece.cuts else kept).append(made)
    common = Manifold.batch_boolean(kept, OpType.Intersect)
    return Manifold.batch_boolean([common, *cut], OpType.Subtract)


def _union(bodies: Sequence[Manifold]) -> Manifold:
    """Return the union, in pairs and pairs of pairs.

    Surfaces that bodies share are cut along all their other surfaces. Without what a body
    was made of those cuts heal, and without healing the faces of 64 bodies are millions.
    """
    while len(bodies) > 1:
        pairs = zip(bodies[::2], bodies[1::2], strict=False)
        left = bodies[len(bodies) // 2 * 2 :]
        bodies = [*((one + other).as_original().simplify(0.0) for one, other in pairs), *left]
    return bodies[0]


def _nearest(
    limits: Sequence[Constraint],
    vertices: FloatArray,
    faces: NDArray[np.int32],
    names: tuple[str, ...],
) -> IntArray:
    """Return the limits on whose surfaces the faces lie, as indices of names, shape (m,)."""
    found = np.zeros(len(faces), dtype=np.int64)
    least = np.full(len(faces), np.inf)
    for limit in limits:
        off = limit.distance(vertices)[faces].max(axis=1)
        found[off < least] = names.index(limit.name)
        least = np.minimum(off, least)
    return found


def _manifold_of(shape: Facets, ids: tuple[int, ...], counts: tuple[int, ...]) -> Manifold:
    """Return a body; so many of its faces, in their order, have each of the ids."""
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


def _solid(body: Manifold, origins: dict[int, int], frame: Frame, names: tuple[str, ...]) -> Solid:
    vertices, faces, ids = _mesh_of(body)
    which, inverse = np.unique(ids, return_inverse=True)
    of_id = np.array([origins[int(each)] for each in which], dtype=np.int64)
    return Solid(frame.back(vertices), faces, of_id[inverse], names, frame.tolerance)


def _mesh_of(body: Manifold) -> tuple[FloatArray, NDArray[np.int32], NDArray[np.uint32]]:
    """Return vertices, faces, and of each face the id of the body that it comes from.

    Raises:
        ExplorerError: a boolean failed.
    """
    from manifold3d import Error

    status = body.status()
    if status != Error.NoError:
        raise ExplorerError(f"the solid could not be made: manifold3d reports {status.name}")
    mesh: Any = body.to_mesh64()
    faces = np.asarray(mesh.tri_verts, dtype=np.int32)
    if len(mesh.merge_from_vert):
        same = np.arange(len(mesh.vert_properties), dtype=np.int32)
        same[mesh.merge_from_vert] = mesh.merge_to_vert
        faces = same[faces]
    runs = np.diff(np.asarray(mesh.run_index, dtype=np.int64)) // 3
    ids = np.repeat(np.asarray(mesh.run_original_id), runs)
    return np.array(mesh.vert_properties[:, :3]), faces, ids
