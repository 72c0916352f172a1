"""The one catalogue of what can be measured of a design.

Compare, the optimiser's table on the page and in the command line, and studies read it: a
measure is added by one entry. All measures are of the constant-orientation workspace at the
home's orientation, in design units.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from typing import Literal, get_args

import numpy as np

from explorer.legs.clearance import PAIRS
from explorer.measures.case import Case
from explorer.measures.size import box_margin, longest_length, reach_of
from explorer.mechanism.design import VARIABLES
from explorer.mechanism.margins import margins
from explorer.mechanism.pose import yaw_pitch_roll_from_rotation

Place = Literal["compare", "optimise", "studies"]
"""Where a measure is listed: in Compare, in the optimiser's tables, or among a study's measures."""

Sense = Literal["more", "less"]
Unit = Literal["", "°", "share"]
Cost = Literal["low", "high"]
Demand = Literal["box", "demanded_margin"]

EVERYWHERE: frozenset[Place] = frozenset(get_args(Place))
POWERS = {1: "", 2: "²", 3: "³"}


def _no_reason(_: Case) -> str:
    return ""


@dataclass(frozen=True)
class Measure:
    """A measure of a design.

    Attributes:
        name: Key of the measure: its column in a study, its name in Python.
        label: What the page and the tables of the command line call it.
        hint: Meaning, one sentence.
        function: Value of a case; NaN where there is none.
        power: Exponent of length in the unit; 3 for a volume.
        unit: Unit of a measure without length; a share is from 0 to 1.
        sense: Whether more or less of it is better; None if neither is.
        cost: "high" if it takes far longer than the exact volume.
        is_whole: Whether it is a count.
        gradient: Partial derivatives by the name of the parameter, as in
            `explorer.workspace.slices.volume.Volume`; None if there is no closed form.
        needs: Attribute of the case without which there is nothing to measure, or None.
        reason: Why a workspace that is not empty lacks the value; "" if nothing is known.
        places: Where it is listed.
    """

    name: str
    label: str
    hint: str
    function: Callable[[Case], float]
    power: int = 0
    unit: Unit = ""
    sense: Sense | None = None
    cost: Cost = "low"
    is_whole: bool = False
    gradient: Callable[[Case], Mapping[str, float]] | None = None
    needs: Demand | None = None
    reason: Callable[[Case], str] = _no_reason
    places: frozenset[Place] = EVERYWHERE

    def unit_in(self, length: str) -> str:
        """Return the unit, "" for a plain number or a share.

        Args:
            length: Unit of lengths, such as "mm".
        """
        if self.power:
            return f"{length}{POWERS[self.power]}"
        return "" if self.unit == "share" else self.unit


def measures_in(place: Place) -> dict[str, Measure]:
    """Return the measures that a place lists, by name in their order."""
    return {name: each for name, each in CATALOGUE.items() if place in each.places}


COMPARE: frozenset[Place] = frozenset({"compare"})
OPTIMISE: frozenset[Place] = frozenset({"optimise"})
STUDIES: frozenset[Place] = frozenset({"studies"})


def _off_planes(case: Case) -> str:
    return f"so far from the singular planes that clearances count ({case.clearance_margin:g} u)"


def _no_node(case: Case) -> str:
    if len(case.at_nodes.positions):
        return ""
    return f"none of {case.nodes} nodes an axis lies in the workspace"


def _no_clearance(case: Case, legs: tuple[int, int] | None = None) -> str:
    if not len(case.at_nodes.positions):
        return _no_node(case)
    if not np.isfinite(case.at_nodes.clearances).any():
        return f"no node is {_off_planes(case)}"
    return "" if legs is None else f"legs {legs[0]} and {legs[1]} share a joint"


def _reach_gradient(case: Case) -> Mapping[str, float]:
    x, y = case.design.a3
    reach = case.design.reach
    is_tied = reach >= longest_length(case.design)
    return {"a3x": x / reach, "a3y": y / reach} if is_tied else {}


def _known(found: tuple[float, tuple[int, int]] | tuple[None, None]) -> float:
    return math.nan if found[0] is None else found[0]


def _of_nodes(attribute: Literal["count", "volume", "step"]) -> Callable[[Case], float]:
    def value(case: Case) -> float:
        return math.nan if case.paper_nodes is None else getattr(case.paper_nodes, attribute)

    return value


def _sizes() -> Iterable[Measure]:
    yield Measure(
        "volume",
        "volume",
        "Exact volume of the workspace at the home's orientation",
        lambda case: case.volume.volume,
        power=3,
        sense="more",
        gradient=lambda case: case.volume.gradient,
    )
    yield Measure(
        "volume_per_reach",
        "volume / reach³",
        "Volume of the workspace for the size of the design",
        lambda case: case.volume.volume / reach_of(case.design) ** 3,
        sense="more",
        places=COMPARE,
    )
    yield Measure(
        "node_count",
        "nodes",
        "The paper's measure of the workspace: nodes of the design's own grid",
        _of_nodes("count"),
        is_whole=True,
        places=COMPARE | OPTIMISE,
    )
    yield Measure(
        "node_volume",
        "node volume",
        "Nodes times the cube of their step; it overstates the volume",
        _of_nodes("volume"),
        power=3,
        places=COMPARE | OPTIMISE,
    )
    yield Measure(
        "node_step",
        "node step",
        "Step of the design's own grid",
        _of_nodes("step"),
        power=1,
        places=COMPARE,
    )
    yield Measure(
        "reach",
        "reach",
        "|a3|, or the longest leg where that is longer",
        lambda case: reach_of(case.design),
        power=1,
        sense="less",
        gradient=_reach_gradient,
    )
    for axis, name in enumerate("xyz"):
        yield Measure(
            f"exact_extent_{name}",
            f"extent {name}",
            f"From the lowest to the highest {name} of b4 in the workspace, exact",
            lambda case, axis=axis: float(case.extent[axis]),
            power=1,
            cost="high",
            places=COMPARE,
        )
    for axis, name in enumerate("xyz"):
        yield Measure(
            f"extent_{name}",
            f"extent {name} at nodes",
            f"From the lowest to the highest node of the workspace along {name}",
            lambda case, axis=axis: float(case.at_nodes.extent[axis]),
            power=1,
            reason=_no_node,
            places=STUDIES,
        )


def _margins() -> Iterable[Measure]:
    yield Measure(
        "least_margin",
        "worst margin",
        "The least |δ| anywhere in the workspace, exact; 0 where it goes up to a singularity",
        lambda case: float(case.least_margins.min()),
        power=1,
        sense="more",
        cost="high",
        places=COMPARE,
    )
    yield Measure(
        "worst_margin",
        "worst margin at nodes",
        "Smallest |δ| over the nodes of the workspace",
        lambda case: float(case.at_nodes.margins.min()),
        power=1,
        sense="more",
        reason=_no_node,
        places=STUDIES,
    )
    yield Measure(
        "mean_margin",
        "mean margin at nodes",
        "Mean over the nodes of the workspace of the smallest |δ|",
        lambda case: case.at_nodes.mean_margin,
        power=1,
        sense="more",
        reason=_no_node,
        places=COMPARE | STUDIES,
    )
    for index in range(3):
        yield Measure(
            f"margin_{index + 1}",
            f"margin {index + 1}",
            f"Smallest |δ{index + 1}| over the nodes of the workspace",
            lambda case, index=index: float(case.at_nodes.margins[index]),
            power=1,
            sense="more",
            reason=_no_node,
            places=STUDIES,
        )
    yield Measure(
        "home_margin",
        "margin at home",
        "The smallest |δ| in the home pose",
        _home_margin,
        power=1,
        sense="more",
        places=COMPARE,
    )
    yield Measure(
        "box_margin",
        "margin over box",
        "The least |δ| over the required box",
        lambda case: math.nan if case.box is None else box_margin(case.design, case.box),
        power=1,
        sense="more",
        needs="box",
        places=OPTIMISE,
    )


def _clearances() -> Iterable[Measure]:
    yield Measure(
        "least_clearance",
        "clearance",
        "The least of any two legs over the workspace, wherever every |δ| is at least a 20th of "
        "|a3| or what a study asks for; certain to a 1000th of |a3|",
        lambda case: _known(case.clearance),
        power=1,
        sense="more",
        cost="high",
        reason=lambda case: f"no position is {_off_planes(case)}",
    )
    yield Measure(
        "demanded_clearance",
        "demanded clearance",
        "The least of any two legs over the workspace, wherever every |δ| is at least what the "
        "demand says",
        lambda case: _known(case.demanded_clearance),
        power=1,
        sense="more",
        cost="high",
        needs="demanded_margin",
        places=OPTIMISE,
    )
    yield Measure(
        "clearance",
        "clearance at nodes",
        "Least clearance of any two legs over the nodes off the singular planes",
        lambda case: _finite(float(case.at_nodes.clearances.min())),
        power=1,
        sense="more",
        reason=_no_clearance,
        places=STUDIES,
    )
    for pair, (first, second) in enumerate(PAIRS):
        yield Measure(
            f"clearance_{first}{second}",
            f"clearance {first}{second}",
            f"Least clearance of legs {first} and {second} over the nodes off the singular planes",
            lambda case, pair=pair: _finite(float(case.at_nodes.clearances[pair])),
            power=1,
            sense="more",
            reason=lambda case, legs=(first, second): _no_clearance(case, legs),
            places=STUDIES,
        )
    yield Measure(
        "clear_share",
        "collision-free share",
        "Share of the nodes of the workspace where no two legs meet",
        lambda case: case.at_nodes.clear_share,
        unit="share",
        sense="more",
        reason=_no_node,
        places=COMPARE | STUDIES,
    )
    yield Measure(
        "reachable_volume",
        "accessible volume",
        "Volume that a collision-free move from the home pose leads to",
        lambda case: case.accessible_volume[0],
        power=3,
        sense="more",
        cost="high",
        reason=lambda case: case.accessible_volume[1],
        places=STUDIES,
    )


def _conditions() -> Iterable[Measure]:
    yield Measure(
        "inverse_condition",
        "inverse condition at home",
        "Inverse condition of the Jacobian in the home pose; 0 is singular, 1 the best",
        lambda case: float(case.inverse_conditions(np.array([case.home.position]))[0]),
        sense="more",
        places=COMPARE | STUDIES,
    )
    yield Measure(
        "worst_inverse_condition",
        "worst inverse condition at nodes",
        "Smallest inverse condition of the Jacobian over the nodes of the workspace",
        lambda case: case.conditions[0],
        sense="more",
        cost="high",
        reason=_no_node,
        places=STUDIES,
    )
    yield Measure(
        "mean_inverse_condition",
        "mean inverse condition at nodes",
        "Mean inverse condition of the Jacobian over the nodes of the workspace; 0 is singular, "
        "1 the best",
        lambda case: case.conditions[1],
        sense="more",
        cost="high",
        reason=_no_node,
        places=COMPARE | STUDIES,
    )


def _coordinates() -> Iterable[Measure]:
    yield Measure(
        "yaw",
        "yaw of home",
        "Yaw of the orientation that the workspace has",
        lambda case: float(yaw_pitch_roll_from_rotation(case.rotation)[0]),
        unit="°",
        places=COMPARE | OPTIMISE,
    )
    for index, name in enumerate(VARIABLES):
        yield Measure(
            name,
            name,
            f"Design variable, in the frame of the {'base' if index < 2 else 'platform'}",
            lambda case, index=index: case.design.variables[index],
            power=1,
            gradient=lambda _, name=name: {name: 1.0},
            places=COMPARE,
        )


def _home_margin(case: Case) -> float:
    return float(np.abs(margins(case.home.position, case.rotation)).min())


def _finite(value: float) -> float:
    return value if math.isfinite(value) else math.nan


CATALOGUE: Mapping[str, Measure] = {
    each.name: each
    for group in (_sizes(), _margins(), _clearances(), _conditions(), _coordinates())
    for each in group
}
"""All measures by name, in the order of every list of them."""
