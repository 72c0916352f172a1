"""The load of the page: the action that sets it, the pose under it, and the worker's tasks."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from explorer.app.scene.placing import round_step
from explorer.app.session.feed import Feed, FeedOf
from explorer.app.state.actions import action
from explorer.app.state.frame import Frame
from explorer.app.state.geometry import without_name
from explorer.app.state.parts import with_value
from explorer.app.state.state import State
from explorer.measures.blocks.commands import LoadTopic, load_command
from explorer.mechanism.design import Design
from explorer.mechanism.pose import Pose, Triple
from explorer.motion.weights import MovingBodies
from explorer.numerics.arrays import FloatArray, triple
from explorer.numerics.number_text import format_number
from explorer.statics.loaded import LoadedPose, ToolPrecision
from explorer.statics.reactions import has_limits
from explorer.workspace.nearest_carrying import nearest_carrying_pose

if TYPE_CHECKING:
    # The worker imports this module, and needs nothing of the page.
    from explorer.app.features.feature import Services

from explorer.export.tables import tolerance_csv
from explorer.measures.box import PositionSet, positions_over
from explorer.mechanism.configuration import Configuration
from explorer.statics.budget import SourceCosts, ToleranceBudget, source_costs, tolerance_budget

# Share of the reach below which and above which the arrow of a typed force has another scale.
SHORTEST, LONGEST = 0.1, 1.0
# Force in newtons below which the scale stays.
LEAST_FORCE = 1e-6
# Length of the arrow at the new scale, as a share of the reach.
FITTING = 0.45


def _force_words(_: State, force: Triple, **__: bool) -> str:
    return f"Force {', '.join(format_number(value, 3) for value in force)} N"


@action(_force_words)
def set_force(state: State, force: Triple, *, keeps_scale: bool = False) -> State:
    """Set the force at the tool, along the axes of the base, in newtons.

    Its arrow keeps its scale while it is dragged.

    Raises:
        InputError: A force that is not finite.
    """
    forces = replace(state.view.forces, force=force)
    if not keeps_scale:
        forces = replace(forces, scale=fitting_scale(math.hypot(*force), forces.scale))
    return with_value(state, "view.forces", forces)


def round_force(force: FloatArray, size: float) -> Triple:
    """Return a force (3,) with the decimals that a thousandth of a size has, both in newtons."""
    return triple(np.round(force, 3 - math.floor(math.log10(size))))


def fitting_scale(force: float, scale: float) -> float:
    """Return the force in newtons whose arrow is as long as the reach, so that a force can be seen.

    The present scale stays while the arrow is neither short nor long.
    """
    if force < LEAST_FORCE or SHORTEST <= force / scale <= LONGEST:
        return scale
    return round_step(force / FITTING)


def is_bare(loaded: LoadedPose) -> bool:
    """Whether nothing acts: neither a load nor a weight nor a force of the process."""
    needed = loaded.reactions
    return not (needed.actuators.any() or needed.spread.any())


def weights_of_parts(request: tuple[Design, float]) -> MovingBodies:
    """Return the weights of a prototype's parts, without the payload, at a density in kg/m³.

    Raises:
        ExplorerError: The design has no prototype.
    """
    from explorer.motion.masses import moving_bodies
    from explorer.prototype.assembly import make_prototype

    design, density = request
    return moving_bodies(design, make_prototype(design).masses(density), payload=False)


def _weights_request(frame: Frame) -> tuple[Design, float] | None:
    view = frame.state.view
    if view.forces.weighed != "payload and legs":
        return None
    return without_name(frame.state.design), view.prototype.density


WEIGHTS_FEED = FeedOf(weights_of_parts, _weights_request)


class Loads:
    """The loaded pose of the present frame, which the panel and the scene share."""

    def __init__(self, services: Services) -> None:
        self.weights = services.get(WEIGHTS_FEED)
        self._last: tuple[State, MovingBodies | None, ToolPrecision] | None = None

    def of(self, frame: Frame) -> LoadedPose:
        """Return the pose of a frame under its load and the weights that count."""
        return self.precision(frame).loaded

    def precision(self, frame: Frame) -> ToolPrecision:
        """Return the precision of the tool in the pose of a frame under its load."""
        state, weights = frame.state, self.weights.drawing
        if self._last is None or self._last[0] is not state or self._last[1] is not weights:
            weighs_payload = state.view.forces.weighed != "none"
            loaded = LoadedPose(state.design, state.pose, state.load, weights, weighs_payload)
            self._last = state, weights, ToolPrecision(loaded)
        return self._last[2]

    def command(self, topic: LoadTopic, state: State) -> str:
        """Return the command that gives the answer in a state."""
        loaded = self.of(Frame(state))
        density = None if loaded.own is None else state.view.prototype.density
        return load_command(topic, loaded, density)


@dataclass(frozen=True)
class NearestDrawing:
    """The pose at the nearest position that holds a load; None if none was found."""

    pose: Pose | None


def nearest_position(request: LoadedPose) -> NearestDrawing:
    """Return the nearest position that holds the load of a pose."""
    return NearestDrawing(nearest_carrying_pose(request))


def nearest_feed(services: Services) -> Feed[LoadedPose, NearestDrawing]:
    """Return the feed of the nearest position that holds the load, while the pose does not."""
    loads = services.get(Loads)

    def request_of(frame: Frame) -> LoadedPose | None:
        loaded = loads.of(frame)
        return loaded if has_limits(loaded.design) and loaded.share > 1.0 else None

    return FeedOf(nearest_position, request_of)(services)


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
    """Return the tolerances of a budget as CSV; errors are those of `budget_of`."""
    return tolerance_csv(budget_of(request).costs).encode()
