"""The surfaces of limits: functions of points on several of them at once, and triangles on them."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from explorer.numerics.arrays import FloatArray, IntArray, dot
from explorer.workspace.limits.constraints import BallOrCylinder, Cone, HalfSpace, surface_of
from explorer.workspace.solids import facets
from explorer.workspace.solids.facets import Box, Facets

# Largest angle between the normals at two ends of an edge, in radians.
WIDEST = 0.06
# Most distance of a face from the true surface, and longest edge, as shares of the box's size.
CHORD, LONGEST = 1.0 / 4000.0, 1.0 / 40.0
# Directions around a cone at the least, and rows along it at the most.
FEWEST, MOST_ROWS = 24, 48
# Largest angle in radians at which a box is seen as a small one.
NARROW = 0.25
NONE: Facets = np.zeros((0, 3)), np.zeros((0, 3), dtype=np.int64)
# Most Newton steps onto surfaces; points start within a chord of them.
STEPS = 4
# Share of steps that keeps them finite where surfaces touch.
RIDGE = 1e-9
# Least length that is divided by.
TINY = 1e-300

Smooth = BallOrCylinder | HalfSpace | Cone


class Surfaces:
    """The surfaces of limits, see `surface_of`."""

    def __init__(self, limits: Sequence[Smooth]) -> None:
        self._limits = limits
        # Origin, scale, axis, steepness and level of each.
        self._rows = np.array([np.hstack(surface_of(limit)) for limit in limits]).reshape(-1, 11)

    def is_repeated(self, index: int) -> bool:
        """Return whether an earlier limit is the same."""
        return bool((self._rows[:index] == self._rows[index]).all(axis=1).any())

    def distances(self, points: FloatArray, which: IntArray) -> tuple[FloatArray, FloatArray]:
        """Return signed distances (n,) of points (n, 3), positive inside, and their gradients.

        The gradients (n, 3) are unit normals that point inwards. Distances from cones are exact
        on the cone and right to first order near it. The limits of the points are given by their
        indices, shape (n,).
        """
        rows = self._rows[which]
        scale, axis, steepness, level = rows[:, 3:6], rows[:, 6:9], rows[:, 9], rows[:, 10]
        off = (points - rows[:, :3]) * scale
        length = np.maximum(np.sqrt(dot(off, off)), TINY)
        gradient = -(steepness / length)[:, None] * off - axis * scale
        size = np.maximum(np.sqrt(dot(gradient, gradient)), TINY)
        return (level - steepness * length - dot(axis, off)) / size, gradient / size[:, None]

    def distances_from(self, points: FloatArray, index: int) -> FloatArray:
        """Return signed distances (n,) of points (n, 3) from one surface, see `distances`."""
        return self._limits[index].signed_distance(points)

    def project(
        self, points: FloatArray, which: IntArray, error: float
    ) -> tuple[FloatArray, FloatArray]:
        """Return points (n, 3) on several surfaces at once, and their distances from these, (n,).

        They are found by Newton's method, whose steps are as short as possible, up to an error. The
        limits of each point are given by their indices, -1 for none, shape (n, k).
        """
        count, number = which.shape
        flat, none = np.maximum(which, 0).ravel(), which < 0
        ones = np.eye(number) * (none[:, :, None] + RIDGE)
        off = np.zeros(count)
        for step in range(STEPS + 1):
            distance, normal = self.distances(np.repeat(points, number, axis=0), flat)
            distance, normal = distance.reshape(count, number), normal.reshape(count, number, 3)
            distance[none], normal[none] = 0.0, 0.0
            off = np.abs(distance).max(axis=1)
            if step == STEPS or not count or float(off.max()) <= error:
                break
            shares = distance
            if number > 1:
                gram = normal @ np.swapaxes(normal, -1, -2) + ones
                shares = np.linalg.solve(gram, distance[..., None])[..., 0]
            points = points - (shares[:, None, :] @ normal)[:, 0]
        return points, off


def pattern(limit: BallOrCylinder | HalfSpace | Cone, box: Box) -> Facets:
    """Return triangles that cover the surface of a limit within a box, and more.

    They have no certain orientation.
    """
    if isinstance(limit, HalfSpace):
        return _plane(limit.normal / np.linalg.norm(limit.normal), limit, box)
    if isinstance(limit, Cone):
        return _wedge(limit, box) if limit.flat else _cone(limit, box)
    start = 0 if limit.is_ball else 1
    centre = limit.centre[start:]
    nearest, farthest = box.distances(centre)
    if not nearest <= limit.radius <= farthest:
        return NONE
    edge = _edge(limit.radius, box)
    towards, angle = _part_near(centre, limit.radius, box)
    if limit.is_ball:
        points, faces = facets.sphere_part(angle, edge / limit.radius)
        return limit.centre + limit.radius * (points @ facets.frame_about(towards)), faces
    count = max(3, math.ceil(2.0 * angle * limit.radius / edge))
    turns = math.atan2(towards[1], towards[0]) + np.linspace(-angle, angle, count + 1)
    rows = _rows(box.lows[0], box.highs[0], edge)
    y, z = (centre + limit.radius * np.column_stack([np.cos(turns), np.sin(turns)])).T[..., None]
    return _join(rows, y, z), _grid_faces(len(turns), len(rows))


def _part_near(centre: FloatArray, radius: float, box: Box) -> tuple[FloatArray, float]:
    """Return the unit direction from a centre to a box, and the angle about it that holds the box.

    The base that closes the part of a solid passes below a box, which takes an angle as large as
    the square root of the box's size. A surface needs no base, so that around a small box the
    angle at which the box is seen will do.
    """
    to_middle = box.middle[3 - len(centre) :] - centre
    seen = _seen(float(np.linalg.norm(to_middle)), box)
    if seen > NARROW:
        return facets.facing_part(centre, radius, box, 0.0)
    return to_middle / np.linalg.norm(to_middle), seen


def _seen(distance: float, box: Box) -> float:
    """Return the half-angle at which a box is seen, and a little more; π from inside."""
    half = (0.5 + facets.BEYOND) * box.size
    return math.asin(half / distance) if half < distance else math.pi


def _edge(radius: float, box: Box) -> float:
    """Return the length of edges on a surface with a radius."""
    chord = math.sqrt(8.0 * radius * CHORD * box.size)
    return min(WIDEST * radius, chord, LONGEST * box.size)


def _rows(low: float, high: float, edge: float) -> FloatArray:
    """Return evenly spaced numbers between two, and a little beyond."""
    more = 1e-3 * (high - low)
    count = max(2, math.ceil((high - low) / edge) + 1)
    return np.linspace(low - more, high + more, count)


def _join(*coordinates: FloatArray | float) -> FloatArray:
    """Return points (n, 3) with coordinates that are broadcast."""
    return np.stack(np.broadcast_arrays(*coordinates), axis=-1).reshape(-1, 3)


def _grid_faces(rows: int, columns: int) -> IntArray:
    """Return the faces of a grid of points, in the order of `reshape`."""
    first: IntArray = (np.arange(rows - 1)[:, None] * columns + np.arange(columns - 1)).ravel()
    cell = first[:, None] + np.array([0, 1, columns + 1, columns])
    return np.concatenate([cell[:, :3], cell[:, [0, 2, 3]]])


def _plane(normal: FloatArray, limit: HalfSpace, box: Box) -> Facets:
    offset = limit.offset / float(np.linalg.norm(limit.normal))
    along = box.corners @ normal
    if not along.min() <= offset <= along.max():
        return NONE
    frame = facets.frame_about(normal)
    flat = box.corners @ frame[:2].T
    edge = LONGEST * box.size
    u, v = (_rows(flat[:, k].min(), flat[:, k].max(), edge) for k in (0, 1))
    return _join(u[:, None], v, offset) @ frame, _grid_faces(len(u), len(v))


def _cone(limit: Cone, box: Box) -> Facets:
    near, far = box.distances(limit.apex)
    radius = far * math.sin(limit.half_angle)
    edge = _edge(radius, box)
    frame = facets.frame_about(limit.axis)
    across = frame[:2] @ (box.middle - limit.apex)
    seen = _seen(float(np.linalg.norm(across)), box)
    count = max(FEWEST, math.ceil(2.0 * seen * radius / edge))
    turns = math.atan2(across[1], across[0]) + np.linspace(-seen, seen, count + 1)
    spacing = max(edge, (far - near) / (MOST_ROWS - 1))
    rows = np.maximum(_rows(near, far, spacing), 0.0)
    sine, cosine = math.sin(limit.half_angle), math.cos(limit.half_angle)
    rim = [sine * np.cos(turns), sine * np.sin(turns), np.full(count + 1, cosine)]
    points = limit.apex + rows[:, None, None] * (np.column_stack(rim) @ frame)
    faces = _grid_faces(len(rows), count + 1)
    if seen < math.pi:
        return points.reshape(-1, 3), faces
    # The last direction is the first.
    row, column = faces // (count + 1), faces % (count + 1) % count
    return points.reshape(-1, 3), row * (count + 1) + column


def _wedge(limit: Cone, box: Box) -> Facets:
    """Return the two half-planes of the legs that slide along x."""
    across = float(np.linalg.norm(limit.axis[1:]))
    if across <= abs(math.cos(limit.half_angle)):
        return NONE
    apex = limit.apex[1:]
    near, far = box.distances(apex)
    turn = math.acos(math.cos(limit.half_angle) / across)
    middle = math.atan2(limit.axis[2], limit.axis[1])
    edge = LONGEST * box.size
    x, rows = _rows(box.lows[0], box.highs[0], edge), _rows(near, far, edge)
    at, along = np.array([middle - turn, middle + turn])[:, None, None], np.maximum(rows, 0.0)
    points = _join(x[:, None], apex[0] + along * np.cos(at), apex[1] + along * np.sin(at))
    faces = _grid_faces(len(x), len(rows))
    return points, np.concatenate([faces, faces + len(x) * len(rows)])
