"""The data of a report, computed by the functions that the page and the command line use.

A value that cannot be computed does not stop the report: the reason stands in its place.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TypeVar

import numpy as np

from explorer.errors import ExplorerError
from explorer.export.simulation import DENSITY
from explorer.measures.catalogue import measures_in
from explorer.measures.measure import Case
from explorer.measures.measurements import Measurements, measure_design
from explorer.measures.snapshot import Snapshot, evaluate
from explorer.mechanism.design import Design
from explorer.mechanism.machine import Payload, Tool
from explorer.mechanism.pose import Pose
from explorer.optimise.record import Record
from explorer.prototype.assembly import Bill, bill_of_materials, make_prototype
from explorer.statics.compliance import largest_deflection
from explorer.statics.loaded import LoadedPose, ToolPrecision
from explorer.workspace.accessible.workspace import AccessibleWorkspace, accessible_workspace
from explorer.workspace.carried_region import CarriedRegion
from explorer.workspace.slices.volume import NodeCount, Volume
from explorer.workspace.solids.solid import Solid
from explorer.workspace.solids.solids import workspace_solid

T = TypeVar("T")


@dataclass(frozen=True)
class Missing:
    """A value that could not be computed.

    Attributes:
        reason: Reason, in one line.
    """

    reason: str


def compute(function: Callable[[], T]) -> T | Missing:
    """Return the value of a function, or why it cannot be computed."""
    try:
        return function()
    except ExplorerError as error:
        return Missing(str(error))


@dataclass(frozen=True)
class ReportData:
    """The data of a report: a design in a pose and its workspace at that orientation.

    Attributes:
        case: Design and pose, as the catalogue measures them.
        record: Record of the search that found the design; None without one.
    """

    case: Case
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
    def is_home(self) -> bool:
        """Whether the pose is the home pose."""
        return self.case.at == self.design.home_pose

    @property
    def pose_words(self) -> str:
        """The words for the pose."""
        return "its home pose" if self.is_home else "the pose of this report"

    @cached_property
    def measured(self) -> Measurements:
        """Measures of the catalogue that the report lists."""
        return measure_design(self.case, measures_in("report"))

    @cached_property
    def snapshot(self) -> Snapshot:
        """Values of the design in the pose."""
        return evaluate(self.design, self.case.at)

    @cached_property
    def nodes(self) -> NodeCount | Missing:
        """Nodes of the workspace, counted as in the paper."""
        return compute(lambda: self.case.paper_nodes)

    @cached_property
    def solid(self) -> Solid | Missing:
        """Mesh of the workspace."""
        if self.volume.volume <= 0.0:
            return Missing("the workspace is empty")
        return compute(lambda: workspace_solid(self.design, self.case.rotation, volume=self.volume))

    @cached_property
    def accessible(self) -> AccessibleWorkspace | Missing | None:
        """Accessible part of the workspace; None where all legs have zero radius."""
        if not any(self.design.limits.leg_radii):
            return None
        at = self.case.at
        return compute(lambda: accessible_workspace(self.design, at.rotation, start=at.position))

    @property
    def loaded(self) -> LoadedPose:
        """The pose under the payload's weight and its force of any direction."""
        return LoadedPose(self.design, self.case.at)

    @property
    def has_machine(self) -> bool:
        """Whether the design has a tool, a payload or a limit of a force."""
        has_load = self.design.tool != Tool() or self.design.payload != Payload()
        return has_load or self.case.is_limited

    @cached_property
    def held(self) -> CarriedRegion | Missing | None:
        """Part of the workspace that holds the payload; None without a payload or limits."""
        if not (self.case.is_loaded and self.case.is_limited):
            return None
        return compute(lambda: self.case.held)

    @cached_property
    def precision(self) -> ToolPrecision | None:
        """Errors and deflection in the pose; None of a design that is exact and rigid.

        The load is the payload's weight, and its force in the direction that moves the tool most.
        """
        weighed = ToolPrecision(self.loaded)
        if not (weighed.has_errors or self.case.is_elastic):
            return None
        force = self.design.payload.force_n
        _, worst = largest_deflection(weighed.compliance, weighed.wrench, force)
        if not np.isfinite(worst).all():
            return weighed
        x, y, z = worst.tolist()
        return ToolPrecision(replace(weighed.loaded, load=(x, y, z, 0.0, 0.0, 0.0)))

    @cached_property
    def bill(self) -> Bill | Missing:
        """Bill of the prototype's parts."""
        return compute(lambda: bill_of_materials(make_prototype(self.design), DENSITY))


def gather_report_data(
    design: Design, pose: Pose | None = None, record: Record | None = None
) -> ReportData:
    """Return the data of a report, which are computed when they are read.

    Args:
        design: The manipulator.
        pose: Pose of the platform, whose orientation is that of the workspace; the home pose if
            None.
        record: Record of the search that found the design.
    """
    return ReportData(Case(design, pose=pose), record)
