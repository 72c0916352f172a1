"""The precision of the tool in a pose: its errors, their sources, its deflection and compliance."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from explorer.measures.blocks.block import (
    Bars,
    Block,
    Column,
    Fact,
    Facts,
    Names,
    Number,
    Split,
    Statement,
    Table,
    Vector,
    direction,
)
from explorer.mechanism.design import JOINTS
from explorer.statics.accuracy import IS_TILT, RMS_ERRORS, SOURCES
from explorer.statics.compliance import is_elastic
from explorer.statics.loaded import GROUPS, ToolPrecision

DIGITS = 3
LISTED = 8
"""Number of sources of errors that the page and a report list by themselves."""


def tool_errors(precision: ToolPrecision, listed: int | None = LISTED) -> Iterator[Block]:
    """Yield the errors of the tool, and what each source does alone.

    Args:
        precision: The precision.
        listed: Number of sources that are listed, from the largest; all if None.
    """
    if not precision.has_errors:
        yield Statement("The design states no errors")
        return
    if not precision.is_regular:
        yield Statement("Errors are infinite here", "The pose is singular.", "beyond")
        return
    unit, bounds = precision.loaded.design.unit_mm, precision.bounds
    stated = [name for name, sources in GROUPS.items() if bounds[sources].any()]
    if len(stated) == 2:
        # One of the two is all.
        stated = stated[:1]
    errors = [
        error
        for name in stated
        for error in (precision.worst(GROUPS[name]), precision.rms(GROUPS[name]))
    ]
    moved = [unit * float(error.displacement) for error in errors]
    turned = [math.degrees(error.turn) for error in errors]
    # The last group has all errors, the first of its two is the worst.
    within = Number(moved[-2], " mm", DIGITS), ", ±", Number(turned[-2], "°", DIGITS)
    yield Statement(("Tool within ±", *within))
    yield Table(
        "Errors of the tool",
        (
            Names("error of", [f"{name}, {kind}" for name in stated for kind in ("worst", "RMS")]),
            Column("displacement", moved, " mm", DIGITS),
            Column("turn", turned, "°", DIGITS),
        ),
        "Displacement of the tool point, and turn of the tool. Worst: the largest for all signs "
        f"of the errors, each at its largest. RMS: root mean square of {RMS_ERRORS}.",
    )
    yield from _sources(precision, listed)


def _sources(precision: ToolPrecision, listed: int | None) -> Iterator[Block]:
    unit, bounds = precision.loaded.design.unit_mm, precision.bounds
    moved, turned = unit * precision.alone.displacement, np.degrees(precision.alone.turn)
    order: list[int] = np.lexsort([-turned, -moved]).tolist()
    ranked = [k for k in order if moved[k] > 0.0 or turned[k] > 0.0]
    shown = ranked[:listed]
    most = float(moved.max()) or 1.0
    limits = [math.degrees(bounds[k]) if IS_TILT[k] else unit * float(bounds[k]) for k in shown]
    yield Table(
        "By source",
        (
            Names("source", [SOURCES[k] for k in shown]),
            Column("bound", limits, ["°" if IS_TILT[k] else " mm" for k in shown], before="± ",
                   wide=True),
            Column("displacement", moved[shown].tolist(), " mm", DIGITS),
            Column("turn", turned[shown].tolist(), "°", DIGITS),
            Bars(
                (moved[shown] / most).tolist(),
                ["actuator" if k < len(JOINTS) else "dimension" for k in shown],
            ),
        ),
        "What each actuator at its largest error, and each dimension at its tolerance, does alone.",
    )  # fmt: skip
    if len(ranked) > len(shown):
        rest = Number(float(moved[ranked[len(shown)]]), " mm", 2)
        yield Statement("", (f"{len(ranked) - len(shown)} more, each at most ", rest))


def deflections(precision: ToolPrecision, load: str, *, has_force: bool = False) -> Iterator[Block]:
    """Yield the deflection of the tool, what gives way, and the softest directions.

    Args:
        precision: The precision.
        load: The load in words, such as "the load and the weights".
        has_force: Whether this load is the payload's force in its worst direction.
    """
    design = precision.loaded.design
    if not is_elastic(design):
        yield Statement(
            "",
            "Rigid: the design states no stiffness of its actuators and no tubes for its struts.",
        )
        return
    if not precision.is_regular:
        yield Statement("", "The deflection is infinite: the pose is singular.", "beyond")
        return
    unit, force, deflection = design.unit_mm, design.payload.force_n, precision.deflection
    moved, turned = (unit * deflection[:3]).tolist(), np.degrees(deflection[3:]).tolist()
    facts = [
        Fact("displacement", (Number(math.hypot(*moved), " mm", DIGITS),), (Vector(moved),)),
        Fact("turn", (Number(math.hypot(*turned), "°", DIGITS),), (Vector(turned),)),
    ]
    if force and has_force:
        along = [each / force for each in precision.loaded.load[:3]]
        facts.append(Fact("direction of the payload's force", "", (direction(along),)))
    elif force:
        most = Number(unit * precision.largest_displacement, " mm", DIGITS)
        hint = "The payload's force acts besides, in the direction that deflects the tool most."
        facts.append(Fact("with the payload's force", ("at most ", most), hint=hint))
    yield Facts("Deflection", facts, f"Displacement and turn of the tool under {load}.")
    shares = [float(share) for share in precision.shares]
    if not np.isnan(shares).any():
        yield Split(
            "Work of the load",
            ("guide", "struts", "actuators"),
            shares,
            "Parts of the work that the load does: on the actuators d1 and d3 along the guide, on "
            "the bending struts of legs 2 and 3, and on the actuators l1, d2, d4 and l4.",
        )
    yield from _softest(precision)


def _softest(precision: ToolPrecision) -> Iterator[Block]:
    unit, principal = precision.loaded.design.unit_mm, precision.principal
    # Radians per newton and unit become degrees per newton metre.
    per_moment = math.degrees(1e3 / unit)
    for title, hint, values, name, axes in (
        (
            "Softest directions of a force",
            "Displacement of the tool per force, softest first, and the direction of the force.",
            unit * principal.displacement,
            " mm/N",
            principal.force_directions,
        ),
        (
            "Softest directions of a moment",
            "Turn of the tool per moment, softest first, and the axis of the moment.",
            per_moment * principal.turn,
            " °/(N m)",
            principal.moment_directions,
        ),
    ):
        yield Table(
            title,
            (
                Names("along x, y, z", [(direction(axis),) for axis in axes.tolist()]),
                Names("compliance", [(Number(value, name, DIGITS),) for value in values.tolist()]),
            ),
            hint,
        )
