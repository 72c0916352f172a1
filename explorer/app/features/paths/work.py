"""The task of the planner's own process."""

from __future__ import annotations

from dataclasses import dataclass

from explorer.app.features.forces.tasks import WeightsRequest, weights_of_parts
from explorer.app.state.view import Weighed
from explorer.mechanism.design import Design
from explorer.mechanism.machine import Six
from explorer.mechanism.pose import Pose, Triple
from explorer.paths.planning import PlannedPath, plan_path
from explorer.statics.loaded import LoadedPose


@dataclass(frozen=True)
class PlanRequest:
    """A request for a path from a pose to another, of at most some seconds.

    Attributes:
        tool: Point that moves straight in the platform frame, in design units; None for b4.
        load: (F; M) at the tool point, base axes, in N and N × unit, that the path has to hold.
        weighed: Bodies whose weights act besides the load.
        density: Density of the parts, in kg/m³.
    """

    design: Design
    start: Pose
    goal: Pose
    seconds: float
    tool: Triple | None = None
    load: Six | None = None
    weighed: Weighed = "none"
    density: float = 0.0


def plan(request: PlanRequest) -> PlannedPath:
    """Return a path between two poses, see `explorer.paths.planning`."""
    design, ends, load = request.design, (request.start, request.goal), request.load
    weights = own = None
    if load is not None:
        if request.weighed == "payload and legs":
            own = weights_of_parts(WeightsRequest(design, request.density))
        weights = LoadedPose(design, ends[0], load, own, request.weighed != "none").weights
    seconds, tool = request.seconds, request.tool
    return plan_path(design, *ends, seconds=seconds, tool=tool, load=load, weights=weights)
