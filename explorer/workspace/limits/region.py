"""Regions: intersections of limits as rows of numbers, their nodes, and boxes around them.

A circle is a row (x, y, z, radius, is_ball, side): a sphere about (x, y, z), or a cylinder along
the x-axis through that point. Their slices at constant x are circles. The region lies inside the
surface (side +1) or outside it (side -1). A plane is a row (x, y, z, offset): the half-space
n·p <= offset with the normal n = (x, y, z). A cone is a row of its apex, its unit axis, the cosine
of its half-angle, and whether it is flat: only the yz-part of a position counts for a flat one.

Two limits may have the same surface (the box may start where δ3 is zero); only the tighter of
them has a row. Planes perpendicular to x become ends of the x-range.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from explorer.numerics.arrays import BoolArray, FloatArray
from explorer.numerics.compiled import helper, kernel
from explorer.workspace.limits.constraints import BallOrCylinder, Cone, Constraint, HalfSpace, Never

# Columns of the rows.
X, Y, Z = 0, 1, 2
RADIUS, IS_BALL, SIDE = 3, 4, 5
OFFSET, PLANE_COLUMNS = 3, 4
AXIS_X, AXIS_Y, AXIS_Z, COSINE, IS_FLAT, CONE_COLUMNS = 3, 4, 5, 6, 7, 8
# Surfaces that differ by less than this share of the region's size are the same.
SAME = 1e-12
# Approximate number of cells in each round of contracting a box, most rounds, and the share of the
# box's volume of which a round that leaves more is the last.
CELLS, MOST_ROUNDS, WORTH_WHILE = 4096, 60, 0.8


@dataclass(frozen=True)
class Region:
    """An intersection of limits.

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
    def ends(self) -> tuple[FloatArray, FloatArray]:
        """(lows, highs) of a box that holds the region, (3,) each; lows may exceed highs."""
        lows = np.array([self.low, -math.inf, -math.inf])
        highs = np.array([self.high, math.inf, math.inf])
        for limit in self.circle_limits:
            if limit.inside:
                start = 0 if limit.is_ball else 1
                lows[start:] = np.maximum(lows[start:], limit.centre[start:] - limit.radius)
                highs[start:] = np.minimum(highs[start:], limit.centre[start:] + limit.radius)
        for row in self.planes:
            for axis, other in ((Y, Z), (Z, Y)):
                if row[X] == row[other] == 0.0:
                    tighten, ends = (np.minimum, highs) if row[axis] > 0.0 else (np.maximum, lows)
                    ends[axis] = tighten(ends[axis], row[OFFSET] / row[axis])
        return lows, highs

    @property
    def box(self) -> tuple[FloatArray, FloatArray] | None:
        """`ends`; None if they or a single surface already show that there is no volume."""
        lows, highs = self.ends
        return None if self.is_flat or not (lows < highs).all() else (lows, highs)


def region_of(limits: Sequence[Constraint]) -> Region:
    """Return the region that satisfies all limits; at least one must be the inside of a ball."""
    balls = [c for c in limits if isinstance(c, BallOrCylinder)]
    tolerance = SAME * max(ball.radius + float(np.abs(ball.centre).max()) for ball in balls)
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
    cones = [
        [*c.apex, *c.axis, math.cos(c.half_angle), c.flat] for c in limits if isinstance(c, Cone)
    ]
    return Region(
        circles=np.array([[*c.centre, c.radius, c.is_ball, 2.0 * c.inside - 1.0] for c in circles]),
        planes=np.array([[*c.normal, c.offset] for c in planes]).reshape(-1, PLANE_COLUMNS),
        cones=np.array(cones, dtype=np.float64).reshape(-1, CONE_COLUMNS),
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
        sides = {
            other.inside
            for other in distinct
            if other.is_ball == limit.is_ball
            and abs(other.radius - limit.radius) <= tolerance
            and np.abs(other.centre - limit.centre)[0 if limit.is_ball else 1 :].max() <= tolerance
        }
        is_flat = is_flat or (not limit.inside) in sides
        if limit.inside not in sides:
            distinct.append(limit)
    return distinct, is_flat


def _add_plane(planes: list[HalfSpace], new: HalfSpace, tolerance: float) -> list[HalfSpace]:
    """Return the planes and a new one; of two parallel planes only the tighter."""
    norm = float(np.linalg.norm(new.normal))
    for index, old in enumerate(planes):
        scale = float(np.linalg.norm(old.normal))
        if float(np.abs(new.normal / norm - old.normal / scale).max()) <= SAME:
            tighter = new.offset / norm < old.offset / scale - tolerance
            return [*planes[:index], new, *planes[index + 1 :]] if tighter else planes
    return [*planes, new]


def contract_box(
    limits: Sequence[Constraint], lows: FloatArray, highs: FloatArray
) -> tuple[FloatArray, FloatArray] | None:
    """Return (lows, highs) of a smaller box that holds all positions within the limits, (3,) each.

    The slack of a limit anywhere in a cell of the box exceeds that at its middle by half its
    diagonal at most, so that cells are discarded with certainty. Cones are ignored. None if no
    position of the box is within the limits.
    """
    for _ in range(MOST_ROUNDS):
        size, volume = float((highs - lows).max()), float(np.prod(highs - lows))
        edge = max(volume / CELLS, (size / CELLS) ** 3) ** (1.0 / 3.0)
        counts = np.maximum(1, np.ceil((highs - lows) / edge)).astype(np.int64)
        step = (highs - lows) / counts
        cells = np.indices(tuple(counts.tolist())).reshape(3, -1).T
        middles, half = lows + (cells + 0.5) * step, 0.5 * float(np.linalg.norm(step))
        # Rounding must not discard a cell of which only a corner satisfies the limits.
        half += 1e-12 * (size + float(np.abs([lows, highs]).max()))
        for limit in limits:
            if not isinstance(limit, Cone):
                satisfiable = limit.signed_distance(middles) >= -half
                cells, middles = cells[satisfiable], middles[satisfiable]
        if not len(cells):
            return None
        highs = lows + (cells.max(axis=0) + 1) * step
        lows = lows + cells.min(axis=0) * step
        if float(np.prod(highs - lows)) > WORTH_WHILE * volume:
            break
    return lows, highs


@helper
def is_within(
    x: float,
    y: float,
    z: float,
    circles: FloatArray,
    planes: FloatArray,
    cones: FloatArray,
    slack: float,
) -> bool:
    """Return whether a position satisfies all limits, to within a slack in design units."""
    for k in range(circles.shape[0]):
        dy, dz = y - circles[k, Y], z - circles[k, Z]
        square = dy * dy + dz * dz
        if circles[k, IS_BALL] > 0.0:
            dx = x - circles[k, X]
            square += dx * dx
        edge = circles[k, RADIUS] + (slack if circles[k, SIDE] > 0.0 else -slack)
        if edge > 0.0 and (square - edge * edge) * circles[k, SIDE] > 0.0:
            return False
        if edge <= 0.0 and circles[k, SIDE] > 0.0:
            return False
    for k in range(planes.shape[0]):
        if planes[k, X] * x + planes[k, Y] * y + planes[k, Z] * z > planes[k, OFFSET] + slack:
            return False
    for k in range(cones.shape[0]):
        dx = 0.0 if cones[k, IS_FLAT] > 0.0 else x - cones[k, X]
        dy, dz = y - cones[k, Y], z - cones[k, Z]
        along = dx * cones[k, AXIS_X] + dy * cones[k, AXIS_Y] + dz * cones[k, AXIS_Z]
        if along < cones[k, COSINE] * math.sqrt(dx * dx + dy * dy + dz * dz) - slack:
            return False
    return True


@kernel("void(f8[:,::1], f8[:,::1], f8[:,::1], f8[::1], f8[::1], f8, b1[:,:,::1])")
def mark_nodes(
    circles: FloatArray,
    planes: FloatArray,
    cones: FloatArray,
    first: FloatArray,
    step: FloatArray,
    slack: float,
    within: BoolArray,
) -> None:
    """Write whether nodes satisfy all limits, to within a slack in design units, (nx, ny, nz).

    The first node and the step on each axis have the shape (3,).
    """
    for i in range(within.shape[0]):
        x = first[0] + i * step[0]
        for j in range(within.shape[1]):
            y = first[1] + j * step[1]
            for k in range(within.shape[2]):
                z = first[2] + k * step[2]
                within[i, j, k] = is_within(x, y, z, circles, planes, cones, slack)
