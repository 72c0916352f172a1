"""How `explorer optimise` tells what was found: as JSON, and as tables beside the start."""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import msgspec

from explorer.cli.output import figure, table
from explorer.design import VARIABLES, Design
from explorer.design_file import encode_design

if TYPE_CHECKING:
    from explorer.optimise.facts import Facts
    from explorer.optimise.findings import Finding
    from explorer.optimise.outcome import Outcome


def found_design(outcome: Outcome) -> Design:
    """Return the design of an outcome under a name of its own."""
    name = f"{outcome.problem.start.name[:80]}, optimised"
    return msgspec.structs.replace(outcome.design, name=name)


def outcome_json(outcome: Outcome, written: Sequence[Path]) -> dict[str, object]:
    """Return an outcome as plain values."""
    best, run = outcome.best, outcome.run
    return {
        "design": _design_json(found_design(outcome)),
        "objective": best.objective,
        "objective_name": outcome.problem.objective,
        "volume": best.volume,
        "reach": outcome.design.reach,
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


def outcome_lines(outcome: Outcome, written: Sequence[Path]) -> list[str]:
    """Return an outcome as lines of text: the start and what was found, side by side."""
    from explorer.optimise.facts import facts_of

    problem, best = outcome.problem, outcome.best
    margin = problem.demands.clearance_margin or None
    box = problem.demands.required_box
    if box is not None:
        box = problem.required_box_at(best.values)
    facts = (
        facts_of(problem.start, clearance_margin=margin, box=box),
        facts_of(outcome.design, clearance_margin=margin, box=box),
    )
    rows = [("", "start", "best so far" if not outcome.converged else "found", "change")]
    for name, (before, after) in _rows(facts):
        change = "" if before is None or after is None else f"{after - before:+.6g}"
        cells = ["none" if each is None else figure(each) for each in (before, after)]
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


def _rows(
    facts: tuple[Facts, Facts],
) -> list[tuple[str, tuple[float | None, float | None]]]:
    """Return what is told of two designs, by name."""
    named: list[tuple[str, Callable[[Facts], float | None]]] = [
        ("yaw (degrees)", lambda each: each.yaw),
        ("reach", lambda each: each.reach),
        ("exact volume", lambda each: each.volume),
        ("node volume", lambda each: each.node_volume),
        ("least clearance", lambda each: each.clearance),
        ("worst margin", lambda each: each.worst_margin),
    ]
    before, after = facts
    own = zip(VARIABLES, before.design.variables, after.design.variables, strict=True)
    return [
        *((name, (first, second)) for name, first, second in own),
        *((name, (of(before), of(after))) for name, of in named if of(after) is not None),
    ]


def finding_json(finding: Finding) -> dict[str, object]:
    """Return a finding as plain values; null is what there is not."""
    facts = finding.facts
    return {
        "name": finding.name,
        "design": _design_json(facts.design),
        "iterations": finding.iterations,
        "objective": finding.objective,
        "seconds": finding.seconds,
        "volume": facts.volume,
        "node_count": facts.node_count,
        "node_volume": facts.node_volume,
        "reach": facts.reach,
        "worst_margin": facts.worst_margin,
        "clearance": facts.clearance,
        "nearest_legs": facts.nearest,
    }


def findings_table(found: Sequence[Finding]) -> str:
    """Return the page of findings."""
    from explorer.optimise.findings import BOX, CLEARANCE, PAPER_VOLUME, STARTS, STEP

    rows = [
        (
            "",
            "iterations",
            "F",
            "exact volume",
            "nodes",
            "reach",
            "margin / reach",
            "clearance",
            "seconds",
        )
    ]
    for each in found:
        facts = each.facts
        margin = facts.worst_margin
        rows.append(
            (
                each.name,
                "–" if each.iterations is None else str(each.iterations),
                "–" if each.objective is None else f"{each.objective:.1e}",
                f"{facts.volume:.3f}",
                str(facts.node_count),
                f"{facts.reach:.4f}",
                "–" if margin is None else f"{margin / facts.reach:.4f}",
                "–" if facts.clearance is None else f"{facts.clearance:.4f}",
                "–" if each.seconds is None else f"{each.seconds:.2f}",
            )
        )
    lows, highs = BOX
    notes = (
        f"F = |1 − V / {PAPER_VOLUME:g}|: the paper counts nodes (step {STEP:g}), here V is the "
        "exact volume.\n"
        f"Interference on: every pair of legs keeps {CLEARANCE:g} wherever every margin is at "
        f"least {found[0].facts.clearance_margin:.4g}; clearance: the least there.\n"
        f"Margin: the worst over the box {_shown(lows)} to {_shown(highs)}. It depends on the "
        "pose alone, so that of a smaller reach is larger for its size.\n"
        f"The smallest reach: the best of {STARTS} starts, with |b1y|, a3y and |b3 − b2| at "
        "least 1 and b within ±10."
    )
    return f"{table(rows, '<>>>>>>>>')}\n\n{notes}"


def _design_json(design: Design) -> Any:
    return json.loads(encode_design(design))


def _shown(p: tuple[float, float, float]) -> str:
    return f"({', '.join(f'{value:g}' for value in p)})"
