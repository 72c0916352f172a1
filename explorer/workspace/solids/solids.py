"""Workspaces as watertight meshes: booleans of primitive solids by manifold3d.

Each face of a mesh has the limit that it comes from.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from explorer.errors import InputError
from explorer.mechanism.design import Design
from explorer.mechanism.pose import checked_rotation
from explorer.numerics.arrays import FloatArray, IntArray
from explorer.numerics.isosurface import surface_below_zero
from explorer.workspace.limits.constraints import (
    Constraint,
    HalfSpace,
    constraints,
    constraints_over,
)
from explorer.workspace.slices.volume import Volume, find_emptying_limits, home_rotation
from explorer.workspace.solids.agreement import ExactVolume, exact_volume, exact_volume_within
from explorer.workspace.solids.booleans import manifold_of, mesh_of, union
from explorer.workspace.solids.primitives import (
    MOST_FACES,
    Frame,
    Primitive,
    frame_around,
    frame_of,
    primitives_of,
)
from explorer.workspace.solids.solid import Solid

if TYPE_CHECKING:
    from manifold3d import Manifold

# Divisor of the tolerance in each round of refining a mesh that does not agree, the most rounds,
# and the most faces of all primitives together.
FINER = 4.0
MOST_ROUNDS = 10
MOST_REFINED = 60_000

# Cells beyond the bounding box of a body at which what a surface removes from it is closed.
AROUND = 2

# Digits of coordinates, in the frame of a mesh, to which the corners of a hull are told apart.
HULL_DIGITS = 12
HULL = "convex hull"
"""The name in `Solid.limits` for the faces of a convex hull."""


def workspace_solid(
    design: Design,
    rotation: ArrayLike | None = None,
    tolerance: float | None = None,
    *,
    volume: Volume | None = None,
    signs: tuple[int, int, int] | None = None,
) -> Solid:
    """Return the constant-orientation workspace as a mesh.

    Its volume is compared with the exact one. If they disagree, the mesh is refined beyond the
    tolerance; `Solid.agrees` is False if they still disagree at `MOST_REFINED` faces.

    Args:
        design: The manipulator.
        rotation: Platform to base, shape (3, 3); that of the home pose if None.
        tolerance: Largest distance of a face from the true surface, in design units; a 500th of
            the reach or of the workspace's extent, whichever is smaller, if None.
        volume: The exact volume, if it has been computed before.
        signs: Sign triple to demand instead of the home's, even if no margin is demanded.

    Raises:
        InputError: not a rotation, or a tolerance that is not positive or too small.
        ExplorerError: a boolean fails.
    """
    r = home_rotation(design) if rotation is None else checked_rotation(rotation)
    limits = constraints(design, r, signs)
    solid = _make_agreeing_solid(
        limits, frame_of([limits], design.reach, tolerance), exact_volume(limits, volume)
    )
    return replace(solid, empty_because=find_emptying_limits(limits)) if solid.is_empty else solid


@dataclass(frozen=True)
class Surface:
    """The zero level of a function that is known on a grid of positions.

    Attributes:
        values: Values at the nodes, shape (nx, ny, nz); the set below zero is removed.
        lows: Position of the first node, in design units, shape (3,).
        step: Distance of nodes on each axis, in design units, shape (3,).
        settle: Function of points on the interpolated surface and of the remaining end of the edge
            of each, both of shape (n, 3), that returns points on the true surface.
        names: Names in `Solid.limits` for faces of the surface.
        name_of: Function of points (n, 3) that returns the indices of their names, shape (n,);
            None if there is one name.
    """

    values: FloatArray
    lows: FloatArray
    step: FloatArray
    settle: Callable[[FloatArray, FloatArray], FloatArray]
    names: tuple[str, ...]
    name_of: Callable[[FloatArray], IntArray] | None = None


def carved_solid(
    whole: Solid, surfaces: Iterable[Surface], seed: FloatArray | None = None
) -> Solid:
    """Return a workspace less what surfaces remove.

    Args:
        whole: The workspace.
        surfaces: The surfaces.
        seed: Position in the part to return, shape (3,); None for all parts.

    Raises:
        ExplorerError: a boolean fails.
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
    parts = [
        replace(_solid_of(part, origins, frame, names), agrees=whole.agrees) for part in pieces
    ]

    def nearness(part: Solid) -> tuple[float, float]:
        if seed is None:
            return 0.0, 0.0
        # Rounding may put the seed on the surface or outside; the nearest vertex then decides.
        distance = float(np.linalg.norm(part.vertices - seed, axis=1).min())
        return round(part.winding(seed), 1), -distance

    solid = parts[0] if seed is None else max(parts, key=nearness)
    limit_of_face = solid.limit_of_face.copy()
    for index, surface in enumerate(carved, len(whole.limits)):
        faces = np.flatnonzero(solid.limit_of_face == index)
        centres = solid.vertices[solid.faces[faces]].mean(axis=1)
        own = surface.name_of(centres) if surface.name_of else np.zeros(len(faces), dtype=np.int64)
        limit_of_face[faces] = np.array([names.index(name) for name in surface.names])[own]
    return replace(solid, limit_of_face=limit_of_face)


def _below_zero(surface: Surface, frame: Frame, face_id: int, near: Manifold) -> Manifold:
    """Return the set below zero of a surface as a body in a frame, with one id for its faces.

    It is closed a little beyond the bounding box of the body that it is removed from.
    """
    from manifold3d import Manifold

    if near.is_empty():
        return Manifold()
    untyped: Any = near
    box = np.array(untyped.bounding_box(), dtype=np.float64)
    ends = frame.to_design(box.reshape(2, 3))
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
    points = surface.settle(lows + grid_points * surface.step, lows + beside * surface.step)
    return manifold_of((frame.to_frame(points), faces), (face_id,), (len(faces),))


def inclusive_solid(
    design: Design,
    rotations: ArrayLike,
    tolerance: float | None = None,
    tool: ArrayLike | None = None,
) -> Solid:
    """Return the inclusive workspace of n orientations, the union over them, as a mesh.

    Args:
        design: The manipulator.
        rotations: Platform to base, shape (n, 3, 3).
        tolerance: As in `workspace_solid`.
        tool: Point of the platform whose positions count, shape (3,), in design units; None for
            b4. The workspace of each orientation is moved by its own vector.

    Raises:
        InputError: not rotations, not a point, or no usable tolerance.
        ExplorerError: a boolean fails.
    """
    families = constraints_over(design, rotations, tool)
    frame = frame_of(families, design.reach, tolerance)
    names = _names(families)
    bodies, _ = _make_bodies(families, frame, names)
    vertices, faces, _ = mesh_of(union(bodies))
    points = frame.to_design(vertices)
    limits = [limit for family in families for limit in family]
    solid = Solid(
        points, faces, _nearest_limits(limits, points, faces, names), names, frame.tolerance
    )
    if not solid.is_empty:
        return solid
    because = dict.fromkeys(name for family in families for name in find_emptying_limits(family))
    return replace(solid, empty_because=tuple(because))


def total_solid(
    design: Design,
    rotations: ArrayLike,
    tolerance: float | None = None,
    tool: ArrayLike | None = None,
) -> Solid:
    """Return the total workspace of n orientations, the intersection over them, as a mesh.

    Arguments and errors are those of `inclusive_solid`.
    """
    limits = [limit for family in constraints_over(design, rotations, tool) for limit in family]

    def make_without(name: str) -> Solid:
        others = [limit for limit in limits if limit.name != name]
        return _make_solid(others, frame_of([others], design.reach, tolerance))

    solid = make_without("")
    if not solid.is_empty:
        return solid
    names = _names([limits])
    sufficient = tuple(name for name in names if not make_without(name).is_empty)
    return replace(solid, empty_because=sufficient or names)


def convex_hull(solid: Solid) -> Solid:
    """Return the convex hull of a mesh; the limit of all its faces is `HULL`.

    Raises:
        ExplorerError: the hull fails.
    """
    from manifold3d import Manifold

    if solid.is_empty:
        return solid
    frame = _frame_of(solid)
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


def cut_solid(solid: Solid, half_space: HalfSpace) -> Solid:
    """Return the part of a mesh in a half-space; the limit of faces in its plane is its name.

    Raises:
        ExplorerError: the boolean fails.
    """
    if solid.is_empty:
        return solid
    body, frame, origins = _body_of(solid)
    length = float(np.linalg.norm(half_space.normal))
    x, y, z = (-half_space.normal / length).tolist()
    offset = (half_space.offset - float(half_space.normal @ frame.middle)) / (length * frame.scale)
    names = tuple(dict.fromkeys((*solid.limits, half_space.name)))
    part = _solid_of(body.trim_by_plane((x, y, z), -offset), origins, frame, names)
    of_cut = names.index(half_space.name)
    limit_of_face = np.where(part.limit_of_face < 0, of_cut, part.limit_of_face)
    return replace(part, limit_of_face=limit_of_face, agrees=solid.agrees)


def _frame_of(solid: Solid) -> Frame:
    lows, highs = solid.vertices.min(axis=0), solid.vertices.max(axis=0)
    return frame_around(lows, highs, solid.tolerance)


def _body_of(solid: Solid) -> tuple[Manifold, Frame, dict[int, int]]:
    """Return a mesh as a body, its frame, and the indices of limits by the ids of faces."""
    from manifold3d import Manifold

    frame = _frame_of(solid)
    order = np.argsort(solid.limit_of_face, kind="stable")
    used, counts = np.unique(solid.limit_of_face, return_counts=True)
    first = Manifold.reserve_ids(len(used))
    shape = frame.to_frame(solid.vertices), solid.faces[order].astype(np.int64)
    ids = tuple(range(first, first + len(used)))
    body = manifold_of(shape, ids, tuple(counts.tolist()))
    return body, frame, dict(zip(ids, used.tolist(), strict=True))


def _names(families: Sequence[Sequence[Constraint]]) -> tuple[str, ...]:
    return tuple(dict.fromkeys(limit.name for limits in families for limit in limits))


def _make_solid(limits: Sequence[Constraint], frame: Frame, *, contracted: bool = False) -> Solid:
    """Return the positions that satisfy all limits as a mesh."""
    names = _names([limits])
    bodies, origins = _make_bodies([limits], frame, names, contracted=contracted)
    return _solid_of(bodies[0], origins, frame, names)


def _make_agreeing_solid(limits: Sequence[Constraint], frame: Frame, exact: ExactVolume) -> Solid:
    """Return a workspace as a mesh that agrees with the exact volume, if that is possible."""
    best = _make_solid(limits, frame)
    if exact.is_settled_by(best):
        return replace(best, agrees=True)
    # The tolerance has to suit the smallest box around the workspace.
    finer = frame.contract(limits)
    if finer is None:
        return _empty_solid(limits, frame)
    exact = exact_volume_within(limits, *finer.ends)
    for _ in range(MOST_ROUNDS):
        faces = sum(primitive.faces for primitive in primitives_of(limits, finer, contracted=True))
        if exact.is_settled_by(best) or faces > MOST_REFINED:
            break
        solid = _make_solid(limits, finer, contracted=True)
        if best.is_empty or exact.excess(solid) < exact.excess(best):
            best = solid
        finer = finer.finer(FINER)
    if exact.is_artefact(best):
        return _empty_solid(limits, frame)
    return replace(best, agrees=exact.excess(best) <= 0.0)


def _empty_solid(limits: Sequence[Constraint], frame: Frame) -> Solid:
    """Return an empty solid that agrees with the exact volume."""
    faces, limit_of_face = np.zeros((0, 3), dtype=np.int32), np.zeros(0, dtype=np.int64)
    names = _names([limits])
    return Solid(np.zeros((0, 3)), faces, limit_of_face, names, frame.tolerance, agrees=True)


def _make_bodies(
    families: Sequence[Sequence[Constraint]],
    frame: Frame,
    names: tuple[str, ...],
    *,
    contracted: bool = False,
) -> tuple[list[Manifold], dict[int, int]]:
    """Return each family's workspace as a body, and the indices of names by the ids of faces."""
    primitives_of_families = [
        primitives_of(limits, frame, contracted=contracted) for limits in families
    ]
    faces = sum(
        primitive.faces for primitives in primitives_of_families for primitive in primitives
    )
    if faces > MOST_FACES:
        # The number of faces of a ball is inverse to the tolerance; other solids have fewer.
        least = frame.tolerance * faces / MOST_FACES
        fewer = ", or there must be fewer orientations" if len(families) > 1 else ""
        raise InputError(
            f"a tolerance of {frame.tolerance:g} takes about {faces:.2g} triangles; at most "
            f"{MOST_FACES:,} are made, so it must be at least about {least:.2g}{fewer}"
        )
    origins: dict[int, int] = {}
    return [
        _make_body(primitives, origins, names) for primitives in primitives_of_families
    ], origins


def _make_body(
    primitives: Sequence[Primitive], origins: dict[int, int], names: tuple[str, ...]
) -> Manifold:
    from manifold3d import Manifold, OpType

    if not primitives:
        return Manifold()
    common: list[Manifold] = []
    cut: list[Manifold] = []
    for primitive in primitives:
        face_id = Manifold.reserve_ids(1)
        if primitive.name:
            origins[face_id] = names.index(primitive.name)
        shape = primitive.tessellate()
        body = manifold_of(shape, (face_id,), (len(shape[1]),))
        (cut if primitive.is_cut else common).append(body)
    whole = Manifold.batch_boolean(common, OpType.Intersect)
    return Manifold.batch_boolean([whole, *cut], OpType.Subtract)


def _nearest_limits(
    limits: Sequence[Constraint],
    vertices: FloatArray,
    faces: NDArray[np.int32],
    names: tuple[str, ...],
) -> IntArray:
    """Return the indices of the names of the limits on whose surfaces faces lie, shape (m,)."""
    nearest = np.zeros(len(faces), dtype=np.int64)
    least = np.full(len(faces), np.inf)
    for limit in limits:
        off = limit.distance(vertices)[faces].max(axis=1)
        nearest[off < least] = names.index(limit.name)
        least = np.minimum(off, least)
    return nearest


def _solid_of(
    body: Manifold, origins: dict[int, int], frame: Frame, names: tuple[str, ...]
) -> Solid:
    vertices, faces, ids = mesh_of(body)
    distinct, inverse = np.unique(ids, return_inverse=True)
    limit_of_id = np.array([origins.get(int(face_id), -1) for face_id in distinct], dtype=np.int64)
    return Solid(frame.to_design(vertices), faces, limit_of_id[inverse], names, frame.tolerance)
