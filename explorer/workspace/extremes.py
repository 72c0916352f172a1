"""The extent of a workspace, and the least margins within it.

Margins are linear in the position, so both are extremes of linear functions over a region that
spheres, cylinders along x, cones and planes bound. An extreme lies where the gradient is normal to
one surface, or to the curve in which two surfaces meet, or else where three surfaces meet. All
such points are computed, and those within the limits are compared; nothing is searched for.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from explorer.mechanism.design import TOLERANCE, Design
from explorer.mechanism.pose import checked_rotation
from explorer.numerics.arrays import BoolArray, FloatArray
from explorer.singularity.ellipsoids import planes_of_singularity
from explorer.workspace.common_points import Surfaces
from explorer.workspace.limits.constraints import BallOrCylinder, Cone, HalfSpace, constraints
from explorer.workspace.limits.region import box_of

# Largest violation of a limit by a point before its rounding errors are removed, as a share of the
# size of the region.
NEAR = 1e-3


def extent_of(design: Design, rotation: ArrayLike) -> tuple[FloatArray, FloatArray] | None:
    """Return (lows, highs) of a workspace, each (3,), in design units; None if it has no volume.

    Raises:
        InputError: not a rotation.
    """
    points = extreme_positions(design, checked_rotation(rotation), np.zeros((0, 3)))
    return (points.min(axis=0), points.max(axis=0)) if len(points) else None


def least_margins(design: Design, rotation: ArrayLike) -> FloatArray | None:
    """Return the least |δ1|, |δ2| and |δ3| in a workspace, in design units; None as `extent_of`.

    Raises:
        InputError: not a rotation.
    """
    r = checked_rotation(rotation)
    gradients = planes_of_singularity(r)
    points = extreme_positions(design, r, gradients)
    if not len(points):
        return None
    least = np.abs(points @ gradients.T).min(axis=0)
    least[least <= design.tolerance] = 0.0
    return least


def extreme_positions(design: Design, rotation: FloatArray, normals: FloatArray) -> FloatArray:
    """Return positions in a workspace, shape (n, 3), the extreme ones among them.

    They are extreme along the axes and along the normals, shape (m, 3), in the whole workspace and
    on either side of the planes through a1 with these normals.
    """
    limits = constraints(design, rotation)
    box = box_of(limits)
    if box is None:
        return np.zeros((0, 3))
    lows, highs = box
    middle, unit = 0.5 * (lows + highs), 0.5 * float(np.linalg.norm(highs - lows))
    lengths = np.linalg.norm(normals, axis=1)
    directions = normals[lengths > 0.0] / lengths[lengths > 0.0, None]
    # A limit counts if its surface may pass through the ball about the region.
    crossing = [
        limit
        for limit in (*limits, *(HalfSpace("", normal, 0.0) for normal in directions))
        if isinstance(limit, Cone) or float(limit.distance(middle)) <= unit * (1.0 + 1e-12)
    ]
    surfaces = Surfaces.of([limit.shifted(-middle) for limit in crossing], unit)
    radii = [limit.radius for limit in crossing if isinstance(limit, BallOrCylinder)]
    directions = np.vstack([np.eye(3), directions])

    def within(points: FloatArray, excess: float) -> BoolArray:
        positions = middle + unit * points
        kept: BoolArray = np.abs(points).max(axis=1) <= 1.0 + NEAR
        for limit in limits:
            rest = positions[kept]
            kept[kept] = (limit.slack(rest) >= 0.0) | (limit.distance(rest) <= excess)
        return kept

    points, equations = surfaces.common_points(directions)
    kept = within(points, NEAR * unit)
    refined = surfaces.refine(points[kept], equations[kept], directions)
    found = np.vstack([points[kept], refined, surfaces.poles(directions)])
    return middle + unit * found[within(found, TOLERANCE * max([design.reach, *radii]))]
