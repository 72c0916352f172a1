"""The extent of a workspace, and the least margins within it.

Margins are linear in the position, so both are extremes of linear functions over a solid. A
descent on the exact limits starts at the best vertex of its mesh and ends on the true surface.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from explorer.mechanism.design import Design
from explorer.mechanism.pose import checked_rotation
from explorer.numerics.arrays import BoolArray, FloatArray, finite_array
from explorer.numerics.descent import descend
from explorer.singularity.ellipsoids import planes_of_singularity
from explorer.workspace.limits.constraints import Cone, Constraint, constraints, slacks
from explorer.workspace.solids.solid import Solid

# Tolerance of a limit, over the reach.
LIMIT_TOLERANCE = 1e-9
# Error of a vertex, over the mesh's tolerance, where surfaces meet at a small angle.
VERTEX_ERROR = 4.0


def farthest(
    design: Design, rotation: ArrayLike, solid: Solid, directions: ArrayLike
) -> FloatArray:
    """Return the largest direction · p over a workspace that is not empty, in design units.

    It is exact where the descent ends within a few tolerances of the mesh, as it does unless
    surfaces touch; otherwise it is the value of the mesh. Directions have the shape (k, 3), none
    of them zero; results have the shape (k,).

    Raises:
        InputError: not a rotation, or directions that are not finite.
    """
    limits = constraints(design, checked_rotation(rotation))
    rows = finite_array("directions", directions, (3,)).reshape(-1, 3)
    lengths = np.linalg.norm(rows, axis=1)
    units = rows / lengths[:, None]
    return lengths * np.array([_farthest(design, limits, solid, unit) for unit in units])


def extent_of(design: Design, rotation: ArrayLike, solid: Solid) -> tuple[FloatArray, FloatArray]:
    """Return (lows, highs) of a workspace that is not empty, each (3,), in design units.

    Raises:
        InputError: not a rotation.
    """
    ends = farthest(design, rotation, solid, np.concatenate([-np.eye(3), np.eye(3)]))
    return -ends[:3], ends[3:]


def least_margins(design: Design, rotation: ArrayLike, solid: Solid) -> FloatArray:
    """Return the least |δ1|, |δ2| and |δ3| over a workspace that is not empty, in design units.

    Raises:
        InputError: not a rotation.
    """
    least = np.zeros(3)
    for index, normal in enumerate(planes_of_singularity(rotation)):
        values = solid.vertices @ normal
        if not normal.any():
            continue
        corners = values[solid.faces]
        if ((corners > 0.0).any(axis=1) & (corners < 0.0).any(axis=1)).any():
            # The singular plane cuts the workspace.
            continue
        # The parts of the workspace on either side of the plane are measured one by one.
        nearest = [
            -float(farthest(design, rotation, _part(solid, distances >= 0.0), [-side * normal])[0])
            for side in (-1.0, 1.0)
            for distances in [side * values]
            if (distances > 0.0).any()
        ]
        least[index] = max(0.0, min(nearest, default=0.0))
    least[least <= LIMIT_TOLERANCE * design.reach] = 0.0
    return least


def _part(solid: Solid, chosen: BoolArray) -> Solid:
    """Return a solid with some of the vertices and no faces, enough for `farthest`."""
    faces, limit_of_face = np.zeros((0, 3), dtype=np.int32), np.zeros(0, dtype=np.int64)
    return Solid(solid.vertices[chosen], faces, limit_of_face, solid.limits, solid.tolerance)


def _farthest(
    design: Design, limits: tuple[Constraint, ...], solid: Solid, unit: FloatArray
) -> float:
    reach = design.reach
    along = solid.vertices @ unit
    corner = int(along.argmax())
    start, end = solid.vertices[corner], float(along[corner])
    error = VERTEX_ERROR * solid.tolerance
    near = tuple(limit for limit in limits if float(limit.distance(start)) <= error)

    def objective(p: FloatArray) -> tuple[float, FloatArray]:
        return -float(p @ unit), -unit

    # The limits near the vertex bound the solid there, unless a surface is strongly curved.
    for bounding in (near, limits):

        def limit_shares(p: FloatArray, bounding: tuple[Constraint, ...] = bounding) -> FloatArray:
            return _shares(bounding, p * reach, reach)

        optimum = descend(objective, limit_shares, start / reach) if bounding else None
        if optimum is None:
            continue
        value = float(optimum @ unit) * reach
        within = float(_shares(limits, optimum * reach, reach).min()) >= -LIMIT_TOLERANCE
        if within and abs(value - end) <= error + LIMIT_TOLERANCE * reach:
            return value
    return end


def _shares(limits: tuple[Constraint, ...], p: FloatArray, reach: float) -> FloatArray:
    """Return the slacks at a position as shares of the reach, those of cones in radians."""
    units = np.array([1.0 if isinstance(limit, Cone) else reach for limit in limits])
    return slacks(limits, p) / units
