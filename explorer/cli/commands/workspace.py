"""`explorer workspace`: the measures of the workspace."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated

from explorer.cli.answers.workspace import WorkspaceMeasures
from explorer.cli.load_options import held_by
from explorer.cli.options import (
    DesignOptions,
    JsonOptions,
    OrientationOptions,
    PointOptions,
    RadiiOptions,
)
from explorer.cli.output import degrees, figures, heading
from explorer.cli.values import (
    OPTIONAL,
    Flag,
    hint,
    load_numbers,
    numbers,
    positive,
    whole_number,
)
from explorer.errors import InputError
from explorer.measures.case import Case
from explorer.mechanism.design import Design
from explorer.mechanism.machine import Six
from explorer.mechanism.pose import Pose, Triple, yaw_pitch_roll_from_rotation

if TYPE_CHECKING:
    from explorer.numerics.arrays import FloatArray
    from explorer.workspace.accessible.radii import RadiusCurve
    from explorer.workspace.accessible.workspace import AccessibleWorkspace
    from explorer.workspace.held import HeldWorkspace

Ends = tuple[float, float]

# Default numbers of orientations: of a range of angles, and of a cone of tilts.
SAMPLES_ON_RANGE = 5
SAMPLES_OF_TILT = 33


@dataclass(frozen=True, kw_only=True)
class Workspace(JsonOptions, RadiiOptions, OrientationOptions, PointOptions, DesignOptions):
    """Measure the workspace: exact volume and gradient, the paper's nodes, a mesh.

    Ranges or a tilt add the inclusive volume (union over these orientations) and the total
    volume (intersection). An empty workspace is an answer too, with the limits that empty it.
    With `--at tool` it is the workspace of the tool point: at one orientation moved as a whole,
    over several each by its own vector.
    """

    step: Annotated[float | None, positive("--step"), hint("default: that of the design")] = None
    """Step of the paper's grid of nodes, in design units."""

    tolerance: Annotated[
        float | None, positive("--tolerance"), hint("default: a 500th of the reach")
    ] = None
    """Largest distance of the mesh from the true surface, in design units."""

    hull: Flag = False
    """Add the convex hull."""

    interference: Flag = False
    """Add the accessible volume, without a collision of legs on the way from the home pose, and
    the volume that each pair blocks."""

    radius_curve: Flag = False
    """Add the accessible volume as a function of one radius of all legs, and the largest radius
    without a loss."""

    yaw_range: Annotated[Ends | None, numbers("--yaw-range", "low high"), OPTIONAL] = None
    """Range of yaw in degrees; the other angles are those of the given orientation."""

    pitch_range: Annotated[Ends | None, numbers("--pitch-range", "low high"), OPTIONAL] = None
    """Range of pitch in degrees."""

    roll_range: Annotated[Ends | None, numbers("--roll-range", "low high"), OPTIONAL] = None
    """Range of roll in degrees."""

    tilt: Annotated[float | None, positive("--tilt"), OPTIONAL] = None
    """Half-angle of a cone of tilts of the platform, in degrees."""

    samples: Annotated[
        int | None,
        whole_number("--samples", 1, 1_000_000),
        hint("default: 5 a range, 33 tilts, 100000 for a capability"),
    ] = None
    """Number of orientations: per range, of a tilt, or of all."""

    load: Annotated[Six | None, load_numbers("--load"), OPTIONAL] = None
    """Force in N and moment in N × unit at the tool, besides the payload: add the volume where it
    is held within the limits of actuators, struts and guide."""

    capability: Annotated[Triple | None, numbers("--capability", "x y z"), OPTIONAL] = None
    """Position of b4, or of the tool, at which to compute the share of feasible orientations, among
    the given or all."""

    table1: Flag = False
    """Measure the claim table-1 of `explorer reproduce` instead: the paper's Table 1."""

    def run(self) -> None:
        """Write the measures of the workspace."""
        if self.table1:
            from explorer.cli.commands.reproduce import claim_lines
            from explorer.reproduce.claims import measure_claims

            (result,) = measure_claims(["table-1"])
            self.write(lambda: dict(result.measurement.values), lambda: claim_lines(result))
            return
        design = self.with_radii(self.read_design())
        pose = self.oriented_home(design)
        measures = self._measure(design, pose, self._orientations(pose))
        angles = "  ".join(degrees(yaw_pitch_roll_from_rotation(pose.rotation).tolist()))
        head = [heading(design), f"yaw pitch roll  {angles}", ""]
        if self.at == "tool":
            tool = "  ".join(figures(design.tool.position))
            head.insert(2, f"of the tool point  {tool}")
        self.write(measures.as_json, lambda: (*head, *measures.as_lines()))

    def _measure(
        self, design: Design, pose: Pose, orientations: FloatArray | None
    ) -> WorkspaceMeasures:
        from explorer.workspace.solids import solids

        case = Case(design, node_step=self.step, pose=pose)
        # Too fine a grid is refused before anything else is computed.
        _ = case.paper_nodes
        solid = solids.workspace_solid(design, pose.rotation, self.tolerance, volume=case.volume)
        shift, tool = self.shift(design, pose), self.tool(design)
        if shift is not None:
            solid = solid.shifted(shift)
        inclusive = total = None
        if orientations is not None:
            inclusive = solids.inclusive_solid(design, orientations, self.tolerance, tool)
            total = solids.total_solid(design, orientations, self.tolerance, tool)
        return WorkspaceMeasures(
            case=case,
            shift=shift,
            solid=solid,
            hull=solids.convex_hull(solid) if self.hull else None,
            orientations=None if orientations is None else len(orientations),
            inclusive=inclusive,
            total=total,
            capability=self._share(design, orientations),
            held=self._held(design, pose),
            interference=self._interference(design, pose),
            curve=self._curve(design, pose),
        )

    def _interference(self, design: Design, pose: Pose) -> AccessibleWorkspace | None:
        if not self.interference:
            return None
        from explorer.workspace.accessible.workspace import accessible_workspace

        return accessible_workspace(
            design, pose.rotation, node_step=self.step, tolerance=self.tolerance
        )

    def _held(self, design: Design, pose: Pose) -> HeldWorkspace | None:
        if self.load is None:
            return None
        return held_by(design, pose.rotation, self.load, self.tolerance)

    def _curve(self, design: Design, pose: Pose) -> RadiusCurve | None:
        if not self.radius_curve:
            return None
        from explorer.workspace.accessible.radii import radius_curve

        return radius_curve(design, pose.rotation)

    def _orientations(self, pose: Pose) -> FloatArray | None:
        """Return the requested orientations, shape (n, 3, 3); None without any."""
        from explorer.workspace.orientations.sets import cone_of_directions, yaw_pitch_roll_range

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

    def _share(self, design: Design, orientations: FloatArray | None) -> float | None:
        if self.capability is None:
            return None
        from explorer.workspace.orientations.share import (
            CAPABILITY_ORIENTATIONS,
            orientation_capability,
        )

        count = self.samples or CAPABILITY_ORIENTATIONS
        chosen = count if orientations is None else orientations
        return orientation_capability(design, self.capability, chosen, self.tool(design))
