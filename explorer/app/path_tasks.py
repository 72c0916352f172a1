"""What the planner's own process does."""

from __future__ import annotations

from explorer.design import Design
from explorer.planning import PlannedPath, plan_path
from explorer.pose import Pose


def plan(design: Design, start: Pose, goal: Pose, seconds: float) -> PlannedPath:
    """Return a path between two poses, see `explorer.planning`."""
    return plan_path(design, start, goal, seconds=seconds)
