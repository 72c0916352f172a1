"""Workspaces as watertight meshes: booleans of primitive solids by manifold3d.

Each face of a mesh has the limit that it comes from. The volume of a mesh is compared with the
exact volume of its workspace. If all faces are within the tolerance of the true surface, the volume
is wrong by at most the tolerance times their area. For a workspace about as thin as the tolerance
that bound is useless, so the difference must not exceed a share of the exact volume either.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from explorer.errors import InputError
from explorer.mechanism.design import Design
from explorer.workspace.limits.constraints import (
    Constraint,
    HalfSpace,
    constraints,
    constraints_over,
    orientation_of,
)
from explorer.workspace.limits.region import region_of
from explorer.workspace.slices.volume import Volume, find_emptying_limits, volume_of
from explorer.workspace.solids.primitives import MOST_FACES, Frame, frame_of, primitives_of
from explorer.workspace.solids.solid import Solid, manifold_of, mesh_of, solid_of, union

if TYPE_CHECKING:
    from manifold3d import Manifold

# Divisor of the tolerance in each round of refining a mesh that does not agree, the most rounds,
# and the most faces of all primitives together.
FINER, MOST_ROUNDS, MOST_REFINED = 4.0, 10, 60_000
# The largest difference of a mesh from the exact volume, as a share of it.
LARGEST_SHARE = 0.01
# Columns per axis for the exact volume within cones, which then takes as long as the mesh, and for
# that within a small box.
COLUMNS, WITHIN_BOX = 120, 400


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
        InputError: Not a rotation, or a tolerance that is not positive or too small.
        ExplorerError: A boolean fails.
    """
    r = orientation_of(design, rotation)
    limits = constraints(design, r, signs)
    if volume is None:
        exact = exact_volume(limits, COLUMNS)
    else:
        exact = ExactVolume(volume.volume, 2.0 * volume.error)
    solid = _make_agreeing_solid(limits, frame_of([limits], design.reach, tolerance), exact)
    return replace(solid, empty_because=find_emptying_limits(limits)) if solid.is_empty else solid


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
    families = constraints_over(design, rotations, tool)
    frame = frame_of(families, design.reach, tolerance)
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


def _names(families: Sequence[Sequence[Constraint]]) -> tuple[str, ...]:
    return tuple(dict.fromkeys(limit.name for limits in families for limit in limits))


def _make_solid(limits: Sequence[Constraint], frame: Frame) -> Solid:
    """Return the positions that satisfy all limits as a mesh."""
    names = _names([limits])
    bodies, origins = _make_bodies([limits], frame, names)
    return solid_of(bodies[0], origins, frame, names)


def _make_agreeing_solid(limits: Sequence[Constraint], frame: Frame, exact: ExactVolume) -> Solid:
    """Return a workspace as a mesh that agrees with the exact volume, if that is possible."""
    best = _make_solid(limits, frame)
    if exact.is_met_by(best):
        return replace(best, agrees=True)
    # The tolerance has to suit the smallest box around the workspace.
    finer = frame.contract(limits)
    if finer is not None:
        # Within the box columns are closer and rounding is smaller.
        sides, (lows, highs) = np.concatenate([-np.eye(3), np.eye(3)]), finer.ends
        ends = [*(-lows).tolist(), *highs.tolist()]
        walls = (HalfSpace("", side, end) for side, end in zip(sides, ends, strict=True))
        exact = exact_volume([*limits, *walls], WITHIN_BOX)
        for _ in range(MOST_ROUNDS):
            faces = sum(primitive.faces for primitive in primitives_of(limits, finer))
            if exact.is_met_by(best) or faces > MOST_REFINED:
                break
            solid = _make_solid(limits, finer)
            if best.is_empty or exact.excess(solid) < exact.excess(best):
                best = solid
            finer = replace(finer, tolerance=finer.tolerance / FINER)
    if finer is None or exact.is_artefact(best):
        empty = replace(best, vertices=best.vertices[:0], faces=best.faces[:0], agrees=True)
        return replace(empty, limit_of_face=best.limit_of_face[:0], tolerance=frame.tolerance)
    return replace(best, agrees=exact.excess(best) <= 0.0)


def _make_bodies(
    families: Sequence[Sequence[Constraint]], frame: Frame, names: tuple[str, ...]
) -> tuple[list[Manifold], dict[int, int]]:
    """Return each family's workspace as a body, and the indices of names by the ids of faces."""
    from manifold3d import Manifold, OpType

    primitives_of_families = [primitives_of(limits, frame) for limits in families]
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
class ExactVolume:
    """The exact volume that a mesh is compared with and a bound of its error, in cubed units."""

    volume: float
    error: float

    def excess(self, solid: Solid) -> float:
        """Return the volume by which the difference of a mesh exceeds the allowed one.

        The mesh agrees if the excess is not positive. It is infinite if some face comes from no
        limit, since its facet protrudes.
        """
        if (solid.limit_of_face < 0).any():
            return math.inf
        allowed = min(solid.tolerance * solid.area, LARGEST_SHARE * self.volume)
        return abs(solid.volume - self.volume) - allowed - self.error

    def is_met_by(self, solid: Solid) -> bool:
        """Return whether a mesh agrees, and is not empty although the exact volume is not zero."""
        return self.excess(solid) <= 0.0 and not (solid.is_empty and self.volume > 0.0)

    def is_artefact(self, solid: Solid) -> bool:
        """Return whether the exact volume is zero and that of the mesh is due to its tolerance."""
        disagrees = self.volume <= 0.0 and self.excess(solid) > 0.0
        return disagrees and abs(solid.volume) <= solid.tolerance * solid.area


def exact_volume(limits: Sequence[Constraint], columns: int) -> ExactVolume:
    """Return the exact volume of a workspace; within cones that of some columns per axis."""
    volume, error, _ = volume_of(region_of(limits), columns)
    return ExactVolume(volume, 2.0 * error)
