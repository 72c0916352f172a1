"""The search as HTML: what prevents it, its progress, its verdict, and the limits in force."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from html import escape

from explorer.app.features.compare.table import ComparedDesign, measure_row
from explorer.app.features.optimise import buttons, work
from explorer.app.features.optimise.actions import lift_words
from explorer.app.features.optimise.state import REACHED, Optimisation, SearchResult, SearchRun
from explorer.app.state.state import State
from explorer.app.state.view import View
from explorer.app.widgets import markup
from explorer.measures.blocks.block import Look
from explorer.measures.catalogue import CATALOGUE, Measurements
from explorer.measures.measure import CERTAIN
from explorer.mechanism.design import VARIABLES, Design
from explorer.numerics.number_text import Unit, format_number
from explorer.optimise import problem as problems
from explorer.optimise.conflicts import Conflict
from explorer.optimise.outcome import GOALS, OBJECTIVE_SYMBOLS, Iterate
from explorer.workspace.limits.quantities import DIGITS as LIMIT_DIGITS
from explorer.workspace.limits.table import limits_in_force

TITLES = {
    "converged": "Converged",
    "not converged": "Not converged",
    "infeasible": "No design keeps all demands",
    "stalled": "Stalled",
    "cancelled": "Cancelled: the best so far",
}
MEANINGS = {
    "converged": "The new design keeps all demands, and none nearby is better.",
    "not converged": "The search ended before it was sure, or a demand is not proven.",
    "infeasible": "The search found no design that keeps what was demanded.",
    "stalled": "The demands are kept, but the search found no way to a better design.",
    "cancelled": "The search was ended early, and its best design is kept.",
}
VERDICTS = {title: MEANINGS[status] for status, title in TITLES.items()}
"""The verdicts on a search, each with its meaning."""
# Limits of refusals without a problem that could be searched.
NO_PROBLEM = ("", problems.SWING_LIMIT, problems.MAXIMA)

# Numbers in the words of a search, and those that are lengths or volumes, with the power of these.
NUMBER = re.compile(r"−?\d+(?:,\d{3})*(?:\.\d+)?")
IN_UNITS = re.compile(r"(\([^()]*\)|−?\d[\d,.]*) units(³?)")


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
    run = Optimisation.of(state).run
    if run is None:
        return None
    if not Optimisation.of(state).is_on:
        if run.verdict is None or run.best is None or run.accepted:
            return None
        value = _reached_text(run.problem, run.best, state)
        return Notice(TITLES[run.verdict.status], value, None, (buttons.ACCEPT, buttons.REVERT))
    if run.phase == "cancelling":
        return Notice("Cancelling …", "", None, (buttons.CANCEL,))
    if not run.iterates:
        return Notice("Starting …", "the first start compiles kernels", None, (buttons.CANCEL,))
    last = run.iterates[-1]
    step = sum(iterate.run == last.run for iterate in run.iterates) - 1
    start = f"start {last.run + 1} of {run.starts}, " if run.starts > 1 else ""
    broken = f", broken: {last.worst}" if last.spare < 0.0 else ""
    return Notice(
        f"{start}{last.phase} {step}".capitalize(),
        f"{_reached_text(run.problem, last, state)}{broken}",
        last.run / run.starts if run.starts > 1 else None,
        (buttons.CANCEL,),
    )


def _reached_text(problem: problems.Problem, iterate: Iterate, state: State) -> str:
    """Return the result of a search: the volume that it matches, or the objective."""
    unit = goal_unit(problem.objective, state)
    if problem.objective == "match-volume":
        return f"volume {unit.text(iterate.volume, 5)}"
    return f"{OBJECTIVE_SYMBOLS[problem.objective]} {unit.text(iterate.objective, 6)}"


def goal_unit(objective: problems.ObjectiveName, state: State) -> Unit:
    """Return the unit in which the measure of an objective is shown."""
    return CATALOGUE[GOALS[objective]].unit_in(state.unit, state.design.reach**3)


def search_words(state: State) -> str:
    """Return how the search goes or ended, and its buttons, as HTML, which stay in sight.

    At most one of its buttons is filled: what prevents a search comes first, then the answer to
    a search that succeeded, then the search itself.
    """
    run, notice = Optimisation.of(state).run, search_notice(state)
    if notice is not None and Optimisation.of(state).is_on:
        return (
            f'<div class="ex-line"><div class="ex-strong">{escape(notice.title)}</div>'
            f"{buttons.button(buttons.CANCEL, state)}</div>"
            f'<div class="ex-dim ex-cut">{escape(notice.text) or "&nbsp;"}</div>'
            + ("" if notice.share is None else markup.meter(100.0 * notice.share))
        )
    refusals, limits = work.find_refusals(state), work.liftable_limits(state)
    remedies = "".join(
        buttons.button(
            buttons.LIFT,
            state,
            words=lift_words(limit),
            value=limit,
            is_main=limit == limits[0],
        )
        for limit in limits
    )
    undecided = Optimisation.of(state).undecided
    is_success = undecided is not None and undecided.has_converged
    verdict = "" if run is None or run.verdict is None else verdict_words(state, run, run.verdict)
    why = markup.sentence(*(refusal.message for refusal in refusals))
    has_result = run is not None and run.best is not None
    acts = buttons.button(
        buttons.START,
        state,
        words="Search again" if has_result else "",
        hint=f"No search can start: {why}" if refusals else "",
        is_main=not (remedies or refusals or is_success),
    )
    if undecided is None:
        acts += buttons.button(buttons.PAPER, state)
    else:
        accept = buttons.button(buttons.ACCEPT, state, is_main=is_success and not remedies)
        acts = accept + buttons.button(buttons.REVERT, state) + acts
    refused = refused_words(why, refusals, limits) if refusals else ""
    return f'{verdict}{refused}<div class="ex-flow">{remedies}{acts}</div>'


def result_words(state: State, built: str = "") -> str:
    """Return what a search found as HTML, whether that can be built, and the limits in force."""
    run, found = Optimisation.of(state).run, ""
    if run is not None and run.best is not None and not Optimisation.of(state).is_on:
        found = f'<div class="ex-before">{built}</div>{comparison_table(run, state.view)}'
    return markup.box(found, limits_table(state.design, state.unit))


def refused_words(body: str, refusals: Sequence[Conflict], limits: Sequence[str]) -> str:
    """Return why no search can start, as HTML; buttons below offer to lift some limits."""
    if any(refusal.limit not in limits for refusal in refusals):
        body += " Change the demands, or the limits in the tab Design."
    is_problem = not any(refusal.limit in NO_PROBLEM for refusal in refusals)
    title = "No design can keep these demands" if is_problem else "This cannot be optimised"
    return markup.alert(title, body)


def verdict_words(state: State, run: SearchRun, verdict: SearchResult) -> str:
    """Return the verdict on a run, as HTML."""
    if verdict.status == "failed":
        return markup.alert(
            "No result", f"{markup.sentence(verdict.message)} Your design is as it was."
        )
    if verdict.best is not None and state.design.variables != verdict.best.design.variables:
        return markup.dim("The design was changed by hand since the search.")
    title = "Cancelled" if verdict.best is None else TITLES[verdict.status]
    message = verdict.message.removeprefix(f"{verdict.status}: ")
    if verdict.best is not None:
        message = message.replace(REACHED, _reached_text(run.problem, verdict.best, state))
    message = IN_UNITS.sub(lambda found: _in_unit_of(state, found[1], found[2]), message)
    remarks: list[str] = []
    if verdict.starts > 1:
        remarks.append(f"{verdict.starts} starts, {verdict.converged} converged")
    if verdict.seconds is not None:
        remarks.append(f"{format_number(verdict.seconds, 2)} s")
    if run.accepted:
        remarks.append("accepted")
    look = "within" if verdict.status == "converged" else "beyond"
    return (
        f"{markup.status(title, look, MEANINGS[verdict.status])}"
        f"<div>{escape(markup.sentence(message))} "
        f'<span class="ex-dim">{" · ".join(remarks)}</span></div>'
    )


def _in_unit_of(state: State, numbers: str, power: str) -> str:
    """Return numbers in design units, or a power of them, as text in the unit of a state."""
    unit = state.unit_of(3 if power else 1)

    def number(found: re.Match[str]) -> str:
        return unit.number(float(found[0].replace(",", "").replace("−", "-")))

    return f"{NUMBER.sub(number, numbers)} {unit.name}"


def comparison_table(run: SearchRun, view: View) -> str:
    """Return the user's own design and the best one side by side, as HTML."""
    if run.comparison is None:
        return markup.dim("Comparing …")
    columns = [
        ComparedDesign(number, each.design, each, view.unit_for(each.design))
        for number, each in enumerate(run.comparison)
    ]
    rows = [
        _comparison_row(run.problem, name, columns)
        for name in run.comparison[1].values
        if name != problems.YAW or problems.YAW in run.problem.names
    ]
    head = "".join(f'<td class="ex-number">{each}</td>' for each in ("", "old", "new", "change"))
    return f'<table class="ex-compare"><tr class="ex-dim">{head}</tr>{"".join(rows)}</table>'


def _comparison_row(problem: problems.Problem, name: str, columns: Sequence[ComparedDesign]) -> str:
    measure, after = CATALOGUE[name], columns[-1].measured
    label, hint = measure.label, measure.hint
    pairs: dict[str, tuple[int, int] | None] = {}
    if isinstance(after, Measurements):
        pairs = {"least_clearance": after.nearest, "demanded_clearance": after.demanded_nearest}
        if name == "demanded_clearance":
            # The unit of the row follows.
            least = columns[-1].unit.number(after.demanded_margin or 0.0, 3)
            label += f", |δ| ≥ {least}"
    if legs := pairs.get(name):
        hint += f"; in the new design that of legs {legs[0]} and {legs[1]}"
    look = "ex-strong" if name == GOALS[problem.objective] else ""
    look = "ex-first" if name == VARIABLES[0] else look
    change = _look_of_change(problem, name, *(column.value(measure) for column in columns))
    return measure_row(measure, columns, label=label, hint=hint, look=look, change=change)


def _look_of_change(
    problem: problems.Problem, name: str, old: float | None, new: float | None
) -> Look | None:
    """Return whether a change is good or bad for the problem; None if neither."""
    # Clearances are exact to this length.
    accuracy = CERTAIN * problem.start.reach
    if name == "least_clearance":
        return "beyond" if new is not None and new <= accuracy else None
    if name == "demanded_clearance":
        demand = problem.demands.clearance or 0.0
        return "beyond" if new is not None and new < demand - accuracy else "within"
    if name != GOALS[problem.objective] or old is None or new is None:
        return None
    if problem.objective == "match-volume":
        target = problem.demands.volume or 0.0
        is_better = abs(new - target) < abs(old - target)
    else:
        is_better = new > old if CATALOGUE[name].sense == "more" else new < old
    return "within" if is_better else None


def limits_table(design: Design, unit: Unit) -> str:
    """Return the limits in force as HTML, a row for those of equal words."""
    hint = "They hold throughout a search; the tab Design changes them."
    rows = "".join(markup.row(markup.dim(name), text) for name, text in limit_rows(design, unit))
    return (
        f'<div class="ex-after" title="{hint}">{markup.caption(f"Limits in force ({unit.name})")}'
        f'<table class="ex-limits">{rows}</table></div>'
    )


def limit_rows(design: Design, unit: Unit) -> Iterator[tuple[str, str]]:
    """Yield the symbols and the words of the limits that are in force."""
    for symbols, demand in limits_in_force(design):
        yield symbols, demand.words(unit.factor)
    radii = design.limits.leg_radii
    if any(radii):
        ends = sorted({min(radii), max(radii)})
        yield "leg radii", " to ".join(unit.number(end, LIMIT_DIGITS) for end in ends)
