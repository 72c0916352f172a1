"""The worker's tasks for the budget: costs of tolerances, and those of a wanted precision."""

from __future__ import annotations

from dataclasses import dataclass

from explorer.export.tables import tolerance_csv
from explorer.measures.box import PositionSet, positions_over
from explorer.mechanism.configuration import Configuration
from explorer.mechanism.design import Design
from explorer.mechanism.pose import Pose, Triple
from explorer.statics.budget import SourceCosts, ToleranceBudget, source_costs, tolerance_budget


@dataclass(frozen=True)
class BudgetRequest:
    """A request for a budget over positions in the orientation of a pose, or at the pose itself.

    The tool's largest displacement that is wanted is in mm, None for the costs alone; its largest
    turn in degrees, None for any.
    """

    design: Design
    over: PositionSet
    pose: Pose
    box: tuple[Triple, Triple] | None
    wanted: float | None
    wanted_turn: float | None
    keep_actuators: bool


@dataclass(frozen=True)
class BudgetDrawing:
    """A budget: the costs of the tolerances found, or else stated; None found if none is wanted."""

    request: BudgetRequest
    costs: SourceCosts
    found: ToleranceBudget | None


def budget_of(request: BudgetRequest) -> BudgetDrawing:
    """Return a budget.

    Raises:
        ExplorerError: Errors are infinite at the positions, no position is within the limits, or
            the errors of the actuators alone exceed what is wanted.
    """
    design, pose = request.design, request.pose
    positions = positions_over(design, request.over, pose, request.box)
    at = Configuration(design, positions, pose.rotation, design.tool.position)
    if request.wanted is None:
        return BudgetDrawing(request, source_costs(at), None)
    found = tolerance_budget(
        at, request.wanted, request.wanted_turn, keep_actuators=request.keep_actuators
    )
    return BudgetDrawing(request, found.costs, found)


def budget_table(request: BudgetRequest) -> bytes:
    """Return the tolerances of a budget as CSV.

    Raises:
        ExplorerError: As for `budget_of`.
    """
    return tolerance_csv(budget_of(request).costs).encode()
