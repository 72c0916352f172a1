"""A table on six legs to measure, as `explorer.measures.measure.Case` is a design."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Any, cast

import numpy as np
from numpy.typing import ArrayLike

from explorer.measures.catalogue import CATALOGUE, Measure, MeasureValues, values_of
from explorer.mechanism.pose import rotation_array
from explorer.mechanism.tilt_torsion import rotation_from_tilt_torsion, tilt_torsion_of
from explorer.numerics.arrays import BoolArray, FloatArray
from explorer.six_legged.table import SixLegged, TablePoses
from explorer.workspace.extremes import extremes_of
from explorer.workspace.least_clearance import DEFAULT_NODES, nodes_of
from explorer.workspace.limits.constraints import Constraint
from explorer.workspace.limits.region import Region, region_of
from explorer.workspace.orientations.share import even_angles, share_of
from explorer.workspace.slices.volume import Volume, find_emptying_limits, region_volume

TABLE_MEASURES = tuple(name for name, measure in CATALOGUE.items() if measure.for_tables)
"""The measures that a table has."""

OF_TABLES = (
    "≤ is an upper bound: of a table on six legs all positions and orientations within its strokes "
    "and cones count, also those behind singular poses and below its base. The sign of det J is no "
    "assembly mode of a table, while a design keeps its mode, by the signs of its margins."
)
"""What the numbers of tables mean beside those of designs, in words."""

# Azimuths of the greatest tilt, steps of tilt in which a limit is looked for, and halvings of one.
AZIMUTHS, TILT_STEPS, HALVINGS = 72, 720, 40

Holds = Callable[[FloatArray, FloatArray], BoolArray]
"""Function that tells which poses (..., 3), (..., 3, 3) are within limits, shape (...)."""


@dataclass
class TableCase:
    """A table to measure; lengths in millimetres.

    Attributes:
        table: The table.
        rotation: Platform to base, shape (3, 3), of the workspace; that of home if None.
        nodes: Number of nodes on each axis of the grid of means and least values.
    """

    table: SixLegged
    rotation: ArrayLike | None = None
    nodes: int = DEFAULT_NODES

    @cached_property
    def at_rotation(self) -> FloatArray:
        """The orientation of the workspace, shape (3, 3)."""
        home = self.table.home_pose.rotation
        return home if self.rotation is None else rotation_array(self.rotation)

    @cached_property
    def limits(self) -> tuple[Constraint, ...]:
        """The lengths and cones as solids of positions of the platform's origin."""
        return self.table.limits(self.at_rotation)

    @cached_property
    def region(self) -> Region:
        """The region of positions that satisfies all limits."""
        return region_of(self.limits)

    @cached_property
    def volume(self) -> Volume:
        """The exact volume in mm³; its gradient by points in mm³ per mm, unless there are cones."""
        volume, error, gradient = region_volume(self.region)
        because = () if volume > 0.0 else find_emptying_limits(self.limits)
        return Volume(volume, error, gradient, because)

    @cached_property
    def box(self) -> tuple[FloatArray, FloatArray] | None:
        """The lows and highs of the workspace, each (3,), exact; None if it is empty."""
        points = extremes_of(self.limits, self.region, self.table.reach)
        is_empty = not len(points) or self.volume.volume <= 0.0
        return None if is_empty else (points.min(axis=0), points.max(axis=0))

    @property
    def extent(self) -> FloatArray:
        """The exact extents of the workspace on the axes, shape (3,); NaN if it is empty."""
        return np.full(3, math.nan) if self.box is None else self.box[1] - self.box[0]

    @property
    def longest_leg(self) -> float:
        """The longest leg."""
        return self.table.reach

    @cached_property
    def node_positions(self) -> FloatArray:
        """The nodes of a grid in the box of the workspace, shape (n, 3)."""
        return nodes_of(self.region, self.nodes, self.box)

    @cached_property
    def home_indices(self) -> TablePoses:
        """The table in its home pose, with its indices."""
        return self.table.home_poses

    @cached_property
    def node_indices(self) -> TablePoses:
        """The table at the nodes, with its indices."""
        return TablePoses(self.table, self.node_positions, self.at_rotation)

    @cached_property
    def home_share(self) -> float:
        """The share of all orientations that the home position can have."""
        return share_of(lambda rotations: self.holds(self.table.home.position_mm, rotations)).share

    @cached_property
    def home_tilt(self) -> float:
        """The greatest tilt at home in every azimuth, at home's torsion, see `greatest_tilts`."""
        home = self.table.home_pose
        return float(greatest_tilts(self.holds, [home.position], home.rotation)[0])

    def holds(self, position: ArrayLike, rotation: ArrayLike) -> BoolArray:
        """Return whether poses (..., 3), (..., 3, 3) keep lengths and cones, shape (...)."""
        poses, table = TablePoses(self.table, position, rotation), self.table
        held = (poses.lengths >= table.shortest_mm) & (poses.lengths <= table.longest_mm)
        if table.cones_deg is not None:
            home, legs = table.home_poses, poses.directions
            within = np.cos(np.radians(table.cones_deg))
            # As the platform sees its legs.
            own = legs @ (poses.rotation @ home.rotation.T)
            for seen in (legs, own):
                held &= (seen * home.directions).sum(axis=-1) >= within
        return np.asarray(held.all(axis=-1))

    @cached_property
    def measurements(self) -> MeasureValues:
        """The values of `TABLE_MEASURES`, in millimetres, degrees and plain numbers."""
        # The measures of tables ask only for what both cases have.
        values, infinite = values_of(cast("Any", self), TABLE_MEASURES)
        return MeasureValues(
            values=values, empty_because=self.volume.empty_because, infinite=infinite
        )


def is_upper_bound(of: object, measure: Measure) -> bool:
    """Return whether the value of a measure is an upper bound, as some of a table are."""
    return isinstance(of, SixLegged) and measure.for_tables == "at most"


def greatest_tilts(
    holds: Holds,
    positions: ArrayLike,
    rotation: FloatArray,
    azimuths: int = AZIMUTHS,
    steps: int = TILT_STEPS,
) -> FloatArray:
    """Return the greatest tilts in every azimuth at n positions, in degrees, shape (n,).

    All tilts below are within limits too; it is 0 where tilt zero is not. The torsion is that of an
    orientation (3, 3). It is the least over the azimuths, and a violation within less than one of
    the steps, into which 180° are divided, can be missed.
    """
    torsion, at = tilt_torsion_of(rotation).torsion, np.asarray(positions)[:, None]

    def are_within(position: FloatArray, azimuth: FloatArray, tilt: FloatArray) -> BoolArray:
        angles = np.stack(np.broadcast_arrays(azimuth, tilt, torsion), axis=-1)
        return holds(position, rotation_from_tilt_torsion(angles))

    azimuth = even_angles("azimuths", azimuths)
    tilts = np.asarray(np.linspace(0.0, 180.0, steps + 1), dtype=np.float64)
    within = are_within(at[..., None, :], azimuth[:, None], tilts)
    ends = np.where(within.all(axis=-1), steps, within.argmin(axis=-1) - 1)
    low, high = tilts[np.maximum(ends, 0)], tilts[np.minimum(ends + 1, steps)]
    for _ in range(HALVINGS):
        middle = 0.5 * (low + high)
        is_within = are_within(at, azimuth, middle)
        low, high = np.where(is_within, middle, low), np.where(is_within, high, middle)
    return np.where((ends >= 0).all(axis=-1), low.min(axis=-1), 0.0)
