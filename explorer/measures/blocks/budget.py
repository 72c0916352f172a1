"""The budget of tolerances: what each costs in precision, and what those found keep."""

from __future__ import annotations

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
    Statement,
    Table,
)
from explorer.mechanism.design import JOINTS
from explorer.statics.accuracy import IS_TILT, RMS_ERRORS, SOURCES
from explorer.statics.budget.allocation import ToleranceBudget
from explorer.statics.budget.costs import PARTS, SourceCosts

DIGITS = 3


def tolerance_budget(
    costs: SourceCosts,
    found: ToleranceBudget | None,
    wanted: float | None = None,
    wanted_turn: float | None = None,
) -> Iterator[Block]:
    """Yield the errors that tolerances allow, and what each of them costs, the costliest first.

    Args:
        costs: Costs of the tolerances.
        found: The tolerances, if they were found for a wanted precision.
        wanted: Largest displacement of the tool that was wanted, in mm; None for any.
        wanted_turn: Largest turn of the tool that was wanted, in degrees; None for any.
    """
    has_tolerances = bool(costs.tolerances[np.isfinite(costs.tolerances)].any())
    if has_tolerances:
        yield _errors(costs, wanted, wanted_turn)
    else:
        yield Statement(
            "",
            "The design states no tolerances; the displacements are those by an error of 1 mm, and "
            "by a tilt that moves the guide's end by 1 mm.",
        )
    if found is not None:
        above = Number(100.0 * found.excess, " %", 2)
        effort = Number(found.effort, " /mm", 4)
        words = ("The sum of 1/tolerance is ", effort, ", at most ", above, " above the least.")
        yield Statement("", words, act="set")
    yield _costs(costs, per_unit=not has_tolerances)


def _errors(costs: SourceCosts, wanted: float | None, wanted_turn: float | None) -> Facts:
    def limit(value: float | None, unit: str) -> str:
        return "" if value is None else f"of the wanted {value:g}{unit}"

    where = "" if costs.count == 1 else f" At the worst of {costs.count:,} positions."
    return Facts(
        "Errors of the tool",
        (
            Fact(
                "worst displacement",
                (Number(costs.worst_displacement, " mm", DIGITS),),
                limit(wanted, " mm"),
            ),
            Fact("worst turn", (Number(costs.worst_turn, "°", DIGITS),), limit(wanted_turn, "°")),
            Fact("RMS displacement", (Number(costs.rms_displacement, " mm", DIGITS),)),
            Fact("RMS turn", (Number(costs.rms_turn, "°", DIGITS),)),
        ),
        f"Worst: for all signs of the errors. RMS: root mean square of {RMS_ERRORS}.{where}",
    )


def _costs(costs: SourceCosts, *, per_unit: bool) -> Table:
    """Return the table of the sources of errors.

    Args:
        costs: Costs of the tolerances.
        per_unit: Whether displacements are those by unit errors, in place of the tolerances.
    """
    moved = costs.displacement / costs.lengths if per_unit else costs.displacement_within
    ranking: list[int] = costs.ranking.tolist()
    most = float(moved.max()) or 1.0
    tilts = [IS_TILT[k] for k in ranking]
    return Table(
        "By source",
        (
            Names("error of", [SOURCES[k] for k in ranking]),
            Names("part", [PARTS[k] for k in ranking]),
            Column("displacement", costs.displacement[ranking].tolist(),
                   [" mm/°" if tilt else " mm/mm" for tilt in tilts], wide=True),
            Column("turn", costs.turn[ranking].tolist(),
                   ["°/°" if tilt else "°/mm" for tilt in tilts], wide=True),
            Column("tolerance", costs.tolerances[ranking].tolist(),
                   ["°" if tilt else " mm" for tilt in tilts], DIGITS, before="± ",
                   infinite="any"),
            Bars((moved[ranking] / most).tolist(),
                 ["actuator" if k < len(JOINTS) else "dimension" for k in ranking]),
            Column("displacement", moved[ranking].tolist(), " mm", 2),
            Column("turn", costs.turn_within[ranking].tolist(), "°", wide=True),
            Column("share", (100.0 * costs.shares[ranking]).tolist(), " %", wide=True),
        ),
        "Errors of the six actuators and the 23 dimensions. A tilt counts as what it moves the "
        "guide's end by.",
    )  # fmt: skip
