"""`explorer workspace` and `orientation`: the positions and the orientations within the limits."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Annotated

import numpy as np

from explorer.cli import options, output, values
from explorer.errors import InputError
from explorer.measures.blocks.clearances import workspace_clearances
from explorer.measures.catalogue import CATALOGUE, measure_design, measures_in
from explorer.measures.measure import Case
from explorer.mechanism.configuration import position_of
from explorer.mechanism.pose import Pose
from explorer.numerics.arrays import FloatArray
from explorer.numerics.number_text import UNITS
from explorer.workspace.accessible import radii, workspace as accessible
from explorer.workspace.orientations import share as shares, tilts
from explorer.workspace.solids import solids
from explorer.workspace.solids.solid import Solid, convex_hull

Range = Annotated[tuple[float, float] | None, values.numbers("low high"), values.OPTIONAL]

# The measures of nodes that the remark on their volume gives.
_IN_REMARK = ("node_count", "node_step")
# The number of rows of the radius curve in a table, less one.
ROWS = 10
# Default numbers of orientations: of a range of angles, and of a cone of tilts.
SAMPLES_ON_RANGE = 5
SAMPLES_OF_TILT = 33


@dataclass(frozen=True, kw_only=True)
class WorkspaceCommand(
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

    def run(self) -> None:
        """Write the measures of the workspace."""
        design = self.with_radii(self.read_design())
        pose = self.oriented_home(design)
        orientations = self._orientations(pose)
        case = Case(design, node_step=self.step, pose=pose)
        # Too fine a grid is refused before anything else is computed.
        answer = _Answer(case, self.shift(design, pose))
        self._add_meshes(answer, orientations)
        if self.capability is not None:
            count = self.samples or shares.CAPABILITY_ORIENTATIONS
            chosen = count if orientations is None else orientations
            tool = self.tool(design)
            capability = shares.orientation_capability(design, self.capability, chosen, tool)
            answer.values["orientation_capability"] = capability
            answer.lines += ["", f"orientation capability {100.0 * capability:.2f} %"]
        if self.interference:
            answer.add_accessible(
                accessible.accessible_part(
                    case.workspace, node_step=self.step, tolerance=self.tolerance
                )
            )
        if self.radius_curve:
            answer.add_curve(radii.radius_curve(case.workspace))
        angles = "  ".join(output.degrees(pose.yaw_pitch_roll))
        head = [output.heading(design), f"yaw pitch roll  {angles}", ""]
        if self.at == "tool":
            at = "  ".join(output.figures(design.tool.position))
            head.insert(2, f"of the tool point  {at}")
        cubic = (0.1 * design.unit_mm) ** 3
        rows = [
            (name, output.figure(volume), output.figure(volume * cubic), remark)
            for name, volume, remark in answer.volumes
        ]
        table = output.table([("", "units³", "cm³", ""), *rows], "<>><")
        self.write(lambda: answer.values, [*head, table, *answer.lines])

    def _add_meshes(self, answer: _Answer, orientations: FloatArray | None) -> None:
        """Add the volumes of the meshes: the workspace and what is asked for besides."""
        case = answer.case
        design, solid = case.design, solids.whole_solid(case.workspace, self.tolerance)
        answer.add_mesh("mesh", "mesh", solid)
        if solid.agrees is False:
            answer.values["mesh_agrees"] = False
        if self.hull:
            hull = convex_hull(solid).volume
            answer.values["hull_volume"] = hull
            answer.volumes.append(("convex hull", hull, ""))
        if orientations is not None:
            count, tool = len(orientations), self.tool(design)
            answer.values["orientations"] = count
            for name, solid_of in (
                ("inclusive", solids.inclusive_solid),
                ("total", solids.total_solid),
            ):
                mesh = solid_of(design, orientations, self.tolerance, tool)
                key, remark = f"{name}_mesh", f"{count} orientations, "
                answer.add_mesh(f"{name} workspace", key, mesh, remark)
        if self.load is not None:
            part = options.carrying_part(case.workspace, self.load, self.tolerance)
            answer.values["held_volume"] = part.held_volume
            answer.values["held_mesh"] = _mesh_json(part.solid)
            remark = _mesh_remark(part.solid)
            if part.factor is not None:
                answer.values["held_factor"] = part.factor
                remark += f"; {part.factor:.3g} of load and payload is held somewhere"
            answer.volumes.append(("that holds the load", part.held_volume, remark))

    def _orientations(self, pose: Pose) -> FloatArray | None:
        """Return the requested orientations, shape (n, 3, 3); None without any."""
        ranges = (self.yaw_range, self.pitch_range, self.roll_range)
        if self.tilt is not None:
            if any(ends is not None for ends in ranges):
                raise InputError("give ranges of angles or --tilt, not both")
            return shares.cone_of_directions(
                pose.rotation, self.tilt, self.samples or SAMPLES_OF_TILT
            )
        if all(ends is None for ends in ranges):
            if self.samples is not None and self.capability is None:
                raise InputError("--samples needs ranges of angles, --tilt or --capability")
            return None
        angles = pose.yaw_pitch_roll
        pairs = [ends or (angle, angle) for ends, angle in zip(ranges, angles, strict=True)]
        count = self.samples or SAMPLES_ON_RANGE
        return shares.yaw_pitch_roll_range(
            [low for low, _ in pairs],
            [high for _, high in pairs],
            [1 if ends is None else count for ends in ranges],
        )


class _Answer:
    """The measures of a workspace, as they are added: JSON, a table of volumes, lines below it.

    A row of the table is name, volume and remark; the shift (3,) leads from b4 to the point whose
    workspace it is.
    """

    def __init__(self, case: Case, shift: FloatArray) -> None:
        self.case, self.shift, nodes = case, shift, case.paper_nodes
        measured = measure_design(case, measures_in("workspace")).values
        extent = None if nodes.extent is None else np.array(nodes.extent) + shift
        self.values: dict[str, object] = {
            **measured,
            **output.attributes(case.volume, "gradient empty_because"),
            "extent": extent,
        }
        self.volumes: list[tuple[str, float, str]] = []
        self.lines: list[str] = []
        others: list[tuple[str, str]] = []
        for name, value in measured.items():
            measure = CATALOGUE[name]
            if measure.power == CATALOGUE["volume"].power:
                remarks = {"node_volume": f"{nodes.count} nodes at multiples of {nodes.step:.6g}"}
                if case.volume.error and not case.volume.gradient:
                    remarks["volume"] = f"± {case.volume.error:.1g}, since swings are bounded"
                self.volumes.append((measure.heading, value or 0.0, remarks.get(name, "")))
            elif name not in _IN_REMARK:
                text = "none" if value is None else output.figure(value)
                others.append((measure.heading, f"{text} {measure.unit_in(UNITS).name}".rstrip()))
        if others:
            self.lines.append(output.table(others, "<<"))
        if extent is not None:
            self.lines += ["", "extent of the nodes"]
            for axis, low, high in zip("xyz", *extent.tolist(), strict=True):
                self.lines.append(f"  {axis}  {output.figure(low)} to {output.figure(high)}")
        if case.volume.empty_because:
            self.lines += ["", f"empty because of {', '.join(case.volume.empty_because)}"]
        if case.volume.gradient:
            rates = [(name, output.figure(rate)) for name, rate in case.volume.gradient.items()]
            head = ("moves with", "units² (yaw: units³ a radian)")
            self.lines += ["", output.table([head, *rates], "<>")]

    def add_mesh(self, name: str, key: str, solid: Solid, remark: str = "") -> None:
        """Add a mesh about b4, and its volume with a remark."""
        self.values[key] = _mesh_json(solid)
        self.volumes.append((name, solid.volume, remark + _mesh_remark(solid)))

    def add_accessible(self, found: accessible.AccessibleWorkspace) -> None:
        """Add the accessible workspace, and what each pair of legs blocks."""
        self.values |= {
            **output.attributes(found, "accessible_volume accessible_node_count harmless_radius"),
            "pairs": [
                output.attributes(pair, "legs clearance bound blocked_volume")
                for pair in found.pairs
            ],
            "accessible_solid": _mesh_json(found.solid),
        }
        remark = f"{found.accessible_node_count} of {found.node_count} nodes"
        title = CATALOGUE["accessible_volume"].heading
        self.volumes.append((title, found.accessible_volume, remark))
        design = self.case.design
        self.lines += ["", output.radii_line(design)]
        self.lines += output.block_lines(workspace_clearances(found.pairs, design))

    def add_curve(self, curve: radii.RadiusCurve) -> None:
        """Add a radius curve at a few radii, and the largest radius without a loss."""
        values = output.attributes(curve, "radii volumes harmless harmless_bound")
        self.values["radius_curve"] = {**values, "closest": curve.closest_legs}
        rows = [("radius of all legs", "mm", "accessible (units³)", "share")]
        # The last radius comes twice: beyond it the volume is zero.
        last = max(0, len(curve.radii) - 2)
        for index in sorted({round(last * row / ROWS) for row in range(ROWS + 1)}):
            radius, volume = float(curve.radii[index]), float(curve.volumes[index])
            part = volume / float(curve.volumes[0]) if curve.volumes[0] > 0.0 else 0.0
            lengths = output.lengths(self.case.design, radius)
            rows.append((*lengths, output.figure(volume), f"{100.0 * part:.1f} %"))
        self.lines += ["", output.table(rows, ">>>>")]
        if curve.closest_legs is not None:
            i, j = curve.closest_legs
            at = np.array(curve.closest_position) + self.shift
            place = ", ".join(f"{x:.4g}" for x in at.tolist())
            if curve.harmless > 0.0:
                radius = output.figure(curve.harmless)
                self.lines.append(f"no legs collide up to a radius of {radius}")
                self.lines.append(f"legs {i} and {j} come closest, at ({place})")
            else:
                self.lines.append(f"no radius is harmless: legs {i} and {j} touch at ({place})")


def _mesh_json(solid: Solid) -> dict[str, object]:
    sizes = {"volume": solid.volume, "triangles": len(solid.faces)}
    return {**sizes, "watertight": solid.is_watertight}


def _mesh_remark(solid: Solid) -> str:
    off = f", {output.DISAGREES}" if solid.agrees is False else ""
    if solid.is_empty:
        return f"empty because of {', '.join(solid.empty_because) or 'the tolerance'}{off}"
    state = "watertight" if solid.is_watertight else "not watertight"
    return f"{len(solid.faces)} triangles, {state}, tolerance {solid.tolerance:.3g}{off}"


CONNECTED = "connected to tilt zero by a tilt without a gap"
NOT_CONNECTED = "not connected to tilt zero by a tilt within the limits"


@dataclass(frozen=True, kw_only=True)
class OrientationCommand(options.JsonOptions, options.PointOptions):
    """Measure the orientations of a position: share of all, greatest tilts, torsion.

    The platform tilts from tilt zero, at one torsion and in each azimuth, until it meets the first
    limit. Collisions of legs are not among the limits. With `--at tool` the tool stays in its
    place, and b4 moves about it.
    """

    position: Annotated[values.Position, values.OF_HOME] = None
    """Position of b4, or of the tool, in the base frame, in design units."""

    torsion: Annotated[values.Finite, values.OF_HOME] = None
    """Torsion of the tilts, in degrees."""

    samples: Annotated[int, values.whole_number(2, 1_000_000)] = 100_000
    """Number of orientations for the share."""

    def run(self) -> None:
        """Write the measures of the orientations."""
        design = self.read_design()
        home, tool = design.home_pose, self.tool(design)
        position = position_of(design, home, self.at) if self.position is None else self.position
        share = shares.orientation_share(design, position, self.samples, tool=tool)
        least = tilts.greatest_tilt(design, position, self.torsion, tool)
        by_azimuth = tilts.tilt_map(design, position, self.torsion, tool=tool)
        by_torsion = tilts.tilt_by_torsion(design, position, tool=tool)
        best = by_torsion.best
        torsions = tilts.torsion_range(design, position, self.torsion, tool=tool)
        is_home_connected = tilts.is_connected(design, position, home.rotation, tool=tool)
        name = "position" if self.at == "b4" else "tool position"
        rows = [
            ("share of all orientations", _share_words(share)),
            ("torsion", *output.degrees([least.torsion])),
            ("greatest tilt in every azimuth", _least_words(least)),
            ("largest at any torsion", _best_words(best)),
            ("torsion range at tilt zero", _range_words(torsions)),
            ("home orientation", CONNECTED if is_home_connected else NOT_CONNECTED),
        ]
        self.write(
            lambda: {
                name.replace(" ", "_"): position,
                **output.attributes(share, "share standard_error orientations"),
                "torsion": least.torsion,
                "greatest_tilt": least.tilt,
                **output.attributes(least, "azimuth limit"),
                **output.attributes(by_azimuth, "azimuths tilts limits"),
                "torsions": by_torsion.torsions,
                "tilts_by_torsion": by_torsion.tilts,
                "best_torsion": best.torsion,
                "best_tilt": best.tilt,
                "torsion_range": [torsions.low, torsions.high],
                "torsion_limits": [torsions.low_limit, torsions.high_limit],
                "home_connected": is_home_connected,
            },
            [
                output.heading(design),
                f"{name}  {'  '.join(output.figures(position))}",
                *("", output.table(rows, "<<"), ""),
                *([] if math.isnan(least.tilt) else [_azimuth_table(by_azimuth)]),
            ],
        )


def _azimuth_table(by_azimuth: tilts.TiltMap) -> str:
    ends = zip(by_azimuth.azimuths.tolist(), by_azimuth.tilts.tolist(), strict=True)
    rows = [
        (*output.degrees(pair), limit or "no limit")
        for pair, limit in zip(ends, by_azimuth.limits, strict=True)
    ]
    return output.table([("azimuth", "tilt", "ends at"), *rows], ">><")


def _share_words(share: shares.OrientationShare) -> str:
    if share.share in (0.0, 1.0):
        return f"{'all' if share.share else 'none'} of {share.orientations:,} orientations"
    error = f"standard error {output.figure(share.standard_error)}"
    return f"{output.figure(share.share)} ({error}, {share.orientations:,} orientations)"


def _least_words(least: tilts.GreatestTilt) -> str:
    if math.isnan(least.tilt):
        return f"none: tilt zero violates {least.limit}"
    tilt, azimuth = output.degrees([least.tilt, least.azimuth])
    if least.limit is None:
        return f"{tilt}, no limit"
    return f"{tilt} in azimuth {azimuth}, ended by {least.limit}"


def _best_words(best: tilts.GreatestTilt) -> str:
    if math.isnan(best.tilt):
        return "none: tilt zero violates a limit at every torsion"
    tilt, torsion = output.degrees([best.tilt, best.torsion])
    return f"{tilt} at torsion {torsion}"


def _range_words(torsions: tilts.TorsionRange) -> str:
    if math.isnan(torsions.low):
        return f"none: tilt zero violates {torsions.low_limit}"
    if torsions.low_limit is None:
        return "all"
    low, high = output.degrees([torsions.low, torsions.high])
    return f"{low} ({torsions.low_limit}) to {high} ({torsions.high_limit})"
