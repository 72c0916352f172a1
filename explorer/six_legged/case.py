"""A table on six legs to measure, as `explorer.measures.measure.Case` is a design."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any, cast

import numpy as np
from numpy.typing import ArrayLike

from explorer.measures.catalogue import CATALOGUE, MeasureValues, values_of
from explorer.mechanism.pose import rotation_array
from explorer.mechanism.tilt_torsion import rotation_from_tilt_torsion, tilt_torsion_of
from explorer.numerics.arrays import BoolArray, FloatArray
from explorer.six_legged.table import SixLegged, TablePoses
from explorer.workspace.extremes import extremes_of
from explorer.workspace.least_clearance import DEFAULT_NODES, nodes_of
from explorer.workspace.limits.constraints import Constraint
from explorer.workspace.limits.region import Region, region_of
from explorer.workspace.orientations.share import share_of
from explorer.workspace.slices.volume import Volume, find_emptying_limits, region_volume

if TYPE_CHECKING:
    from explorer.measures.measure import Case

TABLE_MEASURES = tuple(name for name, measure in CATALOGUE.items() if measure.for_tables)
"""The measures that a table has."""

OF_TABLES = (
    "All positions of a table on six legs within its strokes and cones count, on both sides of "
    "singular poses and of the base: the sign of det J is no assembly mode of a table, while the "
    "signs of the margins are one of a design, which keeps it."
)
"""What the numbers of tables mean beside those of designs, in words."""

# Azimuths of the greatest tilt, steps of tilt in which a limit is looked for, and halvings of one.
AZIMUTHS, TILT_STEPS, HALVINGS = 72, 720, 40


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
    def limits(self) -> tuple[Constraint, ...]:
        """The lengths and cones as solids of positions of the platform's origin."""
        home = self.table.home_pose.rotation
        return self.table.limits(home if self.rotation is None else rotation_array(self.rotation))

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
    def extent(self) -> FloatArray:
        """The exact extents of the workspace on the axes, shape (3,); NaN if it is empty."""
        points = extremes_of(self.limits, self.region, self.table.reach, np.zeros((0, 3)))
        empty = not len(points) or self.volume.volume <= 0.0
        return np.full(3, math.nan) if empty else np.ptp(points, axis=0)

    @property
    def longest_leg(self) -> float:
        """The longest leg."""
        return self.table.reach

    @cached_property
    def node_positions(self) -> FloatArray:
        """The nodes of a grid in the workspace, shape (n, 3)."""
        return nodes_of(self.region, self.nodes)

    @cached_property
    def home_indices(self) -> TablePoses:
        """The table in its home pose, with its indices."""
        return self.table.home_poses

    @cached_property
    def node_indices(self) -> TablePoses:
        """The table at the nodes, with its indices."""
        home = self.table.home_pose.rotation
        return TablePoses(
            self.table, self.node_positions, home if self.rotation is None else self.rotation
        )

    @cached_property
    def home_share(self) -> float:
        """The share of all orientations that the home position can have."""
        return share_of(lambda rotations: self.holds(self.table.home.position_mm, rotations)).share

    @cached_property
    def home_tilt(self) -> float:
        """The greatest tilt at home in every azimuth, in degrees, without a gap from tilt zero.

        It is the least over 72 azimuths, at home's torsion; 0 if tilt zero is not within limits. A
        violation within less than a quarter of a degree can be missed.
        """
        position = self.table.home.position_mm
        torsion = tilt_torsion_of(self.table.home_pose.rotation).torsion

        def are_held(azimuths: ArrayLike, tilts: ArrayLike) -> BoolArray:
            angles = np.stack(np.broadcast_arrays(azimuths, tilts, torsion), axis=-1)
            return self.holds(position, rotation_from_tilt_torsion(angles))

        azimuths = np.arange(AZIMUTHS) * (360.0 / AZIMUTHS)
        tilts = np.linspace(0.0, 180.0, TILT_STEPS + 1)
        held = are_held(azimuths[:, None], tilts)
        ends = np.where(held.all(axis=1), TILT_STEPS, held.argmin(axis=1) - 1)
        low, high = tilts[np.maximum(ends, 0)], tilts[np.minimum(ends + 1, TILT_STEPS)]
        for _ in range(HALVINGS):
            middle = 0.5 * (low + high)
            is_held = are_held(azimuths, middle)
            low, high = np.where(is_held, middle, low), np.where(is_held, high, middle)
        return float(low.min()) if ends.min() >= 0 else 0.0

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
        values, infinite = values_of(cast("Case", cast("Any", self)), TABLE_MEASURES)
        return MeasureValues(
            values=values, empty_because=self.volume.empty_because, infinite=infinite
        )
