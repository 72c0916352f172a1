"""The measures of the constant-orientation workspace: size, margins, clearances, conditioning.

Lengths are in design units.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from functools import partial
from typing import Any, Literal

import numpy as np

from explorer.errors import InputError
from explorer.legs.clearance import PAIRS
from explorer.measures.measure import Case, Measure, Sense
from explorer.mechanism.margins import MARGIN_KINDS
from explorer.numerics.arrays import FloatArray

Length = partial(Measure, power=1)
# Measures of which more is better.
More = partial(Measure, sense="more")
Margin = partial(More, power=1)


def _off_planes(case: Case) -> str:
    return f"so far from the singular planes that clearances count ({case.clearance_margin:g} u)"


def _no_node(case: Case) -> str:
    if len(case.node_positions):
        return ""
    return f"none of {case.nodes} nodes an axis lies in the workspace"


AtNodes = partial(More, reason=_no_node)


def _length_at_nodes(
    name: str,
    label: str,
    hint: str,
    values_of: Callable[[Case], Any],
    reason: Callable[[Case], str] = _no_node,
    sense: Sense | None = "more",
) -> Measure:
    """Return a measure that is the least of some lengths at the nodes, or one of them."""

    def function(case: Case) -> float:
        value = float(np.min(values_of(case)))
        return value if math.isfinite(value) else math.nan

    return Measure(
        name, label, hint, function, power=1, reason=reason, sense=sense, places=("studies",)
    )


def _no_clearance(case: Case, legs: str = "") -> str:
    if not len(case.at_nodes.positions):
        return _no_node(case)
    if not np.isfinite(case.at_nodes.clearances).any():
        return f"no node is {_off_planes(case)}"
    return legs and f"legs {legs} share a joint"


def _no_nodes_counted(case: Case) -> str:
    try:
        _ = case.paper_nodes
    except InputError as error:
        return str(error)
    return ""


def _of_paper_nodes(attribute: Literal["count", "volume", "step"]) -> Callable[[Case], float]:
    def value(case: Case) -> float:
        return math.nan if _no_nodes_counted(case) else getattr(case.paper_nodes, attribute)

    return value


def _sizes() -> Iterable[Measure]:
    yield More(
        "volume",
        "volume",
        "Volume of the workspace at the home's orientation: exact, or good to about 10⁻⁴ where "
        "joints bound the swing of legs",
        lambda case: case.volume.volume,
        title="exact volume",
        power=3,
        for_tables="at most",
    )
    yield More(
        "volume_per_leg",
        "volume / longest leg³",
        "Volume of the workspace for the size of the design",
        lambda case: case.volume.volume / case.longest_leg**3,
        places=("compare",),
        for_tables="at most",
    )
    yield Measure(
        "node_count",
        "nodes",
        "The paper's measure of the workspace: nodes of the design's own grid",
        _of_paper_nodes("count"),
        reason=_no_nodes_counted,
        is_whole=True,
        places=("compare", "optimise", "workspace"),
    )
    yield Measure(
        "node_volume",
        "node volume",
        "Nodes times the cube of their step; it overstates the volume",
        _of_paper_nodes("volume"),
        reason=_no_nodes_counted,
        power=3,
        places=("compare", "optimise", "workspace", "report"),
    )
    yield Length(
        "node_step",
        "node step",
        "Step of the design's own grid",
        _of_paper_nodes("step"),
        reason=_no_nodes_counted,
        places=("compare", "workspace"),
    )
    yield Length(
        "reach",
        "reach",
        "The distance |a3| from a1 to a3",
        lambda case: case.design.reach,
        sense="less",
        places=("compare", "studies"),
    )
    yield Length(
        "longest_leg",
        "longest leg",
        "The largest maximum length of l1, d2, d4 and l4; the reach where all are tied to it",
        lambda case: case.longest_leg,
        sense="less",
        places=("compare", "optimise", "studies"),
        for_tables="exact",
    )
    for axis, name in enumerate("xyz"):
        yield Length(
            f"exact_extent_{name}",
            f"extent {name}",
            f"From the lowest to the highest {name} of b4 in the workspace, exact",
            lambda case, axis=axis: float(case.extent[axis]),
            cost="high",
            places=("compare",),
            for_tables="at most",
        )
    for axis, name in enumerate("xyz"):
        yield _length_at_nodes(
            f"extent_{name}",
            f"extent {name} at nodes",
            f"From the lowest to the highest node of the workspace along {name}",
            lambda case, axis=axis: case.at_nodes.extent[axis],
            sense=None,
        )


def _margins() -> Iterable[Measure]:
    yield Margin(
        "least_margin",
        "worst margin",
        "The least |δ| anywhere in the workspace, exact; 0 where it goes up to a singularity. "
        f"{MARGIN_KINDS}",
        lambda case: float(case.least_margins.min()),
        cost="high",
        places=("compare",),
    )
    yield _length_at_nodes(
        "worst_margin",
        "worst margin at nodes",
        f"Smallest |δ| over the nodes of the workspace. {MARGIN_KINDS}",
        lambda case: case.at_nodes.margins,
    )
    yield AtNodes(
        "mean_margin",
        "mean margin at nodes",
        f"Mean over the nodes of the workspace of the smallest |δ|. {MARGIN_KINDS}",
        lambda case: case.at_nodes.mean_margin,
        power=1,
        places=("compare", "studies"),
    )
    for index in range(3):
        yield _length_at_nodes(
            f"margin_{index + 1}",
            f"margin {index + 1}",
            f"Smallest |δ{index + 1}| over the nodes of the workspace",
            lambda case, index=index: case.at_nodes.margins[index],
        )
    yield Margin(
        "home_margin",
        "margin at home",
        f"The smallest |δ| in the home pose. {MARGIN_KINDS}",
        lambda case: float(np.abs(case.home_indices.margins).min()),
        places=("compare",),
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
        places=("compare", "optimise", "studies"),
    )
    yield Margin(
        "demanded_clearance",
        "demanded clearance",
        "The least clearance of any two legs over the workspace, wherever every |δ| is at least "
        "what the demand says",
        lambda case: case.demanded_clearance[0],
        cost="high",
        needs=("demanded_margin",),
        places=("optimise",),
    )
    yield _length_at_nodes(
        "clearance",
        "clearance at nodes",
        "Least clearance of any two legs over the nodes off the singular planes",
        lambda case: case.at_nodes.clearances,
        _no_clearance,
    )
    for pair, (first, second) in enumerate(PAIRS):
        yield _length_at_nodes(
            f"clearance_{first}{second}",
            f"clearance {first}{second}",
            f"Least clearance of legs {first} and {second} over the nodes off the singular planes",
            lambda case, pair=pair: case.at_nodes.clearances[pair],
            partial(_no_clearance, legs=f"{first} and {second}"),
        )
    yield AtNodes(
        "clear_share",
        "collision-free share",
        "Share of the nodes of the workspace where no two legs meet",
        lambda case: case.at_nodes.clear_share,
        unit="share",
        places=("compare", "studies"),
    )
    yield More(
        "accessible_volume",
        "accessible volume",
        "Volume that a collision-free move from the home pose leads to",
        lambda case: case.accessible_volume[0],
        title="accessible",
        power=3,
        cost="high",
        reason=lambda case: case.accessible_volume[1],
        places=("studies",),
    )


def _index(name: str, label: str, hint: str, mean: str = "") -> Iterable[Measure]:
    """Yield the measures of an attribute of `PoseIndices`; its mean if that has a name."""

    def over_nodes(reduce: Callable[[FloatArray], Any]) -> Callable[[Case], float]:
        def function(case: Case) -> float:
            values = getattr(case.node_indices, name)
            return float(reduce(values)) if len(values) else math.nan

        return function

    yield More(
        name,
        f"{label} at home",
        f"In the home pose, the {hint}",
        lambda case: float(getattr(case.home_indices, name)),
        places=("compare", "studies"),
        for_tables="exact",
    )
    yield AtNodes(
        f"worst_{name}",
        f"worst {label} at nodes",
        f"Least value at the nodes of the workspace of the {hint}",
        over_nodes(np.min),
        cost="high",
        places=("studies",) if mean else ("compare", "studies"),
        for_tables="exact",
    )
    if mean:
        yield AtNodes(
            f"mean_{name}",
            mean,
            f"Mean over the nodes of the workspace of the {hint}",
            over_nodes(np.mean),
            cost="high",
            for_tables="exact",
        )


def _indices() -> Iterable[Measure]:
    yield from _index(
        "inverse_condition",
        "inverse condition",
        "inverse condition number 1/κ of the Jacobian, with lengths divided by the reach (of a "
        "table on six legs, by the largest distance of two base points); 0 is singular, 1 the best "
        "(Gosselin and Angeles 1991)",
        "global conditioning index",
    )
    yield from _index(
        "transmission_index",
        "transmission index",
        "local transmission index: the least cosine, over the actuators, of the angle between "
        "the actuator's force on the platform and the velocity of its point while the others are "
        "locked; 0 is singular, above 0.64 to 0.7 is called good (Wang, Wu and Liu 2010)",
        "global transmission index",
    )
    yield from _index(
        "smallest_singular_value",
        "singular value",
        "smallest singular value of the Jacobian, with lengths divided by the reach: errors of "
        "actuators and loads grow at most by its inverse; 0 is singular",
    )
    yield from _index(
        "manipulability",
        "manipulability",
        "manipulability |det J|, with lengths divided by the reach; 0 is singular (Yoshikawa 1985)",
    )
    for name, label, hint in (
        (
            "force_per_newton",
            "largest force per newton",
            "the largest force of an actuator for each newton of a force in any direction",
        ),
        (
            "error_per_joint_error",
            "error per joint error",
            "the largest displacement for each unit of error of all six joints",
        ),
    ):
        yield Measure(
            name,
            f"{label} at home",
            f"In the home pose, at b4 (of a table on six legs, at the platform's origin), {hint}; "
            "infinite in a singular pose",
            lambda case, name=name: float(getattr(case.home_indices, name)),
            sense="less",
            places=("compare", "studies"),
            for_tables="exact",
        )


def _orientations() -> Iterable[Measure]:
    yield More(
        "orientation_share",
        "orientation share at home",
        "Share of all orientations that the home position can have within the limits",
        lambda case: case.home_share,
        unit="share",
        places=("compare", "optimise", "studies", "report"),
        for_tables="at most",
    )
    yield More(
        "home_tilt",
        "tilt at home",
        "Greatest tilt in every azimuth at the home position, from tilt zero at home's torsion; 0 "
        "if tilt zero violates a limit",
        lambda case: case.home_tilt,
        unit="°",
        places=("compare", "optimise", "studies", "report"),
        for_tables="at most",
    )


def workspace_measures() -> Iterable[Measure]:
    """Yield the measures of the workspace, in the order in which every list has them."""
    yield from _sizes()
    yield from _margins()
    yield from _clearances()
    yield from _indices()
    yield from _orientations()
