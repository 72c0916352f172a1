"""Tessellations of primitive solids near a box, as closed triangle meshes.

Only the part of a ball or cylinder that faces the box is tessellated, closed by a flat base
beyond the box. Facets are within a chord tolerance of the true surface. Their corners are moved
outwards until the volume is that of the true solid, which inscribed facets would fall short of.
"""

from __future__ import annotations

import functools
import math
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np

from explorer.numerics.arrays import BoolArray, FloatArray, IntArray

Facets: TypeAlias = tuple[FloatArray, IntArray]
"""Vertices (n, 3) and faces (m, 3), counter-clockwise from outside."""

# The largest angle between neighbouring corners, however coarse the tolerance.
WIDEST = math.radians(30.0)
# The distance of bases from the box, as a share of its size.
BEYOND = 0.05
# The circumradius of a facet of a ball over the distance of rings of corners.
CIRCUMRADIUS = 0.78
# The ratio of the sizes of parts of a ball, so that one mesh serves many angles.
RATIO = 2.0**0.125

_CORNERS: BoolArray = np.array([[k >> 2 & 1, k >> 1 & 1, k & 1] for k in range(8)], dtype=np.bool_)

# A square, counter-clockwise.
_SQUARE: FloatArray = np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]])


class Box:
    """An axis-aligned box.

    Attributes:
        lows, highs: Ends, shape (3,).
        corners: Corners, shape (8, 3).
        middle: Middle, shape (3,).
        size: Length of the diagonal.
    """

    def __init__(self, lows: FloatArray, highs: FloatArray) -> None:
        self.lows, self.highs = lows, highs
        self.corners: FloatArray = np.where(_CORNERS, highs, lows)
        self.middle: FloatArray = 0.5 * (lows + highs)
        self.size = float(np.linalg.norm(highs - lows))

    def distances(self, point: FloatArray) -> tuple[float, float]:
        """Return the least and the largest distance of a point (3,), or (2,) in y and z."""
        start = 3 - len(point)
        nearest = np.clip(point, self.lows[start:], self.highs[start:])
        farthest = np.linalg.norm(self.corners[:, start:] - point, axis=1).max()
        return float(np.linalg.norm(nearest - point)), float(farthest)

    def surroundings(self, share: float = BEYOND) -> Box:
        """Return a box that holds this one and touches it nowhere; it is larger by a share."""
        more = share * self.size
        return Box(self.lows - more, self.highs + more)

    def mesh(self) -> Facets:
        """Return the vertices and faces of the box."""
        half = 0.5 * (self.highs - self.lows)[1:]
        return prism(self.middle[1:] + half * _SQUARE, self.lows[0], self.highs[0])


@dataclass(frozen=True)
class TessellationFrame:
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


def frame_around(lows: FloatArray, highs: FloatArray, tolerance: float) -> TessellationFrame:
    """Return the frame around a box; all arguments are in design units."""
    middle, scale = 0.5 * (lows + highs), float((highs - lows).max())
    return TessellationFrame(
        middle, scale, tolerance, Box((lows - middle) / scale, (highs - middle) / scale)
    )


def step_of(radius: float, tolerance: float) -> float:
    """Return the angle in radians between neighbouring corners whose chord is within tolerance."""
    return min(WIDEST, 4.0 * math.asin(math.sqrt(min(0.25, 0.5 * tolerance / radius))))


def facing_part(
    centre: FloatArray, radius: float, box: Box, tolerance: float
) -> tuple[FloatArray, float]:
    """Return the unit direction from a centre to a box, and the angle about it to tessellate.

    Beyond this angle, in radians, a sphere is outside the box by more than a tolerance; it is π
    if all of the sphere may be inside. A centre in y and z, shape (2,), is that of a circle.
    """
    corners = box.corners[:, 3 - len(centre) :]
    axes = np.eye(len(centre))
    to_middle = box.middle[3 - len(centre) :] - centre
    distance = float(np.linalg.norm(to_middle))
    directions = np.concatenate([axes, -axes, [to_middle / distance] if distance else axes[:1]])
    nearest = ((corners - centre) @ directions.T).min(axis=0)
    best = int(np.argmax(nearest))
    cosine = (float(nearest[best]) - BEYOND * box.size) / (radius + tolerance)
    return directions[best], math.pi if cosine < -0.9 else math.acos(min(1.0, cosine))


def ball(
    centre: FloatArray, radius: float, towards: FloatArray, angle: float, step: float
) -> Facets:
    """Return the part of a ball within an angle of a unit direction, closed by a flat base.

    The angle in radians is π for the whole ball; for the step see `step_of`.
    """
    points, faces, base, outward = _unit_cap(*_cap_of(angle, step))
    frame = frame_about(towards)
    return centre + (radius * outward) * (points @ frame), np.concatenate([faces, base])


def sphere_part(angle: float, edge: float) -> Facets:
    """Return the unit sphere within an angle of z or more, π for all, as regular triangles.

    The angle is in radians; edges have about a given length.
    """
    # Rings are as far apart as an equilateral triangle is high.
    step = edge * math.sqrt(3.0) * CIRCUMRADIUS
    return _unit_cap(*_cap_of(angle, step))[:2]


def ball_faces(angle: float, step: float) -> int:
    """Return the approximate number of faces of `ball` at an angle and a step."""
    size, rings = _cap_of(angle, step)
    widest = math.pi * RATIO**-size
    # Facets are about equilateral triangles whose height is the distance of the rings.
    return int(4.0 * math.pi * (1.0 - math.cos(widest)) / (widest / rings) ** 2 / 1.1547) + 8


def cylinder(
    centre: FloatArray, radius: float, towards: FloatArray, angle: float, step: float, box: Box
) -> Facets:
    """Return the part of a cylinder along x within an angle of a direction, longer than a box.

    The centre and the unit direction are in y and z, shape (2,); the angle in radians is π for
    the whole cylinder; for the step see `step_of`.
    """
    count = max(3, math.ceil(2.0 * angle / step))
    turns = math.atan2(towards[1], towards[0]) + np.linspace(-angle, angle, count + 1)
    if angle >= math.pi:
        turns = turns[:-1]
    outline = (
        radius * _outward_scale(2.0 * angle / count) * np.array([np.cos(turns), np.sin(turns)])
    )
    return prism(centre + outline.T, *_along(box))


def prism(outline: FloatArray, low: float, high: float) -> Facets:
    """Return the prism along x over a convex outline (n, 2) in y and z, counter-clockwise."""
    count = len(outline)
    points = np.column_stack([np.repeat([low, high], count), np.vstack([outline, outline])])
    return points, np.concatenate([_tube(count), _fan(count)[:, [0, 2, 1]], _fan(count) + count])


def _along(box: Box) -> tuple[float, float]:
    """Return the ends along x of what goes through a box."""
    beyond = BEYOND * box.size
    return float(box.lows[0]) - beyond, float(box.highs[0]) + beyond


def _tube(count: int) -> IntArray:
    """Return the faces between a ring of corners and the ring that follows it."""
    indices = np.arange(count)
    following = (indices + 1) % count
    return np.concatenate(
        [
            np.column_stack([indices, following, following + count]),
            np.column_stack([indices, following + count, indices + count]),
        ]
    )


def _fan(count: int) -> IntArray:
    """Return the faces within a ring of corners."""
    inner = np.arange(1, count - 1)
    return np.column_stack([np.zeros_like(inner), inner, inner + 1])


def half_space(normal: FloatArray, offset: float, box: Box) -> Facets:
    """Return a block that fills the half-space normal · p <= offset in and around a box."""
    length = float(np.linalg.norm(normal))
    unit = normal / length
    off = box.middle - (float(unit @ box.middle) - offset / length) * unit
    reach = 2.0 * box.size + float(np.linalg.norm(off - box.middle))
    points, faces = prism(_SQUARE, -2.0, 0.0)
    # The axis of the prism is the normal, the last axis of the frame.
    return off + reach * (points[:, [1, 2, 0]] @ frame_about(unit)), faces


def wedge(apex: FloatArray, axis: FloatArray, half_angle: float, box: Box) -> Facets:
    """Return the part of a wedge along x in and around a box.

    The apex and the unit direction of the middle plane are in y and z, shape (2,); the half-angle
    in radians is below a right angle.
    """
    width, height, wall = _far_rim(apex, half_angle, box)
    far, across = (height + wall) * axis, width * np.array([-axis[1], axis[0]])
    low, high = height * axis - across, height * axis + across
    return prism(apex + np.array([0.0 * axis, low, far - across, far + across, high]), *_along(box))


def cone(apex: FloatArray, axis: FloatArray, half_angle: float, step: float, box: Box) -> Facets:
    """Return the part of a cone in and around a box.

    The axis is a unit vector, the half-angle is below a right angle, and the step is the angle
    between neighbouring corners of the rim, see `step_of`.
    """
    count = max(8, math.ceil(2.0 * math.pi / step))
    width, height, wall = _far_rim(apex, half_angle, box)
    width *= _outward_scale(2.0 * math.pi / count)
    turns = 2.0 * math.pi / count * np.arange(count)
    rim = np.column_stack([width * np.cos(turns), width * np.sin(turns), np.full(count, height)])
    points = np.concatenate([[[0.0, 0.0, 0.0]], rim, rim + [0.0, 0.0, wall]])
    indices = np.arange(count)
    tip = np.column_stack([np.zeros_like(indices), 1 + (indices + 1) % count, 1 + indices])
    faces = [tip, _tube(count) + 1, _fan(count) + 1 + count]
    return apex + points @ frame_about(axis), np.concatenate(faces)


def _far_rim(apex: FloatArray, half_angle: float, box: Box) -> tuple[float, float, float]:
    """Return the radius and the height of a cone's rim, and the length of the wall beyond it.

    Wide cones need the wall, since a flat base beyond the box would be far too wide.
    """
    farthest = box.distances(apex)[1] + BEYOND * box.size
    length = 2.0 * farthest
    return length * math.sin(half_angle), length * math.cos(half_angle), length


def _outward_scale(step: float) -> float:
    """Return the factor by which to scale a regular polygon to the area of its circle."""
    return math.sqrt(step / math.sin(step))


def frame_about(axis: FloatArray) -> FloatArray:
    """Return a right-handed frame, as rows, whose third row is a given unit vector (3,)."""
    first = np.zeros(3)
    first[int(np.argmin(np.abs(axis)))] = 1.0
    first -= float(first @ axis) * axis
    first /= np.linalg.norm(first)
    return np.array([first, np.cross(axis, first), axis])


def _cap_of(angle: float, step: float) -> tuple[int, int]:
    """Return the size of the cap that holds an angle, and the number of its rings."""
    size = max(0, math.floor(math.log(math.pi / angle) / math.log(RATIO)))
    rings = math.ceil(math.pi * RATIO**-size * 2.0 * CIRCUMRADIUS / step)
    return size, max(rings, 3)


@functools.lru_cache(maxsize=64)
def _unit_cap(size: int, rings: int) -> tuple[FloatArray, IntArray, IntArray, float]:
    """Return points, faces and base of a cap about z, and the factor to scale it to its volume."""
    widest = math.pi * RATIO**-size
    height = widest / rings
    tilts = height * np.arange(rings + 1)
    spacing = height * 2.0 / math.sqrt(3.0)
    counts = np.ceil(2.0 * math.pi * np.sin(tilts) / spacing - 1e-9).astype(np.int64)
    counts = np.maximum(counts, 3)
    counts[0] = 1
    if size == 0:
        counts[-1] = 1
    first: IntArray = np.concatenate([[0], np.cumsum(counts)])
    tilt = np.repeat(tilts, counts)
    turn = 2.0 * math.pi * _positions_in_groups(counts) / np.repeat(counts, counts)
    points = np.column_stack(
        [np.sin(tilt) * np.cos(turn), np.sin(tilt) * np.sin(turn), np.cos(tilt)]
    )
    faces = _stitch_rings(counts, first)
    a, b, c = points[faces[:, 0]], points[faces[:, 1]], points[faces[:, 2]]
    squares = ((a - b) ** 2 + (b - c) ** 2 + (c - a) ** 2).sum(axis=1)
    areas = np.linalg.norm(np.cross(b - a, c - a), axis=1)
    # Flat triangles lie below a sphere of radius one by this much on average.
    outward = 1.0 + float((areas * squares).sum() / areas.sum()) / 24.0
    # A whole sphere ends in a point, which is no rim.
    base = first[-2] + _fan(int(counts[-1]))[:, [0, 2, 1]]
    return points, faces, base, outward


def _stitch_rings(counts: IntArray, first: IntArray) -> IntArray:
    """Return the faces between neighbouring rings of evenly spaced points.

    Around a pair of rings, edges of both are taken in the order of their middles. Each makes a
    triangle with the current point of the other ring.
    """
    pairs = np.arange(len(counts) - 1)
    edges = np.where(counts > 1, counts, 0)
    # The edges of the inner ring of each pair come first, then those of the outer one.
    edge_counts = np.concatenate([edges[:-1], edges[1:]])
    pair = np.repeat(np.concatenate([pairs, pairs]), edge_counts)
    side = np.repeat([0, 1], [edges[:-1].sum(), edges[1:].sum()])
    middle = (_positions_in_groups(edge_counts) + 0.5) / np.repeat(edge_counts, edge_counts)
    order = np.lexsort((side, middle, pair))
    pair, side = pair[order], side[order]
    starts = np.searchsorted(pair, pairs)
    rings = np.array([side == 0, side == 1])
    before = np.cumsum(rings, axis=1) - rings
    passed: IntArray = before - before[:, starts[pair]]
    ring = np.stack([pair, pair + 1])
    points: IntArray = first[ring] + passed % counts[ring]
    following: IntArray = first[ring] + (passed + 1) % counts[ring]
    # Rings go from the pole outwards, each counter-clockwise about z.
    faces = np.empty((len(side), 3), dtype=np.int64)
    faces[:, :2], faces[:, 2] = points.T, following[side, np.arange(len(side))]
    return faces


def _positions_in_groups(counts: IntArray) -> IntArray:
    """Return 0, 1, …, count - 1 for each count, concatenated."""
    total = np.cumsum(counts)
    return np.asarray(np.arange(total[-1]) - np.repeat(total - counts, counts), dtype=np.int64)
