"""The outcome of `explorer optimise` as JSON, and as tables of the start and the optimum."""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import msgspec

from explorer.cli.output import figure, table
from explorer.mechanism.design import VARIABLES, Design
from explorer.mechanism.design_file import encode_design

if TYPE_CHECKING:
    from explorer.optimise.facts import Facts
    from explorer.optimise.findings import Finding
    from explorer.optimise.outcome import Outcome
    from explorer.optimise.problem import Problem


def optimised_design(outcome: Outcome) -> Design:
    """Return the design of an outcome, renamed."""
    name = f"{outcome.problem.start.name[:80]}, optimised"
    return msgspec.structs.replace(outcome.design, name=name)


def outcome_json(outcome: Outcome, written: Sequence[Path]) -> dict[str, object]:
    """Return an outcome as plain values."""
    from explorer.optimise.facts import reach_of

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
    from explorer.optimise.facts import reach_of

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
    from explorer.optimise.facts import facts_of

    problem, best = outcome.problem, outcome.best
    margin = None if problem.demands.clearance is None else problem.demands.clearance_margin
    box = problem.demands.required_box
    if box is not None:
        box = problem.required_box_at(best.values)
    facts = (
        facts_of(problem.start, demanded_margin=margin, box=box),
        facts_of(outcome.design, demanded_margin=margin, box=box),
    )
    rows = [("", "start", "optimum" if outcome.converged else "best so far", "change")]
    for name, (before, after) in fact_rows(facts):
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


def fact_rows(
    facts: tuple[Facts, Facts],
) -> list[tuple[str, tuple[float | None, float | None]]]:
    """Return the rows of a table of two designs: a name and its two values."""
    named: list[tuple[str, Callable[[Facts], float | None]]] = [
        ("yaw (degrees)", lambda each: each.yaw),
        ("reach", lambda each: each.reach),
        ("exact volume", lambda each: each.volume),
        ("node volume", lambda each: each.nodes and each.nodes.volume),
        ("clearance", lambda each: each.clearance),
        ("margin over the box", lambda each: each.box_margin),
    ]
    before, after = facts
    if after.demanded_margin is not None:
        words = f"clearance, margins ≥ {after.demanded_margin:.4g}"
        named.append((words, lambda each: each.demanded_clearance))
    own = zip(VARIABLES, before.design.variables, after.design.variables, strict=True)
    return [
        *((name, (first, second)) for name, first, second in own),
        *((name, (of(before), of(after))) for name, of in named if of(after) is not None),
    ]


def finding_json(finding: Finding) -> dict[str, object]:
    """Return a finding as plain values; null is not available."""
    facts = finding.facts
    return {
        "name": finding.name,
        "design": _design_json(facts.design),
        "iterations": finding.iterations,
        "objective": finding.objective,
        "seconds": finding.seconds,
        "volume": facts.volume,
        "node_step": facts.nodes and facts.nodes.step,
        "node_count": facts.nodes and facts.nodes.count,
        "node_volume": facts.nodes and facts.nodes.volume,
        "reach": facts.reach,
        "box_margin": facts.box_margin,
        "clearance": facts.clearance,
        "nearest_legs": facts.nearest,
        "demanded_margin": facts.demanded_margin,
        "demanded_clearance": facts.demanded_clearance,
    }


def findings_table(found: Sequence[Finding]) -> str:
    """Return the table of findings with notes."""
    from explorer.optimise.findings import BOX, CLEARANCE, PAPER_VOLUME, STARTS, STEP

    demanded = found[0].facts.demanded_margin or 0.0
    rows = [
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
        facts = each.facts
        margin, clearance = facts.box_margin, facts.demanded_clearance
        rows.append(
            (
                each.name,
                "–" if each.iterations is None else str(each.iterations),
                "–" if each.objective is None else f"{each.objective:.1e}",
                f"{facts.volume:.3f}",
                "–" if facts.nodes is None else str(facts.nodes.count),
                f"{facts.reach:.4f}",
                "–" if margin is None else f"{margin / facts.reach:.4f}",
                "–" if clearance is None else f"{clearance:.4f}",
                "–" if each.seconds is None else f"{each.seconds:.2f}",
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


def _design_json(design: Design) -> Any:
    return json.loads(encode_design(design))


def _point_text(p: tuple[float, float, float]) -> str:
    return f"({', '.join(f'{value:g}' for value in p)})"
