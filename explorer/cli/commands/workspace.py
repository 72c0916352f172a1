"""`explorer workspace`: the measures of the workspace, and of its accessible part."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property
from itertools import chain
from typing import TYPE_CHECKING, Annotated

import numpy as np

from explorer.cli import options, output, values
from explorer.cli.blocks import lines
from explorer.errors import InputError
from explorer.measures.blocks.clearances import workspace_clearances
from explorer.measures.catalogue import CATALOGUE, measure_design, measures_in
from explorer.measures.measure import Case
from explorer.mechanism.design import Design
from explorer.mechanism.pose import Pose, yaw_pitch_roll_from_rotation

if TYPE_CHECKING:
    from explorer.numerics.arrays import FloatArray
    from explorer.workspace.accessible.radii import RadiusCurve
    from explorer.workspace.accessible.workspace import AccessibleWorkspace
    from explorer.workspace.carried_region import CarriedRegion
    from explorer.workspace.solids.solid import Solid

Range = Annotated[tuple[float, float] | None, values.numbers("low high"), values.OPTIONAL]

# The measures of nodes that the remark on their volume gives.
_IN_REMARK = ("node_count", "node_step")
# The number of rows of the radius curve in a table, less one.
ROWS = 10
# Default numbers of orientations: of a range of angles, and of a cone of tilts.
SAMPLES_ON_RANGE = 5
SAMPLES_OF_TILT = 33


@dataclass(frozen=True, kw_only=True)
class Workspace(
    options.JsonOptions, options.RadiiOptions, options.OrientationOptions, options.PointOptions
):
    """Measure the workspace: exact volume and gradient, the paper's nodes, a mesh.

    Ranges or a tilt add the inclusive volume (union over these orientations) and the total
    volume (intersection). An empty workspace is an answer too, with the limits that empty it.
    With `--at tool` it is the workspace of the tool point: at one orientation moved as a whole,
    over several each by its own vector.
    """

    step: Annotated[values.Positive, values.OF_DESIGN] = None
    """Step of the paper's grid of nodes, in design units."""

    tolerance: Annotated[values.Positive, values.hint("default: a 500th of the reach")] = None
    """Largest distance of the mesh from the true surface, in design units."""

    hull: values.Flag = False
    """Add the convex hull."""

    interference: values.Flag = False
    """Add the accessible volume, without a collision of legs on the way from the home pose, and
    the volume that each pair blocks."""

    radius_curve: values.Flag = False
    """Add the accessible volume as a function of one radius of all legs, and the largest radius
    without a loss."""

    yaw_range: Range = None
    """Range of yaw in degrees; the other angles are those of the given orientation."""

    pitch_range: Range = None
    """Range of pitch in degrees."""

    roll_range: Range = None
    """Range of roll in degrees."""

    tilt: Annotated[values.Positive, values.OPTIONAL] = None
    """Half-angle of a cone of tilts of the platform, in degrees."""

    samples: Annotated[
        int | None,
        values.whole_number(1, 1_000_000),
        values.hint("default: 5 a range, 33 tilts, 100000 for a capability"),
    ] = None
    """Number of orientations: per range, of a tilt, or of all."""

    load: Annotated[values.Load, values.OPTIONAL] = None
    """Force in N and moment in N × unit at the tool, besides the payload: add the volume where it
    is held within the limits of actuators, struts and guide."""

    capability: Annotated[values.Position, values.OPTIONAL] = None
    """Position of b4, or of the tool, at which to compute the share of feasible orientations, among
    the given or all."""

    table1: values.Flag = False
    """Measure the claim table-1 of `explorer reproduce` instead: the paper's Table 1."""

    def run(self) -> None:
        """Write the measures of the workspace."""
        if self.table1:
            from explorer.cli.commands.reproduce import claim_lines
            from explorer.reproduce.claims import measure_claims

            (result,) = measure_claims(["table-1"])
            self.write(lambda: dict(result.measurement.values), claim_lines(result))
            return
        design = self.with_radii(self.read_design())
        pose = self.oriented_home(design)
        measures = self._measure(design, pose, self._orientations(pose))
        angles = "  ".join(output.degrees(yaw_pitch_roll_from_rotation(pose.rotation).tolist()))
        head = [output.heading(design), f"yaw pitch roll  {angles}", ""]
        if self.at == "tool":
            tool = "  ".join(output.figures(design.tool.position))
            head.insert(2, f"of the tool point  {tool}")
        self.write(measures.as_json, chain(head, measures.as_lines()))

    def _measure(
        self, design: Design, pose: Pose, orientations: FloatArray | None
    ) -> WorkspaceMeasures:
        from explorer.workspace.solids import solids
        from explorer.workspace.solids.solid import convex_hull

        case, rotation = Case(design, node_step=self.step, pose=pose), pose.rotation
        # Too fine a grid is refused before anything else is computed.
        _ = case.paper_nodes
        solid = solids.workspace_solid(design, rotation, self.tolerance, volume=case.volume)
        shift, tool = self.shift(design, pose), self.tool(design)
        measures = WorkspaceMeasures(case, shift, solid if shift is None else solid.shifted(shift))
        if self.hull:
            measures.hull = convex_hull(measures.solid)
        if orientations is not None:
            measures.orientations = len(orientations)
            measures.inclusive = solids.inclusive_solid(design, orientations, self.tolerance, tool)
            measures.total = solids.total_solid(design, orientations, self.tolerance, tool)
        if self.capability is not None:
            from explorer.workspace.orientations.share import (
                CAPABILITY_ORIENTATIONS,
                orientation_capability,
            )

            count = self.samples or CAPABILITY_ORIENTATIONS
            chosen = count if orientations is None else orientations
            measures.capability = orientation_capability(design, self.capability, chosen, tool)
        if self.load is not None:
            measures.carrying = options.carrying_part(design, rotation, self.load, self.tolerance)
        if self.interference:
            from explorer.workspace.accessible.workspace import accessible_workspace

            measures.accessible = accessible_workspace(
                design, rotation, node_step=self.step, tolerance=self.tolerance
            )
        if self.radius_curve:
            from explorer.workspace.accessible.radii import radius_curve

            measures.curve = radius_curve(design, rotation)
        return measures

    def _orientations(self, pose: Pose) -> FloatArray | None:
        """Return the requested orientations, shape (n, 3, 3); None without any."""
        from explorer.workspace.orientations.share import cone_of_directions, yaw_pitch_roll_range

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
        count = self.samples or SAMPLES_ON_RANGE
        return yaw_pitch_roll_range(
            [low for low, _ in pairs],
            [high for _, high in pairs],
            [1 if ends is None else count for ends in ranges],
        )


@dataclass
class WorkspaceMeasures:
    """The measures of a workspace; None if not requested.

    Attributes:
        case: Design and orientation, with the exact volume and the nodes of the workspace.
        shift: Vector from b4 to the tool point whose workspace it is, shape (3,); None for b4.
        solid: Mesh of the workspace.
        hull: Convex hull of the mesh.
        orientations: Number of orientations of the next two.
        inclusive: Union of the workspaces over the orientations.
        total: Intersection of the workspaces over the orientations.
        capability: Share of feasible orientations at a position, from 0 to 1.
        carrying: Part where a load is held.
        accessible: Accessible workspace.
        curve: Accessible volume as a function of the radius of all legs.
    """

    case: Case
    shift: FloatArray | None
    solid: Solid
    hull: Solid | None = None
    orientations: int | None = None
    inclusive: Solid | None = None
    total: Solid | None = None
    capability: float | None = None
    carrying: CarriedRegion | None = None
    accessible: AccessibleWorkspace | None = None
    curve: RadiusCurve | None = None

    @cached_property
    def measured(self) -> Mapping[str, float | None]:
        """Values of the measures in the catalogue."""
        return measure_design(self.case, measures_in("workspace")).values

    @property
    def extent(self) -> FloatArray | None:
        """The lowest and the highest position of the counted nodes, shape (2, 3)."""
        extent = self.case.paper_nodes.extent
        shift = 0.0 if self.shift is None else self.shift
        return None if extent is None else np.array(extent) + shift

    def as_json(self) -> dict[str, object]:
        """Return the measures as plain values."""
        meshes = {"inclusive_mesh": self.inclusive, "total_mesh": self.total}
        answer: dict[str, object] = {
            "volume": self.measured["volume"],
            **output.attributes(self.case.volume, "gradient empty_because"),
            "node_step": self.measured["node_step"],
            **self.measured,
            "extent": self.extent,
            "mesh": output.mesh_json(self.solid),
        }
        if self.solid.agrees is False:
            answer["mesh_agrees"] = False
        if self.hull is not None:
            answer["hull_volume"] = self.hull.volume
        if self.orientations is not None:
            answer["orientations"] = self.orientations
        answer |= {key: output.mesh_json(mesh) for key, mesh in meshes.items() if mesh is not None}
        if self.carrying is not None:
            answer["held_volume"] = self.carrying.held_volume
            answer["held_mesh"] = output.mesh_json(self.carrying.solid)
            if self.carrying.factor is not None:
                answer["held_factor"] = self.carrying.factor
        if self.capability is not None:
            answer["orientation_capability"] = self.capability
        if self.accessible is not None:
            found = self.accessible
            answer |= {
                **output.attributes(found, "accessible_volume accessible_node_count"),
                "harmless_radius": output.finite(found.harmless_radius),
                "pairs": [
                    {
                        "legs": pair.legs,
                        "clearance": output.finite(pair.clearance),
                        "bound": output.finite(pair.bound),
                        "blocked_volume": pair.blocked_volume,
                    }
                    for pair in found.pairs
                ],
                "accessible_solid": output.mesh_json(found.solid),
            }
        if self.curve is not None:
            curve = output.attributes(self.curve, "radii volumes harmless harmless_bound")
            answer["radius_curve"] = {**curve, "closest": self.curve.closest_legs}
        return answer

    def as_lines(self) -> Iterator[str]:
        """Yield the measures as lines of text."""
        design, nodes, volume = self.case.design, self.case.paper_nodes, self.case.volume
        rows: list[tuple[str, float, str]] = []
        others: list[tuple[str, str]] = []
        for name, value in self.measured.items():
            measure = CATALOGUE[name]
            if measure.power == CATALOGUE["volume"].power:
                remark = f"{nodes.count} nodes at multiples of {nodes.step:.6g}"
                remark = remark if name == "node_volume" else ""
                rows.append((measure.heading, value or 0.0, remark))
            elif name not in _IN_REMARK:
                text = "none" if value is None else output.figure(value)
                others.append((measure.heading, f"{text} {measure.unit_in('units')}".rstrip()))
        rows += self._volumes_of_meshes()
        accessible = self.accessible
        if accessible is not None:
            remark = f"{accessible.accessible_node_count} of {accessible.node_count} nodes"
            title = CATALOGUE["accessible_volume"].heading
            rows.append((title, accessible.accessible_volume, remark))
        cubic = (0.1 * design.unit_mm) ** 3
        cells = [(name, output.figure(v), output.figure(v * cubic), text) for name, v, text in rows]
        yield output.table([("", "units³", "cm³", ""), *cells], "<>><")
        if others:
            yield output.table(others, "<<")
        if self.extent is not None:
            yield from ("", "extent of the nodes")
            for axis, low, high in zip("xyz", *self.extent.tolist(), strict=True):
                yield f"  {axis}  {output.figure(low)} to {output.figure(high)}"
        if volume.empty_because:
            yield from ("", f"empty because of {', '.join(volume.empty_because)}")
        if volume.gradient:
            rates = [(name, output.figure(rate)) for name, rate in volume.gradient.items()]
            head = ("moves with", "units² (yaw: units³ a radian)")
            yield from ("", output.table([head, *rates], "<>"))
        if self.capability is not None:
            yield from ("", f"orientation capability {100.0 * self.capability:.2f} %")
        if accessible is not None:
            yield from ("", output.radii_line(design))
            yield from lines(workspace_clearances(accessible.pairs, design))
        if self.curve is not None:
            yield from ("", *_curve_lines(design, self.curve, self.shift))

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
        if self.carrying is not None:
            remark = _mesh_remark(self.carrying.solid)
            if self.carrying.factor is not None:
                remark += f"; {self.carrying.factor:.3g} of load and payload is held somewhere"
            yield "that holds the load", self.carrying.held_volume, remark


def _mesh_remark(solid: Solid) -> str:
    off = f", {output.DISAGREES}" if solid.agrees is False else ""
    if solid.is_empty:
        return f"empty because of {', '.join(solid.empty_because) or 'the tolerance'}{off}"
    state = "watertight" if solid.is_watertight else "not watertight"
    return f"{len(solid.faces)} triangles, {state}, tolerance {solid.tolerance:.3g}{off}"


def _curve_lines(design: Design, curve: RadiusCurve, shift: FloatArray | None) -> Iterator[str]:
    """Yield a radius curve at a few radii, and the largest radius without a loss."""
    rows = [("radius of all legs", "mm", "accessible (units³)", "share")]
    # The last radius comes twice: beyond it the volume is zero.
    last = max(0, len(curve.radii) - 2)
    for index in sorted({round(last * row / ROWS) for row in range(ROWS + 1)}):
        radius, volume = float(curve.radii[index]), float(curve.volumes[index])
        share = volume / float(curve.volumes[0]) if curve.volumes[0] > 0.0 else 0.0
        rows.append(
            (*output.lengths(design, radius), output.figure(volume), f"{100.0 * share:.1f} %")
        )
    yield output.table(rows, ">>>>")
    if curve.closest_legs is not None:
        i, j = curve.closest_legs
        at = np.array(curve.closest_position) + (0.0 if shift is None else shift)
        place = ", ".join(f"{x:.4g}" for x in at.tolist())
        if curve.harmless > 0.0:
            yield f"no legs collide up to a radius of {output.figure(curve.harmless)}"
            yield f"legs {i} and {j} come closest, at ({place})"
        else:
            yield f"no radius is harmless: legs {i} and {j} touch at ({place})"
