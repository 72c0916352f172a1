"""Workspaces as watertight meshes: booleans of primitive solids by manifold3d.

Each face of a mesh has the limit that it comes from. The volume of a mesh is compared with the
exact volume of its workspace. If all faces are within the tolerance of the true surface, the volume
is wrong by at most the tolerance times their area. For a workspace about as thin as the tolerance
that bound is useless, so the difference must not exceed a share of the exact volume either.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from explorer.errors import InputError
from explorer.mechanism.configuration import tool_offset
from explorer.mechanism.design import Design
from explorer.mechanism.pose import rotation_array
from explorer.numerics.computed_once import computed_once
from explorer.workspace.limits.constraints import (
    BallOrCylinder,
    Cone,
    Constraint,
    HalfSpace,
    shift,
)
from explorer.workspace.limits.region import contract_box, region_of
from explorer.workspace.slices.volume import find_emptying_limits, region_volume, volume_of
from explorer.workspace.solids import facets
from explorer.workspace.solids.facets import Box, TessellationFrame, frame_around
from explorer.workspace.solids.solid import Solid, manifold_of, mesh_of, solid_of, union
from explorer.workspace.workspace import Workspace

if TYPE_CHECKING:
    from manifold3d import Manifold

# The default tolerance of chords, as a share of the size of the workspace.
DEFAULT_TOLERANCE = 1.0 / 500.0
# The largest tolerance as such a share, since coarser facets would miss the workspace.
COARSEST = 1.0 / 4.0
# The most faces of all primitives together.
MOST_FACES = 2_000_000
# A cone within this share of the tolerance of a plane is tessellated as the plane.
FLAT = 1e-3
# Divisor of the tolerance in each round of refining a mesh that does not agree, the most rounds,
# and the most faces of all primitives together.
FINER, MOST_ROUNDS, MOST_REFINED = 4.0, 10, 60_000
# The largest difference of a mesh from the exact volume, as a share of it.
LARGEST_SHARE = 0.01


def workspace_solid(
    design: Design, rotation: ArrayLike | None = None, tolerance: float | None = None
) -> Solid:
    """Return the constant-orientation workspace as a mesh.

    Its volume is compared with the exact one. If they disagree, the mesh is refined beyond the
    tolerance; `Solid.agrees` is False if they still disagree at `MOST_REFINED` faces.

    Args:
        design: The manipulator.
        rotation: Platform to base, shape (3, 3); that of the home pose if None.
        tolerance: Largest distance of a face from the true surface, in design units; a 500th of
            the reach or of the workspace's extent, whichever is smaller, if None.

    Raises:
        InputError: Not a rotation, or a tolerance that is not positive or too small.
        ExplorerError: A boolean fails.
    """
    return whole_solid(Workspace(design, rotation), tolerance)


@computed_once
def whole_solid(workspace: Workspace, tolerance: float | None = None) -> Solid:
    """Return all of a workspace as a mesh, as `workspace_solid` does."""
    exact, limits = volume_of(workspace), workspace.limits
    frame = _frame_of([limits], workspace.design.reach, tolerance)
    solid = _make_agreeing_solid(limits, frame, (exact.volume, 2.0 * exact.error))
    if not solid.is_empty:
        return solid
    return replace(solid, empty_because=exact.empty_because or find_emptying_limits(limits))


def _limits_over(
    design: Design, rotations: ArrayLike, tool: ArrayLike | None
) -> list[tuple[Constraint, ...]]:
    """Return the limits at n orientations (n, 3, 3) as solids of positions of a tool point (3,).

    Raises:
        InputError: Not rotations, or not a point.
    """
    matrices = rotation_array(rotations)
    if matrices.ndim != 3 or not len(matrices):
        raise InputError(f"rotations must have the shape (n, 3, 3); got {matrices.shape}")
    return [
        tuple(shift(limit, offset) for limit in Workspace(design, r).limits)
        for r, offset in zip(matrices, tool_offset(matrices, tool), strict=True)
    ]


def inclusive_solid(
    design: Design,
    rotations: ArrayLike,
    tolerance: float | None = None,
    tool: ArrayLike | None = None,
) -> Solid:
    """Return the inclusive workspace of n orientations (n, 3, 3), the union over them, as a mesh.

    The positions are those of a point of the platform, shape (3,), in design units, or of b4 if
    None; the workspace of each orientation is moved by its own vector. For the tolerance see
    `workspace_solid`.

    Raises:
        InputError: Not rotations, not a point, or no usable tolerance.
        ExplorerError: A boolean fails.
    """
    families = _limits_over(design, rotations, tool)
    frame = _frame_of(families, design.reach, tolerance)
    names = _names(families)
    bodies, _ = _make_bodies(families, frame, names)
    vertices, faces, _ = mesh_of(union(bodies))
    points = frame.to_design(vertices)
    # The simplified union has lost the limits of its faces: each gets that of the nearest surface.
    nearest, least = np.zeros(len(faces), dtype=np.int64), np.full(len(faces), np.inf)
    for limit in (limit for family in families for limit in family):
        off = limit.distance(points)[faces].max(axis=1)
        nearest[off < least] = names.index(limit.name)
        least = np.minimum(off, least)
    solid = Solid(points, faces, nearest, names, frame.tolerance)
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
    limits = [limit for family in _limits_over(design, rotations, tool) for limit in family]

    def make_without(name: str) -> Solid:
        others = [limit for limit in limits if limit.name != name]
        return _make_solid(others, _frame_of([others], design.reach, tolerance))

    solid = make_without("")
    if not solid.is_empty:
        return solid
    names = _names([limits])
    sufficient = tuple(name for name in names if not make_without(name).is_empty)
    return replace(solid, empty_because=sufficient or names)


def _names(families: Sequence[Sequence[Constraint]]) -> tuple[str, ...]:
    return tuple(dict.fromkeys(limit.name for limits in families for limit in limits))


def _make_solid(limits: Sequence[Constraint], frame: TessellationFrame) -> Solid:
    """Return the positions that satisfy all limits as a mesh."""
    names = _names([limits])
    bodies, origins = _make_bodies([limits], frame, names)
    return solid_of(bodies[0], origins, frame, names)


def _make_agreeing_solid(
    limits: Sequence[Constraint], frame: TessellationFrame, exact: tuple[float, float]
) -> Solid:
    """Return a workspace as a mesh that agrees with the exact volume, if that is possible."""
    best = _make_solid(limits, frame)
    if _excess(best, *exact) <= 0.0:
        return replace(best, agrees=True)
    # The tolerance has to suit the smallest box around the workspace.
    ends = contract_box(limits, *frame.ends)
    if ends is not None:
        scale = float((ends[1] - ends[0]).max())
        finer = frame_around(*ends, min(frame.tolerance, DEFAULT_TOLERANCE * scale))
        # Within the box columns are closer and rounding is smaller.
        sides = zip([*-np.eye(3), *np.eye(3)], [*-ends[0], *ends[1]], strict=True)
        walls = (HalfSpace("", side, float(end)) for side, end in sides)
        volume, error, _ = region_volume(region_of([*limits, *walls]))
        exact = volume, 2.0 * error
        for _ in range(MOST_ROUNDS):
            faces = sum(primitive.faces for primitive in _primitives_of(limits, finer))
            if _excess(best, *exact) <= 0.0 or faces > MOST_REFINED:
                break
            solid = _make_solid(limits, finer)
            if best.is_empty or _excess(solid, *exact) < _excess(best, *exact):
                best = solid
            finer = replace(finer, tolerance=finer.tolerance / FINER)
    agrees = _excess(best, *exact) <= 0.0
    is_artefact = exact[0] <= 0.0 and abs(best.volume) <= best.tolerance * float(best.areas.sum())
    if ends is not None and (agrees or not is_artefact):
        return replace(best, agrees=agrees)
    empty = replace(best, vertices=best.vertices[:0], faces=best.faces[:0], agrees=True)
    return replace(empty, limit_of_face=best.limit_of_face[:0], tolerance=frame.tolerance)


def _make_bodies(
    families: Sequence[Sequence[Constraint]], frame: TessellationFrame, names: tuple[str, ...]
) -> tuple[list[Manifold], dict[int, int]]:
    """Return each family's workspace as a body, and the indices of names by the ids of faces."""
    from manifold3d import Manifold, OpType

    primitives_of_families = [_primitives_of(limits, frame) for limits in families]
    faces = sum(primitive.faces for family in primitives_of_families for primitive in family)
    if faces > MOST_FACES:
        # The number of faces of a ball is inverse to the tolerance; other solids have fewer.
        least = frame.tolerance * faces / MOST_FACES
        fewer = ", or there must be fewer orientations" if len(families) > 1 else ""
        raise InputError(
            f"a tolerance of {frame.tolerance:g} takes about {faces:.2g} triangles; at most "
            f"{MOST_FACES:,} are made, so it must be at least about {least:.2g}{fewer}"
        )
    origins: dict[int, int] = {}
    bodies: list[Manifold] = []
    for primitives in primitives_of_families:
        common, cut = list[Manifold](), list[Manifold]()
        for primitive in primitives:
            face_id = Manifold.reserve_ids(1)
            if primitive.name:
                origins[face_id] = names.index(primitive.name)
            shape = primitive.tessellate()
            body = manifold_of(shape, (face_id,), (len(shape[1]),))
            (cut if primitive.is_cut else common).append(body)
        whole = Manifold.batch_boolean(common or [Manifold()], OpType.Intersect)
        bodies.append(Manifold.batch_boolean([whole, *cut], OpType.Subtract))
    return bodies, origins


@dataclass(frozen=True)
class Primitive:
    """A primitive solid, before its tessellation, in the frame of a workspace.

    Attributes:
        name: Name of the limit, "" for the block around the workspace.
        is_cut: Whether positions outside satisfy the limit, rather than those inside.
        faces: Approximate number of faces.
        tessellate: Function that returns the vertices and faces.
    """

    name: str
    is_cut: bool
    faces: int
    tessellate: Callable[[], facets.Facets]


def _frame_of(
    families: Sequence[Sequence[Constraint]], reach: float, tolerance: float | None
) -> TessellationFrame:
    """Return the frame for workspaces, given by the limits of each.

    The tolerance in design units is at most a quarter of the largest extent; if None, it is a 500th
    of the reach or of the largest extent, whichever is smaller.

    Raises:
        InputError: The tolerance is not positive.
    """
    if tolerance is not None and not (math.isfinite(tolerance) and tolerance > 0.0):
        raise InputError(f"the tolerance must be positive; got {tolerance:g}")
    boxes = [box for limits in families if (box := region_of(limits).box) is not None]
    # If all workspaces are empty, any frame will do.
    lows = np.min([low for low, _ in boxes], axis=0) if boxes else np.zeros(3)
    highs = np.max([high for _, high in boxes], axis=0) if boxes else np.full(3, reach)
    scale = float((highs - lows).max())
    chord = min(tolerance or DEFAULT_TOLERANCE * min(reach, scale), COARSEST * scale)
    return frame_around(lows, highs, chord)


def _primitives_of(limits: Sequence[Constraint], frame: TessellationFrame) -> list[Primitive]:
    """Return the primitives of a workspace: their intersection, less those that are cut.

    The list is empty if the boxes around the primitives already show that the workspace is.
    """
    region = region_of(limits)
    if region.box is None:
        return []
    # The box of a contracted frame is smaller than that of the region.
    lows, highs = map(frame.to_frame, region.box)
    box = Box(np.maximum(lows, frame.box.lows), np.minimum(highs, frame.box.highs))
    # The box ends on surfaces of limits, to rounding. The block extends beyond them, so that
    # rounding does not decide whether all of the block satisfies a limit.
    block = box.surroundings()
    ends = (region.low_limit, region.high_limit)
    planes = (*filter(None, ends), *region.plane_limits)
    primitives = [Primitive("", False, 12, block.mesh)]
    for primitive in (
        *(_half_space(plane, box, block, frame) for plane in planes),
        *_balls_and_cylinders(region.circle_limits, box, block, frame),
        *(_cone(limit, frame) for limit in limits if isinstance(limit, Cone)),
    ):
        if primitive is False:
            return []
        if primitive is not True:
            primitives.append(primitive)
    return primitives


def _half_space(
    plane: HalfSpace, box: Box, block: Box, frame: TessellationFrame
) -> Primitive | bool:
    """Return the primitive; True if the whole block satisfies it, False if the box violates it."""
    length = float(np.linalg.norm(plane.normal))
    normal = plane.normal / length
    offset = (plane.offset / length - float(normal @ frame.middle)) / frame.scale
    if float((block.corners @ normal).max()) < offset:
        return True
    if float((box.corners @ normal).min()) >= offset:
        return False
    return Primitive(plane.name, False, 12, partial(facets.half_space, normal, offset, frame.box))


def _balls_and_cylinders(
    limits: Sequence[BallOrCylinder], box: Box, block: Box, frame: TessellationFrame
) -> Iterator[Primitive | bool]:
    """Yield each primitive; True if the whole block satisfies it, False if the box violates it."""
    concentric: dict[tuple[bool, bytes], list[BallOrCylinder]] = {}
    for limit in limits:
        concentric.setdefault((limit.is_ball, limit.centre.tobytes()), []).append(limit)
    for group in concentric.values():
        # Concentric surfaces share a pattern of facets, so that thin shells have no holes.
        start = 0 if group[0].is_ball else 1
        centre = frame.to_frame(group[0].centre)[start:]
        (near, far), beyond = box.distances(centre), block.distances(centre)[1]
        bounding: list[tuple[BallOrCylinder, float]] = []
        for limit in group:
            radius = limit.radius / frame.scale
            if radius <= near or radius > (beyond if limit.inside else far):
                yield (radius <= near) != limit.inside
            else:
                bounding.append((limit, radius))
        if not bounding:
            continue
        radii = [radius for _, radius in bounding]
        parts = [facets.facing_part(centre, radius, frame.box, frame.chord) for radius in radii]
        towards, angle = parts[0][0], max(part[1] for part in parts)
        step = facets.step_of(max(radii), frame.chord)
        for limit, radius in bounding:
            if limit.is_ball:
                faces = facets.ball_faces(angle, step)
                tessellate = partial(facets.ball, centre, radius, towards, angle, step)
            else:
                faces, args = math.ceil(8.0 * angle / step), (centre, radius, towards, angle, step)
                tessellate = partial(facets.cylinder, *args, frame.box)
            yield Primitive(limit.name, not limit.inside, faces, tessellate)


def _cone(limit: Cone, frame: TessellationFrame) -> Primitive | bool:
    """Return the primitive; True if all positions satisfy the limit, False if none does."""
    apex, axis, angle = frame.to_frame(limit.apex), limit.axis, limit.half_angle
    if limit.flat:
        # The leg is perpendicular to x, so only a section of its cone counts: a wedge.
        across = math.hypot(axis[1], axis[2])
        cosine = math.cos(angle)
        if abs(cosine) >= across:
            return cosine <= 0.0
        axis, angle = np.array([0.0, axis[1], axis[2]]) / across, math.acos(cosine / across)
        # The edge of the wedge is a line along x, represented by its nearest point.
        apex = np.array([frame.box.middle[0], apex[1], apex[2]])
    if angle >= math.pi:
        return True
    farthest = frame.box.distances(apex)[1]
    if abs(math.cos(angle)) * farthest <= FLAT * frame.chord:
        plane = partial(facets.half_space, -axis, -float(axis @ apex), frame.box)
        return Primitive(limit.name, False, 12, plane)
    is_cut = angle > 0.5 * math.pi
    if is_cut:
        axis, angle = -axis, math.pi - angle
    step = facets.step_of(farthest, frame.chord)
    faces, tessellate = 16, partial(facets.wedge, apex[1:], axis[1:], angle, frame.box)
    if not limit.flat:
        faces = math.ceil(12.0 * math.pi / step)
        tessellate = partial(facets.cone, apex, axis, angle, step, frame.box)
    return Primitive(limit.name, is_cut, faces, tessellate)


def _excess(solid: Solid, volume: float, error: float) -> float:
    """Return the volume by which a mesh differs from an exact one by more than is allowed.

    The mesh agrees if it is not positive. It is infinite if some face comes from no limit, since
    its facet protrudes, and for a mesh that is empty although the exact volume is not zero.
    """
    if (solid.limit_of_face < 0).any() or (solid.is_empty and volume > 0.0):
        return math.inf
    allowed = min(solid.tolerance * float(solid.areas.sum()), LARGEST_SHARE * volume)
    return abs(solid.volume - volume) - allowed - error
