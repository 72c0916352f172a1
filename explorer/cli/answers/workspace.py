"""The measures of a workspace, for `explorer workspace`."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from explorer.cli.answers.accessible import (
    curve_json,
    curve_table,
    interference_json,
    interference_table,
)
from explorer.cli.output import DISAGREES, figure, mesh_json, table
from explorer.mechanism.design import Design
from explorer.workspace.slices.volume import NodeCount, Volume

if TYPE_CHECKING:
    from explorer.workspace.accessible.radii import RadiusCurve
    from explorer.workspace.accessible.workspace import ReachableWorkspace
    from explorer.workspace.solids.solid import Solid


@dataclass(frozen=True)
class WorkspaceMeasures:
    """The measures of a workspace; None if not requested.

    Attributes:
        volume: Exact volume and its gradient.
        nodes: Nodes of the paper's grid.
        solid: Mesh of the workspace.
        hull: Convex hull of the mesh.
        orientations: Number of orientations of the next three.
        reachable: Union of the workspaces over the orientations.
        dexterous: Intersection of the workspaces over the orientations.
        capability: Share of feasible orientations at a position, from 0 to 1.
        interference: Accessible workspace.
        curve: Accessible volume as a function of the radius of all legs.
    """

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
        """Return the measures as plain values."""
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
        """Return the measures as lines of text."""
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
            add("accessible", found.reachable_volume, remark)
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
