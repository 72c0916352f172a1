"""The task of the planner's own process."""

from __future__ import annotations

from explorer.mechanism.design import Design
from explorer.mechanism.pose import Pose, Triple
from explorer.paths.planning import PlannedPath, plan_path


def plan(
    design: Design, start: Pose, goal: Pose, seconds: float, tool: Triple | None = None
) -> PlannedPath:
    """Return a path between two poses, see `explorer.paths.planning`."""
    return plan_path(design, start, goal, seconds=seconds, tool=tool)
