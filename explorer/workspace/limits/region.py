"""Regions: intersections of limits as rows of numbers for kernels.

Two limits may have the same surface (the box may start where δ3 is zero); only the tighter of
them has a row. Planes perpendicular to x become ends of the x-range.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from explorer.numerics.arrays import FloatArray
from explorer.workspace.limits.columns import CONE_COLUMNS, PLANE_COLUMNS
from explorer.workspace.limits.constraints import BallOrCylinder, Cone, Constraint, HalfSpace, Never

# Surfaces that differ by less than this share of the region's size are the same.
SAME = 1e-12


@dataclass(frozen=True)
class Region:
    """An intersection of limits; rows are those of `explorer.workspace.limits.columns`.

    Attributes:
        circles: Rows of balls and cylinders, whose slices at constant x are circles, shape (n, 6).
        planes: Rows of half-spaces whose surfaces are not perpendicular to x, shape (m, 4).
        cones: Rows of cones, shape (k, 8).
        low, high: Range of x; empty if low exceeds high.
        circle_limits, plane_limits: Limits of the rows.
        low_limit, high_limit: Limits at the ends of the range, None where a ball is the end.
        is_flat: Whether positions must lie both inside and outside one ball or cylinder. The
            region then has no volume, although positions on the surface satisfy all limits.
    """

    circles: FloatArray
    planes: FloatArray
    cones: FloatArray
    low: float
    high: float
    circle_limits: tuple[BallOrCylinder, ...]
    plane_limits: tuple[HalfSpace, ...]
    low_limit: HalfSpace | None
    high_limit: HalfSpace | None
    is_flat: bool

    @property
    def rows(self) -> tuple[FloatArray, FloatArray, FloatArray]:
        """(circles, planes, cones)."""
        return self.circles, self.planes, self.cones

    @property
    def is_empty(self) -> bool:
        """Whether the range of x or a single surface already shows that there is no volume."""
        return self.is_flat or not self.low < self.high


def region_of(limits: Sequence[Constraint]) -> Region:
    """Return the region that satisfies all limits; at least one must be the inside of a ball."""
    balls = [c for c in limits if isinstance(c, BallOrCylinder)]
    size = max(ball.radius + float(np.abs(ball.centre).max()) for ball in balls)
    tolerance = SAME * max(size, 1e-300)
    circles, is_flat = _drop_duplicates(balls, tolerance)
    low, high = -math.inf, math.inf
    low_limit: HalfSpace | None = None
    high_limit: HalfSpace | None = None
    for limit in circles:
        if limit.is_ball and limit.inside:
            low = max(low, float(limit.centre[0]) - limit.radius)
            high = min(high, float(limit.centre[0]) + limit.radius)
    planes: list[HalfSpace] = []
    for limit in limits:
        if not isinstance(limit, HalfSpace):
            continue
        across = math.hypot(limit.normal[1], limit.normal[2])
        if across > SAME * abs(float(limit.normal[0])):
            planes = _add_plane(planes, limit, tolerance)
            continue
        end = limit.offset / float(limit.normal[0])
        if limit.normal[0] > 0.0 and end < high:
            high, high_limit = end, limit
        elif limit.normal[0] < 0.0 and end > low:
            low, low_limit = end, limit
    if any(isinstance(limit, Never) for limit in limits):
        high = -math.inf
    return Region(
        circles=np.array(
            [[*c.centre, c.radius, float(c.is_ball), 1.0 if c.inside else -1.0] for c in circles]
        ),
        planes=np.array([[*c.normal, c.offset] for c in planes]).reshape(-1, PLANE_COLUMNS),
        cones=np.array(
            [
                [*c.apex, *c.axis, math.cos(c.half_angle), float(c.flat)]
                for c in limits
                if isinstance(c, Cone)
            ]
        ).reshape(-1, CONE_COLUMNS),
        low=low,
        high=high,
        circle_limits=tuple(circles),
        plane_limits=tuple(planes),
        low_limit=low_limit,
        high_limit=high_limit,
        is_flat=is_flat,
    )


def _drop_duplicates(
    balls: list[BallOrCylinder], tolerance: float
) -> tuple[list[BallOrCylinder], bool]:
    """Return each surface once for each side, and whether limits demand both sides of one."""
    distinct: list[BallOrCylinder] = []
    is_flat = False
    for limit in balls:
        same_surface = [other for other in distinct if _is_same(limit, other, tolerance)]
        is_flat = is_flat or any(twin.inside != limit.inside for twin in same_surface)
        if all(twin.inside != limit.inside for twin in same_surface):
            distinct.append(limit)
    return distinct, is_flat


def _is_same(a: BallOrCylinder, b: BallOrCylinder, tolerance: float) -> bool:
    off = np.abs(a.centre - b.centre)[0 if a.is_ball else 1 :]
    return (
        a.is_ball == b.is_ball
        and float(off.max()) <= tolerance
        and abs(a.radius - b.radius) <= tolerance
    )


def _add_plane(planes: list[HalfSpace], new: HalfSpace, tolerance: float) -> list[HalfSpace]:
    """Return the planes and a new one; of two parallel planes only the tighter."""
    norm = float(np.linalg.norm(new.normal))
    for index, old in enumerate(planes):
        scale = float(np.linalg.norm(old.normal))
        if float(np.abs(new.normal / norm - old.normal / scale).max()) <= SAME:
            tighter = new.offset / norm < old.offset / scale - tolerance
            return [*planes[:index], new, *planes[index + 1 :]] if tighter else planes
    return [*planes, new]
