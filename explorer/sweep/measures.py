"""What a study can measure of a design, and how.

Everything is of the constant-orientation workspace at the home's orientation, in design units.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass
from functools import cached_property
from types import MappingProxyType

import numpy as np

from explorer.legs.clearance import PAIRS
from explorer.mechanism.design import Design
from explorer.mechanism.home import home_pose
from explorer.numerics.arrays import FloatArray
from explorer.optimise.facts import clearance_beyond, clearance_margin_of, reach_of
from explorer.singularity.jacobian import inverse_condition, jacobian
from explorer.workspace.node_measures import DEFAULT_NODES, NodeMeasures, node_measures
from explorer.workspace.slices.volume import Volume, workspace_volume


@dataclass
class Case:
    """A design to measure, with what several measures share.

    Attributes:
        design: The design.
        nodes: On each axis of the grid.
        margin: From which |κ| on clearances count, in design units; a 20th of the design's
            reach if None.
        reason: Why a measure is missing, "" as long as none is.
    """

    design: Design
    nodes: int = DEFAULT_NODES
    margin: float | None = None
    reason: str = ""

    @property
    def clearance_margin(self) -> float:
        """From which |κ| on clearances count, in design units."""
        return clearance_margin_of(self.design) if self.margin is None else self.margin

    @cached_property
    def volume(self) -> Volume:
        """Of the workspace, and what empties it."""
        return workspace_volume(self.design)

    @cached_property
    def at_nodes(self) -> NodeMeasures:
        """What the nodes of the workspace tell."""
        return node_measures(self.design, nodes=self.nodes, clearance_margin=self.clearance_margin)

    def inverse_conditions(self, positions: FloatArray) -> FloatArray:
        """Return those of the Jacobian at positions (n, 3), shape (n,)."""
        rates = jacobian(self.design, positions, home_pose(self.design).rotation)
        return inverse_condition(rates, self.design.reach)

    @cached_property
    def conditions(self) -> tuple[float, float]:
        """The smallest and the mean inverse condition over the nodes."""
        positions = self.at_nodes.positions
        if not len(positions):
            return math.nan, math.nan
        found = self.inverse_conditions(positions)
        return float(found.min()), float(found.mean())

    def least_clearance(self) -> float:
        """Return the least clearance, looked for between the nodes too."""
        found, _ = clearance_beyond(self.design, self.clearance_margin)
        return math.nan if found is None else found

    def reachable_volume(self) -> float:
        """Return the volume that the home pose leads to."""
        # Imports the kernel of solids.
        from explorer.workspace.accessible.start import StartError
        from explorer.workspace.accessible.workspace import reachable_workspace

        try:
            return reachable_workspace(self.design).reachable_volume
        except StartError as error:
            self.reason = str(error)
            return math.nan


@dataclass(frozen=True)
class Measure:
    """A measure.

    Attributes:
        words: What it is.
        unit: "u³", "u" for design units, or "" for a plain number.
        of: Finds it; NaN where there is none.
        is_slow: Whether it takes far longer than the volume does.
    """

    words: str
    unit: str
    of: Callable[[Case], float]
    is_slow: bool = False


def _margin(index: int) -> Measure:
    return Measure(
        f"smallest |κ{index + 1}| over the nodes of the workspace",
        "u",
        lambda case: float(case.at_nodes.margins[index]),
    )


def _clearance(pair: int) -> Measure:
    first, second = PAIRS[pair]
    return Measure(
        f"least clearance of legs {first} and {second} over the nodes off the singular planes",
        "u",
        lambda case: _finite(float(case.at_nodes.clearances[pair])),
    )


def _extent(axis: int) -> Measure:
    return Measure(
        f"from the lowest to the highest node of the workspace along {'xyz'[axis]}",
        "u",
        lambda case: float(case.at_nodes.extent[axis]),
    )


def _finite(value: float) -> float:
    """Return a value, NaN for what there is none of."""
    return value if math.isfinite(value) else math.nan


MEASURES: Mapping[str, Measure] = MappingProxyType(
    {
        "volume": Measure("exact volume of the workspace", "u³", lambda case: case.volume.volume),
        "reach": Measure(
            "the reach |a3|, or the largest length where that is larger",
            "u",
            lambda case: reach_of(case.design),
        ),
        "worst_margin": Measure(
            "smallest |κ| over the nodes of the workspace",
            "u",
            lambda case: float(case.at_nodes.margins.min()),
        ),
        "mean_margin": Measure(
            "mean over the nodes of the workspace of the smallest |κ|",
            "u",
            lambda case: case.at_nodes.mean_margin,
        ),
        **{f"margin_{index + 1}": _margin(index) for index in range(3)},
        "clearance": Measure(
            "least clearance of any two legs over the nodes off the singular planes",
            "u",
            lambda case: _finite(float(case.at_nodes.clearances.min())),
        ),
        **{f"clearance_{a}{b}": _clearance(pair) for pair, (a, b) in enumerate(PAIRS)},
        "clear_share": Measure(
            "share of the nodes of the workspace where no two legs meet",
            "",
            lambda case: case.at_nodes.clear_share,
        ),
        **{f"extent_{'xyz'[axis]}": _extent(axis) for axis in range(3)},
        "inverse_condition": Measure(
            "inverse condition of the Jacobian in the home pose",
            "",
            lambda case: float(case.inverse_conditions(_home_position(case.design))[0]),
        ),
        "worst_inverse_condition": Measure(
            "smallest inverse condition over the nodes of the workspace",
            "",
            lambda case: case.conditions[0],
            is_slow=True,
        ),
        "mean_inverse_condition": Measure(
            "mean inverse condition over the nodes of the workspace",
            "",
            lambda case: case.conditions[1],
            is_slow=True,
        ),
        "least_clearance": Measure(
            "least clearance of any two legs off the singular planes, to a 1000th of the reach",
            "u",
            lambda case: case.least_clearance(),
            is_slow=True,
        ),
        "reachable_volume": Measure(
            "volume that the home pose leads to without a collision of legs",
            "u³",
            lambda case: case.reachable_volume(),
            is_slow=True,
        ),
    }
)
"""What can be measured, by the name of its column."""

AT_NODES = frozenset(
    {
        "worst_margin",
        "mean_margin",
        "clearance",
        *(f"extent_{axis}" for axis in "xyz"),
    }
)
"""Measures of the nodes of a grid that `explorer.optimise.figures` has under the same name of the
whole workspace, or of another grid."""


def measured(case: Case, names: Collection[str]) -> dict[str, float]:
    """Return measures of a design by name, out of `MEASURES`.

    What cannot be told is NaN: of an empty workspace all but volumes, the reach and the
    inverse condition at home. Of another the case gets a reason for each that is missing.
    """
    found = {name: MEASURES[name].of(case) for name in names}
    if case.volume.volume > 0.0:
        missing = [name for name, value in found.items() if not math.isfinite(value)]
        reasons = dict.fromkeys([case.reason, *(_why_missing(case, name) for name in missing)])
        case.reason = "; ".join(each for each in reasons if each)
    return found


def _why_missing(case: Case, name: str) -> str:
    """Return why a measure cannot be told; "" if the case knows it already, or nobody does."""
    off = f"so far from the singular planes that clearances count ({case.clearance_margin:g} u)"
    if name == "reachable_volume":
        return ""
    if name == "least_clearance":
        return f"no position is {off}"
    if not len(case.at_nodes.positions):
        return f"none of {case.nodes} nodes an axis lies in the workspace"
    if not name.startswith("clearance"):
        return ""
    if not np.isfinite(case.at_nodes.clearances).any():
        return f"no node is {off}"
    return f"legs {name[-2]} and {name[-1]} share a joint"


def _home_position(design: Design) -> FloatArray:
    return np.array([home_pose(design).position])
