"""Workspaces as watertight meshes: the limits' primitive solids, combined by booleans.

With `explorer.workspace.solids.booleans` the only module that uses manifold3d, but for
`explorer.prototype.shapes`. Each face remembers the limit that it comes from.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from explorer.errors import InputError
from explorer.mechanism.design import Design
from explorer.mechanism.pose import checked_rotation
from explorer.numerics.arrays import FloatArray, IntArray
from explorer.numerics.isosurface import surface_below_zero
from explorer.workspace.limits.constraints import Constraint, HalfSpace, constraints
from explorer.workspace.slices.volume import Volume, home_rotation, what_empties
from explorer.workspace.solids.agreement import Exact, exact_of, exact_within
from explorer.workspace.solids.booleans import manifold_of, mesh_of, union
from explorer.workspace.solids.primitives import (
    MOST_FACES,
    Frame,
    Piece,
    frame_around,
    frame_of,
    pieces_of,
)
from explorer.workspace.solids.solid import Solid

if TYPE_CHECKING:
    from manifold3d import Manifold

CORNERS = np.array(list(itertools.product((0, 1), repeat=3)))

# So many times finer is a mesh made again whose volume is not the exact one,
FINER = 4.0
# as often as this, and as long as its primitives have no more faces than this together.
MOST_ROUNDS = 10
MOST_REFINED = 60_000

HULL = "convex hull"
"""What the faces of a convex hull come from."""


def workspace_solid(
    design: Design,
    rotation: ArrayLike | None = None,
    tolerance: float | None = None,
    *,
    volume: Volume | None = None,
) -> Solid:
    """Return the constant-orientation workspace as a mesh.

    Its volume is compared with the exact one. Where they disagree the mesh is made finer than
    the tolerance asks for; `Solid.agrees` is False if they still disagree at `MOST_REFINED`
    faces.

    Args:
        design: The manipulator.
        rotation: Platform to base, shape (3, 3); that of the home pose if None.
        tolerance: Largest distance of a face from the true surface, in design units; a
            500th of the reach, or of the workspace if that is smaller, if None.
        volume: The exact volume if it is known already.

    Raises:
        InputError: not a rotation, or a tolerance that is not positive or too small.
        ExplorerError: a boolean fails.
    """
    r = home_rotation(design) if rotation is None else checked_rotation(rotation)
    limits = constraints(design, r)
    solid = _agreeing(limits, frame_of([limits], design.reach, tolerance), exact_of(limits, volume))
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


def carved_solid(whole: Solid, surface: Surface | None, seed: FloatArray) -> Solid:
    """Return the connected part that holds a position of what a surface leaves of a workspace.

    Args:
        whole: What keeps the limits, as of `workspace_solid`.
        surface: What else bounds it, if anything; it keeps to its own grid.
        seed: The position, shape (3,).

    Raises:
        ExplorerError: a boolean fails.
    """
    from manifold3d import Manifold

    if whole.is_empty:
        return whole
    names = whole.limits
    body, frame, origins = _body_of(whole)
    if surface is not None:
        own = Manifold.reserve_ids(1)
        origins[own] = len(names)
        body = body - _below_zero(surface, frame, own)
    made = [_solid(part, origins, frame, names) for part in body.decompose()]
    parts = [replace(part, agrees=whole.agrees) for part in made]
    if not parts:
        return replace(_solid(body, origins, frame, names), agrees=whole.agrees)

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
    return manifold_of((frame.to(points), faces), (own,), (len(faces),))


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
    vertices, faces, _ = mesh_of(union(bodies))
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
    vertices, faces, _ = mesh_of(shapes.hull_points(points))
    origin = np.zeros(len(faces), dtype=np.int64)
    points = vertices * scale + middle
    return Solid(points, faces, origin, (HULL,), solid.tolerance, agrees=solid.agrees)


def cut_solid(solid: Solid, half_space: HalfSpace) -> Solid:
    """Return what of a mesh lies in a half-space; faces in its plane come from its name.

    Raises:
        ExplorerError: the boolean fails.
    """
    if solid.is_empty:
        return solid
    body, frame, origins = _body_of(solid)
    length = float(np.linalg.norm(half_space.normal))
    x, y, z = (-half_space.normal / length).tolist()
    offset = (half_space.offset - float(half_space.normal @ frame.middle)) / (length * frame.scale)
    names = (*solid.limits, half_space.name)
    part = _solid(body.trim_by_plane((x, y, z), -offset), origins, frame, names)
    of_face = np.where(part.limit_of_face < 0, len(solid.limits), part.limit_of_face)
    return replace(part, limit_of_face=of_face, agrees=solid.agrees)


def _body_of(solid: Solid) -> tuple[Manifold, Frame, dict[int, int]]:
    """Return a mesh as a body, its frame, and the limits by the ids of its faces."""
    from manifold3d import Manifold

    lows, highs = solid.vertices.min(axis=0), solid.vertices.max(axis=0)
    frame = frame_around(lows, highs, solid.tolerance)
    order = np.argsort(solid.limit_of_face, kind="stable")
    used, counts = np.unique(solid.limit_of_face, return_counts=True)
    first = Manifold.reserve_ids(len(used))
    shape = frame.to(solid.vertices), solid.faces[order].astype(np.int64)
    ids = tuple(range(first, first + len(used)))
    body = manifold_of(shape, ids, tuple(counts.tolist()))
    return body, frame, dict(zip(ids, used.tolist(), strict=True))


def _families(design: Design, rotations: ArrayLike) -> list[tuple[Constraint, ...]]:
    matrices = checked_rotation(rotations)
    if matrices.ndim != 3 or not len(matrices):
        raise InputError(f"rotations must have the shape (n, 3, 3); got {matrices.shape}")
    return [constraints(design, r) for r in matrices]


def _names(families: Sequence[Sequence[Constraint]]) -> tuple[str, ...]:
    return tuple(dict.fromkeys(limit.name for limits in families for limit in limits))


def _common(design: Design, limits: Sequence[Constraint], tolerance: float | None) -> Solid:
    """Return what keeps all limits."""
    return _mesh_within(limits, frame_of([limits], design.reach, tolerance))


def _mesh_within(limits: Sequence[Constraint], frame: Frame, *, contracted: bool = False) -> Solid:
    names = _names([limits])
    bodies, origins = _bodies([limits], frame, names, contracted=contracted)
    return _solid(bodies[0], origins, frame, names)


def _agreeing(limits: Sequence[Constraint], frame: Frame, exact: Exact) -> Solid:
    """Return what keeps all limits, as finely as the exact volume asks for."""
    best = _mesh_within(limits, frame)
    if exact.is_settled_by(best):
        return replace(best, agrees=True)
    # Facets are fine enough for the workspace if they are so for the smallest box around it.
    finer = frame.contracted(limits)
    if finer is None:
        return _nothing(limits, frame)
    exact = exact_within(limits, finer.back(finer.box.lows), finer.back(finer.box.highs))
    for _ in range(MOST_ROUNDS):
        pieces = pieces_of(limits, finer, contracted=True)
        if exact.is_settled_by(best) or sum(piece.faces for piece in pieces) > MOST_REFINED:
            break
        solid = _mesh_within(limits, finer, contracted=True)
        if best.is_empty or exact.excess(solid) < exact.excess(best):
            best = solid
        finer = finer.finer(FINER)
    if exact.is_artefact(best):
        return _nothing(limits, frame)
    return replace(best, agrees=exact.excess(best) <= 0.0)


def _nothing(limits: Sequence[Constraint], frame: Frame) -> Solid:
    """Return an empty solid that is known to be right."""
    faces, of_face = np.zeros((0, 3), dtype=np.int32), np.zeros(0, dtype=np.int64)
    names = _names([limits])
    return Solid(np.zeros((0, 3)), faces, of_face, names, frame.tolerance, agrees=True)


def _bodies(
    families: Sequence[Sequence[Constraint]],
    frame: Frame,
    names: tuple[str, ...],
    *,
    contracted: bool = False,
) -> tuple[list[Manifold], dict[int, int]]:
    """Return what keeps all limits of each family, and the limits by the ids of bodies."""
    everything = [pieces_of(limits, frame, contracted=contracted) for limits in families]
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
        made = manifold_of(shape, (own,), (len(shape[1]),))
        (cut if piece.cuts else kept).append(made)
    common = Manifold.batch_boolean(kept, OpType.Intersect)
    return Manifold.batch_boolean([common, *cut], OpType.Subtract)


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


def _solid(body: Manifold, origins: dict[int, int], frame: Frame, names: tuple[str, ...]) -> Solid:
    vertices, faces, ids = mesh_of(body)
    which, inverse = np.unique(ids, return_inverse=True)
    of_id = np.array([origins.get(int(each), -1) for each in which], dtype=np.int64)
    return Solid(frame.back(vertices), faces, of_id[inverse], names, frame.tolerance)
