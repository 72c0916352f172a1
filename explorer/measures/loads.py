"""The measures of loads, errors and compliance: at home and over the required box."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from functools import partial

import numpy as np

from explorer.measures.measure import (
    COMPARE,
    OPTIMISE,
    REPORT,
    STUDIES,
    WORKSPACE,
    Case,
    Measure,
    Need,
    Place,
    Sense,
    Unit,
)
from explorer.measures.size import BOX_NODES
from explorer.measures.statics import BoxStatics
from explorer.mechanism.design import JOINTS, Design
from explorer.numerics.arrays import FloatArray
from explorer.statics.reactions import largest_payload, part_limits
from explorer.statics.slopes import (
    BENDING,
    TURN,
    compliance_slopes,
    deflection_slopes,
    error_slopes,
)

ELSEWHERE = COMPARE | STUDIES | REPORT


@dataclass(frozen=True)
class LoadLocation:
    """Where loads, errors and compliance are measured.

    Attributes:
        prefix: Beginning of the names of the measures.
        label: End of their labels.
        hint: End of their hints.
        needs: What they need besides the parts of the machine.
        places: Where they are listed.
        of: Function that returns the statics of a case.
    """

    prefix: str
    label: str
    hint: str
    needs: tuple[Need, ...]
    places: frozenset[Place]
    of: Callable[[Case], BoxStatics | None]


LOAD_LOCATIONS = (
    LoadLocation("home_", "at home", "at home", (), ELSEWHERE, lambda case: case.home_statics),
    LoadLocation(
        "",
        "over the box",
        f"at {BOX_NODES} nodes an axis of the required box",
        ("box",),
        OPTIMISE,
        lambda case: case.box_statics,
    ),
)


@dataclass(frozen=True)
class LoadMeasure:
    """A measure of loads, errors or compliance, wherever it is measured.

    Attributes:
        name, label, hint: As in `Measure`, without the location.
        value: Value of the statics at a location.
        needs: What it needs of the machine.
        title: As in `Measure`, without the location; the label if empty.
        power, unit, sense, names: As in `Measure`.
        gradient: Derivatives of the statics at a location, as in `Measure`.
        in_report: Whether the report lists it among its headlines, rather than in a table.
    """

    name: str
    label: str
    hint: str
    value: Callable[[BoxStatics], float]
    needs: tuple[Need, ...]
    title: str = ""
    power: int = 0
    unit: Unit = ""
    sense: Sense | None = "less"
    names: tuple[str, ...] = ()
    gradient: Callable[[BoxStatics], Mapping[str, float]] | None = None
    in_report: bool = True


LOAD_MEASURES = (
    LoadMeasure(
        "load_share",
        "load share",
        "The largest share of a limit of actuators, struts or guide under the payload's weight and "
        "force",
        lambda statics: statics.largest_share,
        ("is_loaded", "is_limited"),
        title="largest share of a limit",
        unit="share",
        gradient=lambda statics: statics.share_slopes(part_limits(statics.design)),
    ),
    LoadMeasure(
        "worst_actuator",
        "worst actuator",
        "The actuator with the largest share of its limit under the payload's weight and force; 1 "
        "to 6 stand for l1, d1, d2, d3, d4, l4",
        lambda statics: float(statics.shares[:6].argmax() + 1) if statics.is_regular else math.nan,
        ("is_loaded", "limits_actuators"),
        sense=None,
        names=JOINTS,
        in_report=False,
    ),
    LoadMeasure(
        "largest_payload",
        "largest payload",
        "The largest mass in place of the payload that keeps all limits",
        lambda statics: (
            float(largest_payload(statics.configuration).min()) if statics.is_regular else 0.0
        ),
        ("is_limited",),
        unit="kg",
        sense="more",
    ),
    LoadMeasure(
        "largest_bending",
        "largest bending",
        "The largest bending moment of struts 2 and 3 under the payload's weight and force",
        lambda statics: statics.largest_bending,
        ("is_loaded",),
        unit="N m",
        gradient=lambda statics: statics.share_slopes(_bending_limits(statics.design)),
        in_report=False,
    ),
    LoadMeasure(
        "worst_error",
        "worst error",
        "The largest displacement of the tool by the errors of the actuators",
        lambda statics: statics.worst_error,
        ("has_errors",),
        power=1,
        gradient=lambda statics: statics.slopes_at(
            statics.errors.displacement, partial(error_slopes, statics.design)
        ),
    ),
    LoadMeasure(
        "worst_turn",
        "worst turn",
        "The largest turn of the tool by the errors of the actuators",
        lambda statics: math.degrees(statics.worst(statics.errors.turn)),
        ("has_errors",),
        unit="°",
        gradient=lambda statics: statics.slopes_at(
            statics.errors.turn,
            partial(error_slopes, statics.design, rows=TURN),
            math.degrees(1.0),
        ),
        in_report=False,
    ),
    LoadMeasure(
        "softest_compliance",
        "softest compliance",
        "The largest displacement of the tool per force at it",
        lambda statics: statics.design.unit_mm * statics.worst(statics.softest),
        ("is_elastic",),
        unit="mm/N",
        gradient=lambda statics: statics.slopes_at(
            statics.softest, partial(compliance_slopes, statics.design), statics.design.unit_mm
        ),
    ),
    LoadMeasure(
        "deflection",
        "deflection",
        "The largest displacement of the tool under the payload's weight and force",
        lambda statics: statics.largest_deflection,
        ("is_loaded", "is_elastic"),
        power=1,
        gradient=lambda statics: statics.slopes_at(
            statics.deflections, partial(deflection_slopes, statics.design, statics.rotation)
        ),
    ),
)


def _bending_limits(design: Design) -> FloatArray:
    """Return limits (2, 10) of which a bending moment of 1 N m is a share of 1."""
    limits = np.full((2, 10), np.inf)
    limits[:, BENDING] = 1e3 / design.unit_mm
    return limits


def loads() -> Iterable[Measure]:
    """Yield the measures of loads, errors and compliance."""
    for location in LOAD_LOCATIONS:
        for load in LOAD_MEASURES:
            yield _measure(load, location)
    yield Measure(
        "held_volume",
        "held volume",
        "Volume of the workspace at whose positions the payload's weight and force are held within "
        "the limits of actuators, struts and guide",
        lambda case: case.held.held_volume,
        title="volume that holds the payload",
        power=3,
        sense="more",
        cost="high",
        needs=("is_loaded", "is_limited"),
        places=ELSEWHERE | WORKSPACE,
    )


def _measure(load: LoadMeasure, location: LoadLocation) -> Measure:
    def function(case: Case) -> float:
        statics = location.of(case)
        return math.nan if statics is None else load.value(statics)

    def reason(case: Case) -> str:
        statics = location.of(case)
        if statics is None or statics.is_regular:
            return ""
        where = "the required box has singular positions" if location.needs else "home is singular"
        return f"{where}, where forces and errors are infinite"

    slopes = load.gradient

    def gradient(case: Case) -> Mapping[str, float]:
        statics = location.of(case)
        return {} if statics is None or slopes is None else slopes(statics)

    return Measure(
        f"{location.prefix}{load.name}",
        f"{load.label} {location.label}",
        f"{load.hint}, {location.hint}",
        function,
        title=f"{load.title or load.label} {location.label}",
        power=load.power,
        unit=load.unit,
        sense=load.sense,
        is_whole=bool(load.names),
        names=load.names,
        gradient=None if slopes is None else gradient,
        needs=(*location.needs, *load.needs),
        reason=reason,
        places=location.places if load.in_report else location.places - REPORT,
    )
