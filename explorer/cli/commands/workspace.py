"""`explorer workspace`: the measures of the workspace."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated

import tyro

from explorer.cli.answers.workspace import WorkspaceMeasures
from explorer.cli.options import DesignOptions, JsonOptions, OrientationOptions, RadiiOptions
from explorer.cli.output import degrees, heading, write_json, write_lines
from explorer.cli.values import numbers, positive, whole_number
from explorer.errors import InputError
from explorer.mechanism.design import Design
from explorer.mechanism.pose import Pose, Triple, yaw_pitch_roll_from_rotation
from explorer.workspace.slices.volume import workspace_nodes, workspace_volume

if TYPE_CHECKING:
    from explorer.numerics.arrays import FloatArray
    from explorer.workspace.accessible.radii import RadiusCurve
    from explorer.workspace.accessible.workspace import ReachableWorkspace

Ends = tuple[float, float]

# The default number of orientations of a range of angles, and of a cone of tilts.
SAMPLES_ON_RANGE = 5
SAMPLES_OF_TILT = 33

_OPTIONAL = tyro.conf.arg(help_behavior_hint="(optional)")


@dataclass(frozen=True, kw_only=True)
class Workspace(JsonOptions, RadiiOptions, OrientationOptions, DesignOptions):
    """Measure the workspace: exact volume and gradient, the paper's nodes, a mesh.

    Ranges or a tilt add the reachable volume (union over these orientations) and the dexterous
    volume (intersection). An empty workspace is an answer too, with the limits that empty it.
    """

    step: Annotated[
        float | None,
        positive("--step"),
        tyro.conf.arg(help_behavior_hint="(default: that of the design)"),
    ] = None
    """Step of the paper's grid of nodes, in design units."""

    tolerance: Annotated[
        float | None,
        positive("--tolerance"),
        tyro.conf.arg(help_behavior_hint="(default: a 500th of the reach)"),
    ] = None
    """Largest distance of the mesh from the true surface, in design units."""

    hull: Annotated[bool, tyro.conf.FlagCreatePairsOff] = False
    """Add the convex hull."""

    interference: Annotated[bool, tyro.conf.FlagCreatePairsOff] = False
    """Add the accessible volume, without a collision of legs on the way from the home pose, and
    the volume that each pair blocks."""

    radius_curve: Annotated[bool, tyro.conf.FlagCreatePairsOff] = False
    """Add the accessible volume as a function of one radius of all legs, and the largest radius
    without a loss."""

    yaw_range: Annotated[Ends | None, numbers("--yaw-range", "low high"), _OPTIONAL] = None
    """Range of yaw in degrees; the other angles are those of the given orientation."""

    pitch_range: Annotated[Ends | None, numbers("--pitch-range", "low high"), _OPTIONAL] = None
    """Range of pitch in degrees."""

    roll_range: Annotated[Ends | None, numbers("--roll-range", "low high"), _OPTIONAL] = None
    """Range of roll in degrees."""

    tilt: Annotated[float | None, positive("--tilt"), _OPTIONAL] = None
    """Half-angle of a cone of tilts of the platform, in degrees."""

    samples: Annotated[
        int | None,
        whole_number("--samples", 1, 1_000_000),
        tyro.conf.arg(help_behavior_hint="(default: 5 a range, 33 tilts, 100000 for a capability)"),
    ] = None
    """Number of orientations: per range, of a tilt, or of all."""

    capability: Annotated[Triple | None, numbers("--capability", "x y z"), _OPTIONAL] = None
    """Position at which to compute the share of feasible orientations, among the given or all."""

    table1: Annotated[bool, tyro.conf.FlagCreatePairsOff] = False
    """Reproduce the paper's Table 1 instead, from both presets."""

    def run(self) -> None:
        """Write the measures of the workspace.

        Raises:
            InputError: a design, orientation or number that cannot be used.
        """
        if self.table1:
            self._write_table_one()
            return
        design = self.with_radii(self.load())
        pose = self.oriented_home(design)
        orientations = self._orientations(pose)
        measures = self._measure(design, pose, orientations)
        if self.json:
            write_json(measures.as_json())
        else:
            angles = "  ".join(degrees(yaw_pitch_roll_from_rotation(pose.rotation).tolist()))
            lines = measures.as_lines(design)
            write_lines(heading(design), f"yaw pitch roll  {angles}", "", *lines)

    def _measure(
        self, design: Design, pose: Pose, orientations: FloatArray | None
    ) -> WorkspaceMeasures:
        from explorer.workspace.solids.solids import (
            convex_hull,
            dexterous_solid,
            reachable_solid,
            workspace_solid,
        )

        nodes = workspace_nodes(design, pose.rotation, self.step)
        volume = workspace_volume(design, pose.rotation)
        solid = workspace_solid(design, pose.rotation, self.tolerance, volume=volume)
        reachable = dexterous = None
        if orientations is not None:
            reachable = reachable_solid(design, orientations, self.tolerance)
            dexterous = dexterous_solid(design, orientations, self.tolerance)
        return WorkspaceMeasures(
            volume=volume,
            nodes=nodes,
            solid=solid,
            hull=convex_hull(solid) if self.hull else None,
            orientations=None if orientations is None else len(orientations),
            reachable=reachable,
            dexterous=dexterous,
            capability=self._share(design, orientations),
            interference=self._interference(design, pose),
            curve=self._curve(design, pose),
        )

    def _interference(self, design: Design, pose: Pose) -> ReachableWorkspace | None:
        if not self.interference:
            return None
        from explorer.workspace.accessible.workspace import reachable_workspace

        return reachable_workspace(
            design, pose.rotation, node_step=self.step, tolerance=self.tolerance
        )

    def _curve(self, design: Design, pose: Pose) -> RadiusCurve | None:
        if not self.radius_curve:
            return None
        from explorer.workspace.accessible.radii import radius_curve

        return radius_curve(design, pose.rotation)

    def _orientations(self, pose: Pose) -> FloatArray | None:
        """Return the requested orientations, shape (n, 3, 3); None without any."""
        from explorer.workspace.orientations import cone_of_directions, yaw_pitch_roll_range

        ranges = (self.yaw_range, self.pitch_range, self.roll_range)
        if self.tilt is not None:
            if any(ends is not None for ends in ranges):
                raise InputError("give ranges of angles or --tilt, not both")
            return cone_of_directions(pose.rotation, self.tilt, self.samples or SAMPLES_OF_TILT)
        if all(ends is None for ends in ranges):
            if self.samples is not None and self.capability is None:
                raise InputError("--samples needs ranges of angles, --tilt or --capability")
            return None
        angles = yaw_pitch_roll_from_rotation(pose.rotation).tolist()
        pairs = [ends or (angle, angle) for ends, angle in zip(ranges, angles, strict=True)]
        many = self.samples or SAMPLES_ON_RANGE
        return yaw_pitch_roll_range(
            [low for low, _ in pairs],
            [high for _, high in pairs],
            [1 if ends is None else many for ends in ranges],
        )

    def _share(self, design: Design, orientations: FloatArray | None) -> float | None:
        if self.capability is None:
            return None
        from explorer.workspace.orientations import CAPABILITY_ORIENTATIONS, orientation_capability

        count = self.samples or CAPABILITY_ORIENTATIONS
        chosen = count if orientations is None else orientations
        return orientation_capability(design, self.capability, chosen)

    def _write_table_one(self) -> None:
        from explorer.cli.answers.table_one import (
            WHY_THEY_DIFFER,
            as_json,
            as_lines,
            compute_table_one,
        )

        rows = compute_table_one()
        if self.json:
            write_json({"table1": [as_json(row) for row in rows], "note": WHY_THEY_DIFFER})
            return
        write_lines("Table 1 of the paper, and the values of this program, in design units")
        for row in rows:
            write_lines("", as_lines(row))
        write_lines("", WHY_THEY_DIFFER)
