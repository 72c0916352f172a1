"""The progress, the verdict and the comparison of an optimisation as HTML."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from html import escape

from explorer.app.state.optimisation import SearchResult
from explorer.app.state.state import Run, State
from explorer.app.widgets.markup import (
    Look,
    alert,
    box,
    decimals_for,
    dim,
    format_number,
    meter,
    row,
    sentence,
    signed,
    status,
    table,
)
from explorer.measures.catalogue import CATALOGUE
from explorer.measures.clearance import CERTAIN
from explorer.measures.measurements import Measurements
from explorer.mechanism.design import VARIABLES
from explorer.numerics.number_text import set_true_minus
from explorer.optimise.curves import CALLED
from explorer.optimise.problem import YAW, ObjectiveName, Problem
from explorer.optimise.refutation.refutation import BOX_LIMIT, Refutation

TITLES = {
    "converged": "Converged",
    "not converged": "Not converged",
    "infeasible": "No design keeps all demands",
    "stalled": "Stalled",
    "cancelled": "Cancelled: the best so far",
}
# Significant digits of the larger of two compared numbers.
DIGITS = 6
# The measure that each objective improves.
GOALS: dict[ObjectiveName, str] = {
    "match-volume": "volume",
    "largest-volume": "volume",
    "smallest-reach": "reach",
    "largest-margin": "box_margin",
}


def refused_words(refusals: Sequence[Refutation]) -> str:
    """Return the demands that the limits rule out, as HTML."""
    title = "No design can keep these demands"
    body = " ".join(sentence(refusal.message) for refusal in refusals)
    if any(refusal.limit != BOX_LIMIT for refusal in refusals):
        body += " Lower the demands, or change the limits in the tab Design."
    return alert(title, body)


def progress_line(run: Run) -> str:
    """Return the progress of a run, as HTML."""
    if run.phase == "cancelling":
        return _running("Cancelling …", "", 0.0)
    if not run.iterates:
        return _running("Starting …", "the first start compiles kernels", 0.0)
    last = run.iterates[-1]
    step = sum(iterate.run == last.run for iterate in run.iterates) - 1
    start = f"start {last.run + 1} of {run.starts}, " if run.starts > 1 else ""
    broken = f", broken: {last.worst}" if last.spare < 0.0 else ""
    name = CALLED[run.problem.objective]
    return _running(
        f"{start}{last.phase} {step}".capitalize(),
        f"{name} {format_number(last.objective, 5)}{broken}",
        last.run / run.starts,
    )


def verdict_words(state: State, run: Run, verdict: SearchResult) -> str:
    """Return the verdict on a run, as HTML."""
    if verdict.status == "failed":
        return alert("No result", f"{sentence(verdict.message)} Your design is as it was.")
    title = "Cancelled" if verdict.best is None else TITLES[verdict.status]
    message = sentence(verdict.message.removeprefix(f"{verdict.status}: "))
    remarks: list[str] = []
    if verdict.starts > 1:
        remarks.append(f"{verdict.starts} starts, {verdict.converged} converged")
    if verdict.seconds is not None:
        remarks.append(f"{verdict.seconds:.2g} s")
    if run.accepted:
        remarks.append("accepted")
    if verdict.best is not None and state.design.variables != verdict.best.design.variables:
        remarks.append("changed by hand since")
    return box(
        status(title, "within" if verdict.status == "converged" else "beyond"),
        f"<div>{escape(message)}</div>",
        f'<div class="ex-dim ex-small">{" · ".join(remarks)}</div>',
    )


@dataclass(frozen=True)
class Row:
    """A measure or a variable of two designs.

    Attributes:
        name: Name, with the unit after a comma.
        hint: Meaning.
        before, after: Values; None where there is none.
        is_whole: Whether it is a count.
        look: Whether the change keeps or breaks the demands, where that is defined.
        is_goal: Whether it is the objective.
    """

    name: str
    hint: str
    before: float | None
    after: float | None
    is_whole: bool = False
    look: Look | None = None
    is_goal: bool = False


def comparison_table(run: Run) -> str:
    """Return the user's own design and the best one side by side, as HTML."""
    if run.comparison is None:
        return box(dim("Comparing …"))
    before, after = run.comparison.before, run.comparison.after
    measures = map(_row, measure_rows(run.problem, before, after))
    both = zip(VARIABLES, before.design.variables, after.design.variables, strict=True)
    variables = (
        _row(Row(name, "Design variable, in design units", old, new), is_first=index == 0)
        for index, (name, old, new) in enumerate(both)
    )
    return box(table((*measures, *variables), ("", "old", "new", "change")))


def measure_rows(problem: Problem, before: Measurements, after: Measurements) -> Iterator[Row]:
    """Yield the rows of the measures of two designs.

    Args:
        problem: The problem that the second design is to solve.
        before: The measures of the user's own design.
        after: The same measures of the other one.
    """
    goal = GOALS[problem.objective]
    for name in after.values:
        if name == "yaw" and YAW not in problem.names:
            continue
        if name == "demanded_clearance" and problem.demands.clearance is None:
            continue
        measure = CATALOGUE[name]
        label, hint = measure.label, measure.hint
        if name == "demanded_clearance":
            label += f", |δ| ≥ {after.demanded_margin:.3g}"
            hint += _pair(after.demanded_nearest)
        elif unit := measure.unit_in("units"):
            label += f", {unit}"
        if name == "least_clearance":
            hint += _pair(after.nearest)
        yield Row(
            label,
            hint,
            before[name],
            after[name],
            measure.is_whole,
            _look(problem, name, before, after),
            is_goal=name == goal,
        )


def _look(problem: Problem, name: str, before: Measurements, after: Measurements) -> Look | None:
    """Return whether a change is good or bad for the problem; None if neither."""
    old, new = before[name] or 0.0, after[name] or 0.0
    # Clearances are exact to this length.
    accuracy = CERTAIN * (after["reach"] or 0.0)
    if name == "least_clearance":
        return "beyond" if after[name] is not None and new <= accuracy else None
    if name == "demanded_clearance":
        demand = problem.demands.clearance or 0.0
        return "beyond" if after[name] is not None and new < demand - accuracy else "within"
    if name != GOALS[problem.objective]:
        return None
    if problem.objective == "match-volume":
        target = problem.demands.volume or 0.0
        is_better = abs(new - target) < abs(old - target)
    else:
        is_better = new > old if CATALOGUE[name].sense == "more" else new < old
    return "within" if is_better else None


def _row(line: Row, *, is_first: bool = False) -> str:
    """Return a row of the table; the first of a group has a line above."""
    largest = max(
        (abs(value) for value in (line.before, line.after) if value is not None), default=0.0
    )
    digits = 0 if line.is_whole else decimals_of(largest)
    change = ""
    if line.before is not None and line.after is not None:
        change = _change(line.after - line.before, digits)
    if line.look is not None:
        change = f'<span class="ex-{line.look}">{change}</span>'
    name, _, unit = line.name.partition(", ")
    return row(
        f"{name} {dim(unit)}" if unit else name,
        _number(line.before, digits),
        _number(line.after, digits),
        change,
        look=" ".join(["ex-strong"] * line.is_goal + ["ex-first"] * is_first),
        hint=line.hint,
    )


def decimals_of(size: float) -> int:
    """Return the decimals with which a number of a size has `DIGITS` digits, 4 at most."""
    return min(4, decimals_for(size, DIGITS)) if size > 0.0 else 1


def _number(value: float | None, digits: int) -> str:
    return "none" if value is None else signed(value, digits)


def _change(value: float, digits: int) -> str:
    text = f"{value:+.{digits}f}"
    return "0" if float(text) == 0.0 else set_true_minus(text)


def _running(title: str, text: str, share: float) -> str:
    return box(
        f'<div class="ex-strong">{escape(title)}</div>',
        f'<div class="ex-dim ex-cut">{escape(text) or "&nbsp;"}</div>',
        meter(100.0 * share),
    )


def _pair(legs: tuple[int, int] | None) -> str:
    return "" if legs is None else f"; in the new design that of legs {legs[0]} and {legs[1]}"
