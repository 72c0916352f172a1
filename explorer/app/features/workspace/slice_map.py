"""The map of a slice of the workspace, a picture in the colours of a measure."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from explorer.app.scene.bands import Colouring
from explorer.app.widgets.colours import FAR_WARNINGS, OUTLINE, proximity_colour
from explorer.legs.clearance import leg_clearances
from explorer.numerics.arrays import BoolArray, FloatArray
from explorer.workspace.limits.constraints import constraints, slacks
from explorer.workspace.limits.region import region_of
from explorer.workspace.slices.volume import bounds
from explorer.workspace.solids.solid import Solid

Axis = Literal["x", "y", "z"]

AXES: tuple[Axis, ...] = ("x", "y", "z")
CUT = "cut"
"""Name of the limit whose faces lie in the plane of a cut."""

# Pixels on the longer side of the map of a slice.
MAP_PIXELS = 110
# Colour and opacity of positions within the limits that are not reachable.
BLOCKED = (*OUTLINE, 96)


@dataclass(frozen=True)
class SliceMap:
    """A map of the slice: pixels (h, w, 4), from its lows to its highs on two axes."""

    pixels: NDArray[np.uint8]
    axes: tuple[Axis, Axis]
    lows: tuple[float, float]
    highs: tuple[float, float]

    @cached_property
    def picture(self) -> NDArray[np.uint8]:
        """The pixels three times as large, so that a browser draws them sharp."""
        return np.repeat(np.repeat(self.pixels, 3, axis=0), 3, axis=1)


def level_within(low: float, high: float, level: float | None) -> float:
    """Return the level of a cut: the one given if it is within the extent, else the middle."""
    return level if level is not None and low <= level <= high else 0.5 * (low + high)


def slice_map(
    colouring: Colouring, axis: Axis, level: float, whole: Solid | None, reached: Solid | None
) -> SliceMap | None:
    """Return the map of a slice through a workspace, None if it has no extent.

    Args:
        colouring: Colouring of the workspace by a measure.
        axis: Axis across which the workspace is cut.
        level: Coordinate of the cut on that axis.
        whole: Cut solid of the workspace within the limits; None if collisions do not count.
        reached: Cut solid of its reachable part; None likewise.
    """
    limits = constraints(colouring.design, colouring.rotation)
    lows, highs = bounds(region_of(limits))
    if not np.isfinite([lows, highs]).all() or not (lows < highs).all():
        return None
    cut = AXES.index(axis)
    first, second = (index for index in range(3) if index != cut)
    width, height = float(highs[first] - lows[first]), float(highs[second] - lows[second])
    pixel = max(width, height) / MAP_PIXELS
    columns = lows[first] + pixel * (np.arange(max(1, round(width / pixel))) + 0.5)
    rows = lows[second] + pixel * (np.arange(max(1, round(height / pixel))) + 0.5)
    points = np.zeros((len(rows), len(columns), 3))
    points[..., cut] = level
    points[..., first] = columns
    # The first row of a picture is at the top.
    points[..., second] = rows[::-1, None]
    inside = np.asarray((slacks(limits, points) >= 0.0).all(axis=-1))
    pixels = np.zeros((*inside.shape, 4), dtype=np.uint8)
    if whole is not None and reached is not None:
        flat = points[..., [first, second]]
        in_section = inside & section(whole, (first, second), flat)
        blocked = in_section & ~section(reached, (first, second), flat)
        # Facets leave out a rim at the limits, where only collisions of legs are checked.
        rim = inside & ~in_section
        clearance = leg_clearances(colouring.design, points[rim], colouring.rotation).clearance
        blocked[rim] = (clearance <= 0.0).any(axis=-1)
        inside &= ~blocked
        pixels[blocked] = BLOCKED
    if inside.any():
        share = colouring.values(points[inside])
        table = np.array([proximity_colour(s) for s in np.linspace(0.0, FAR_WARNINGS, 201)])
        index = np.clip(np.rint(share / FAR_WARNINGS * 200.0), 0, 200).astype(np.int64)
        pixels[inside, :3] = table[index]
        pixels[inside, 3] = 255
    return SliceMap(
        pixels,
        (AXES[first], AXES[second]),
        (float(lows[first]), float(lows[second])),
        (float(highs[first]), float(highs[second])),
    )


def section(solid: Solid, axes: tuple[int, int], points: FloatArray) -> BoolArray:
    """Return which points of the plane of a cut lie in the faces of the cut.

    Args:
        solid: Solid that was cut; its cut faces have the limit `CUT`.
        axes: Two axes of the plane.
        points: Coordinates on these axes of a grid of points, shape (h, w, 2).
    """
    inside = np.zeros(points.shape[:2], dtype=np.bool_)
    if CUT not in solid.limits:
        return inside
    faces = solid.faces[solid.limit_of_face == solid.limits.index(CUT)]
    for corners in solid.vertices[faces][:, :, axes]:
        low, high = corners.min(axis=0), corners.max(axis=0)
        near = ((points >= low) & (points <= high)).all(axis=-1)
        sides = np.stack([_side(corners[k - 1], corners[k], points[near]) for k in range(3)])
        inside[near] |= (sides >= 0.0).all(axis=0) | (sides <= 0.0).all(axis=0)
    return inside


def _side(start: FloatArray, end: FloatArray, points: FloatArray) -> FloatArray:
    """Return numbers (n,) whose signs say on which side of a line points (n, 2) lie."""
    (x, y), offsets = end - start, points - start
    return x * offsets[:, 1] - y * offsets[:, 0]
