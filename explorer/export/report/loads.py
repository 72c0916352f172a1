"""The loads of a report: a design under its payload in one pose, and over its workspace."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import msgspec

from explorer.measures.case import Case
from explorer.mechanism.machine import Payload, Tool
from explorer.statics.loaded import LoadedPose, WorstForce


@dataclass(frozen=True)
class ReportLoads:
    """A design with a machine around it, in the pose of a report.

    The load is the payload's weight and its force of any direction; the legs count as weightless.

    Attributes:
        case: Design and pose, as the catalogue measures them.
    """

    case: Case

    @cached_property
    def loaded(self) -> LoadedPose:
        """The pose under the payload."""
        return LoadedPose(self.case.design, self.case.at)

    @cached_property
    def worst_payload_force(self) -> WorstForce:
        """The direction of the payload's force that uses the largest share of a limit."""
        design, force = self.case.design, self.case.design.payload.force_n
        payload = msgspec.structs.replace(design.payload, force_n=0.0)
        weighed = msgspec.structs.replace(design, payload=payload)
        return LoadedPose(weighed, self.case.at).worst_force(force)


def loads_of(case: Case) -> ReportLoads | None:
    """Return the loads of a design; None if it has no tool, no payload and no limit of a force."""
    design = case.design
    has_machine = design.tool != Tool() or design.payload != Payload() or case.is_limited
    return ReportLoads(case) if has_machine else None
