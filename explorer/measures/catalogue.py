"""The one catalogue of the measures of a design.

Compare, the optimiser, studies, the report and the command line read it: one entry adds a
measure. All measures describe the constant-orientation workspace, in design units.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping
from functools import partial
from typing import Any, Literal, NamedTuple

import numpy as np

from explorer.errors import InputError
from explorer.legs.clearance import PAIRS
from explorer.measures.loads import loads
from explorer.measures.measure import (
    COMPARE,
    OPTIMISE,
    REPORT,
    STUDIES,
    WORKSPACE,
    Case,
    Measure,
    Place,
)
from explorer.measures.size import box_margins, box_tilt, home_tilt, longest_leg
from explorer.mechanism.design import LENGTHS, VARIABLES
from explorer.mechanism.margins import MARGIN_KINDS, margins
from explorer.mechanism.pose import yaw_pitch_roll_from_rotation
from explorer.numerics.arrays import FloatArray
from explorer.workspace.orientations.share import orientation_share

PAGE = COMPARE | OPTIMISE | STUDIES

Length = partial(Measure, power=1)
Margin = partial(Measure, power=1, sense="more")


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


AtNodes = partial(Measure, reason=_no_node, places=STUDIES)
MarginAtNodes = partial(AtNodes, power=1, sense="more")


def _reach_gradient(case: Case) -> Mapping[str, float]:
    x, y = case.design.a3
    reach = case.design.reach
    return {"a3x": x / reach, "a3y": y / reach}


def _longest_leg_gradient(case: Case) -> Mapping[str, float]:
    limits, longest = case.design.limits, longest_leg(case.design)
    fixed = [most for name in LENGTHS if (most := getattr(limits, name)[1]) is not None]
    return {} if longest in fixed else _reach_gradient(case)


def _finite_or_nan(value: float) -> float:
    return value if math.isfinite(value) else math.nan


def _no_nodes_counted(case: Case) -> str:
    try:
        _ = case.paper_nodes
    except InputError as error:
        return str(error)
    return ""


def _value_of_nodes(attribute: Literal["count", "volume", "step"]) -> Callable[[Case], float]:
    def value(case: Case) -> float:
        try:
            return getattr(case.paper_nodes, attribute)
        except InputError:
            return math.nan

    return value


def _sizes() -> Iterable[Measure]:
    yield Measure(
        "volume",
        "volume",
        "Exact volume of the workspace at the home's orientation",
        lambda case: case.volume.volume,
        title="exact volume",
        power=3,
        sense="more",
        gradient=lambda case: case.volume.gradient,
    )
    yield Measure(
        "volume_per_leg",
        "volume / longest leg³",
        "Volume of the workspace for the size of the design",
        lambda case: case.volume.volume / longest_leg(case.design) ** 3,
        sense="more",
        places=COMPARE,
    )
    yield Measure(
        "node_count",
        "nodes",
        "The paper's measure of the workspace: nodes of the design's own grid",
        _value_of_nodes("count"),
        reason=_no_nodes_counted,
        is_whole=True,
        places=COMPARE | OPTIMISE | WORKSPACE,
    )
    yield Measure(
        "node_volume",
        "node volume",
        "Nodes times the cube of their step; it overstates the volume",
        _value_of_nodes("volume"),
        reason=_no_nodes_counted,
        power=3,
        places=COMPARE | OPTIMISE | WORKSPACE | REPORT,
    )
    yield Length(
        "node_step",
        "node step",
        "Step of the design's own grid",
        _value_of_nodes("step"),
        reason=_no_nodes_counted,
        places=COMPARE | WORKSPACE,
    )
    yield Length(
        "reach",
        "reach",
        "The distance |a3| from a1 to a3",
        lambda case: case.design.reach,
        sense="less",
        gradient=_reach_gradient,
        places=COMPARE | STUDIES,
    )
    yield Length(
        "longest_leg",
        "longest leg",
        "The largest maximum length of l1, d2, d4 and l4; the reach where all are tied to it",
        lambda case: longest_leg(case.design),
        sense="less",
        gradient=_longest_leg_gradient,
        places=PAGE,
    )
    for axis, name in enumerate("xyz"):
        yield Length(
            f"exact_extent_{name}",
            f"extent {name}",
            f"From the lowest to the highest {name} of b4 in the workspace, exact",
            lambda case, axis=axis: float(case.extent[axis]),
            cost="high",
            places=COMPARE,
        )
    for axis, name in enumerate("xyz"):
        yield AtNodes(
            f"extent_{name}",
            f"extent {name} at nodes",
            f"From the lowest to the highest node of the workspace along {name}",
            lambda case, axis=axis: float(case.at_nodes.extent[axis]),
            power=1,
        )


def _margins() -> Iterable[Measure]:
    yield Margin(
        "least_margin",
        "worst margin",
        "The least |δ| anywhere in the workspace, exact; 0 where it goes up to a singularity. "
        f"{MARGIN_KINDS}",
        lambda case: float(case.least_margins.min()),
        cost="high",
        places=COMPARE,
    )
    yield MarginAtNodes(
        "worst_margin",
        "worst margin at nodes",
        f"Smallest |δ| over the nodes of the workspace. {MARGIN_KINDS}",
        lambda case: float(case.at_nodes.margins.min()),
    )
    yield MarginAtNodes(
        "mean_margin",
        "mean margin at nodes",
        f"Mean over the nodes of the workspace of the smallest |δ|. {MARGIN_KINDS}",
        lambda case: case.at_nodes.mean_margin,
        places=COMPARE | STUDIES,
    )
    for index in range(3):
        yield MarginAtNodes(
            f"margin_{index + 1}",
            f"margin {index + 1}",
            f"Smallest |δ{index + 1}| over the nodes of the workspace",
            lambda case, index=index: float(case.at_nodes.margins[index]),
        )
    yield Margin(
        "home_margin",
        "margin at home",
        f"The smallest |δ| in the home pose. {MARGIN_KINDS}",
        lambda case: float(np.abs(margins(case.at.position, case.rotation)).min()),
        places=COMPARE,
    )
    yield Margin(
        "box_margin",
        "margin over the box",
        f"The least |δ| over the required box, 0 where a singular plane meets it. {MARGIN_KINDS}",
        lambda case: (
            math.nan if case.box is None else float(box_margins(case.box, case.rotation).min())
        ),
        needs=("box",),
        places=OPTIMISE,
    )


def _clearances() -> Iterable[Measure]:
    yield Margin(
        "least_clearance",
        "clearance",
        "The least clearance of any two legs over the workspace, wherever every |δ| is at least a "
        "20th of |a3| or what a study states; certain to a 1000th of |a3|",
        lambda case: case.clearance[0],
        cost="high",
        reason=lambda case: f"no position is {_off_planes(case)}",
        places=PAGE,
    )
    yield Margin(
        "demanded_clearance",
        "demanded clearance",
        "The least clearance of any two legs over the workspace, wherever every |δ| is at least "
        "what the demand says",
        lambda case: case.demanded_clearance[0],
        cost="high",
        needs=("demanded_margin",),
        places=OPTIMISE,
    )
    yield MarginAtNodes(
        "clearance",
        "clearance at nodes",
        "Least clearance of any two legs over the nodes off the singular planes",
        lambda case: _finite_or_nan(float(case.at_nodes.clearances.min())),
        reason=_no_clearance,
    )
    for pair, (first, second) in enumerate(PAIRS):
        yield MarginAtNodes(
            f"clearance_{first}{second}",
            f"clearance {first}{second}",
            f"Least clearance of legs {first} and {second} over the nodes off the singular planes",
            lambda case, pair=pair: _finite_or_nan(float(case.at_nodes.clearances[pair])),
            reason=partial(_no_clearance, legs=(first, second)),
        )
    yield AtNodes(
        "clear_share",
        "collision-free share",
        "Share of the nodes of the workspace where no two legs meet",
        lambda case: case.at_nodes.clear_share,
        unit="share",
        sense="more",
        places=COMPARE | STUDIES,
    )
    yield Measure(
        "accessible_volume",
        "accessible volume",
        "Volume that a collision-free move from the home pose leads to",
        lambda case: case.accessible_volume[0],
        title="accessible",
        power=3,
        sense="more",
        cost="high",
        reason=lambda case: case.accessible_volume[1],
        places=STUDIES,
    )


class Index(NamedTuple):
    """An attribute of `PoseIndices`, its label, its hint, and the name that its mean has if any."""

    name: str
    label: str
    hint: str
    mean: str = ""


INDICES = (
    Index(
        "inverse_condition",
        "inverse condition",
        "inverse condition number 1/κ of the Jacobian, with lengths divided by the reach; 0 is "
        "singular, 1 the best (Gosselin and Angeles 1991)",
        mean="global conditioning index",
    ),
    Index(
        "transmission_index",
        "transmission index",
        "output transmission index: the least cosine, over the actuators, of the angle between "
        "the actuator's force on the platform and the velocity of its point while the others are "
        "locked; 0 is singular, above 0.64 to 0.7 is called good (Wang, Wu and Liu 2010)",
        mean="global transmission index",
    ),
    Index(
        "smallest_singular_value",
        "singular value",
        "smallest singular value of the Jacobian, with lengths divided by the reach: errors of "
        "actuators and loads grow at most by its inverse; 0 is singular",
    ),
    Index(
        "manipulability",
        "manipulability",
        "manipulability |det J|, with lengths divided by the reach; 0 is singular (Yoshikawa 1985)",
    ),
)


def _over_nodes(case: Case, name: str, reduce: Callable[[FloatArray], np.floating[Any]]) -> float:
    values = getattr(case.node_indices, name)
    return float(reduce(values)) if len(values) else math.nan


def _indices() -> Iterable[Measure]:
    for name, label, hint, mean in INDICES:
        yield Measure(
            name,
            f"{label} at home",
            f"In the home pose, the {hint}",
            lambda case, name=name: float(getattr(case.home_indices, name)),
            sense="more",
            places=COMPARE | STUDIES,
        )
        at_nodes = partial(Measure, sense="more", cost="high", reason=_no_node)
        yield at_nodes(
            f"worst_{name}",
            f"worst {label} at nodes",
            f"Least value at the nodes of the workspace of the {hint}",
            lambda case, name=name: _over_nodes(case, name, np.min),
            places=STUDIES,
        )
        if mean:
            yield at_nodes(
                f"mean_{name}",
                mean,
                f"Mean over the nodes of the workspace of the {hint}",
                lambda case, name=name: _over_nodes(case, name, np.mean),
            )


def _orientations() -> Iterable[Measure]:
    yield Measure(
        "orientation_share",
        "orientation share at home",
        "Share of all orientations that the home position can have within the limits",
        lambda case: orientation_share(case.design, case.at.position).share,
        unit="share",
        sense="more",
        places=PAGE | REPORT,
    )
    yield Measure(
        "home_tilt",
        "tilt at home",
        "Greatest tilt in every azimuth at the home position, from tilt zero at home's torsion; 0 "
        "if tilt zero violates a limit",
        lambda case: home_tilt(case.design, case.at),
        unit="°",
        sense="more",
        places=PAGE | REPORT,
    )
    yield Measure(
        "box_tilt",
        "tilt over the box",
        "Least of the greatest tilts in every azimuth at the nodes of a grid over the required "
        "box; 0 if tilt zero violates a limit at one",
        lambda case: math.nan if case.box is None else box_tilt(case.design, case.box, case.at),
        unit="°",
        sense="more",
        needs=("box",),
        places=OPTIMISE,
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
        yield Length(
            name,
            name,
            f"Design variable, in the frame of the {'base' if index < 2 else 'platform'}",
            lambda case, index=index: case.design.variables[index],
            gradient=lambda _, name=name: {name: 1.0},
            places=COMPARE,
        )


CATALOGUE: Mapping[str, Measure] = {
    measure.name: measure
    for group in (
        _sizes(),
        _margins(),
        _clearances(),
        _indices(),
        _orientations(),
        loads(),
        _coordinates(),
    )
    for measure in group
}
"""All measures by name, in the order in which every list has them."""


def measures_in(place: Place) -> dict[str, Measure]:
    """Return the measures that a place lists, by name in their order."""
    return {name: measure for name, measure in CATALOGUE.items() if place in measure.places}
