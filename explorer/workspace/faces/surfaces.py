"""The surfaces of limits, as functions of points that belong to several of them at once."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from explorer.numerics.arrays import FloatArray, IntArray, dot
from explorer.workspace.limits.constraints import BallOrCylinder, Cone, HalfSpace

# Most Newton steps onto surfaces; points start within a chord of them.
STEPS = 4
# Share of steps that keeps them finite where surfaces touch.
RIDGE = 1e-9

Smooth = BallOrCylinder | HalfSpace | Cone


class Surfaces:
    """The surfaces of limits, in arrays with one row for each.

    Args:
        limits: The limits.
    """

    def __init__(self, limits: Sequence[Smooth]) -> None:
        count = len(limits)
        self._limits = limits
        self._kind = np.zeros(count, dtype=np.int64)
        # Centre, apex, or nothing; normal or axis; radius, offset or half-angle; the side.
        self._origin, self._normal = np.zeros((count, 3)), np.zeros((count, 3))
        self._size, self._side = np.zeros(count), np.ones(count)
        self._axes = np.ones((count, 3))
        for k, limit in enumerate(limits):
            if isinstance(limit, HalfSpace):
                length = float(np.linalg.norm(limit.normal))
                self._normal[k], self._size[k] = limit.normal / length, limit.offset / length
            elif isinstance(limit, BallOrCylinder):
                self._kind[k] = 1
                self._origin[k], self._size[k] = limit.centre, limit.radius
                self._side[k] = 1.0 if limit.inside else -1.0
                self._axes[k, 0] = 1.0 if limit.is_ball else 0.0
            else:
                self._kind[k] = 2
                self._origin[k], self._normal[k] = limit.apex, limit.axis
                self._size[k] = limit.half_angle
                self._axes[k, 0] = 0.0 if limit.flat else 1.0
        self._has_cones = bool((self._kind == 2).any())

    def is_repeated(self, index: int) -> bool:
        """Return whether an earlier limit is the same."""
        rows = np.column_stack(
            [self._kind, self._origin * self._axes, self._normal, self._size, self._side]
        )
        return bool((rows[:index] == rows[index]).all(axis=1).any())

    def distances(self, points: FloatArray, which: IntArray) -> tuple[FloatArray, FloatArray]:
        """Return signed distances (n,) of points (n, 3), positive inside, and their gradients.

        The gradients (n, 3) are unit normals that point inwards. Distances from cones are exact
        on the cone and right to first order near it.

        Args:
            points: Points, shape (n, 3).
            which: Index of the limit of each point, shape (n,).
        """
        kind, normal, size = self._kind[which], self._normal[which], self._size[which]
        off = (points - self._origin[which]) * self._axes[which]
        length = np.maximum(np.sqrt(dot(off, off)), 1e-300)
        along = dot(off, normal)
        is_plane, side = kind == 0, self._side[which]
        distance = np.where(is_plane, size - along, side * (size - length))
        outward = np.where(is_plane[:, None], normal, (side / length)[:, None] * off)
        if self._has_cones:
            cones = np.flatnonzero(kind == 2)
            unit = off[cones] / length[cones, None]
            axis = normal[cones] * self._axes[which][cones]
            # The part of the axis across the leg points to smaller angles.
            across = axis - dot(axis, unit)[:, None] * unit
            sine = np.maximum(np.sqrt(dot(across, across)), 1e-300)
            full = np.sqrt(np.maximum(1.0 - dot(normal[cones], unit) ** 2, 0.0))
            angle = np.arctan2(full, dot(normal[cones], unit))
            # A wedge's angle changes slower than the turn about its edge if its axis is tilted.
            rate = np.maximum(sine / np.maximum(full, 1e-300), 1e-12)
            distance[cones] = (size[cones] - angle) * length[cones] / rate
            outward[cones] = -across / sine[:, None]
        return distance, -outward

    def distances_from(self, points: FloatArray, index: int) -> FloatArray:
        """Return signed distances (n,) of points (n, 3) from one surface, see `distances`."""
        limit = self._limits[index]
        slack = limit.slack(points)
        if isinstance(limit, BallOrCylinder):
            return slack
        if isinstance(limit, HalfSpace):
            return slack / float(np.linalg.norm(limit.normal))
        return np.copysign(limit.distance(points), slack)

    def settle(
        self, points: FloatArray, which: IntArray, error: float
    ) -> tuple[FloatArray, FloatArray]:
        """Return points (n, 3) on several surfaces at once, and their distances from these, (n,).

        They are found by Newton's method, whose steps are as short as possible.

        Args:
            points: Points near their surfaces, shape (n, 3).
            which: Indices of the limits on whose surfaces each point is to lie, -1 for none,
                shape (n, k).
            error: Largest distance to aim at.
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
