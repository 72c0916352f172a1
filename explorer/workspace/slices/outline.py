"""The exact outline of a slice of the workspace: arcs of circles and straight edges.

At one orientation the limits are balls, cylinders along x and half-spaces, so a plane across
an axis cuts each in a circle, in a pair of lines or in a line. Each of these curves is split
where it meets the others, and the parts that satisfy all other limits are joined to closed loops.

Of a field on a grid, marching squares give the outlines of the parts in which it is at least a
level.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import TypeAlias

import numpy as np

from explorer.numerics.arrays import BoolArray, FloatArray
from explorer.workspace.limits.constraints import BallOrCylinder, Cone, HalfSpace
from explorer.workspace.workspace import Workspace

# Shares of the size of the region: directions that differ by less than SAME are the same, ends of
# edges closer than CORNER are one corner, and edges shorter than SHORT are dropped.
SAME = 1e-11
CORNER = 1e-6
SHORT = 1e-9

AXES = "xyz"
"""The axes across which a slice can be cut."""

Point: TypeAlias = tuple[float, float]


@dataclass(frozen=True)
class Edge:
    """A part of an outline, with the slice on its left.

    Attributes:
        start, end: Ends on the two axes of the slice, in design units.
        centre: Centre of the circle of an arc; None for a straight edge.
        turn: Angle of an arc in radians, positive counter-clockwise; 0 for a straight edge.
    """

    start: Point
    end: Point
    centre: Point | None
    turn: float

    @property
    def radius(self) -> float:
        """The radius of an arc, 0 for a straight edge."""
        return 0.0 if self.centre is None else math.dist(self.centre, self.start)


Outline: TypeAlias = tuple[tuple[Edge, ...], ...]
"""The closed loops of the edges of a slice; those about holes run clockwise. () if it is empty."""


@dataclass(frozen=True)
class _Curve:
    """A circle, or a line n·q = offset with |n| = 1, with the slice on one side of it."""

    # A cylinder has two lines with the same index.
    limit_index: int
    side: float
    centre: Point = (0.0, 0.0)
    radius: float = 0.0
    normal: Point = (0.0, 0.0)
    offset: float = 0.0

    @property
    def is_circle(self) -> bool:
        return self.radius > 0.0


def slice_outline(workspace: Workspace, axis: str, level: float) -> Outline | None:
    """Return the outline of a slice of a workspace across "x", "y" or "z"; None if there is none.

    There is none if a limit on a swing bounds it, since a plane does not cut a cone in circles, or
    if edges cannot be distinguished in double precision. The level is the coordinate on the axis.
    """
    cut = AXES.index(axis)
    axes = cut, *(other for other in range(3) if other != cut)
    if any(isinstance(limit, Cone) for limit in workspace.limits):
        return None
    region = workspace.region
    if region.box is None:
        return ()
    size = float(np.abs(region.box).max())
    ends = [end for end in (region.low_limit, region.high_limit) if end is not None]
    curves: list[_Curve] = []
    for index, limit in enumerate([*region.circle_limits, *region.plane_limits, *ends]):
        limit_curves = _curves_of(limit, axes, level, index)
        if limit_curves is None:
            return ()
        curves += limit_curves
    edges = [edge for curve in curves for edge in _edges_of(curve, curves, size)]
    return _join(edges, CORNER * size)


def _curves_of(
    limit: BallOrCylinder | HalfSpace, axes: tuple[int, ...], level: float, limit_index: int
) -> list[_Curve] | None:
    """Return the curves in which a plane cuts a limit surface; None if the limit holds nowhere."""
    cut, first, second = axes
    if isinstance(limit, HalfSpace):
        n = limit.normal[[first, second]]
        offset = limit.offset - float(limit.normal[cut]) * level
        length = float(np.hypot(n[0], n[1]))
        if length <= SAME * float(np.linalg.norm(limit.normal)):
            return [] if offset >= 0.0 else None
        u, v = (n / length).tolist()
        return [_Curve(limit_index, 1.0, normal=(u, v), offset=offset / length)]
    side = 1.0 if limit.inside else -1.0
    centre = (float(limit.centre[first]), float(limit.centre[second]))
    if not limit.is_ball and cut == 0:
        return [_Curve(limit_index, side, centre, limit.radius)]
    off = level - float(limit.centre[cut])
    square = (limit.radius - off) * (limit.radius + off)
    if square <= 0.0:
        return None if limit.inside else []
    half = math.sqrt(square)
    if limit.is_ball:
        return [_Curve(limit_index, side, centre, half)]
    # A cylinder along x is cut in two lines, on either side of its axis.
    return [
        _Curve(limit_index, side, normal=(0.0, end * side), offset=offset)
        for end, offset in ((1.0, side * (half + centre[1])), (-1.0, side * (half - centre[1])))
    ]


def _edges_of(curve: _Curve, curves: list[_Curve], size: float) -> list[Edge]:
    """Return the parts of a curve that satisfy all limits but its own."""
    others = [other for other in curves if other.limit_index != curve.limit_index]
    # The two lines of a cylinder are parallel, so curves of one limit never meet.
    ends_of_parts = sorted(
        parameter for other in others for parameter in _find_meetings(curve, other)
    )
    if curve.is_circle:
        if not ends_of_parts:
            ends_of_parts = [0.0, math.pi]
        ends_of_parts.append(ends_of_parts[0] + 2.0 * math.pi)
    else:
        ends_of_parts = [-4.0 * size, *ends_of_parts, 4.0 * size]
    low, high = np.array(ends_of_parts[:-1]), np.array(ends_of_parts[1:])
    long = (high - low) * (curve.radius or 1.0) > SHORT * size
    low, high = low[long], high[long]
    inside = _are_inside(_points_at(curve, 0.5 * (low + high)), others)
    low, high = low[inside], high[inside]
    starts, ends = _points_at(curve, low).tolist(), _points_at(curve, high).tolist()
    turns = (high - low).tolist() if curve.is_circle else [0.0] * len(starts)
    centre = curve.centre if curve.is_circle else None
    edges = [
        Edge((a[0], a[1]), (b[0], b[1]), centre, turn)
        for a, b, turn in zip(starts, ends, turns, strict=True)
    ]
    if curve.is_circle and curve.side < 0.0:
        return [replace(e, start=e.end, end=e.start, turn=-e.turn) for e in edges]
    return edges


def _points_at(curve: _Curve, parameter: FloatArray) -> FloatArray:
    """Return the points of a curve at angles, or at lengths along a line, shape (n, 2)."""
    if curve.is_circle:
        along = np.stack([np.cos(parameter), np.sin(parameter)], axis=-1)
        return np.array(curve.centre) + curve.radius * along
    u, v = curve.normal
    # The slice lies to the left of this direction.
    return np.array([u, v]) * curve.offset + parameter[:, None] * np.array([-v, u])


def _are_inside(points: FloatArray, others: list[_Curve]) -> BoolArray:
    """Return whether points (n, 2) satisfy the limits of curves, shape (n,)."""
    inside = np.ones(len(points), dtype=np.bool_)
    for limit_index in {other.limit_index for other in others}:
        curves_of_limit = [other for other in others if other.limit_index == limit_index]
        within = np.stack([_slack(other, points) > 0.0 for other in curves_of_limit])
        # A point outside a cylinder is above one of its lines or below the other.
        inside &= within.any(axis=0) if curves_of_limit[0].side < 0.0 else within.all(axis=0)
    return inside


def _slack(curve: _Curve, points: FloatArray) -> FloatArray:
    if curve.is_circle:
        off = points - np.array(curve.centre)
        return curve.side * (curve.radius - np.hypot(off[:, 0], off[:, 1]))
    return curve.offset - points @ np.array(curve.normal)


def _find_meetings(curve: _Curve, other: _Curve) -> list[float]:
    """Return the parameters of a curve at which it meets another."""
    (u, v), offset = curve.normal, curve.offset
    if curve.is_circle:
        # Where two circles meet, they meet the line through both points.
        (cu, cv), r = curve.centre, curve.radius
        du, dv = other.normal
        along = other.offset - du * cu - dv * cv
        if other.is_circle:
            du, dv = other.centre[0] - cu, other.centre[1] - cv
            along = 0.5 * (r**2 + du**2 + dv**2 - other.radius**2)
        most = r * math.hypot(du, dv)
        if abs(along) >= most:
            return []
        bearing, half = math.atan2(dv, du), math.acos(along / most)
        return [(bearing + sign * half) % (2.0 * math.pi) for sign in (-1.0, 1.0)]
    if other.is_circle:
        cu, cv = other.centre
        off = offset - u * cu - v * cv
        square = (other.radius - off) * (other.radius + off)
        middle, half = -v * cu + u * cv, math.sqrt(max(square, 0.0))
        return [middle - half, middle + half] if square > 0.0 else []
    slope = other.normal[1] * u - other.normal[0] * v
    along = other.normal[0] * u + other.normal[1] * v
    return [(other.offset - along * offset) / slope] if abs(slope) > SAME else []


def _join(edges: list[Edge], corner: float) -> Outline | None:
    """Return edges joined to closed loops; None if an end has no start nearby."""
    unjoined, loops = list(edges), list[tuple[Edge, ...]]()
    while unjoined:
        loop, index = [unjoined.pop()], -1
        while index != 0:
            gaps = [math.dist(loop[-1].end, edge.start) for edge in (loop[0], *unjoined)]
            index = gaps.index(min(gaps))
            if gaps[index] > corner:
                return None
            if index:
                loop.append(unjoined.pop(index - 1))
        loops.append(tuple(loop))
    return tuple(loops)
