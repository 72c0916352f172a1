"""The outcome of `explorer optimise` as JSON, and as tables of the start and the optimum."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import msgspec

from explorer.cli.output import attributes, figure, table
from explorer.measures.case import Case
from explorer.measures.catalogue import CATALOGUE, measures_in
from explorer.measures.measurements import Measurements, measure_design
from explorer.measures.size import longest_leg
from explorer.mechanism.design import VARIABLES, Design

if TYPE_CHECKING:
    from explorer.optimise.outcome import Outcome
    from explorer.optimise.problem import Problem


def optimised_design(outcome: Outcome) -> Design:
    """Return the design of an outcome, renamed."""
    name = f"{outcome.problem.start.name[:80]}, optimised"
    return msgspec.structs.replace(outcome.design, name=name)


def outcome_json(outcome: Outcome, written: Sequence[Path]) -> dict[str, object]:
    """Return an outcome as plain values."""
    best, run, problem = outcome.best, outcome.run, outcome.problem
    return {
        "design": optimised_design(outcome),
        "objective": best.objective,
        "objective_name": problem.objective,
        "volume": best.volume,
        "reach": outcome.design.reach,
        "longest_leg": longest_leg(outcome.design),
        **attributes(run, "iterations evaluations"),
        **attributes(outcome, "seconds converged"),
        **attributes(run, "status holding message"),
        "values": dict(zip(problem.names, best.values, strict=True)),
        "runs": [
            {
                "status": start.status,
                "objective": start.best.objective,
                **attributes(start, "iterations attempts"),
            }
            for start in outcome.runs
        ],
        "files": written,
    }


def infeasible_json(problem: Problem, limit: str, message: str) -> dict[str, object]:
    """Return the answer to an infeasible problem as plain values; null is not measured.

    Args:
        problem: Infeasible problem.
        limit: Limit that contradicts the demands.
        message: Reason, in one line.
    """
    return {
        "design": problem.start,
        "objective": None,
        "objective_name": problem.objective,
        "volume": None,
        "reach": problem.start.reach,
        "longest_leg": longest_leg(problem.start),
        "iterations": 0,
        "evaluations": 0,
        "seconds": 0.0,
        "converged": False,
        "status": "infeasible",
        "holding": limit,
        "message": message,
        "values": dict(zip(problem.names, problem.start_values, strict=True)),
        "runs": [],
        "files": [],
    }


def outcome_lines(outcome: Outcome, written: Sequence[Path]) -> Iterator[str]:
    """Yield an outcome as lines of text, with the start and the best design side by side."""
    problem = outcome.problem
    margin = None if problem.demands.clearance is None else problem.demands.clearance_margin
    box = problem.demands.required_box
    shifted = None if box is None else problem.required_box_at(outcome.best.values)
    before, after = (
        measure_design(Case(design, demanded_margin=margin, box=where), measures_in("optimise"))
        for design, where in ((problem.start, box), (outcome.design, shifted))
    )
    optimum = "optimum" if outcome.converged else "best so far"
    rows: list[tuple[str, ...]] = [("", "start", optimum, "change")]
    for name, values in measure_rows(before, after):
        finite = [value for value in values if value is not None and math.isfinite(value)]
        change = f"{finite[1] - finite[0]:+.6g}" if len(finite) == len(values) else ""
        rows.append((name, *map(_cell, values), change))
    if outcome.converged:
        yield from (outcome.run.message, "")
    yield table(rows, "<>>>")
    yield (
        f"\n{len(outcome.runs)} start{'s' if len(outcome.runs) > 1 else ''}, "
        f"{outcome.run.iterations} iterations and {outcome.run.evaluations} evaluations of the "
        f"best, {outcome.seconds:.2f} s in all"
    )
    yield from map(str, written)


def measure_rows(
    before: Measurements, after: Measurements
) -> Iterator[tuple[str, tuple[float | None, float | None]]]:
    """Yield the label and the two values of each measure that the second design has.

    A value may be infinite.

    Args:
        before: The measures of one design.
        after: The same measures of another.
    """
    yield from zip(
        VARIABLES, zip(before.design.variables, after.design.variables, strict=True), strict=True
    )
    for name in after.values:
        new = after.value(name)
        if new is None:
            continue
        measure = CATALOGUE[name]
        label = f"{measure.label} (degrees)" if measure.unit == "°" else measure.label
        if "demanded_margin" in measure.needs:
            label += f", margins ≥ {after.demanded_margin:.4g}"
        yield label, (before.value(name), new)


def _cell(value: float | None) -> str:
    if value is None:
        return "none"
    return figure(value) if math.isfinite(value) else "infinite"
