"""The measures of loads, errors and compliance: at home and over the required box."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Mapping
from functools import partial
from typing import Any

import numpy as np

from explorer.measures.box import BOX_NODES, BoxStatics
from explorer.measures.measure import Case, Measure, Place, Sense
from explorer.measures.workspace import AtNodes
from explorer.mechanism.design import JOINTS, Design
from explorer.numerics.arrays import FloatArray
from explorer.statics import slopes
from explorer.statics.reactions import largest_accelerations, largest_payload, part_limits

ACCELERATION = (
    "largest acceleration (1 g is 9.81 m/s²; below 0 where the payload is not held) from rest in "
    "every direction, without turning, that the payload's weight and force leave within the limits "
    "of actuators, struts and guide"
)

ELSEWHERE: tuple[Place, ...] = ("compare", "studies", "report")


def loads() -> Iterable[Measure]:
    """Yield the measures of loads, errors and compliance."""
    yield from _loads_at(is_home=True)
    yield from _loads_at(is_home=False)
    yield Measure(
        "held_volume",
        "held volume",
        "Volume of the workspace at whose positions the payload's weight and force are held within "
        "the limits of actuators, struts and guide",
        lambda case: case.carried_region.held_volume,
        title="volume that holds the payload",
        power=3,
        sense="more",
        cost="high",
        needs=("is_loaded", "is_limited"),
        places=(*ELSEWHERE, "workspace"),
    )
    yield AtNodes(
        "worst_acceleration",
        "worst acceleration at nodes",
        f"Least value at the nodes of the workspace of the {ACCELERATION}",
        lambda case: _least(largest_accelerations(case.node_indices)),
        unit="m/s²",
        needs=("has_mass", "is_limited"),
        places=("compare", "studies"),
    )


def _least(accelerations: FloatArray) -> float:
    """Return the least acceleration; NaN where a limit is exceeded whatever the acceleration."""
    least = float(accelerations.min(initial=math.inf))
    return least if math.isfinite(least) else math.nan


def _loads_at(*, is_home: bool) -> Iterator[Measure]:
    """Yield the measures at home, or those over the required box."""
    measure = partial(_measure, is_home)
    yield measure(
        "load_share",
        "load share",
        "The largest share of a limit of actuators, struts or guide under the payload's weight and "
        "force",
        lambda statics: statics.worst(statics.node_utilisations),
        ("is_loaded", "is_limited"),
        title="largest share of a limit",
        unit="share",
        gradient=lambda statics: statics.utilisation_slopes(part_limits(statics.design)),
    )
    yield measure(
        "worst_actuator",
        "worst actuator",
        "The actuator with the largest share of its limit under the payload's weight and force; 1 "
        "to 6 stand for l1, d1, d2, d3, d4, l4",
        lambda statics: (
            float(statics.utilisations[:6].argmax() + 1) if statics.is_regular else math.nan
        ),
        ("is_loaded", "limits_actuators"),
        sense=None,
        is_whole=True,
        names=JOINTS,
        in_report=False,
    )
    yield measure(
        "largest_payload",
        "largest payload",
        "The largest mass in place of the payload that keeps all limits",
        lambda statics: float(largest_payload(statics).min()) if statics.is_regular else 0.0,
        ("is_limited",),
        unit="kg",
        sense="more",
    )
    yield measure(
        "acceleration",
        "acceleration",
        f"The {ACCELERATION}",
        lambda statics: _least(statics.accelerations) if statics.is_regular else math.nan,
        ("has_mass", "is_limited"),
        unit="m/s²",
        sense="more",
        gradient=BoxStatics.acceleration_slopes,
    )
    yield measure(
        "largest_bending",
        "largest bending",
        "The largest bending moment of struts 2 and 3 under the payload's weight and force",
        lambda statics: 1e-3 * statics.design.unit_mm * statics.worst(statics.bending),
        ("is_loaded",),
        unit="N m",
        gradient=lambda statics: statics.utilisation_slopes(_bending_limits(statics.design)),
        in_report=False,
    )
    yield measure(
        "worst_error",
        "worst error",
        "The largest displacement of the tool by the errors of the actuators",
        lambda statics: statics.worst(statics.errors.displacement),
        ("has_errors",),
        power=1,
        gradient=lambda statics: statics.slopes_at_worst(
            statics.errors.displacement, partial(slopes.error_slopes, statics.design)
        ),
    )
    yield measure(
        "worst_turn",
        "worst turn",
        "The largest turn of the tool by the errors of the actuators",
        lambda statics: math.degrees(statics.worst(statics.errors.turn)),
        ("has_errors",),
        unit="°",
        gradient=lambda statics: statics.slopes_at_worst(
            statics.errors.turn,
            partial(slopes.error_slopes, statics.design, rows=slopes.TURN),
            math.degrees(1.0),
        ),
        in_report=False,
    )
    yield measure(
        "softest_compliance",
        "softest compliance",
        "The largest displacement of the tool per force at it",
        lambda statics: statics.design.unit_mm * statics.worst(statics.softest),
        ("is_elastic",),
        unit="mm/N",
        gradient=lambda statics: statics.slopes_at_worst(
            statics.softest,
            partial(slopes.compliance_slopes, statics.design),
            statics.design.unit_mm,
        ),
    )
    yield measure(
        "deflection",
        "deflection",
        "The largest displacement of the tool under the payload's weight and force",
        lambda statics: statics.worst(statics.deflections),
        ("is_loaded", "is_elastic"),
        power=1,
        gradient=lambda statics: statics.slopes_at_worst(
            statics.deflections,
            partial(slopes.deflection_slopes, statics.design, statics.rotation),
        ),
    )


def _bending_limits(design: Design) -> FloatArray:
    """Return limits (2, 10) of which a bending moment of 1 N m is a share of 1."""
    limits = np.full((2, 10), np.inf)
    limits[:, slopes.BENDING] = 1e3 / design.unit_mm
    return limits


def _measure(
    is_home: bool,
    name: str,
    label: str,
    hint: str,
    value: Callable[[BoxStatics], float],
    needs: tuple[str, ...],
    *,
    title: str = "",
    sense: Sense | None = "less",
    gradient: Callable[[BoxStatics], Mapping[str, float]] | None = None,
    in_report: bool = True,
    **others: Any,
) -> Measure:
    """Return a measure of the statics at home or over the required box, see `Measure`."""
    where = "at home" if is_home else "over the box"
    nodes = "at home" if is_home else f"at {BOX_NODES} nodes an axis of the required box"
    singular = "home is singular" if is_home else "the required box has singular positions"
    listed = ELSEWHERE if in_report else ELSEWHERE[:-1]

    def statics_of(case: Case) -> BoxStatics | None:
        return case.home_statics if is_home else case.box_statics

    def function(case: Case) -> float:
        statics = statics_of(case)
        return math.nan if statics is None else value(statics)

    def reason(case: Case) -> str:
        statics = statics_of(case)
        if statics is None or statics.is_regular:
            return ""
        return f"{singular}, where no unique forces hold a load and errors are infinite"

    def derivatives(case: Case) -> Mapping[str, float]:
        statics = statics_of(case)
        return {} if statics is None or gradient is None else gradient(statics)

    return Measure(
        f"home_{name}" if is_home else name,
        f"{label} {where}",
        f"{hint}, {nodes}",
        function,
        title=f"{title or label} {where}",
        gradient=None if gradient is None else derivatives,
        needs=needs if is_home else ("box", *needs),
        reason=reason,
        places=listed if is_home else ("optimise",),
        sense=sense,
        **others,
    )
