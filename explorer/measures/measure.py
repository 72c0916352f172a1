"""A measure of a design: its words, unit, sense, cost and function; and a case of one.

A case is a design with the intermediate results that several measures share.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Literal, get_args

import numpy as np

from explorer.legs.clearance import PAIRS
from explorer.measures.snapshot import PoseIndices
from explorer.mechanism.design import LENGTHS, Design
from explorer.mechanism.pose import Pose
from explorer.mechanism.tilt_torsion import tilt_torsion_of
from explorer.numerics.arrays import FloatArray
from explorer.numerics.computed_once import computed_once
from explorer.numerics.number_text import Unit
from explorer.statics.compliance import is_elastic
from explorer.statics.loaded import LoadedPose
from explorer.statics.reactions import has_limits
from explorer.workspace.extremes import extent_of, least_margins
from explorer.workspace.least_clearance import (
    DEFAULT_NODES,
    NodeMeasures,
    least_clearances,
    node_measures,
)
from explorer.workspace.orientations.share import orientation_share
from explorer.workspace.orientations.tilts import greatest_tilts
from explorer.workspace.slices.volume import NodeCount, Volume, node_count_of, volume_of
from explorer.workspace.workspace import Workspace

if TYPE_CHECKING:
    from explorer.workspace.carried_region import CarriedRegion

CERTAIN = 1e-3
"""Accuracy of the least clearance, as a share of the reach."""

MARGIN_OF_CLEARANCE = 0.05
"""Least |δ| of the positions at which clearances count by default, as a share of the reach."""


def longest_leg(design: Design) -> float:
    """Return the largest of the maximum lengths of l1, d2, d4 and l4, in design units.

    It is the reach |a3| where all four are tied to it.
    """
    return max(design.length_range(name)[1] for name in LENGTHS)


@dataclass
class Case:
    """A design to measure; lengths in design units.

    All values describe the constant-orientation workspace, except for those at home.

    Attributes:
        design: The manipulator.
        nodes: Number of nodes on each axis of the grid of node measures.
        margin: Least |δ| at which clearances count; a 20th of the design's reach if None.
        node_step: Step of the paper's nodes; that of the design if None.
        demanded_margin: Least |δ| at which a demanded clearance counts; None without demand.
        pose: Pose that has the orientation of the workspace; the home pose if None.
    """

    design: Design
    nodes: int = DEFAULT_NODES
    margin: float | None = None
    node_step: float | None = None
    demanded_margin: float | None = None
    pose: Pose | None = None

    @property
    def clearance_margin(self) -> float:
        """The least |δ| at which clearances count, in design units."""
        default = MARGIN_OF_CLEARANCE * self.design.reach
        return default if self.margin is None else self.margin

    @property
    def at(self) -> Pose:
        """The pose of the case: the given one, or else the home pose."""
        return self.design.home_pose if self.pose is None else self.pose

    @property
    def rotation(self) -> FloatArray:
        """The rotation of the workspace, platform to base, shape (3, 3)."""
        return self.at.rotation

    @cached_property
    def workspace(self) -> Workspace:
        """The workspace."""
        return Workspace(self.design, self.rotation)

    @property
    def volume(self) -> Volume:
        """The exact volume, its gradient, and the limits that empty the workspace."""
        return volume_of(self.workspace)

    @property
    def paper_nodes(self) -> NodeCount:
        """The paper's nodes; an InputError if the grid is too fine to count."""
        return node_count_of(self.workspace, self.node_step)

    @property
    def at_nodes(self) -> NodeMeasures:
        """Extent, margins and clearances at the nodes of a grid over the workspace."""
        margin = self.clearance_margin
        return node_measures(self.workspace, nodes=self.nodes, clearance_margin=margin)

    @property
    def node_positions(self) -> FloatArray:
        """The nodes of `at_nodes`, shape (n, 3)."""
        return self.at_nodes.positions

    @property
    def longest_leg(self) -> float:
        """The longest leg, see `longest_leg`."""
        return longest_leg(self.design)

    @property
    def home_share(self) -> float:
        """The share of all orientations that the home position can have."""
        return orientation_share(self.design, self.design.home_pose.position).share

    @property
    def home_tilt(self) -> float:
        """The greatest tilt in every azimuth at home, in degrees; 0 if tilt zero is not allowed."""
        home = self.design.home_pose
        torsion = tilt_torsion_of(home.rotation).torsion
        tilts = greatest_tilts(self.design, np.array(home.position), torsion)
        return float(np.nan_to_num(tilts).min())

    @cached_property
    def home_indices(self) -> PoseIndices:
        """The indices of conditioning, manipulability and transmission in the home pose."""
        home = self.design.home_pose
        return PoseIndices(self.design, home.position, home.rotation)

    @cached_property
    def node_indices(self) -> PoseIndices:
        """The indices of conditioning, manipulability and transmission at the nodes."""
        return PoseIndices(self.design, self.node_positions, self.rotation)

    @property
    def clearance(self) -> tuple[float, tuple[int, int] | None]:
        """The least clearance where every |δ| is at least `clearance_margin`, and its two legs.

        It is accurate to a thousandth of the reach. Nearer to a singularity legs may have to meet.
        Both are NaN and None where the workspace has no such position, or no volume: the positions
        left may then all lie on a surface.
        """
        return _clearance_beyond(self.workspace, self.clearance_margin)

    @property
    def demanded_clearance(self) -> tuple[float, tuple[int, int] | None]:
        """The least clearance where every |δ| is at least `demanded_margin`, and its two legs."""
        if self.demanded_margin is None:
            return math.nan, None
        return _clearance_beyond(self.workspace, self.demanded_margin)

    @property
    def extent(self) -> FloatArray:
        """The exact extents of the workspace on the axes, shape (3,); NaN if it is empty."""
        ends = extent_of(self.workspace) if self.volume.volume > 0.0 else None
        return np.full(3, math.nan) if ends is None else ends[1] - ends[0]

    @property
    def least_margins(self) -> FloatArray:
        """The least |δ1|, |δ2|, |δ3| in the workspace, exact, shape (3,); NaN if it is empty."""
        least = least_margins(self.workspace) if self.volume.volume > 0.0 else None
        return np.full(3, math.nan) if least is None else least

    @property
    def accessible_volume(self) -> tuple[float, str]:
        """The volume that a collision-free move from home leads to; else NaN and the reason."""
        # Both load the kernel of solids.
        from explorer.workspace.accessible.nodes import InvalidStartError
        from explorer.workspace.accessible.workspace import accessible_part

        try:
            return accessible_part(self.workspace).accessible_volume, ""
        except InvalidStartError as error:
            return math.nan, str(error)

    @cached_property
    def home_loaded(self) -> LoadedPose:
        """The home pose under the payload's weight and force; the legs count as weightless."""
        return LoadedPose(self.design, self.design.home_pose)

    @property
    def carried_region(self) -> CarriedRegion:
        """The part of the workspace where the design's load is held."""
        # It loads the kernel of solids.
        from explorer.workspace.carried_region import carried_region

        return carried_region(self.workspace)

    def has(self, need: str) -> bool:
        """Return whether the case has what a measure needs."""
        return NEEDS[need][1](self)


@computed_once
def _clearance_beyond(workspace: Workspace, margin: float) -> tuple[float, tuple[int, int] | None]:
    """Return the least clearance where every |δ| is at least a margin, and its two legs."""
    if volume_of(workspace).volume <= 0.0:
        return math.nan, None
    design = workspace.design
    away = design.with_limits(margin=max(design.limits.margin or 0.0, margin))
    clearances = least_clearances(
        Workspace(away, workspace.rotation), CERTAIN * design.reach, only_least=True
    ).clearance
    pair = int(clearances.argmin())
    if not np.isfinite(clearances[pair]):
        return math.nan, None
    return float(clearances[pair]), PAIRS[pair]


Place = Literal["compare", "optimise", "studies", "workspace", "report"]
"""Where a measure is listed: Compare, the optimiser's tables, a study's measures, the command
`explorer workspace`, or the report."""

Sense = Literal["more", "less"]
Cost = Literal["low", "high"]
NEEDS: Mapping[str, tuple[str, Callable[[Case], bool]]] = {
    "demanded_margin": ("demanded clearance", lambda case: case.demanded_margin is not None),
    "is_loaded": (
        "payload or force at the tool",
        lambda case: bool(case.design.payload.mass_kg or case.design.payload.force_n),
    ),
    "has_mass": ("mass of the payload", lambda case: case.design.payload.mass_kg > 0.0),
    "is_limited": ("limit of actuators, struts or guide", lambda case: has_limits(case.design)),
    "limits_actuators": (
        "limit of the actuators",
        lambda case: bool(case.design.actuators.push_n or case.design.actuators.pull_n),
    ),
    "has_errors": ("errors of the actuators", lambda case: any(case.design.actuators.error_mm)),
    "is_elastic": ("stiffness of actuators or struts", lambda case: is_elastic(case.design)),
}
"""Words for what measures need, without an article, and whether a case has it."""


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
        unit: Name of the unit of a measure without length; a "share" is from 0 to 1.
        sense: Whether more or less of it is better; None if neither is.
        cost: "high" if it takes far longer than the exact volume.
        is_whole: Whether it is a count.
        names: Names of the whole numbers from 1, if it is one of several things.
        needs: What the measure needs of a case, out of `NEEDS`.
        reason: Why a workspace that is not empty lacks the value; "" if nothing is known.
        places: Where it is listed.
        for_tables: Whether a table on six legs has it too, see `explorer.six_legged.case`, and
            whether its value is exact there or an upper bound, "at most"; "" if it has none.
    """

    name: str
    label: str
    hint: str
    function: Callable[[Case], float]
    title: str = ""
    power: int = 0
    unit: str = ""
    sense: Sense | None = None
    cost: Cost = "low"
    is_whole: bool = False
    names: tuple[str, ...] = ()
    needs: tuple[str, ...] = ()
    reason: Callable[[Case], str] = lambda _: ""
    places: tuple[Place, ...] = get_args(Place)
    for_tables: Literal["", "exact", "at most"] = ""

    @property
    def heading(self) -> str:
        """The title, or the label of a measure that has none."""
        return self.title or self.label

    def unit_in(self, lengths: Unit, size: float = 0.0) -> Unit:
        """Return the unit, given that of lengths; its name is "" for a plain number or a share.

        The size, in design units, is that of `Unit.to_power`.
        """
        if self.power:
            return lengths.to_power(self.power, size)
        return Unit("" if self.unit == "share" else self.unit)
