"""`explorer workspace`: how large the workspace is, by each way of measuring it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated

import tyro

from explorer.cli.collisions import (
    curve_json,
    curve_table,
    interference_json,
    interference_table,
)
from explorer.cli.options import DesignOptions, JsonOptions, OrientationOptions, RadiiOptions
from explorer.cli.output import (
    DISAGREES,
    degrees,
    figure,
    heading,
    mesh_json,
    table,
    write_json,
    write_lines,
)
from explorer.cli.values import numbers, positive, whole_number
from explorer.errors import InputError
from explorer.mechanism.design import Design
from explorer.mechanism.pose import Pose, Triple, yaw_pitch_roll_from_rotation
from explorer.workspace.slices.volume import NodeCount, Volume, workspace_nodes, workspace_volume

if TYPE_CHECKING:
    from explorer.numerics.arrays import FloatArray
    from explorer.workspace.accessible.radii import RadiusCurve
    from explorer.workspace.accessible.workspace import ReachableWorkspace
    from explorer.workspace.solids.solid import Solid

Ends = tuple[float, float]

# Orientations of a range of angles, and of a cone of tilts, unless told otherwise.
SAMPLES_ON_RANGE = 5
SAMPLES_OF_TILT = 33

_OPTIONAL = tyro.conf.arg(help_behavior_hint="(optional)")


@dataclass(frozen=True, kw_only=True)
class Workspace(JsonOptions, RadiiOptions, OrientationOptions, DesignOptions):
    """Measure the workspace: exact volume and gradient, the paper's nodes, a mesh.

    With ranges or a tilt also the volumes that some (reachable) and all (dexterous) of these
    orientations have. An empty workspace is an answer too: it names the limits that empty it.
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
    """Measure the convex hull too."""

    interference: Annotated[bool, tyro.conf.FlagCreatePairsOff] = False
    """Measure too what the home pose leads to without a collision of legs, and each pair's cost."""

    radius_curve: Annotated[bool, tyro.conf.FlagCreatePairsOff] = False
    """Tell too how that shrinks as one radius of all legs grows, and which is harmless."""

    yaw_range: Annotated[Ends | None, numbers("--yaw-range", "low high"), _OPTIONAL] = None
    """Orientations with a yaw from low to high, in degrees, else as the orientation given."""

    pitch_range: Annotated[Ends | None, numbers("--pitch-range", "low high"), _OPTIONAL] = None
    """Orientations with a pitch from low to high, in degrees."""

    roll_range: Annotated[Ends | None, numbers("--roll-range", "low high"), _OPTIONAL] = None
    """Orientations with a roll from low to high, in degrees."""

    tilt: Annotated[float | None, positive("--tilt"), _OPTIONAL] = None
    """Orientations that tilt the platform every way up to this half-angle, in degrees."""

    samples: Annotated[
        int | None,
        whole_number("--samples", 1, 1_000_000),
        tyro.conf.arg(help_behavior_hint="(default: 5 a range, 33 tilts, 100000 for a capability)"),
    ] = None
    """How many orientations: on each range, of a tilt, or of all."""

    capability: Annotated[Triple | None, numbers("--capability", "x y z"), _OPTIONAL] = None
    """Tell the share of orientations that this position can have: of those asked for, or of all."""

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
        pose = self.oriented(design)
        orientations = self._orientations(pose)
        findings = self._findings(design, pose, orientations)
        if self.json:
            write_json(findings.as_json())
        else:
            angles = "  ".join(degrees(yaw_pitch_roll_from_rotation(pose.rotation).tolist()))
            lines = findings.as_lines(design)
            write_lines(heading(design), f"yaw pitch roll  {angles}", "", *lines)

    def _findings(self, design: Design, pose: Pose, orientations: FloatArray | None) -> _Findings:
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
        return _Findings(
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
        """Return the set of orientations that is asked for, shape (n, 3, 3)."""
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
        asked = count if orientations is None else orientations
        return orientation_capability(design, self.capability, asked)

    def _write_table_one(self) -> None:
        from explorer.cli.table_one import WHY_THEY_DIFFER, as_json, as_lines, table_one

        rows = table_one()
        if self.json:
            write_json({"table1": [as_json(row) for row in rows], "note": WHY_THEY_DIFFER})
            return
        write_lines("Table 1 of the paper, and what this program finds, in design units")
        for row in rows:
            write_lines("", as_lines(row))
        write_lines("", WHY_THEY_DIFFER)


@dataclass(frozen=True)
class _Findings:
    """What has been found of a workspace; None is what was not asked for."""

    volume: Volume
    nodes: NodeCount
    solid: Solid
    hull: Solid | None
    orientations: int | None
    reachable: Solid | None
    dexterous: Solid | None
    capability: float | None
    interference: ReachableWorkspace | None
    curve: RadiusCurve | None

    def as_json(self) -> dict[str, object]:
        extent = self.nodes.extent
        answer: dict[str, object] = {
            "volume": self.volume.volume,
            "gradient": self.volume.gradient,
            "empty_because": list(self.volume.empty_because),
            "node_step": self.nodes.step,
            "node_count": self.nodes.count,
            "node_volume": self.nodes.volume,
            "extent": None if extent is None else [list(ends) for ends in extent],
            "mesh": mesh_json(self.solid),
        }
        if self.solid.agrees is False:
            answer["mesh_agrees"] = False
        if self.hull is not None:
            answer["hull_volume"] = self.hull.volume
        if self.reachable is not None and self.dexterous is not None:
            answer["orientations"] = self.orientations
            answer["reachable_mesh"] = mesh_json(self.reachable)
            answer["dexterous_mesh"] = mesh_json(self.dexterous)
        if self.capability is not None:
            answer["orientation_capability"] = self.capability
        if self.interference is not None:
            answer |= interference_json(self.interference)
        if self.curve is not None:
            answer["radius_curve"] = curve_json(self.curve)
        return answer

    def as_lines(self, design: Design) -> list[str]:
        rows = [("", "units³", "cm³", "")]

        def add(name: str, volume: float, remark: str = "") -> None:
            rows.append(
                (name, figure(volume), figure(volume * (0.1 * design.unit_mm) ** 3), remark)
            )

        add("exact volume", self.volume.volume)
        add(
            "node volume",
            self.nodes.volume,
            f"{self.nodes.count} nodes at multiples of {self.nodes.step:.6g}",
        )
        add("mesh", self.solid.volume, _mesh_remark(self.solid))
        if self.hull is not None:
            add("convex hull", self.hull.volume)
        for name, solid in (("reachable", self.reachable), ("dexterous", self.dexterous)):
            if solid is not None:
                add(name, solid.volume, f"{self.orientations} orientations, {_mesh_remark(solid)}")
        found = self.interference
        if found is not None:
            remark = f"{found.reachable_node_count} of {found.node_count} nodes"
            add("without collisions", found.reachable_volume, remark)
        lines = [table(rows, "<>><")]
        if self.nodes.extent is not None:
            lines += ["", "extent of the nodes"]
            lines += [
                f"  {axis}  {figure(low)} to {figure(high)}"
                for axis, low, high in zip("xyz", *self.nodes.extent, strict=True)
            ]
        if self.volume.empty_because:
            lines += ["", f"empty because of {', '.join(self.volume.empty_because)}"]
        if self.volume.gradient:
            moves = [("moves with", "units² (yaw: units³ a radian)")]
            moves += [(name, figure(rate)) for name, rate in self.volume.gradient.items()]
            lines += ["", table(moves, "<>")]
        if self.capability is not None:
            lines += ["", f"orientation capability {100.0 * self.capability:.2f} %"]
        if found is not None:
            lines += ["", interference_table(design, found)]
        if self.curve is not None:
            lines += ["", curve_table(design, self.curve)]
        return lines


def _mesh_remark(solid: Solid) -> str:
    off = f", {DISAGREES}" if solid.agrees is False else ""
    if solid.is_empty:
        return f"empty because of {', '.join(solid.empty_because) or 'the tolerance'}{off}"
    state = "watertight" if solid.is_watertight else "not watertight"
    return f"{len(solid.faces)} triangles, {state}, tolerance {solid.tolerance:.3g}{off}"
