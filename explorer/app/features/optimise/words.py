"""The search as HTML: what prevents it, its progress, its verdict, and the limits in force."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from html import escape

from explorer.app.features.optimise.actions import LiftLimit
from explorer.app.features.optimise.buttons import (
    ACCEPT,
    CANCEL,
    DESIGN,
    HULL,
    LIFT,
    PAPER,
    PAPER_BOX,
    RECORD,
    REVERT,
    START,
    button,
)
from explorer.app.features.optimise.work import (
    box_on_offer,
    find_refusals,
    liftable_limits,
)
from explorer.app.state.optimisation import SearchResult
from explorer.app.state.state import Run, State
from explorer.app.widgets.markup import (
    alert,
    box,
    caption,
    dim,
    meter,
    row,
    sentence,
    status,
    table,
)
from explorer.measures.blocks.block import Look
from explorer.measures.catalogue import CATALOGUE
from explorer.measures.measurements import Measurements
from explorer.measures.size import CERTAIN
from explorer.mechanism.design import VARIABLES, Design
from explorer.numerics.number_text import decimals_for, format_decimals, format_number
from explorer.optimise.conflicts import Conflict
from explorer.optimise.outcome import Iterate
from explorer.optimise.problem import (
    MAXIMA,
    NO_ERRORS,
    NO_LOAD,
    RIGID,
    SWING_LIMIT,
    YAW,
    Problem,
)
from explorer.optimise.record import GOALS, OBJECTIVE_SYMBOLS
from explorer.workspace.limits.limit import DIGITS as LIMIT_DIGITS
from explorer.workspace.limits.table import limits_in_force

TITLES = {
    "converged": "Converged",
    "not converged": "Not converged",
    "infeasible": "No design keeps all demands",
    "stalled": "Stalled",
    "cancelled": "Cancelled: the best so far",
}
# Missing inputs of a design, by the limits of refusals, and where to enter them.
LACKING = {
    NO_LOAD: "payload and limits in the tab Machine",
    NO_ERRORS: "the errors of the actuators in the tab Machine",
    RIGID: "the stiffness of the actuators or the tubes of the struts in the tab Machine",
}
# Limits of refusals without a problem that could be searched.
NO_PROBLEM = ("", SWING_LIMIT, MAXIMA, *LACKING)
# Significant digits of the larger of two compared numbers.
COMPARED_DIGITS = 6


@dataclass(frozen=True)
class Notice:
    """A search that is under way, or whose result waits for an answer, in words.

    Attributes:
        title: State of the search, such as "Solving 5" or "Converged".
        text: Its value, with its unit.
        share: Share of the starts that have ended; None for one start, or at the end.
        buttons: Names of the buttons that answer it, the main one first.
    """

    title: str
    text: str
    share: float | None
    buttons: tuple[str, ...]


def search_notice(state: State) -> Notice | None:
    """Return the search that is under way or waits for an answer; None if there is none."""
    run = state.optimisation.run
    if run is None:
        return None
    if not state.optimisation.is_on:
        if run.verdict is None or run.best is None or run.accepted:
            return None
        value = _reached_text(run.problem, run.best)
        return Notice(TITLES[run.verdict.status], value, None, (ACCEPT, REVERT))
    if run.phase == "cancelling":
        return Notice("Cancelling …", "", None, (CANCEL,))
    if not run.iterates:
        return Notice("Starting …", "the first start compiles kernels", None, (CANCEL,))
    last = run.iterates[-1]
    step = sum(iterate.run == last.run for iterate in run.iterates) - 1
    start = f"start {last.run + 1} of {run.starts}, " if run.starts > 1 else ""
    broken = f", broken: {last.worst}" if last.spare < 0.0 else ""
    return Notice(
        f"{start}{last.phase} {step}".capitalize(),
        f"{_reached_text(run.problem, last)}{broken}",
        last.run / run.starts if run.starts > 1 else None,
        (CANCEL,),
    )


def _reached_text(problem: Problem, iterate: Iterate) -> str:
    """Return what a search has reached: the volume that it matches, or the objective."""
    if problem.objective == "match-volume":
        return f"volume {format_number(iterate.volume, 5)} units³"
    name = OBJECTIVE_SYMBOLS[problem.objective]
    if iterate.objective is None:
        return f"{name} infinite"
    unit = CATALOGUE[GOALS[problem.objective]].unit_in("units")
    return f"{name} {format_number(iterate.objective, 6)} {unit}"


def result_words(state: State) -> str:
    """Return the column of the search as HTML: what can be done, how it goes, what it found.

    At most one of its buttons is filled: what prevents a search comes first, then the answer to
    a search that succeeded, then the search itself.
    """
    run = state.optimisation.run
    if state.optimisation.is_on:
        return _running(state)
    refusals, limits = find_refusals(state), liftable_limits(state)
    remedies = _remedies(state, limits)
    is_success = run is not None and run.is_undecided and run.has_converged
    verdict = "" if run is None or run.verdict is None else verdict_words(state, run, run.verdict)
    why = " ".join(sentence(refusal.message) for refusal in refusals)
    acts = [
        button(
            START,
            state,
            words="Search again" if run is not None and run.best is not None else "",
            hint=f"No search can start: {why}" if refusals else "",
            is_main=not (remedies or refusals or is_success),
        ),
    ]
    if run is None or not run.is_undecided:
        acts.append(button(PAPER, state))
    else:
        acts = [
            button(ACCEPT, state, is_main=is_success and not remedies),
            button(REVERT, state),
            *acts,
        ]
    return box(
        verdict,
        refused_words(refusals, limits) if refusals else "",
        f'<div class="ex-flow ex-before">{remedies}</div>' if remedies else "",
        f'<div class="ex-flow ex-before">{"".join(acts)}</div>',
        _downloads(state) if run is not None and run.best is not None else "",
        comparison_table(run) if run is not None and run.best is not None else "",
        limits_table(state.design),
    )


def _remedies(state: State, limits: Sequence[str]) -> str:
    """Return the buttons that lift limits, the first one filled, as HTML; "" if none would help."""
    lifts = [
        button(LIFT, state, words=LiftLimit(limit).title, value=limit, is_main=index == 0)
        for index, limit in enumerate(limits)
    ]
    if box_on_offer(state) is not None:
        lifts.append(button(PAPER_BOX, state))
    return "".join(lifts)


def refused_words(refusals: Sequence[Conflict], limits: Sequence[str] = ()) -> str:
    """Return why no search can start, as HTML; buttons below offer to lift some limits."""
    body = " ".join(sentence(refusal.message) for refusal in refusals)
    if any(refusal.limit not in limits for refusal in refusals):
        lacking = next((refusal.limit for refusal in refusals if refusal.limit in LACKING), "")
        body += f" Change the demands, or {LACKING.get(lacking, 'the limits in the tab Design')}."
    is_problem = not any(refusal.limit in NO_PROBLEM for refusal in refusals)
    title = "No design can keep these demands" if is_problem else "This cannot be optimised"
    return alert(title, body)


def _running(state: State) -> str:
    """Return the progress of the search that is under way, as HTML."""
    notice = search_notice(state)
    if notice is None:
        return ""
    return box(
        f'<div class="ex-line"><div class="ex-strong">{escape(notice.title)}</div>'
        f"{button(CANCEL, state)}</div>",
        f'<div class="ex-dim ex-cut">{escape(notice.text) or "&nbsp;"}</div>',
        "" if notice.share is None else meter(100.0 * notice.share),
        limits_table(state.design),
    )


def _downloads(state: State) -> str:
    """Return the buttons that download the result, as HTML."""
    files = ((HULL, "Hull"), (DESIGN, "Design"), (RECORD, "Record"))
    buttons = "".join(button(name, state, words=words) for name, words in files)
    return f'<div class="ex-flow ex-before"><span class="ex-dim">Download</span>{buttons}</div>'


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
        remarks.append(f"{format_number(verdict.seconds, 2)} s")
    if run.accepted:
        remarks.append("accepted")
    if verdict.best is not None and state.design.variables != verdict.best.design.variables:
        remarks.append("changed by hand since")
    return (
        f"{status(title, 'within' if verdict.status == 'converged' else 'beyond')}"
        f'<div class="ex-before">{escape(message)} '
        f'<span class="ex-dim">{" · ".join(remarks)}</span></div>'
    )


@dataclass(frozen=True)
class Row:
    """A measure or a variable of two designs, as the table shows it.

    Attributes:
        name: Name, with the unit after a comma.
        before, after: Values; None where there is none, and infinite ones.
        names: Names of the whole numbers from 1, as in `Measure`.
        look: Whether the change keeps or breaks the demands, where that is defined.
    """

    name: str
    hint: str
    before: float | None
    after: float | None
    is_whole: bool = False
    names: tuple[str, ...] = ()
    look: Look | None = None
    is_goal: bool = False


def comparison_table(run: Run) -> str:
    """Return the user's own design and the best one side by side, as HTML."""
    if run.comparison is None:
        return dim("Comparing …")
    before, after = run.comparison.before, run.comparison.after
    measures = map(_row, measure_rows(run.problem, before, after))
    both = zip(VARIABLES, before.design.variables, after.design.variables, strict=True)
    variables = (
        _row(Row(name, "Design variable, in design units", old, new), is_first=index == 0)
        for index, (name, old, new) in enumerate(both)
    )
    return table((*measures, *variables), ("", "old", "new", "change"))


def measure_rows(problem: Problem, before: Measurements, after: Measurements) -> Iterator[Row]:
    """Yield the rows of the measures of the user's own design and one that solves a problem."""
    goal = GOALS[problem.objective]
    for name in after.values:
        if name == "yaw" and YAW not in problem.names:
            continue
        if name == "demanded_clearance" and problem.demands.clearance is None:
            continue
        measure = CATALOGUE[name]
        label, hint = measure.label, measure.hint
        if name == "demanded_clearance":
            label += f", |δ| ≥ {format_number(after.demanded_margin or 0.0, 3)}"
            hint += _pair(after.demanded_nearest)
        elif unit := measure.unit_in("units"):
            label += f", {unit}"
        if name == "least_clearance":
            hint += _pair(after.nearest)
        yield Row(
            label,
            hint,
            before.value(name),
            after.value(name),
            measure.is_whole,
            measure.names,
            _look(problem, name, before, after),
            is_goal=name == goal,
        )


def _look(problem: Problem, name: str, before: Measurements, after: Measurements) -> Look | None:
    """Return whether a change is good or bad for the problem; None if neither."""
    old, new = before.value(name) or 0.0, after.value(name) or 0.0
    # Clearances are exact to this length.
    accuracy = CERTAIN * after.design.reach
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
    both = (line.before, line.after)
    finite = [value for value in both if value is not None and math.isfinite(value)]
    digits = 0 if line.is_whole else decimals_of(max(map(abs, finite), default=0.0))
    change = ""
    if len(finite) == 2 and not line.names:
        change = format_decimals(finite[1] - finite[0], digits, signed=True)
        change = change if change.strip("0.") else "0"
    if line.look is not None:
        change = f'<span class="ex-{line.look}">{change}</span>'
    name, _, unit = line.name.partition(", ")
    return row(
        f"{name} {dim(unit)}" if unit else name,
        _value(line, line.before, digits),
        _value(line, line.after, digits),
        change,
        look=" ".join(["ex-strong"] * line.is_goal + ["ex-first"] * is_first),
        hint=line.hint,
    )


def decimals_of(size: float) -> int:
    """Return the decimals with which a number of a size has `COMPARED_DIGITS` digits, 4 at most."""
    return min(4, decimals_for(size, COMPARED_DIGITS)) if size > 0.0 else 1


def _value(line: Row, value: float | None, digits: int) -> str:
    if value is None:
        return "none"
    if math.isinf(value):
        return "infinite"
    return line.names[round(value) - 1] if line.names else format_decimals(value, digits)


def _pair(legs: tuple[int, int] | None) -> str:
    return "" if legs is None else f"; in the new design that of legs {legs[0]} and {legs[1]}"


def limits_table(design: Design) -> str:
    """Return the limits in force as HTML, a row for those of equal words."""
    hint = "They hold throughout a search; the tab Design changes them."
    rows = "".join(row(dim(name), text) for name, text in limit_rows(design))
    return (
        f'<div class="ex-after" title="{hint}">{caption("Limits in force, in design units")}'
        f'<table class="ex-limits">{rows}</table></div>'
    )


def limit_rows(design: Design) -> Iterator[tuple[str, str]]:
    """Yield the symbols and the words of the limits that are in force."""
    for symbols, demand in limits_in_force(design):
        yield symbols, demand.words()
    radii = design.limits.leg_radii
    if any(radii):
        ends = sorted({min(radii), max(radii)})
        yield "leg radii", " to ".join(format_number(end, LIMIT_DIGITS) for end in ends)
