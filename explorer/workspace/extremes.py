"""The extent of a workspace, and the least margins within it.

Margins are linear in the position, so both are extremes of linear functions over a solid. The
best vertex of its mesh is the start of a descent on the exact limits, which ends on the true
surface.
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
KEPT = 1e-9
# Error of a vertex, over the mesh's tolerance, where surfaces meet at a small angle.
OFF = 4.0


def farthest(
    design: Design, rotation: ArrayLike, solid: Solid, directions: ArrayLike
) -> FloatArray:
    """Return the largest direction · p over a workspace, shape (k,), in design units.

    It is exact where the descent ends within a few tolerances of the mesh, as it does unless
    surfaces touch; otherwise it is the value of the mesh.

    Args:
        design: The manipulator.
        rotation: Rotation from platform to base, shape (3, 3).
        solid: Workspace at this orientation; not empty.
        directions: Directions, shape (k, 3), none of them zero.

    Raises:
        InputError: not a rotation, or directions that are not finite.
    """
    limits = constraints(design, checked_rotation(rotation))
    rows = finite_array("directions", directions, (3,)).reshape(-1, 3)
    lengths = np.linalg.norm(rows, axis=1)
    units = rows / lengths[:, None]
    return lengths * np.array([_farthest(design, limits, solid, unit) for unit in units])


def extent_of(design: Design, rotation: ArrayLike, solid: Solid) -> tuple[FloatArray, FloatArray]:
    """Return (lows, highs) of a workspace on the three axes, each (3,), in design units.

    Args:
        design: The manipulator.
        rotation: Rotation from platform to base, shape (3, 3).
        solid: Workspace at this orientation; not empty.

    Raises:
        InputError: not a rotation.
    """
    ends = farthest(design, rotation, solid, np.concatenate([-np.eye(3), np.eye(3)]))
    return -ends[:3], ends[3:]


def least_margins(design: Design, rotation: ArrayLike, solid: Solid) -> FloatArray:
    """Return the least |δ1|, |δ2| and |δ3| over a workspace, shape (3,), in design units.

    Args:
        design: The manipulator.
        rotation: Rotation from platform to base, shape (3, 3).
        solid: Workspace at this orientation; not empty.

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
        # The parts on either side of the plane are taken one by one.
        nearest = [
            -float(farthest(design, rotation, _part(solid, off >= 0.0), [-side * normal])[0])
            for side in (-1.0, 1.0)
            for off in [side * values]
            if (off > 0.0).any()
        ]
        least[index] = max(0.0, min(nearest, default=0.0))
    least[least <= KEPT * design.reach] = 0.0
    return least


def _part(solid: Solid, kept: BoolArray) -> Solid:
    """Return a solid with some of the vertices and no faces, enough for `farthest`."""
    return Solid(
        solid.vertices[kept],
        np.zeros((0, 3), dtype=np.int32),
        np.zeros(0, dtype=np.int64),
        solid.limits,
        solid.tolerance,
    )


def _farthest(
    design: Design, limits: tuple[Constraint, ...], solid: Solid, unit: FloatArray
) -> float:
    reach = design.reach
    along = solid.vertices @ unit
    corner = int(along.argmax())
    start, end = solid.vertices[corner], float(along[corner])
    off = OFF * solid.tolerance
    near = tuple(limit for limit in limits if float(limit.distance(start)) <= off)

    def away(p: FloatArray) -> tuple[float, FloatArray]:
        return -float(p @ unit), -unit

    # The limits at the vertex bound the solid there, unless a surface is so curved that others do.
    for bounding in (near, limits):

        def kept(p: FloatArray, bounding: tuple[Constraint, ...] = bounding) -> FloatArray:
            return _shares(bounding, p * reach, reach)

        at = descend(away, kept, start / reach) if bounding else None
        if at is None:
            continue
        found = float(at @ unit) * reach
        within = float(_shares(limits, at * reach, reach).min()) >= -KEPT
        if within and abs(found - end) <= off + KEPT * reach:
            return found
    return end


def _shares(limits: tuple[Constraint, ...], p: FloatArray, reach: float) -> FloatArray:
    """Return the slacks at a position as shares of the reach, those of cones in radians."""
    units = np.array([1.0 if isinstance(limit, Cone) else reach for limit in limits])
    return slacks(limits, p) / units
