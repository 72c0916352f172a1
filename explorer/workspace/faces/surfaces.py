"""The surfaces of limits, as functions of points that belong to several of them at once."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from explorer.numerics.arrays import FloatArray, IntArray, dot
from explorer.workspace.limits.constraints import BallOrCylinder, Cone, HalfSpace

# Most Newton steps onto surfaces; points start within a chord of them.
STEPS = 4
# Share of steps that keeps them finite where surfaces touch.
RIDGE = 1e-9
# Least length that is divided by.
TINY = 1e-300

Smooth = BallOrCylinder | HalfSpace | Cone


class Surfaces:
    """The surfaces of limits: level = steepness |s (p − origin)| + axis · s (p − origin).

    The scale s of the axes is (0, 1, 1) for cylinders and wedges, otherwise 1.
    """

    def __init__(self, limits: Sequence[Smooth]) -> None:
        self._limits = limits
        # Origin, scale, axis, steepness and level of each.
        self._rows = np.array([_row_of(limit) for limit in limits]).reshape(-1, 11)

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
        limit = self._limits[index]
        slack = limit.slack(points)
        is_distance = isinstance(limit, BallOrCylinder)
        return slack if is_distance else np.copysign(limit.distance(points), slack)

    def settle(
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


def _row_of(limit: Smooth) -> list[float]:
    match limit:
        case HalfSpace():
            length = float(np.linalg.norm(limit.normal))
            return [*np.zeros(3), *np.ones(3), *limit.normal / length, 0.0, limit.offset / length]
        case BallOrCylinder():
            side, along = 1.0 if limit.inside else -1.0, 1.0 if limit.is_ball else 0.0
            # Points of a cylinder's axis differ along x alone.
            origin = limit.centre * [along, 1.0, 1.0]
            return [*origin, along, 1.0, 1.0, *np.zeros(3), side, side * limit.radius]
        case Cone():
            along = 0.0 if limit.flat else 1.0
            origin = limit.apex * [along, 1.0, 1.0]
            return [*origin, along, 1.0, 1.0, *-limit.axis, math.cos(limit.half_angle), 0.0]
