"""The outcome of `explorer optimise` as JSON, and as tables of the start and the optimum."""

from __future__ import annotations

import json
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import msgspec

from explorer.cli.output import figure, table
from explorer.mechanism.design import VARIABLES, Design
from explorer.mechanism.design_file import encode_design

if TYPE_CHECKING:
    from explorer.measures.measurements import Measurements
    from explorer.optimise.findings import Finding
    from explorer.optimise.outcome import Outcome
    from explorer.optimise.problem import Problem


def optimised_design(outcome: Outcome) -> Design:
    """Return the design of an outcome, renamed."""
    name = f"{outcome.problem.start.name[:80]}, optimised"
    return msgspec.structs.replace(outcome.design, name=name)


def outcome_json(outcome: Outcome, written: Sequence[Path]) -> dict[str, object]:
    """Return an outcome as plain values."""
    from explorer.measures.size import reach_of

    best, run = outcome.best, outcome.run
    return {
        "design": _design_json(optimised_design(outcome)),
        "objective": best.objective,
        "objective_name": outcome.problem.objective,
        "volume": best.volume,
        "reach": reach_of(outcome.design),
        "iterations": run.iterations,
        "evaluations": run.evaluations,
        "seconds": outcome.seconds,
        "converged": outcome.converged,
        "status": run.status,
        "holding": run.holding,
        "message": run.message,
        "values": dict(zip(outcome.problem.names, best.values, strict=True)),
        "runs": [
            {
                "status": each.status,
                "objective": each.best.objective,
                "iterations": each.iterations,
                "attempts": each.attempts,
            }
            for each in outcome.runs
        ],
        "files": [str(path) for path in written],
    }


def infeasible_json(problem: Problem, limit: str, message: str) -> dict[str, object]:
    """Return the answer to an infeasible problem as plain values; null is not measured.

    Args:
        problem: Infeasible problem.
        limit: Limit that contradicts the demands.
        message: Reason, in one line.
    """
    from explorer.measures.size import reach_of

    return {
        "design": _design_json(problem.start),
        "objective": None,
        "objective_name": problem.objective,
        "volume": None,
        "reach": reach_of(problem.start),
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


def outcome_lines(outcome: Outcome, written: Sequence[Path]) -> list[str]:
    """Return an outcome as lines of text, with the start and the best design side by side."""
    from explorer.measures.case import Case
    from explorer.measures.catalogue import measures_in
    from explorer.measures.measurements import measure_design

    problem, best = outcome.problem, outcome.best
    margin = None if problem.demands.clearance is None else problem.demands.clearance_margin
    box = problem.demands.required_box
    if box is not None:
        box = problem.required_box_at(best.values)
    before, after = (
        measure_design(Case(design, demanded_margin=margin, box=box), measures_in("optimise"))
        for design in (problem.start, outcome.design)
    )
    rows = [("", "start", "optimum" if outcome.converged else "best so far", "change")]
    for name, (old, new) in measure_rows(before, after):
        change = "" if old is None or new is None else f"{new - old:+.6g}"
        cells = ["none" if each is None else figure(each) for each in (old, new)]
        rows.append((name, cells[0], cells[1], change))
    lines = [outcome.run.message, ""] if outcome.converged else []
    lines.append(table(rows, "<>>>"))
    lines.append(
        f"\n{len(outcome.runs)} start{'s' if len(outcome.runs) > 1 else ''}, "
        f"{outcome.run.iterations} iterations and {outcome.run.evaluations} evaluations of the "
        f"best, {outcome.seconds:.2f} s in all"
    )
    lines += [str(path) for path in written]
    return lines


def measure_rows(
    before: Measurements, after: Measurements
) -> Iterator[tuple[str, tuple[float | None, float | None]]]:
    """Yield the label and the two values of each measure that the second design has.

    Args:
        before: The measures of one design.
        after: The same measures of another.
    """
    from explorer.measures.catalogue import CATALOGUE

    yield from zip(
        VARIABLES, zip(before.design.variables, after.design.variables, strict=True), strict=True
    )
    for name, value in after.values.items():
        if value is None:
            continue
        measure = CATALOGUE[name]
        label = f"{measure.label} (degrees)" if measure.unit == "°" else measure.label
        if measure.needs == "demanded_margin":
            label += f", margins ≥ {after.demanded_margin:.4g}"
        yield label, (before[name], value)


def finding_json(finding: Finding) -> dict[str, object]:
    """Return a finding as plain values; null is not available."""
    measured = finding.measured
    return {
        "name": finding.name,
        "design": _design_json(measured.design),
        "iterations": finding.iterations,
        "objective": finding.objective,
        "seconds": finding.seconds,
        "volume": measured["volume"],
        "node_step": measured["node_step"],
        "node_count": measured["node_count"],
        "node_volume": measured["node_volume"],
        "reach": measured["reach"],
        "box_margin": measured["box_margin"],
        "clearance": measured["least_clearance"],
        "nearest_legs": measured.nearest,
        "demanded_margin": measured.demanded_margin,
        "demanded_clearance": measured["demanded_clearance"],
    }


def findings_table(found: Sequence[Finding]) -> str:
    """Return the table of findings with notes."""
    from explorer.optimise.findings import BOX, CLEARANCE, PAPER_VOLUME, STARTS, STEP

    demanded = found[0].measured.demanded_margin or 0.0
    rows: list[tuple[str, ...]] = [
        (
            "",
            "iterations",
            "F",
            "exact volume",
            f"nodes, step {STEP:g}",
            "reach",
            "margin / reach",
            f"clearance, margins ≥ {demanded:.4g}",
            "seconds",
        )
    ]
    for each in found:
        measured = each.measured
        reach, margin = measured["reach"], measured["box_margin"]
        cells = [
            _cell(measured["volume"], ".3f"),
            _cell(measured["node_count"], "d"),
            _cell(reach, ".4f"),
            _cell(margin and reach and margin / reach, ".4f"),
            _cell(measured["demanded_clearance"], ".4f"),
        ]
        rows.append(
            (
                each.name,
                _cell(each.iterations, "d"),
                _cell(each.objective, ".1e"),
                *cells,
                _cell(each.seconds, ".2f"),
            )
        )
    lows, highs = BOX
    notes = (
        f"F = |1 − V / {PAPER_VOLUME:g}|: the paper counts nodes (step {STEP:g}), here V is the "
        "exact volume.\n"
        f"Interference on: every pair of legs keeps {CLEARANCE:g} wherever every margin is at "
        f"least {demanded:.4g}; clearance: the least of these.\n"
        f"Margin: the worst over the box {_point_text(lows)} to {_point_text(highs)}. It depends "
        "on the pose alone, so that it is larger relative to a smaller reach.\n"
        f"The smallest reach: the best of {STARTS} starts, with |b1y|, a3y and |b3 − b2| at "
        "least 1 and b within ±10."
    )
    return f"{table(rows, '<>>>>>>>>')}\n\n{notes}"


def _cell(value: float | None, form: str) -> str:
    return "–" if value is None else format(value, form)


def _design_json(design: Design) -> Any:
    return json.loads(encode_design(design))


def _point_text(p: tuple[float, float, float]) -> str:
    return f"({', '.join(f'{value:g}' for value in p)})"
