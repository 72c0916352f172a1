"""The precision of the tool: errors and their sources, deflection, and the budget of tolerances."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from explorer.measures.blocks import block
from explorer.mechanism.design import JOINTS
from explorer.numerics.arrays import FloatArray
from explorer.statics.accuracy import IS_TILT, NO_SOURCES, RMS_ERRORS, SOURCES
from explorer.statics.budget import PARTS, SourceCosts, ToleranceBudget
from explorer.statics.compliance import RIGID, is_elastic
from explorer.statics.loaded import GROUPS, ToolPrecision

DIGITS = 3
LISTED = 8
"""Number of sources of errors that the page and a report list by themselves."""


def tool_errors(precision: ToolPrecision, listed: int | None = LISTED) -> Iterator[block.Block]:
    """Yield the errors of the tool, and what each source does alone.

    So many sources are listed, from the largest; all if the number is None.
    """
    if not precision.has_errors:
        yield block.Statement("The design states no errors")
        return
    if not precision.is_regular:
        yield block.Statement("Errors are infinite here", "The pose is singular.", "beyond")
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
    within = block.Number(moved[-2], " mm", DIGITS), ", ±", block.Number(turned[-2], "°", DIGITS)
    yield block.Statement(("Tool within ±", *within))
    yield block.Table(
        "Errors of the tool",
        (
            block.Names(
                "error of", [f"{name}, {kind}" for name in stated for kind in ("worst", "RMS")]
            ),
            block.Column("displacement", moved, " mm", DIGITS),
            block.Column("turn", turned, "°", DIGITS),
        ),
        "Displacement of the tool point, and turn of the tool. Worst: the largest for all signs "
        f"of the errors, each at its largest. RMS: root mean square of {RMS_ERRORS}. "
        f"Left out: {NO_SOURCES}.",
    )
    yield from _sources(precision, listed)


def _sources(precision: ToolPrecision, listed: int | None) -> Iterator[block.Block]:
    unit, bounds = precision.loaded.design.unit_mm, precision.bounds
    moved, turned = unit * precision.alone.displacement, np.degrees(precision.alone.turn)
    order: list[int] = np.lexsort([-turned, -moved]).tolist()
    ranked = [k for k in order if moved[k] > 0.0 or turned[k] > 0.0]
    shown = ranked[:listed]
    limits = [math.degrees(bounds[k]) if IS_TILT[k] else unit * float(bounds[k]) for k in shown]
    yield block.Table(
        "By source",
        (
            block.Names("source", [SOURCES[k] for k in shown]),
            block.Column("bound", limits, _units(shown), before="± ", wide=True),
            block.Column("displacement", moved[shown].tolist(), " mm", DIGITS),
            block.Column("turn", turned[shown].tolist(), "°", DIGITS),
            _bars(moved, shown),
        ),
        "What each actuator at its largest error, and each dimension at its tolerance, does alone.",
    )
    if len(ranked) > len(shown):
        rest = block.Number(float(moved[ranked[len(shown)]]), " mm", 2)
        yield block.Statement("", (f"{len(ranked) - len(shown)} more, each at most ", rest))


def _units(sources: list[int], tilt: str = "°", length: str = " mm") -> list[str]:
    return [tilt if IS_TILT[k] else length for k in sources]


def _bars(moved: FloatArray, sources: list[int]) -> block.Bars:
    """Return bars of what sources of errors displace, over the largest of all."""
    return block.Bars(
        (moved[sources] / (float(moved.max()) or 1.0)).tolist(),
        ["actuator" if k < len(JOINTS) else "dimension" for k in sources],
    )


def deflections(
    precision: ToolPrecision, load: str, *, has_force: bool = False
) -> Iterator[block.Block]:
    """Yield the deflection of the tool, what gives way, and the softest directions.

    The load is in words, such as "the load and the weights"; if it has a force, that is the
    payload's force in its worst direction.
    """
    design = precision.loaded.design
    if not is_elastic(design):
        yield block.Statement(
            "",
            "Rigid: the design states no stiffness of its actuators and no tubes for its struts.",
        )
        return
    if not precision.is_regular:
        yield block.Statement("", "The deflection is infinite: the pose is singular.", "beyond")
        return
    unit, force, deflection = design.unit_mm, design.payload.force_n, precision.deflection
    moved, turned = (unit * deflection[:3]).tolist(), np.degrees(deflection[3:]).tolist()
    facts = [
        block.Fact(
            "displacement",
            (block.Number(math.hypot(*moved), " mm", DIGITS),),
            (block.Vector(moved),),
        ),
        block.Fact(
            "turn", (block.Number(math.hypot(*turned), "°", DIGITS),), (block.Vector(turned),)
        ),
    ]
    if force and has_force:
        along = [each / force for each in precision.loaded.load[:3]]
        facts.append(block.Fact("direction of the payload's force", "", (block.direction(along),)))
    elif force:
        most = block.Number(unit * precision.largest_displacement, " mm", DIGITS)
        hint = "The payload's force acts besides, in the direction that deflects the tool most."
        facts.append(block.Fact("with the payload's force", ("at most ", most), hint=hint))
    words = f"Displacement and turn of the tool under {load}. Rigid: {RIGID}."
    yield block.Facts("Deflection", facts, words)
    shares = [float(share) for share in precision.shares]
    if not np.isnan(shares).any():
        yield block.Split(
            "Work of the load",
            ("guide", "struts", "actuators"),
            shares,
            "Parts of the work that the load does: on the actuators d1 and d3 along the guide, on "
            "the bending struts of legs 2 and 3, and on the actuators l1, d2, d4 and l4.",
        )
    yield from _softest(precision)


def _softest(precision: ToolPrecision) -> Iterator[block.Block]:
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
        yield block.Table(
            title,
            (
                block.Names("along x, y, z", [(block.direction(axis),) for axis in axes.tolist()]),
                block.Names(
                    "compliance",
                    [(block.Number(value, name, DIGITS),) for value in values.tolist()],
                ),
            ),
            hint,
        )


def tolerance_budget(
    costs: SourceCosts,
    found: ToleranceBudget | None,
    wanted: float | None = None,
    wanted_turn: float | None = None,
) -> Iterator[block.Block]:
    """Yield the errors that tolerances allow, and what each of them costs, the costliest first.

    The tolerances may have been found for a largest displacement of the tool, in mm, and a largest
    turn, in degrees; None stands for any.
    """
    has_tolerances = bool(costs.tolerances[np.isfinite(costs.tolerances)].any())
    if has_tolerances:
        yield _errors(costs, wanted, wanted_turn)
    else:
        yield block.Statement(
            "",
            "The design states no tolerances; the displacements are those by an error of 1 mm, and "
            "by a tilt that moves its part's end by 1 mm.",
        )
    if found is not None:
        above = block.Number(100.0 * found.excess, " %", 2)
        effort = block.Number(found.effort, " /mm", 4)
        words = ("The sum of 1/tolerance is ", effort, ", at most ", above, " above the least.")
        yield block.Statement("", words, act="set")
    yield _costs(costs, per_unit=not has_tolerances)


def _errors(costs: SourceCosts, wanted: float | None, wanted_turn: float | None) -> block.Facts:
    where = "" if costs.count == 1 else f" At the worst of {costs.count:,} positions."
    facts = [
        block.Fact(
            name,
            (block.Number(error, unit, DIGITS),),
            "" if limit is None else f"of the wanted {limit:g}{unit}",
        )
        for name, error, unit, limit in (
            ("worst displacement", costs.worst_displacement, " mm", wanted),
            ("worst turn", costs.worst_turn, "°", wanted_turn),
            ("RMS displacement", costs.rms_displacement, " mm", None),
            ("RMS turn", costs.rms_turn, "°", None),
        )
    ]
    words = f"Worst: for all signs of the errors. RMS: root mean square of {RMS_ERRORS}.{where}"
    return block.Facts("Errors of the tool", facts, words)


def _costs(costs: SourceCosts, *, per_unit: bool) -> block.Table:
    """Return the table of sources, with displacements by unit errors or by the tolerances."""
    moved = costs.displacement / costs.lengths if per_unit else costs.displacement_within
    ranking: list[int] = costs.ranking.tolist()
    return block.Table(
        "By source",
        (
            block.Names("error of", [SOURCES[k] for k in ranking]),
            block.Names("part", [PARTS[k] for k in ranking]),
            block.Column("displacement", costs.displacement[ranking].tolist(),
                         _units(ranking, " mm/°", " mm/mm"), wide=True),
            block.Column("turn", costs.turn[ranking].tolist(),
                         _units(ranking, "°/°", "°/mm"), wide=True),
            block.Column("tolerance", costs.tolerances[ranking].tolist(), _units(ranking), DIGITS,
                         before="± ", infinite="any"),
            _bars(moved, ranking),
            block.Column("displacement", moved[ranking].tolist(), " mm", 2),
            block.Column("turn", costs.turn_within[ranking].tolist(), "°", wide=True),
            block.Column("share", (100.0 * costs.shares[ranking]).tolist(), " %", wide=True),
        ),
        "Errors of the six actuators and the 25 dimensions. A tilt counts as what it moves its "
        "part's end by.",
    )  # fmt: skip
