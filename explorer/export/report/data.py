"""The data of a report, computed by the functions that the page and the command line use.

A value that cannot be computed does not stop the report: the reason stands in its place.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, TypeVar, cast

import msgspec
import numpy as np

from explorer.errors import ExplorerError, NoAnswerError
from explorer.find.answers import RequirementCheck
from explorer.find.check import check_requirement
from explorer.find.requirement import Requirement
from explorer.measures.catalogue import Measurements, measure_design, measures_in
from explorer.measures.measure import Case
from explorer.measures.snapshot import Snapshot, evaluate
from explorer.mechanism.design import Limits
from explorer.mechanism.machine import Payload, Tool
from explorer.motion.masses import DENSITY
from explorer.numerics.arrays import triple
from explorer.optimise.outcome import Record
from explorer.paths.drives import TimedPath
from explorer.prototype.assembly import Bill, bill_of_materials, make_prototype
from explorer.statics.compliance import largest_deflection
from explorer.statics.loaded import LoadedPose, ToolPrecision
from explorer.workspace.accessible.workspace import AccessibleWorkspace, accessible_part
from explorer.workspace.carried_region import CarriedRegion
from explorer.workspace.slices.volume import NodeCount
from explorer.workspace.solids.solid import Solid
from explorer.workspace.solids.solids import whole_solid

T = TypeVar("T")


def compute(function: Callable[[], T]) -> T | ExplorerError:
    """Return the value of a function, or why it cannot be computed."""
    try:
        return function()
    except ExplorerError as error:
        return error


@dataclass
class ReportData(Case):
    """The data of a report: a design in a pose and its workspace at that orientation.

    The record is of the search that found the design, the path one with speeds and forces, the
    requirement what the design is checked against. Where lengths are in millimetres, `filed` is the
    same in the unit of the design's file.
    """

    record: Record | None = None
    path: TimedPath | None = None
    requirement: Requirement | None = None
    filed: ReportData | None = None

    @property
    def as_filed(self) -> ReportData:
        """The data in the unit of the design's file."""
        return self.filed or self

    def in_millimetres(self) -> ReportData:
        """Return the data of the same design in a design unit of 1 mm."""
        design, unit = self.design, self.design.unit_mm

        def scale(value: Any) -> Any:
            if isinstance(value, tuple):
                return tuple(map(scale, cast("tuple[Any, ...]", value)))
            return unit * value if isinstance(value, float) else value

        def scaled(whole: Any, *names: str) -> Any:
            lengths = {name: scale(getattr(whole, name)) for name in names}
            return msgspec.structs.replace(whole, **lengths)

        limits = (name for name in Limits.__struct_fields__ if name != "swing")
        lengths = scaled(design, "a3", "b1", "b2", "b3", "node_step", "required_box")
        changed = msgspec.structs.replace(
            lengths,
            unit_mm=1.0,
            limits=scaled(design.limits, *limits),
            home=scaled(design.home_pose, "position"),
            tool=scaled(design.tool, "position"),
            payload=scaled(design.payload, "centre"),
        )
        return replace(self, design=changed, pose=scaled(self.at, "position"), filed=self)

    @property
    def is_home(self) -> bool:
        """Whether the pose is the home pose."""
        return self.at == self.design.home_pose

    @property
    def pose_words(self) -> str:
        """The words for the pose."""
        return "its home pose" if self.is_home else "the pose of this report"

    @property
    def measurements(self) -> Measurements:
        """Measures of the catalogue that the report lists."""
        return measure_design(self, measures_in("report"))

    @cached_property
    def snapshot(self) -> Snapshot:
        """Values of the design in the pose."""
        return evaluate(self.design, self.at)

    @property
    def node_count(self) -> NodeCount | ExplorerError:
        """Nodes of the workspace, counted as in the paper."""
        return compute(lambda: self.paper_nodes)

    @property
    def solid(self) -> Solid | ExplorerError:
        """Mesh of the workspace."""
        if self.volume.volume <= 0.0:
            return NoAnswerError("the workspace is empty")
        return compute(lambda: whole_solid(self.workspace))

    @property
    def accessible(self) -> AccessibleWorkspace | ExplorerError | None:
        """Accessible part of the workspace; None where all legs have zero radius."""
        if not any(self.design.limits.leg_radii):
            return None
        return compute(lambda: accessible_part(self.workspace, self.at.position))

    @property
    def loaded_pose(self) -> LoadedPose:
        """The pose under the payload's weight and its force of any direction."""
        return LoadedPose(self.design, self.at)

    @property
    def has_machine(self) -> bool:
        """Whether the design has a tool, a payload or a limit of a force."""
        has_load = self.design.tool != Tool() or self.design.payload != Payload()
        return has_load or self.has("is_limited")

    @property
    def carrying_part(self) -> CarriedRegion | ExplorerError | None:
        """Part of the workspace that holds the payload; None without a payload or limits."""
        if not (self.has("is_loaded") and self.has("is_limited")):
            return None
        return compute(lambda: self.carried_region)

    @cached_property
    def precision(self) -> ToolPrecision | None:
        """Errors and deflection in the pose; None of a design that is exact and rigid.

        The load is the payload's weight, and its force in the direction that moves the tool most.
        """
        weighed = ToolPrecision(self.loaded_pose)
        if not (weighed.has_errors or self.has("is_elastic")):
            return None
        force = self.design.payload.force_n
        _, worst = largest_deflection(weighed.compliance, weighed.wrench, force)
        if not np.isfinite(worst).all():
            return weighed
        return ToolPrecision(weighed.loaded.with_load((*triple(worst), 0.0, 0.0, 0.0)))

    @property
    def check(self) -> RequirementCheck | ExplorerError | None:
        """Check of the design against the requirement; None without one."""
        needed = self.requirement
        return needed and compute(lambda: check_requirement(self.design, needed))

    @cached_property
    def bill(self) -> Bill | ExplorerError:
        """Bill of the prototype's parts."""
        return compute(lambda: bill_of_materials(make_prototype(self.design), DENSITY))
