"""A measure of a design: its words, unit, sense, cost, function and gradient; and a case of one.

A case is a design with the intermediate results that several measures share.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cached_property
from types import MappingProxyType
from typing import TYPE_CHECKING, Literal, get_args

import numpy as np

from explorer.measures.size import clearance_beyond, clearance_margin_of
from explorer.measures.snapshot import PoseIndices
from explorer.measures.statics import BoxStatics
from explorer.mechanism.configuration import Configuration
from explorer.mechanism.design import Design
from explorer.mechanism.pose import Pose, Triple
from explorer.numerics.arrays import FloatArray
from explorer.statics.compliance import is_elastic
from explorer.statics.reactions import has_limits
from explorer.workspace.extremes import extent_of, least_margins
from explorer.workspace.node_measures import DEFAULT_NODES, NodeMeasures, node_measures
from explorer.workspace.slices.volume import NodeCount, Volume, workspace_nodes, workspace_volume

if TYPE_CHECKING:
    from explorer.workspace.carried_region import CarriedRegion


@dataclass
class Case:
    """A design to measure; lengths in design units.

    All values describe the constant-orientation workspace. Each intermediate result is computed
    when a measure first needs it.

    Attributes:
        design: The manipulator.
        nodes: Number of nodes on each axis of the grid of node measures.
        margin: Least |δ| at which clearances count; a 20th of the design's reach if None.
        node_step: Step of the paper's nodes; that of the design if None.
        box: Box (lows, highs) over which the least |δ| is measured; not measured if None.
        demanded_margin: Least |δ| at which a demanded clearance counts; None without demand.
        pose: Pose that has the orientation of the workspace; the home pose if None.
    """

    design: Design
    nodes: int = DEFAULT_NODES
    margin: float | None = None
    node_step: float | None = None
    box: tuple[Triple, Triple] | None = None
    demanded_margin: float | None = None
    pose: Pose | None = None

    @property
    def clearance_margin(self) -> float:
        """The least |δ| at which clearances count, in design units."""
        return clearance_margin_of(self.design) if self.margin is None else self.margin

    @property
    def at(self) -> Pose:
        """The pose of the case: the given one, or else the home pose."""
        return self.design.home_pose if self.pose is None else self.pose

    @property
    def rotation(self) -> FloatArray:
        """The rotation of the workspace, platform to base, shape (3, 3)."""
        return self.at.rotation

    @cached_property
    def volume(self) -> Volume:
        """The exact volume, its gradient, and the limits that empty the workspace."""
        return workspace_volume(self.design, self.rotation)

    @cached_property
    def paper_nodes(self) -> NodeCount:
        """The paper's nodes; an InputError if the grid is too fine to count."""
        return workspace_nodes(self.design, self.rotation, self.node_step)

    @cached_property
    def at_nodes(self) -> NodeMeasures:
        """Extent, margins and clearances at the nodes of a grid over the workspace."""
        return node_measures(
            self.design,
            self.rotation,
            nodes=self.nodes,
            clearance_margin=self.clearance_margin,
        )

    @cached_property
    def home_indices(self) -> PoseIndices:
        """The indices of conditioning, manipulability and transmission at the case's pose."""
        return PoseIndices(Configuration(self.design, self.at.position, self.rotation))

    @cached_property
    def node_indices(self) -> PoseIndices:
        """The indices of conditioning, manipulability and transmission at the nodes."""
        return PoseIndices(Configuration(self.design, self.at_nodes.positions, self.rotation))

    @cached_property
    def clearance(self) -> tuple[float, tuple[int, int] | None]:
        """The least clearance where every |δ| is at least `clearance_margin`, and its two legs."""
        return clearance_beyond(self.design, self.clearance_margin, self.rotation)

    @cached_property
    def demanded_clearance(self) -> tuple[float, tuple[int, int] | None]:
        """The least clearance where every |δ| is at least `demanded_margin`, and its two legs."""
        if self.demanded_margin is None:
            return math.nan, None
        return clearance_beyond(self.design, self.demanded_margin, self.rotation)

    @cached_property
    def extent(self) -> FloatArray:
        """The exact extents of the workspace on the axes, shape (3,); NaN if it is empty."""
        ends = extent_of(self.design, self.rotation) if self.volume.volume > 0.0 else None
        return np.full(3, math.nan) if ends is None else ends[1] - ends[0]

    @cached_property
    def least_margins(self) -> FloatArray:
        """The least |δ1|, |δ2|, |δ3| in the workspace, exact, shape (3,); NaN if it is empty."""
        least = least_margins(self.design, self.rotation) if self.volume.volume > 0.0 else None
        return np.full(3, math.nan) if least is None else least

    @cached_property
    def accessible_volume(self) -> tuple[float, str]:
        """The volume that a collision-free move from home leads to; else NaN and the reason."""
        # Both load the kernel of solids.
        from explorer.workspace.accessible.nodes import StartError
        from explorer.workspace.accessible.workspace import accessible_workspace

        try:
            return accessible_workspace(self.design, self.rotation).accessible_volume, ""
        except StartError as error:
            return math.nan, str(error)

    @cached_property
    def box_statics(self) -> BoxStatics | None:
        """Loads, errors and compliance over the required box; None without a box."""
        return None if self.box is None else BoxStatics(self.design, self.box, self.rotation)

    @cached_property
    def home_statics(self) -> BoxStatics:
        """Loads, errors and compliance at the position of the case's pose."""
        position = self.at.position
        return BoxStatics(self.design, (position, position), self.rotation)

    @property
    def is_loaded(self) -> bool:
        """Whether the design has a load."""
        return bool(self.design.payload.mass_kg or self.design.payload.force_n)

    @property
    def is_limited(self) -> bool:
        """Whether the design limits forces or moments."""
        return has_limits(self.design)

    @property
    def limits_actuators(self) -> bool:
        """Whether the design limits the forces of its actuators."""
        return self.design.actuators.push_n is not None or self.design.actuators.pull_n is not None

    @property
    def has_errors(self) -> bool:
        """Whether the design's actuators have errors."""
        return any(self.design.actuators.error_mm)

    @property
    def is_elastic(self) -> bool:
        """Whether the design's actuators or struts give way."""
        return is_elastic(self.design)

    def has(self, need: str) -> bool:
        """Return whether the case has what a measure needs, an attribute."""
        value = getattr(self, need)
        return value is not None and value is not False

    @cached_property
    def held(self) -> CarriedRegion:
        """The part of the workspace where the design's load is held."""
        # It loads the kernel of solids.
        from explorer.workspace.carried_region import carried_region

        return carried_region(self.design, self.rotation)


Place = Literal["compare", "optimise", "studies", "workspace", "report"]
"""Where a measure is listed: Compare, the optimiser's tables, a study's measures, the command
`explorer workspace`, or the report."""

Sense = Literal["more", "less"]
Unit = Literal["", "°", "share", "N m", "kg", "mm/N"]
Cost = Literal["low", "high"]
Need = Literal[
    "box",
    "demanded_margin",
    "is_loaded",
    "is_limited",
    "limits_actuators",
    "has_errors",
    "is_elastic",
]

NEED_WORDS: Mapping[Need, str] = MappingProxyType(
    {
        "box": "required box",
        "demanded_margin": "demanded clearance",
        "is_loaded": "payload or force at the tool",
        "is_limited": "limit of actuators, struts or guide",
        "limits_actuators": "limit of the actuators",
        "has_errors": "errors of the actuators",
        "is_elastic": "stiffness of actuators or struts",
    }
)
"""Words for what measures need, without an article."""

COMPARE: frozenset[Place] = frozenset({"compare"})
OPTIMISE: frozenset[Place] = frozenset({"optimise"})
STUDIES: frozenset[Place] = frozenset({"studies"})
WORKSPACE: frozenset[Place] = frozenset({"workspace"})
REPORT: frozenset[Place] = frozenset({"report"})
EVERYWHERE: frozenset[Place] = frozenset(get_args(Place))
POWERS = {1: "", 2: "²", 3: "³"}


@dataclass(frozen=True)
class Measure:
    """A measure of a design.

    Attributes:
        name: Key of the measure: its column in a study, its name in Python and in JSON.
        label: Name of the measure on the page and in the tables of the command line.
        hint: Meaning, one sentence.
        function: Value of a case; NaN where there is none.
        title: Name among several volumes of the workspace; the label if empty.
        power: Exponent of length in the unit; 3 for a volume.
        unit: Unit of a measure without length; a share is from 0 to 1.
        sense: Whether more or less of it is better; None if neither is.
        cost: "high" if it takes far longer than the exact volume.
        is_whole: Whether it is a count.
        names: Names of the whole numbers from 1, if it is one of several things.
        gradient: Partial derivatives by the name of the parameter, as in
            `explorer.workspace.slices.volume.Volume`; None if there is no closed form.
        needs: Attributes of the case that the measure needs, see `Case.has`.
        reason: Why a workspace that is not empty lacks the value; "" if nothing is known.
        places: Where it is listed.
    """

    name: str
    label: str
    hint: str
    function: Callable[[Case], float]
    title: str = ""
    power: int = 0
    unit: Unit = ""
    sense: Sense | None = None
    cost: Cost = "low"
    is_whole: bool = False
    names: tuple[str, ...] = ()
    gradient: Callable[[Case], Mapping[str, float]] | None = None
    needs: tuple[Need, ...] = ()
    reason: Callable[[Case], str] = lambda _: ""
    places: frozenset[Place] = EVERYWHERE

    @property
    def heading(self) -> str:
        """The title, or the label of a measure that has none."""
        return self.title or self.label

    def unit_in(self, length: str) -> str:
        """Return the unit, "" for a plain number or a share.

        Args:
            length: Unit of lengths, such as "mm".
        """
        if self.power:
            return f"{length}{POWERS[self.power]}"
        return "" if self.unit == "share" else self.unit
