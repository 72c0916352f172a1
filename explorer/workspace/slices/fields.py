"""Fields over a slice of the workspace: distances to singularities, and conditioning.

A slice is a grid of positions on a plane across one of the base's axes, at one orientation.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from explorer.errors import InputError
from explorer.mechanism.configuration import Configuration
from explorer.mechanism.design import Design
from explorer.mechanism.margins import margins
from explorer.mechanism.pose import checked_rotation
from explorer.numerics.arrays import BoolArray, FloatArray
from explorer.singularity.ellipsoids import singular_plane_distances
from explorer.singularity.jacobian import inverse_condition, jacobian
from explorer.singularity.nearest import nearest_singular_poses
from explorer.workspace.limits.constraints import constraints, slacks
from explorer.workspace.limits.region import region_of
from explorer.workspace.slices.axes import axes_of_slice
from explorer.workspace.slices.volume import bounds

MOST_STEPS = 2000

Field = Literal["margin", "condition", "ball", "distance"]

FIELDS: tuple[Field, ...] = ("margin", "condition", "ball", "distance")
"""The fields: the smallest margin |δ|; the inverse condition number, 0 to 1; the radius of the
largest singularity-free ball of positions; the root-mean-square distance to the nearest singular
pose."""


@dataclass(frozen=True)
class SliceField:
    """A field over a slice.

    Attributes:
        field: Name of the field.
        axis: Axis across which the slice is cut.
        level: Coordinate of the slice on this axis, in design units.
        columns: Coordinates on the first other axis, ascending, shape (n,).
        rows: Coordinates on the second other axis, ascending, shape (m,).
        values: Values of the field, shape (m, n), in design units except for the condition.
        inside: Whether each position satisfies the limits of the design, shape (m, n).
    """

    field: Field
    axis: str
    level: float
    columns: FloatArray
    rows: FloatArray
    values: FloatArray
    inside: BoolArray


def slice_field(
    design: Design,
    rotation: ArrayLike,
    field: Field,
    *,
    axis: str = "z",
    level: float,
    steps: int = 64,
    extent: tuple[ArrayLike, ArrayLike] | None = None,
) -> SliceField:
    """Return a field over a slice of the workspace's bounding box.

    Args:
        design: The manipulator.
        rotation: Platform to base, shape (3, 3).
        field: One of `FIELDS`.
        axis: Axis across which to cut: "x", "y" or "z".
        level: Coordinate on this axis, in design units.
        steps: Number of positions on the longer side.
        extent: Lows and highs of the positions, (3,) each; those of the workspace if None.

    Raises:
        InputError: an unknown field or axis, too few or too many steps, an empty workspace
            without an extent, or not a rotation.
    """
    r = checked_rotation(rotation)
    if field not in FIELDS:
        raise InputError(f"no field {field!r}; there are {', '.join(FIELDS)}")
    cut, first, second = axes_of_slice(axis)
    if not 2 <= steps <= MOST_STEPS:
        raise InputError(f"a slice has 2 to {MOST_STEPS} steps; got {steps}")
    limits = constraints(design, r)
    lows, highs = bounds(region_of(limits)) if extent is None else map(np.asarray, extent)
    sides = np.array(highs - lows, dtype=np.float64)[[first, second]]
    if not np.isfinite(sides).all() or not (sides > 0.0).all():
        raise InputError(
            "there is nothing to map: the workspace at this orientation is empty; give an extent"
        )
    counts = np.maximum(2, np.rint(steps * sides / sides.max())).astype(np.int64).tolist()
    columns = np.linspace(float(lows[first]), float(highs[first]), counts[0], dtype=np.float64)
    rows = np.linspace(float(lows[second]), float(highs[second]), counts[1], dtype=np.float64)
    points = np.empty((len(rows), len(columns), 3))
    points[..., cut] = level
    points[..., first], points[..., second] = columns, rows[:, None]
    values = field_at(design, points, r, field)
    inside = np.asarray((slacks(limits, points) >= 0.0).all(axis=-1))
    return SliceField(field, axis, level, columns, rows, values, inside)


def field_at(design: Design, position: ArrayLike, rotation: ArrayLike, field: Field) -> FloatArray:
    """Return a field at poses, shape (...), in design units except for the condition.

    Args:
        design: The manipulator.
        position: b4 in the base frame, shape (..., 3), in design units.
        rotation: Platform to base, shape (..., 3, 3).
        field: One of `FIELDS`.

    Raises:
        InputError: a pose that is not finite or not a rotation.
    """
    match field:
        case "margin":
            return np.abs(margins(position, rotation)).min(axis=-1)
        case "condition":
            return inverse_condition(jacobian(design, position, rotation), design.reach)
        case "ball":
            return singular_plane_distances(position, rotation).min(axis=-1)
        case "distance":
            return nearest_singular_poses(Configuration(design, position, rotation)).distance.min(
                axis=-1
            )
