"""The constant-orientation workspace as rows of numbers, ready for the kernels.

The same surface may be named twice (the box may start where κ3 is zero): of each only the
tighter limit is kept. Planes perpendicular to x become ends of the x-range.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from explorer.numerics.arrays import FloatArray
from explorer.workspace.limits.constraints import Cone, Constraint, HalfSpace, Never, Round

# Surfaces that differ by less than this share of the region's size are one.
SAME = 1e-12


@dataclass(frozen=True)
class Region:
    """An intersection of limits.

    Attributes:
        rounds: Balls and cylinders, as rows (x, y, z, radius, is_ball, side), shape (n, 6).
        planes: Half-spaces not perpendicular to x, as rows (normal, offset), shape (m, 4).
        cones: As rows (apex, axis, cosine of the half-angle, flat), shape (k, 8).
        low, high: The range of x; no position if low exceeds high.
        of_rounds, of_planes: The limits that the rows stand for.
        of_low, of_high: The limits that are the ends, None where a ball ends the region.
        is_flat: Whether one surface is to be kept both inside and outside, so that the region
            has no volume, although positions on the surface keep all limits.
    """

    rounds: FloatArray
    planes: FloatArray
    cones: FloatArray
    low: float
    high: float
    of_rounds: tuple[Round, ...]
    of_planes: tuple[HalfSpace, ...]
    of_low: HalfSpace | None
    of_high: HalfSpace | None
    is_flat: bool

    @property
    def is_empty(self) -> bool:
        """Whether it is known to have no volume without looking closer."""
        return self.is_flat or not self.low < self.high


def region_of(limits: Sequence[Constraint]) -> Region:
    """Return the region that keeps all limits; one ball with an inside must be among them."""
    balls = [c for c in limits if isinstance(c, Round)]
    size = max(ball.radius + float(np.abs(ball.centre).max()) for ball in balls)
    same = SAME * max(size, 1e-300)
    rounds, is_flat = _distinct(balls, same)
    low, high = -math.inf, math.inf
    of_low: HalfSpace | None = None
    of_high: HalfSpace | None = None
    for each in rounds:
        if each.is_ball and each.inside:
            low = max(low, float(each.centre[0]) - each.radius)
            high = min(high, float(each.centre[0]) + each.radius)
    planes: list[HalfSpace] = []
    for each in limits:
        if not isinstance(each, HalfSpace):
            continue
        across = math.hypot(each.normal[1], each.normal[2])
        if across > SAME * abs(float(each.normal[0])):
            planes = _with_plane(planes, each, same)
            continue
        end = each.offset / float(each.normal[0])
        if each.normal[0] > 0.0 and end < high:
            high, of_high = end, each
        elif each.normal[0] < 0.0 and end > low:
            low, of_low = end, each
    if any(isinstance(each, Never) for each in limits):
        high = -math.inf
    return Region(
        rounds=np.array(
            [[*c.centre, c.radius, float(c.is_ball), 1.0 if c.inside else -1.0] for c in rounds]
        ),
        planes=np.array([[*c.normal, c.offset] for c in planes]).reshape(-1, 4),
        cones=np.array(
            [
                [*c.apex, *c.axis, math.cos(c.half_angle), float(c.flat)]
                for c in limits
                if isinstance(c, Cone)
            ]
        ).reshape(-1, 8),
        low=low,
        high=high,
        of_rounds=tuple(rounds),
        of_planes=tuple(planes),
        of_low=of_low,
        of_high=of_high,
        is_flat=is_flat,
    )


def _distinct(balls: list[Round], same: float) -> tuple[list[Round], bool]:
    """Return the surfaces once for each side, and whether one is to be kept on both sides."""
    kept: list[Round] = []
    is_flat = False
    for each in balls:
        twins = [other for other in kept if _is_same(each, other, same)]
        is_flat = is_flat or any(twin.inside != each.inside for twin in twins)
        if all(twin.inside != each.inside for twin in twins):
            kept.append(each)
    return kept, is_flat


def _is_same(a: Round, b: Round, same: float) -> bool:
    off = np.abs(a.centre - b.centre)[0 if a.is_ball else 1 :]
    return a.is_ball == b.is_ball and float(off.max()) <= same and abs(a.radius - b.radius) <= same


def _with_plane(planes: list[HalfSpace], new: HalfSpace, same: float) -> list[HalfSpace]:
    """Return the planes with another, of which only the tighter counts if it is parallel."""
    norm = float(np.linalg.norm(new.normal))
    for index, old in enumerate(planes):
        scale = float(np.linalg.norm(old.normal))
        if float(np.abs(new.normal / norm - old.normal / scale).max()) <= SAME:
            tighter = new.offset / norm < old.offset / scale - same
            return [*planes[:index], new, *planes[index + 1 :]] if tighter else planes
    return [*planes, new]
