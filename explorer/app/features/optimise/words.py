"""An optimisation in words: how far it has got, how it ended, and old beside new."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from html import escape

from explorer.app.state.optimisation import SearchResult
from explorer.app.state.state import Run, State
from explorer.app.widgets.markup import BEYOND, DIM, WITHIN, alert, decimals_for, format_number
from explorer.measures.catalogue import CATALOGUE
from explorer.measures.clearance import CERTAIN
from explorer.measures.measurements import Measurements
from explorer.mechanism.design import VARIABLES
from explorer.optimise.curves import CALLED
from explorer.optimise.problem import YAW, ObjectiveName, Problem
from explorer.optimise.refutation.refutation import BOX_LIMIT, Refutation

BOX = (
    '<div style="padding:6px 12px 4px;font-size:12.5px;line-height:1.45;'
    'font-variant-numeric:tabular-nums">'
)
TITLES = {
    "converged": ("Found", WITHIN),
    "not converged": ("Not converged", BEYOND),
    "infeasible": ("No design keeps all demands", BEYOND),
    "stalled": ("Stalled", BEYOND),
    "cancelled": ("Cancelled: the best so far", BEYOND),
}
# Significant digits of the larger of two numbers that are compared.
DIGITS = 6
# The measure that each objective improves.
GOALS: dict[ObjectiveName, str] = {
    "match-volume": "volume",
    "largest-volume": "volume",
    "smallest-reach": "reach",
    "largest-margin": "box_margin",
}


def refused_words(refusals: Sequence[Refutation]) -> str:
    """Return what the limits cannot give of what is asked for, as HTML."""
    title = "No design can keep these demands"
    body = " ".join(_sentence(each.message) for each in refusals)
    if any(each.limit != BOX_LIMIT for each in refusals):
        body += " Ask for less, or change the limits in the tab Design."
    return alert(title, body)


def progress_line(run: Run) -> str:
    """Return how far a run has got, as HTML."""
    if run.phase == "cancelling":
        return _running("Cancelling …", "", 0.0)
    if not run.iterates:
        return _running("Starting …", "the first time, kernels are compiled", 0.0)
    last = run.iterates[-1]
    inside = sum(each.run == last.run for each in run.iterates) - 1
    start = f"start {last.run + 1} of {run.starts}, " if run.starts > 1 else ""
    missed = f", missed: {last.worst}" if last.spare < 0.0 else ""
    name = CALLED[run.problem.objective]
    return _running(
        f"{start}{last.phase} {inside}".capitalize(),
        f"{name} {format_number(last.objective, 5)}{missed}",
        last.run / run.starts,
    )


def verdict_words(state: State, run: Run, verdict: SearchResult) -> str:
    """Return how a run ended, as HTML."""
    if verdict.status == "failed":
        return alert("Nothing was found", f"{_sentence(verdict.message)} Your design is as it was.")
    title, colour = TITLES[verdict.status]
    if verdict.best is None:
        title = "Cancelled"
    message = _sentence(verdict.message.removeprefix(f"{verdict.status}: "))
    facts: list[str] = []
    if verdict.starts > 1:
        facts.append(f"{verdict.starts} starts, {verdict.converged} converged")
    if verdict.seconds is not None:
        facts.append(f"{verdict.seconds:.2g} s")
    if run.accepted:
        facts.append("accepted")
    if verdict.best is not None and state.design.variables != verdict.best.design.variables:
        facts.append("changed by hand since")
    return (
        f'{BOX}<div style="font-size:15px;font-weight:600;color:{colour};margin-bottom:2px">'
        f"{title}</div><div>{escape(message)}</div>"
        f'<div style="{DIM};font-size:11.5px;margin-bottom:6px">{" · ".join(facts)}</div></div>'
    )


@dataclass(frozen=True)
class Row:
    """A measure of two designs.

    Attributes:
        name: What it is, with its unit.
        hint: What it means.
        before, after: None if there is none.
        whole: Whether it is a count.
        colour: Of the change, where that means something.
        is_goal: Whether it is what was wanted.
    """

    name: str
    hint: str
    before: float | None
    after: float | None
    whole: bool = False
    colour: str | None = None
    is_goal: bool = False


def comparison_table(run: Run) -> str:
    """Return own and found design side by side, as HTML."""
    if run.comparison is None:
        return f'{BOX}<span style="{DIM}">Comparing …</span></div>'
    before, after = run.comparison.before, run.comparison.after
    right = f'<td style="text-align:right;{DIM}">'
    head = f"<tr><td></td>{right}old</td>{right}new</td>{right}change</td></tr>"
    measures = "".join(map(_row, measure_rows(run.problem, before, after)))
    own = zip(VARIABLES, before.design.variables, after.design.variables, strict=True)
    variables = "".join(
        _row(Row(name, "Design variable, in design units", first, second), is_first=index == 0)
        for index, (name, first, second) in enumerate(own)
    )
    return (
        f'{BOX}<table style="width:100%;border-collapse:collapse">{head}{measures}{variables}'
        "</table></div>"
    )


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
            _colour(problem, name, before, after),
            is_goal=name == goal,
        )


def _colour(problem: Problem, name: str, before: Measurements, after: Measurements) -> str | None:
    """Return the colour of a change: better or worse for the problem, None if neither."""
    old, new = before[name] or 0.0, after[name] or 0.0
    # Clearances are known to this length.
    known = CERTAIN * (after["reach"] or 0.0)
    if name == "least_clearance":
        return BEYOND if after[name] is not None and new <= known else None
    if name == "demanded_clearance":
        demand = problem.demands.clearance or 0.0
        return BEYOND if after[name] is not None and new < demand - known else WITHIN
    if name != GOALS[problem.objective]:
        return None
    if problem.objective == "match-volume":
        target = problem.demands.volume or 0.0
        is_better = abs(new - target) < abs(old - target)
    else:
        is_better = new > old if CATALOGUE[name].sense == "more" else new < old
    return WITHIN if is_better else None


def _row(row: Row, *, is_first: bool = False) -> str:
    larger = max((abs(each) for each in (row.before, row.after) if each is not None), default=0.0)
    digits = 0 if row.whole else decimals_of(larger)
    cells = [_number(each, digits) for each in (row.before, row.after)]
    change = ""
    if row.before is not None and row.after is not None:
        change = _change(row.after - row.before, digits)
    colour = f"color:{row.colour};" if row.colour is not None else ""
    weight = "font-weight:600;" if row.is_goal else ""
    top = "border-top:1px solid var(--mantine-color-default-border);" if is_first else ""
    name, _, unit = row.name.partition(",")
    unit = f'<span style="{DIM};font-weight:400">{unit}</span>' if unit else ""
    right = f'<td style="text-align:right;{top}">'
    return (
        f'<tr title="{escape(row.hint)}" style="{weight}">'
        f'<td style="padding:1px 0;{top}">{name}{unit}</td>{right}{cells[0]}</td>'
        f'{right}{cells[1]}</td><td style="text-align:right;{top}{colour}">{change}</td></tr>'
    )


def decimals_of(size: float) -> int:
    """Return how many decimals give a number of this size `DIGITS` digits, 4 at the most."""
    return min(4, decimals_for(size, DIGITS)) if size > 0.0 else 1


def _number(value: float | None, digits: int) -> str:
    return "none" if value is None else f"{value:.{digits}f}".replace("-", "−")


def _change(value: float, digits: int) -> str:
    text = f"{value:+.{digits}f}"
    return "0" if float(text) == 0.0 else text.replace("-", "−")


def _running(title: str, text: str, share: float) -> str:
    return (
        f'{BOX}<div style="font-weight:600">{escape(title)}</div>'
        f'<div style="{DIM};overflow:hidden;text-overflow:ellipsis;white-space:nowrap">'
        f"{escape(text) or '&nbsp;'}</div>"
        '<div style="height:3px;border-radius:2px;margin:4px 0 2px;'
        'background:color-mix(in srgb,currentColor 12%,transparent)">'
        f'<div style="height:3px;border-radius:2px;width:{100.0 * share:.1f}%;'
        'background:var(--mantine-primary-color-filled)"></div></div></div>'
    )


def _sentence(text: str) -> str:
    """Return a message as a sentence."""
    return f"{text[:1].upper()}{text[1:]}{'' if text.endswith('.') else '.'}"


def _pair(legs: tuple[int, int] | None) -> str:
    return "" if legs is None else f"; in the new design that of legs {legs[0]} and {legs[1]}"
