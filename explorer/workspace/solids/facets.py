"""Closed triangle meshes that stand for primitive solids where they meet a box.

Only the part of a ball or cylinder that faces the box is made, closed by a flat base
beyond it. Facets keep within a chord tolerance of the true surface, and lie outside it as
much as inside: corners are moved out, so that what inscribed facets lose is no volume lost.
"""

from __future__ import annotations

import functools
import math
from typing import TypeAlias

import numpy as np

from explorer.numerics.arrays import BoolArray, FloatArray, IntArray

Facets: TypeAlias = tuple[FloatArray, IntArray]
"""Vertices (n, 3) and faces (m, 3), counter-clockwise from outside."""

# No angle between neighbouring corners exceeds this, however coarse the tolerance.
WIDEST = math.radians(30.0)
# Bases lie this share of the box's size beyond it.
BEYOND = 0.05
# The circumradius of a facet of a ball over the distance of its rings.
CIRCUMRADIUS = 0.78
# Parts of a ball come in sizes of this ratio, so that one mesh serves many.
RATIO = 2.0**0.125

_CORNERS: BoolArray = np.array([[k >> 2 & 1, k >> 1 & 1, k & 1] for k in range(8)], dtype=np.bool_)

_BLOCK: IntArray = np.array(
    [
        *([0, 1, 3], [0, 3, 2], [4, 6, 7], [4, 7, 5], [0, 4, 5], [0, 5, 1]),
        *([2, 3, 7], [2, 7, 6], [0, 2, 6], [0, 6, 4], [1, 5, 7], [1, 7, 3]),
    ]
)


class Box:
    """An axis-aligned box.

    Attributes:
        lows, highs: Its ends, shape (3,).
        corners: Shape (8, 3).
        middle: Shape (3,).
        size: Its diagonal.
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

    def surroundings(self) -> Box:
        """Return a box that holds this one and touches it nowhere."""
        more = BEYOND * self.size
        return Box(self.lows - more, self.highs + more)

    def mesh(self) -> Facets:
        """Return the corners and faces of the box."""
        return self.corners, _BLOCK


def step_of(radius: float, tolerance: float) -> float:
    """Return the angle between neighbouring corners whose chord is within the tolerance."""
    return min(WIDEST, 4.0 * math.asin(math.sqrt(min(0.25, 0.5 * tolerance / radius))))


def facing(
    centre: FloatArray, radius: float, box: Box, tolerance: float
) -> tuple[FloatArray, float]:
    """Return the direction from a centre to a box, and the angle about it that is needed.

    Beyond this angle the sphere is out of the box; π if all of it may be in.

    Args:
        centre: Shape (3,), or (2,) of a circle in y and z.
        radius: Of the sphere or circle.
        box: Which it may meet.
        tolerance: By which facets may lie outside.
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
    """Return the part of a ball within an angle of a direction, closed by a flat base.

    Args:
        centre: Shape (3,).
        radius: Of the ball.
        towards: The direction, a unit vector (3,).
        angle: What is needed at the least; π for the whole ball.
        step: Between neighbouring corners, see `step_of`.
    """
    points, faces, outward = _unit_cap(*_cap_of(angle, step))
    frame = _frame(towards)
    return centre + (radius * outward) * (points @ frame), faces


def ball_faces(angle: float, step: float) -> int:
    """Return about how many faces such a part of a ball has."""
    size, rings = _cap_of(angle, step)
    widest = math.pi * RATIO**-size
    # Facets are about equilateral, of a height that is the distance of the rings.
    return int(4.0 * math.pi * (1.0 - math.cos(widest)) / (widest / rings) ** 2 / 1.1547) + 8


def cylinder(
    centre: FloatArray, radius: float, towards: FloatArray, angle: float, step: float, box: Box
) -> Facets:
    """Return the part of a cylinder along x within an angle of a direction in y and z.

    Args:
        centre: (y, z), shape (2,).
        radius: Of the cylinder.
        towards: The direction, a unit vector (2,).
        angle: What is needed at the least; π for the whole cylinder.
        step: Between neighbouring corners, see `step_of`.
        box: Along which it reaches.
    """
    whole = angle >= math.pi
    count = max(3, math.ceil(2.0 * angle / step))
    turns = math.atan2(towards[1], towards[0]) + np.linspace(-angle, angle, count + 1)
    if whole:
        turns = turns[:-1]
    outline = centre + radius * _outward(2.0 * angle / count) * np.column_stack(
        [np.cos(turns), np.sin(turns)]
    )
    return prism(outline, box)


def prism(outline: FloatArray, box: Box) -> Facets:
    """Return the prism along x over a convex outline (n, 2) in y and z, counter-clockwise."""
    count = len(outline)
    ends = [
        np.column_stack([np.full(count, x), outline])
        for x in (
            box.lows[0] - BEYOND * box.size,
            box.highs[0] + BEYOND * box.size,
        )
    ]
    here = np.arange(count)
    after = (here + 1) % count
    inner = np.arange(1, count - 1)
    faces = np.concatenate(
        [
            np.column_stack([here, after, after + count]),
            np.column_stack([here, after + count, here + count]),
            np.column_stack([np.zeros_like(inner), inner + 1, inner]),
            np.column_stack([np.zeros_like(inner), inner, inner + 1]) + [count, count, count],
        ]
    )
    return np.concatenate(ends), faces


def half_space(normal: FloatArray, offset: float, box: Box) -> Facets:
    """Return a block that holds what of the box, and around it, has normal · p <= offset."""
    length = float(np.linalg.norm(normal))
    unit = normal / length
    off = box.middle - (float(unit @ box.middle) - offset / length) * unit
    reach = 2.0 * box.size + float(np.linalg.norm(off - box.middle))
    signs = Box(np.array([-1.0, -1.0, -2.0]), np.array([1.0, 1.0, 0.0])).corners
    return off + reach * (signs @ _frame(unit)), _BLOCK


def wedge(apex: FloatArray, axis: FloatArray, half_angle: float, box: Box) -> Facets:
    """Return what of a wedge along x may lie in the box.

    Args:
        apex: Its edge, (y, z), shape (2,).
        axis: Along its middle, a unit vector (2,).
        half_angle: In radians, below a right angle.
        box: Which it may meet.
    """
    width, height, wall = _far_rim(apex, half_angle, box)
    along, across = height * axis, width * np.array([-axis[1], axis[0]])
    far = wall * axis
    outline = [0.0 * axis, along - across, along - across + far, along + across + far]
    return prism(apex + np.array([*outline, along + across]), box)


def cone(apex: FloatArray, axis: FloatArray, half_angle: float, step: float, box: Box) -> Facets:
    """Return what of a cone may lie in the box.

    Args:
        apex: Shape (3,).
        axis: A unit vector (3,).
        half_angle: In radians, below a right angle.
        step: Between neighbouring corners of its rim, see `step_of`.
        box: Which it may meet.
    """
    count = max(8, math.ceil(2.0 * math.pi / step))
    width, height, wall = _far_rim(apex, half_angle, box)
    width *= _outward(2.0 * math.pi / count)
    turns = 2.0 * math.pi / count * np.arange(count)
    rim = np.column_stack([width * np.cos(turns), width * np.sin(turns), np.full(count, height)])
    points = np.concatenate([[[0.0, 0.0, 0.0]], rim, rim + [0.0, 0.0, wall]])
    here = 1 + np.arange(count)
    after = 1 + (np.arange(count) + 1) % count
    inner = np.arange(1, count - 1)
    faces = np.concatenate(
        [
            np.column_stack([np.zeros_like(here), after, here]),
            np.column_stack([here, after, after + count]),
            np.column_stack([here, after + count, here + count]),
            np.column_stack([np.zeros_like(inner), inner, inner + 1]) + 1 + count,
        ]
    )
    return apex + points @ _frame(axis), faces


def _far_rim(apex: FloatArray, half_angle: float, box: Box) -> tuple[float, float, float]:
    """Return how wide and how far along a cone's rim is, and how long the wall beyond it.

    Wide cones need the wall, since a flat base beyond the box would be far too wide.
    """
    farthest = box.distances(apex)[1] + BEYOND * box.size
    length = 2.0 * farthest
    return length * math.sin(half_angle), length * math.cos(half_angle), length


def _outward(step: float) -> float:
    """Return by how much to move the corners of a polygon out for the area of its circle."""
    return math.sqrt(step / math.sin(step))


def _frame(axis: FloatArray) -> FloatArray:
    """Return a right-handed frame, as rows, whose third vector is a unit vector (3,)."""
    first = np.zeros(3)
    first[int(np.argmin(np.abs(axis)))] = 1.0
    first -= float(first @ axis) * axis
    first /= np.linalg.norm(first)
    return np.array([first, np.cross(axis, first), axis])


def _cap_of(angle: float, step: float) -> tuple[int, int]:
    """Return which size of cap holds an angle, and the number of its rings."""
    size = max(0, math.floor(math.log(math.pi / angle) / math.log(RATIO)))
    rings = math.ceil(math.pi * RATIO**-size * 2.0 * CIRCUMRADIUS / step)
    return size, max(rings, 3)


@functools.lru_cache(maxsize=64)
def _unit_cap(size: int, rings: int) -> tuple[FloatArray, IntArray, float]:
    """Return points and faces of a cap about z, and by how much to move its corners out."""
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
    turn = 2.0 * math.pi * _within(counts) / np.repeat(counts, counts)
    points = np.column_stack(
        [np.sin(tilt) * np.cos(turn), np.sin(tilt) * np.sin(turn), np.cos(tilt)]
    )
    faces = _stitched(counts, first)
    a, b, c = points[faces[:, 0]], points[faces[:, 1]], points[faces[:, 2]]
    squares = ((a - b) ** 2 + (b - c) ** 2 + (c - a) ** 2).sum(axis=1)
    areas = np.linalg.norm(np.cross(b - a, c - a), axis=1)
    # A flat triangle on a sphere of radius one lies this deep on the average.
    outward = 1.0 + float((areas * squares).sum() / areas.sum()) / 24.0
    if size > 0:
        last = int(counts[-1])
        rim = first[-2] + np.arange(last)
        inner = np.arange(1, last - 1)
        base = np.column_stack([np.zeros_like(inner), inner + 1, inner])
        faces = np.concatenate([faces, rim[base]])
    return points, faces, outward


def _stitched(counts: IntArray, first: IntArray) -> IntArray:
    """Return the faces between neighbouring rings of evenly spread points.

    Walking around a pair of rings, the edge whose middle comes next makes a triangle with
    the point that has been reached on the other ring.
    """
    pairs = np.arange(len(counts) - 1)
    edges = np.where(counts > 1, counts, 0)
    sides: list[tuple[IntArray, FloatArray, IntArray]] = []
    for side in (0, 1):
        many = edges[pairs + side]
        pair = np.repeat(pairs, many)
        sides.append(
            (pair, (_within(many) + 0.5) / np.repeat(many, many), np.full(len(pair), side))
        )
    pair, middle, side = (np.concatenate(both) for both in zip(*sides, strict=True))
    order = np.lexsort((side, middle, pair))
    pair, side = pair[order], side[order]
    starts = np.searchsorted(pair, pairs)
    reached: list[IntArray] = []
    for which in (0, 1):
        before = np.cumsum(side == which) - (side == which)
        reached.append(before - before[starts][pair])
    inner, outer = counts[pair], counts[pair + 1]
    at_inner, at_outer = first[pair] + reached[0] % inner, first[pair + 1] + reached[1] % outer
    beyond = np.where(
        side == 0,
        first[pair] + (reached[0] + 1) % inner,
        first[pair + 1] + (reached[1] + 1) % outer,
    )
    # Rings go from the pole outwards, each counter-clockwise about z.
    return np.column_stack([at_inner, at_outer, beyond])


def _within(counts: IntArray) -> IntArray:
    """Return 0, 1, … of each group in turn, as many as it counts."""
    total = np.cumsum(counts)
    return np.asarray(np.arange(total[-1]) - np.repeat(total - counts, counts), dtype=np.int64)
