"""The measures of loads, errors and compliance at home, and of what the workspace holds."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator
from typing import Any

from explorer.measures.measure import Measure, Place, Sense
from explorer.measures.workspace import AtNodes
from explorer.mechanism.design import JOINTS
from explorer.numerics.arrays import FloatArray
from explorer.statics.accuracy import ToolError, actuator_errors, worst_errors
from explorer.statics.loaded import LoadedPose, ToolPrecision
from explorer.statics.reactions import largest_accelerations

ACCELERATION = (
    "largest acceleration (1 g is 9.81 m/s²; below 0 where the payload is not held) from rest in "
    "every direction, without turning, that the payload's weight and force leave within the limits "
    "of actuators, struts and guide"
)

ELSEWHERE: tuple[Place, ...] = ("compare", "studies", "report")
SINGULAR_HOME = "home is singular, where no unique forces hold a load and errors are infinite"


def loads() -> Iterable[Measure]:
    """Yield the measures of loads, errors and compliance."""
    yield from _loads_at_home()
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


def _loads_at_home() -> Iterator[Measure]:
    yield _measure(
        "load_share",
        "load share",
        "The largest share of a limit of actuators, struts or guide under the payload's weight and "
        "force",
        lambda home: home.share,
        ("is_loaded", "is_limited"),
        title="largest share of a limit",
        unit="share",
    )
    yield _measure(
        "worst_actuator",
        "worst actuator",
        "The actuator with the largest share of its limit under the payload's weight and force; 1 "
        "to 6 stand for l1, d1, d2, d3, d4, l4",
        lambda home: float(home.shares[:6].argmax() + 1) if home.is_regular else math.nan,
        ("is_loaded", "limits_actuators"),
        sense=None,
        is_whole=True,
        names=JOINTS,
        in_report=False,
    )
    yield _measure(
        "largest_payload",
        "largest payload",
        "The largest mass in place of the payload that keeps all limits",
        lambda home: home.largest_payload,
        ("is_limited",),
        unit="kg",
        sense="more",
    )
    yield _measure(
        "acceleration",
        "acceleration",
        f"The {ACCELERATION}",
        lambda home: _least(largest_accelerations(home)),
        ("has_mass", "is_limited"),
        unit="m/s²",
        sense="more",
    )
    yield _measure(
        "largest_bending",
        "largest bending",
        "The largest bending moment of struts 2 and 3 under the payload's weight and force",
        lambda home: 1e-3 * home.design.unit_mm * _bending(home),
        ("is_loaded",),
        unit="N m",
        in_report=False,
    )
    yield _measure(
        "worst_error",
        "worst error",
        "The largest displacement of the tool by the errors of the actuators",
        lambda home: float(_errors(home).displacement),
        ("has_errors",),
        power=1,
    )
    yield _measure(
        "worst_turn",
        "worst turn",
        "The largest turn of the tool by the errors of the actuators",
        lambda home: math.degrees(_errors(home).turn),
        ("has_errors",),
        unit="°",
        in_report=False,
    )
    yield _measure(
        "softest_compliance",
        "softest compliance",
        "The largest displacement of the tool per force at it",
        lambda home: home.design.unit_mm * float(ToolPrecision(home).principal.displacement[0]),
        ("is_elastic",),
        unit="mm/N",
    )
    yield _measure(
        "deflection",
        "deflection",
        "The largest displacement of the tool under the payload's weight and force",
        lambda home: ToolPrecision(home).largest_displacement,
        ("is_loaded", "is_elastic"),
        power=1,
    )


def _bending(home: LoadedPose) -> float:
    """Return the largest bending moment of struts 2 and 3, in N × unit."""
    return float((home.reactions.bending + home.reactions.spread[6:8]).max())


def _errors(home: LoadedPose) -> ToolError:
    return worst_errors(home, actuator_errors(home.design))


def _measure(
    name: str,
    label: str,
    hint: str,
    value: Callable[[LoadedPose], float],
    needs: tuple[str, ...],
    *,
    title: str = "",
    sense: Sense | None = "less",
    in_report: bool = True,
    **others: Any,
) -> Measure:
    """Return a measure of the statics at home, see `Measure`."""
    return Measure(
        f"home_{name}",
        f"{label} at home",
        f"{hint}, at home",
        lambda case: value(case.home_loaded),
        title=f"{title or label} at home",
        needs=needs,
        reason=lambda case: "" if case.home_loaded.is_regular else SINGULAR_HOME,
        places=ELSEWHERE if in_report else ELSEWHERE[:-1],
        sense=sense,
        **others,
    )
