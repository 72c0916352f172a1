"""The data of a report, computed by the functions that the page and the command line use.

A value that cannot be computed does not stop the report: the reason stands in its place.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TypeVar

from explorer.errors import ExplorerError
from explorer.export.report.loads import ReportLoads, loads_of
from explorer.export.report.precision import precision_of
from explorer.export.simulation import DENSITY
from explorer.measures.case import Case
from explorer.measures.catalogue import measures_in
from explorer.measures.measurements import Measurements, measure_design
from explorer.measures.snapshot import Snapshot, evaluate
from explorer.mechanism.design import Design
from explorer.mechanism.pose import Pose
from explorer.optimise.record import Record
from explorer.prototype.assembly import make_prototype
from explorer.prototype.bill import Bill, bill_of_materials
from explorer.singularity.ellipsoids import (
    Performance,
    SingularityFreeBall,
    certified_radius,
    performance,
    singularity_free_ball,
)
from explorer.statics.tool_precision import ToolPrecision
from explorer.workspace.accessible.workspace import AccessibleWorkspace, accessible_workspace
from explorer.workspace.held import HeldWorkspace
from explorer.workspace.least_clearance import LeastClearances, least_clearances
from explorer.workspace.slices.volume import NodeCount, Volume
from explorer.workspace.solids.solid import Solid
from explorer.workspace.solids.solids import convex_hull, workspace_solid

T = TypeVar("T")


@dataclass(frozen=True)
class Missing:
    """A value that could not be computed.

    Attributes:
        reason: Reason, in one line.
    """

    reason: str


@dataclass(frozen=True)
class ReportData:
    """The data of a report: a design in a pose and its workspace at that orientation.

    Attributes:
        case: Design and pose, as the catalogue measures them.
        measured: Measures of the catalogue that the report lists.
        snapshot: Values of the design in the pose.
        is_home: Whether the pose is the home pose.
        nodes: Nodes of the workspace, counted as in the paper.
        solid: Mesh of the workspace.
        hull_volume: Volume of the convex hull of the mesh, in cubed design units.
        least: Least clearances of the legs over the workspace.
        accessible: Accessible part of the workspace; None where all legs have zero radius.
        performance: Ellipsoids of the pose.
        ball: Largest ball of positions about the pose that holds no singular one.
        certified: Root-mean-square displacement of b1 to b4, in design units, below which no
            pose is singular.
        loads: The pose under the payload; None without a tool, a payload and limits of forces.
        held: Part of the workspace that holds the payload; None without a payload or limits.
        precision: Errors and deflection in the pose; None of a design that is exact and rigid.
        bill: Bill of the prototype's parts.
        record: Record of the search that found the design; None without one.
    """

    case: Case
    measured: Measurements
    snapshot: Snapshot
    is_home: bool
    nodes: NodeCount | Missing
    solid: Solid | Missing
    hull_volume: float | Missing
    least: LeastClearances
    accessible: AccessibleWorkspace | Missing | None
    performance: Performance
    ball: SingularityFreeBall
    certified: float
    loads: ReportLoads | None
    held: HeldWorkspace | Missing | None
    precision: ToolPrecision | None
    bill: Bill | Missing
    record: Record | None

    @property
    def design(self) -> Design:
        """The design."""
        return self.case.design

    @property
    def unit_mm(self) -> float:
        """Millimetres per design unit."""
        return self.design.unit_mm

    @property
    def volume(self) -> Volume:
        """The exact volume of the workspace."""
        return self.case.volume

    @property
    def pose_words(self) -> str:
        """The words for the pose."""
        return "its home pose" if self.is_home else "the pose of this report"


def gather_report_data(
    design: Design, pose: Pose | None = None, record: Record | None = None
) -> ReportData:
    """Compute the data of a report.

    Args:
        design: The manipulator.
        pose: Pose of the platform, whose orientation is that of the workspace; the home pose if
            None.
        record: Record of the search that found the design.
    """
    case = Case(design, pose=pose)
    at, r = case.at, case.rotation
    solid = Missing("the workspace is empty")
    if case.volume.volume > 0.0:
        solid = _compute(lambda: workspace_solid(design, r, volume=case.volume))
    accessible = None
    if any(design.limits.leg_radii):
        accessible = _compute(lambda: accessible_workspace(design, r, start=at.position))
    held = None
    if case.is_loaded and case.is_limited:
        held = _compute(lambda: case.held)
    return ReportData(
        case=case,
        measured=measure_design(case, measures_in("report")),
        snapshot=evaluate(design, at),
        is_home=at == design.home_pose,
        nodes=_compute(lambda: case.paper_nodes),
        solid=solid,
        hull_volume=solid if isinstance(solid, Missing) else _compute(lambda: _hull(solid)),
        least=least_clearances(design, r),
        accessible=accessible,
        performance=performance(design, at),
        ball=singularity_free_ball(at),
        certified=certified_radius(design, at),
        loads=loads_of(case),
        held=held,
        precision=precision_of(case),
        bill=_compute(lambda: bill_of_materials(make_prototype(design), DENSITY)),
        record=record,
    )


def _hull(solid: Solid) -> float:
    return convex_hull(solid).volume


def _compute(function: Callable[[], T]) -> T | Missing:
    """Return the value of a function, or why it cannot be computed."""
    try:
        return function()
    except ExplorerError as error:
        return Missing(str(error))
