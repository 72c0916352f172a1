"""The measures of a workspace and of its accessible part, for `explorer workspace`."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING, TypeAlias

import numpy as np

from explorer.cli.output import (
    DISAGREES,
    attributes,
    figure,
    finite,
    lengths,
    lines,
    measure_text,
    mesh_json,
    radii_line,
    table,
)
from explorer.measures.blocks.clearances import workspace_clearances
from explorer.measures.case import Case
from explorer.measures.catalogue import CATALOGUE, measures_in
from explorer.measures.measurements import Measurements, measure_design
from explorer.mechanism.design import Design
from explorer.mechanism.pose import Triple
from explorer.numerics.arrays import FloatArray

if TYPE_CHECKING:
    from explorer.workspace.accessible.radii import RadiusCurve
    from explorer.workspace.accessible.workspace import AccessibleWorkspace
    from explorer.workspace.held import HeldWorkspace
    from explorer.workspace.solids.solid import Solid


# The number of rows of the radius curve in a table, less one.
ROWS = 10


def interference_json(workspace: AccessibleWorkspace) -> dict[str, object]:
    """Return the accessible workspace as plain values, added to those of the workspace."""
    return {
        **attributes(workspace, "accessible_volume accessible_node_count"),
        "harmless_radius": finite(workspace.harmless_radius),
        "pairs": [
            {
                "legs": pair.legs,
                "clearance": finite(pair.clearance),
                "bound": finite(pair.bound),
                "blocked_volume": pair.blocked_volume,
            }
            for pair in workspace.pairs
        ],
        "accessible_solid": mesh_json(workspace.solid),
    }


def curve_json(curve: RadiusCurve) -> dict[str, object]:
    """Return a radius curve as plain values."""
    answer = attributes(curve, "radii volumes harmless harmless_bound")
    return {**answer, "closest": curve.closest_legs}


def curve_table(design: Design, curve: RadiusCurve, shift: FloatArray | None = None) -> str:
    """Return a radius curve at a few radii, and the largest radius without a loss.

    The place at which legs come closest is moved by `shift`, shape (3,), unless that is None.
    """
    rows = [("radius of all legs", "mm", "accessible (units³)", "share")]
    # The last radius comes twice: beyond it the volume is zero.
    last = max(0, len(curve.radii) - 2)
    for index in sorted({round(last * row / ROWS) for row in range(ROWS + 1)}):
        radius, volume = float(curve.radii[index]), float(curve.volumes[index])
        share = volume / float(curve.volumes[0]) if curve.volumes[0] > 0.0 else 0.0
        rows.append((*lengths(design, radius), figure(volume), f"{100.0 * share:.1f} %"))
    lines = [table(rows, ">>>>")]
    if curve.closest_legs is not None:
        i, j = curve.closest_legs
        at = np.array(curve.closest_position) + (0.0 if shift is None else shift)
        place = ", ".join(f"{x:.4g}" for x in at.tolist())
        if curve.harmless > 0.0:
            lines.append(f"no legs collide up to a radius of {figure(curve.harmless)}")
            lines.append(f"legs {i} and {j} come closest, at ({place})")
        else:
            lines.append(f"no radius is harmless: legs {i} and {j} touch at ({place})")
    return "\n".join(lines)


Extent: TypeAlias = tuple[Triple, Triple]
# The measures of nodes that the remark on their volume gives.
_IN_REMARK = ("node_count", "node_step")


@dataclass(frozen=True)
class WorkspaceMeasures:
    """The measures of a workspace; None if not requested.

    Attributes:
        case: Design and orientation, with the mesh of the workspace.
        shift: Vector from b4 to the tool point whose workspace it is, shape (3,); None for b4.
        solid: Mesh of the workspace.
        hull: Convex hull of the mesh.
        orientations: Number of orientations of the next three.
        inclusive: Union of the workspaces over the orientations.
        total: Intersection of the workspaces over the orientations.
        capability: Share of feasible orientations at a position, from 0 to 1.
        interference: Accessible workspace.
        curve: Accessible volume as a function of the radius of all legs.
        held: Part where a load is held.
    """

    case: Case
    shift: FloatArray | None
    solid: Solid
    hull: Solid | None
    orientations: int | None
    inclusive: Solid | None
    total: Solid | None
    capability: float | None
    interference: AccessibleWorkspace | None
    curve: RadiusCurve | None
    held: HeldWorkspace | None

    def _extent(self) -> FloatArray | Extent | None:
        """Return the lowest and the highest position of the counted nodes."""
        extent = self.case.paper_nodes.extent
        if extent is None or self.shift is None:
            return extent
        return np.array(extent) + self.shift

    def _measured(self) -> Measurements:
        return measure_design(self.case, measures_in("workspace"))

    def as_json(self) -> dict[str, object]:
        """Return the measures as plain values."""
        measured = self._measured()
        answer: dict[str, object] = {
            "volume": measured["volume"],
            **attributes(self.case.volume, "gradient empty_because"),
            "node_step": measured["node_step"],
            **measured.values,
            "extent": self._extent(),
            "mesh": mesh_json(self.solid),
        }
        if self.solid.agrees is False:
            answer["mesh_agrees"] = False
        if self.hull is not None:
            answer["hull_volume"] = self.hull.volume
        if self.inclusive is not None and self.total is not None:
            answer["orientations"] = self.orientations
            answer["inclusive_mesh"] = mesh_json(self.inclusive)
            answer["total_mesh"] = mesh_json(self.total)
        if self.held is not None:
            answer["held_volume"] = self.held.held_volume
            answer["held_mesh"] = mesh_json(self.held.solid)
            if self.held.factor is not None:
                answer["held_factor"] = self.held.factor
        if self.capability is not None:
            answer["orientation_capability"] = self.capability
        if self.interference is not None:
            answer |= interference_json(self.interference)
        if self.curve is not None:
            answer["radius_curve"] = curve_json(self.curve)
        return answer

    def as_lines(self) -> Iterator[str]:
        """Yield the measures as lines of text."""
        design, nodes, volume = self.case.design, self.case.paper_nodes, self.case.volume
        remarks = {"node_volume": f"{nodes.count} nodes at multiples of {nodes.step:.6g}"}
        volumes: list[tuple[str, float, str]] = []
        others: list[tuple[str, str]] = []
        for name, value in self._measured().values.items():
            measure = CATALOGUE[name]
            if measure.power == CATALOGUE["volume"].power:
                volumes.append((measure.heading, value or 0.0, remarks.get(name, "")))
            elif name not in _IN_REMARK:
                text = f"{measure_text(measure, value)} {measure.unit_in('units')}"
                others.append((measure.heading, text.rstrip()))
        volumes += self._volumes_of_meshes()
        accessible = self.interference
        if accessible is not None:
            remark = f"{accessible.accessible_node_count} of {accessible.node_count} nodes"
            title = CATALOGUE["accessible_volume"].heading
            volumes.append((title, accessible.accessible_volume, remark))
        cubic = (0.1 * design.unit_mm) ** 3
        rows = [("", "units³", "cm³", "")]
        rows += [(name, figure(v), figure(v * cubic), remark) for name, v, remark in volumes]
        yield table(rows, "<>><")
        if others:
            yield table(others, "<<")
        extent = self._extent()
        if extent is not None:
            yield from ("", "extent of the nodes")
            for axis, low, high in zip("xyz", *extent, strict=True):
                yield f"  {axis}  {figure(low)} to {figure(high)}"
        if volume.empty_because:
            yield from ("", f"empty because of {', '.join(volume.empty_because)}")
        if volume.gradient:
            rates = [("moves with", "units² (yaw: units³ a radian)")]
            rates += [(name, figure(rate)) for name, rate in volume.gradient.items()]
            yield from ("", table(rates, "<>"))
        if self.capability is not None:
            yield from ("", f"orientation capability {100.0 * self.capability:.2f} %")
        if accessible is not None:
            yield from ("", radii_line(design))
            yield from lines(workspace_clearances(accessible.pairs, design))
        if self.curve is not None:
            yield from ("", curve_table(design, self.curve, self.shift))

    def _volumes_of_meshes(self) -> Iterator[tuple[str, float, str]]:
        """Yield the name, the volume and a remark of each mesh."""
        yield "mesh", self.solid.volume, _mesh_remark(self.solid)
        if self.hull is not None:
            yield "convex hull", self.hull.volume, ""
        for name, solid in (
            ("inclusive workspace", self.inclusive),
            ("total workspace", self.total),
        ):
            if solid is not None:
                remark = f"{self.orientations} orientations, {_mesh_remark(solid)}"
                yield name, solid.volume, remark
        if self.held is not None:
            remark = _mesh_remark(self.held.solid)
            if self.held.factor is not None:
                remark += f"; {self.held.factor:.3g} of load and payload is held somewhere"
            yield "that holds the load", self.held.held_volume, remark


def _mesh_remark(solid: Solid) -> str:
    off = f", {DISAGREES}" if solid.agrees is False else ""
    if solid.is_empty:
        return f"empty because of {', '.join(solid.empty_because) or 'the tolerance'}{off}"
    state = "watertight" if solid.is_watertight else "not watertight"
    return f"{len(solid.faces)} triangles, {state}, tolerance {solid.tolerance:.3g}{off}"
