"""From limits to closed meshes: what of each limit's primitive solid meets the workspace.

Everything is done in a frame in which the workspace has size one, so that designs of any
size are tessellated alike. The limits cut a block, and those that hold all over it are left out.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from explorer.errors import InputError
from explorer.numerics.arrays import FloatArray
from explorer.workspace.limits.constraints import Cone, Constraint, HalfSpace, Round
from explorer.workspace.limits.contraction import contracted
from explorer.workspace.limits.region import region_of
from explorer.workspace.slices.volume import bounds
from explorer.workspace.solids.facets import (
    Box,
    Facets,
    ball,
    ball_faces,
    cone,
    cylinder,
    facing,
    half_space,
    step_of,
    wedge,
)

# Chords may be off by this share of the size of the workspace unless told otherwise.
DEFAULT_TOLERANCE = 1.0 / 500.0
# They are never off by more than this share of it: coarser, facets would miss it.
COARSEST = 1.0 / 4.0
# The most faces that primitives may have together.
MOST_FACES = 2_000_000
# A cone that is off a plane by less than this share of the tolerance is that plane.
FLAT = 1e-3


@dataclass(frozen=True)
class Piece:
    """A primitive solid that is yet to be tessellated, in the frame of a workspace.

    Attributes:
        name: Its limit, "" for the surroundings.
        cuts: Whether the limit keeps p outside, or else inside.
        faces: About how many it will have.
        make: Makes them.
    """

    name: str
    cuts: bool
    faces: int
    make: Callable[[], Facets]


@dataclass(frozen=True)
class Frame:
    """Where workspaces are tessellated, and how finely.

    Attributes:
        middle: Of the workspaces, in design units, shape (3,).
        scale: Their largest extent, in design units.
        tolerance: Largest distance of a face from the true surface, in design units.
        box: Holds them, in this frame.
    """

    middle: FloatArray
    scale: float
    tolerance: float
    box: Box

    @property
    def chord(self) -> float:
        """The tolerance in this frame."""
        return self.tolerance / self.scale

    def finer(self, ratio: float) -> Frame:
        """Return the same frame with a tolerance that is smaller by a ratio."""
        return replace(self, tolerance=self.tolerance / ratio)

    def contracted(self, limits: Sequence[Constraint]) -> Frame | None:
        """Return a frame around less that still holds what keeps all limits, as fine as if new.

        None if nothing keeps them.
        """
        ends = contracted(limits, self.back(self.box.lows), self.back(self.box.highs))
        if ends is None:
            return None
        scale = float((ends[1] - ends[0]).max())
        return frame_around(*ends, min(self.tolerance, DEFAULT_TOLERANCE * scale))

    def to(self, points: FloatArray) -> FloatArray:
        """Return points (..., 3) in this frame."""
        return (points - self.middle) / self.scale

    def back(self, points: FloatArray) -> FloatArray:
        """Return points (..., 3) of this frame in design units."""
        return points * self.scale + self.middle


def frame_of(
    families: Sequence[Sequence[Constraint]], reach: float, tolerance: float | None
) -> Frame:
    """Return the frame for the workspaces of families of limits.

    Args:
        families: Each with the limits of one workspace.
        reach: Of the design, in design units.
        tolerance: In design units; a 500th of the reach, or of the largest extent if that
            is smaller, if None; a quarter of the largest extent at the most.

    Raises:
        InputError: the tolerance is not positive.
    """
    if tolerance is not None and not (math.isfinite(tolerance) and tolerance > 0.0):
        raise InputError(f"the tolerance must be positive; got {tolerance:g}")
    boxes = [box for box in map(_box_of, families) if box is not None]
    # Where all are empty any frame will do.
    lows = np.min([low for low, _ in boxes], axis=0) if boxes else np.zeros(3)
    highs = np.max([high for _, high in boxes], axis=0) if boxes else np.full(3, reach)
    scale = float((highs - lows).max())
    chord = min(tolerance or DEFAULT_TOLERANCE * min(reach, scale), COARSEST * scale)
    return frame_around(lows, highs, chord)


def frame_around(lows: FloatArray, highs: FloatArray, tolerance: float) -> Frame:
    """Return the frame for what lies in a box; all in design units."""
    middle, scale = 0.5 * (lows + highs), float((highs - lows).max())
    return Frame(middle, scale, tolerance, Box((lows - middle) / scale, (highs - middle) / scale))


def pieces_of(
    limits: Sequence[Constraint], frame: Frame, *, contracted: bool = False
) -> list[Piece]:
    """Return the primitives whose intersection, less those that cut, keeps all limits.

    () if nothing does, as far as that is seen at once.

    Args:
        limits: Of one workspace.
        frame: In which they are made.
        contracted: Whether the frame's box holds this workspace more tightly than its limits say.
    """
    ends = _box_of(limits)
    if ends is None:
        return []
    region = region_of(limits)
    box = frame.box if contracted else Box(frame.to(ends[0]), frame.to(ends[1]))
    # The box ends on surfaces of limits, on which side of them is up to rounding. The block
    # goes beyond them, so that whether it keeps a limit is no question of rounding.
    block = box.surroundings()
    planes = [end for end in (region.of_low, region.of_high, *region.of_planes) if end is not None]
    found = [Piece("", False, 12, block.mesh)]
    for each in (
        *(_half_space(plane, box, block, frame) for plane in planes),
        *_rounds(region.of_rounds, box, block, frame),
        *(_cone(limit, frame) for limit in limits if isinstance(limit, Cone)),
    ):
        if each is False:
            return []
        if each is not True:
            found.append(each)
    return found


def _box_of(limits: Sequence[Constraint]) -> tuple[FloatArray, FloatArray] | None:
    region = region_of(limits)
    lows, highs = bounds(region)
    return None if region.is_empty or not (lows < highs).all() else (lows, highs)


def _half_space(plane: HalfSpace, box: Box, block: Box, frame: Frame) -> Piece | bool:
    """Return the piece, True if all the block keeps it, or False if all the box breaks it."""
    length = float(np.linalg.norm(plane.normal))
    normal = plane.normal / length
    offset = (plane.offset / length - float(normal @ frame.middle)) / frame.scale
    if float((block.corners @ normal).max()) < offset:
        return True
    if float((box.corners @ normal).min()) >= offset:
        return False
    return Piece(plane.name, False, 12, partial(half_space, normal, offset, frame.box))


def _rounds(rounds: Sequence[Round], box: Box, block: Box, frame: Frame) -> Iterator[Piece | bool]:
    """Yield the pieces, True if all the block keeps one, or False if all the box breaks it."""
    kin: dict[tuple[bool, bytes], list[Round]] = {}
    for each in rounds:
        kin.setdefault((each.is_ball, each.centre.tobytes()), []).append(each)
    for group in kin.values():
        # Concentric surfaces share a pattern, so that shells thinner than a chord are whole.
        start = 0 if group[0].is_ball else 1
        centre = frame.to(group[0].centre)[start:]
        (near, far), beyond = box.distances(centre), block.distances(centre)[1]
        bounding: list[tuple[Round, float]] = []
        for each in group:
            radius = each.radius / frame.scale
            if radius <= near or radius > (beyond if each.inside else far):
                yield (radius <= near) != each.inside
            else:
                bounding.append((each, radius))
        if not bounding:
            continue
        parts = [facing(centre, radius, frame.box, frame.chord) for _, radius in bounding]
        angle = max(part[1] for part in parts)
        step = step_of(max(radius for _, radius in bounding), frame.chord)
        for each, radius in bounding:
            towards = parts[0][0]
            if each.is_ball:
                faces = ball_faces(angle, step)
                make = partial(ball, centre, radius, towards, angle, step)
            else:
                faces = math.ceil(8.0 * angle / step)
                make = partial(cylinder, centre, radius, towards, angle, step, frame.box)
            yield Piece(each.name, not each.inside, faces, make)


def _cone(limit: Cone, frame: Frame) -> Piece | bool:
    """Return the piece, or whether all positions or none keep the limit."""
    apex, axis, angle = frame.to(limit.apex), limit.axis, limit.half_angle
    if limit.flat:
        # The leg is perpendicular to x, so that only a section of its cone counts: a wedge.
        across = math.hypot(axis[1], axis[2])
        cosine = math.cos(angle)
        if abs(cosine) >= across:
            return cosine <= 0.0
        axis, angle = np.array([0.0, axis[1], axis[2]]) / across, math.acos(cosine / across)
        # Its edge is a line along x: that point of it counts which is nearest.
        apex = np.array([frame.box.middle[0], apex[1], apex[2]])
    if angle >= math.pi:
        return True
    farthest = frame.box.distances(apex)[1]
    if abs(math.cos(angle)) * farthest <= FLAT * frame.chord:
        offset = -float(axis @ apex)
        return Piece(limit.name, False, 12, partial(half_space, -axis, offset, frame.box))
    cuts = angle > 0.5 * math.pi
    if cuts:
        axis, angle = -axis, math.pi - angle
    if limit.flat:
        make = partial(wedge, apex[1:], axis[1:], angle, frame.box)
        return Piece(limit.name, cuts, 16, make)
    step = step_of(farthest, frame.chord)
    faces = math.ceil(12.0 * math.pi / step)
    return Piece(limit.name, cuts, faces, partial(cone, apex, axis, angle, step, frame.box))
