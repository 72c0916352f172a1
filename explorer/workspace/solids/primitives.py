"""Primitives: the parts of the limits' solids near the workspace, to be tessellated.

All lengths are in a frame in which the workspace has size one, so that designs of any size are
tessellated alike. The primitives cut a block around the workspace; limits that hold everywhere in
the block have no primitive.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np

from explorer.errors import InputError
from explorer.numerics.arrays import FloatArray
from explorer.workspace.limits.constraints import BallOrCylinder, Cone, Constraint, HalfSpace
from explorer.workspace.limits.region import box_of, contract_box, region_of
from explorer.workspace.solids import facets
from explorer.workspace.solids.facets import Box

# The default tolerance of chords, as a share of the size of the workspace.
DEFAULT_TOLERANCE = 1.0 / 500.0
# The largest tolerance as such a share, since coarser facets would miss the workspace.
COARSEST = 1.0 / 4.0
# The most faces of all primitives together.
MOST_FACES = 2_000_000
# A cone within this share of the tolerance of a plane is tessellated as the plane.
FLAT = 1e-3


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


@dataclass(frozen=True)
class Frame:
    """The frame in which workspaces are tessellated, and the tolerance.

    Attributes:
        middle: Middle of the workspaces in design units, shape (3,).
        scale: Largest extent of the workspaces in design units; the unit of this frame.
        tolerance: Largest distance of a face from the true surface, in design units.
        box: Box that holds the workspaces, in this frame.
    """

    middle: FloatArray
    scale: float
    tolerance: float
    box: Box

    @property
    def chord(self) -> float:
        """The tolerance in this frame."""
        return self.tolerance / self.scale

    def contract(self, limits: Sequence[Constraint]) -> Frame | None:
        """Return a frame of a smaller box that still holds a workspace, at most as coarse.

        Its tolerance is the default of the smaller box if that is finer. None if no position
        satisfies the limits of the workspace.
        """
        ends = contract_box(limits, *self.ends)
        if ends is None:
            return None
        scale = float((ends[1] - ends[0]).max())
        return frame_around(*ends, min(self.tolerance, DEFAULT_TOLERANCE * scale))

    @property
    def ends(self) -> tuple[FloatArray, FloatArray]:
        """(lows, highs) of the box in design units, each (3,)."""
        return self.to_design(self.box.lows), self.to_design(self.box.highs)

    def to_frame(self, points: FloatArray) -> FloatArray:
        """Return points (..., 3) in design units as points of this frame."""
        return (points - self.middle) / self.scale

    def to_design(self, points: FloatArray) -> FloatArray:
        """Return points (..., 3) of this frame in design units."""
        return points * self.scale + self.middle


def frame_of(
    families: Sequence[Sequence[Constraint]], reach: float, tolerance: float | None
) -> Frame:
    """Return the frame for workspaces, given by the limits of each.

    The tolerance in design units is at most a quarter of the largest extent; if None, it is a 500th
    of the reach or of the largest extent, whichever is smaller.

    Raises:
        InputError: The tolerance is not positive.
    """
    if tolerance is not None and not (math.isfinite(tolerance) and tolerance > 0.0):
        raise InputError(f"the tolerance must be positive; got {tolerance:g}")
    boxes = [box for box in map(box_of, families) if box is not None]
    # If all workspaces are empty, any frame will do.
    lows = np.min([low for low, _ in boxes], axis=0) if boxes else np.zeros(3)
    highs = np.max([high for _, high in boxes], axis=0) if boxes else np.full(3, reach)
    scale = float((highs - lows).max())
    chord = min(tolerance or DEFAULT_TOLERANCE * min(reach, scale), COARSEST * scale)
    return frame_around(lows, highs, chord)


def frame_around(lows: FloatArray, highs: FloatArray, tolerance: float) -> Frame:
    """Return the frame around a box; all arguments are in design units."""
    middle, scale = 0.5 * (lows + highs), float((highs - lows).max())
    return Frame(middle, scale, tolerance, Box((lows - middle) / scale, (highs - middle) / scale))


def primitives_of(limits: Sequence[Constraint], frame: Frame) -> list[Primitive]:
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


def _half_space(plane: HalfSpace, box: Box, block: Box, frame: Frame) -> Primitive | bool:
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
    limits: Sequence[BallOrCylinder], box: Box, block: Box, frame: Frame
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


def _cone(limit: Cone, frame: Frame) -> Primitive | bool:
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
