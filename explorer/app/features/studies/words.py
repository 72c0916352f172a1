"""The progress, the failures and the Pareto front of a study as HTML."""

from __future__ import annotations

from collections.abc import Sequence
from html import escape

import numpy as np

from explorer.app.features.studies.feed import StudyDrawing
from explorer.app.features.studies.figures import FRONT, MOST_ROWS, PICKED, SCALE
from explorer.app.features.studies.state import StudyPlan, choices_for, label_of, title_of
from explorer.app.features.studies.work import StudyRun
from explorer.app.widgets.buttons import extra_button, press_button
from explorer.app.widgets.markup import box, dim, meter
from explorer.files.extras import is_missing
from explorer.measures.catalogue import measures_in
from explorer.mechanism.design import Design
from explorer.numerics.arrays import IntArray
from explorer.numerics.number_text import Unit, decimals_for, format_decimals, format_number
from explorer.optimise.problem import REACH, YAW
from explorer.sweep.machine import MACHINE
from explorer.sweep.results import unit_of
from explorer.sweep.study import NAMES, RADIUS, Sense, Study

ROWS = 10
"""Rows of the table of the front."""

# Reasons that are listed; the others are counted.
MOST_REASONS = 4
# Columns of the table besides the index.
MOST_COLUMNS = 9
ARROWS: dict[str, str] = {"max": "↑", "min": "↓"}
BUTTONS = {
    "start": (
        "Start study",
        "Compute a small study around the live design; its results go to the data folder.",
    ),
    "cancel": ("Cancel study", "End the study; finished designs are kept."),
    "continue": ("Continue the study", "Compute the designs of the open study that are missing."),
    "new": ("New study", "Close the study, and set up a small one around the live design."),
    "clear": ("Clear filters", "Free all axes."),
}
"""Words and hint of each button, by its name."""


def status(drawing: StudyDrawing, *, is_running: bool = False) -> str:
    """Return how far a study is, unless it is running, and what its plots show, as HTML."""
    study, count = drawing.results.study, drawing.results.count
    total = "" if drawing.is_complete else f" of {format_number(study.count)}"
    parts = [] if is_running else [f"<b>{format_number(count)}</b>{total} designs"]
    front, inside = len(drawing.front), int(drawing.inside.sum())
    if study.objectives:
        parts.append(f"{_dot(FRONT)}<b>{format_number(front)}</b> on the Pareto front")
    if drawing.studies.brushes:
        hint = BUTTONS["clear"][1]
        clear = press_button("studies.clear", "", "clear", hint=hint, class_name="ex-link")
        parts.append(f"<b>{format_number(inside)}</b> within the filters {clear}")
    plotted = drawing.plotted
    if plotted is not None and plotted.count > MOST_ROWS["lines"]:
        points, lines = (format_number(len(plotted.rows[plot])) for plot in ("points", "lines"))
        parts.append(f"{points} drawn as points and {lines} as lines, the front first")
    if plotted is not None and plotted.lacking[0]:
        lacking, names = plotted.lacking
        lacks = escape(" or ".join(map(label_of, names)))
        parts.append(f"<b>{format_number(lacking)}</b> without a line, which lack {lacks}")
    if count and plotted is None:
        parts.append("nothing to draw yet: the designs so far differ in fewer than two values")
    summary = _summary(study)
    return (
        f"<div>{' · '.join(parts)}</div>"
        f'<div class="ex-dim ex-small ex-cut" title="{escape(summary)}">{escape(summary)}</div>'
        f"{failures(drawing)}"
    )


def _summary(study: Study) -> str:
    """Return the variables and the objectives of a study, in one line."""
    objectives = ", ".join(
        f"{label_of(objective.measure)} {ARROWS[objective.sense]}" for objective in study.objectives
    )
    return " · ".join(
        (
            f"objectives: {objectives}" if objectives else "no objectives",
            f"varied: {', '.join(map(label_of, study.variables))}",
            f"1 unit = {format_number(study.base.unit_mm, 6)} mm",
        )
    )


def failures(drawing: StudyDrawing) -> str:
    """Return the number of designs that are not done, by reason, as HTML; "" where all are."""
    failed = sum(count for *_, count in drawing.reasons)
    if not failed:
        return ""
    listed = [
        f"{format_number(count)} {status}{f' ({reason})' if reason else ''}"
        for status, reason, count in drawing.reasons[:MOST_REASONS]
    ]
    rest = drawing.reasons[MOST_REASONS:]
    if rest:
        others = format_number(sum(count for *_, count in rest))
        listed.append(f"{others} for {len(rest)} other reasons")
    return (
        f'<div class="ex-beyond ex-small">{format_number(failed)} not done: '
        f"{escape('; '.join(listed))}</div>"
    )


def run_words(run: StudyRun) -> str:
    """Return how far a study that is being computed is, as HTML."""
    progress = run.progress
    if progress is None:
        words = "the process is starting …"
    else:
        words = f"<b>{format_number(progress.done)}</b> of {format_number(progress.total)} designs"
        if progress.rate > 0.0:
            words += f" · {format_number(progress.rate, 3)} a second"
        if left := progress.seconds_left:
            whole = max(1, round(left))
            duration = f"{whole} s" if whole < 60 else f"{whole // 60} min {whole % 60} s"
            words += f" · {duration} left"
    return f"{escape(run.name)}: {words}{' · ending' if run.is_cancelled else ''}"


def head(
    drawing: StudyDrawing | None, run: StudyRun | None, plan: StudyPlan | None, design: str
) -> str:
    """Return the lines on top of the tab as HTML: of the open, the computed and the new study."""
    parts: list[str] = []
    if run is not None:
        parts.append(f"<div>{run_words(run)}</div>{meter(100.0 * run.share)}")
    if plan is not None:
        count, percent = format_number(plan.count), format_number(plan.percent)
        parts.append(
            f"A new study: <b>{count}</b> designs around <b>{escape(design)}</b>, the live "
            f"design, with variables within ± {percent} % of its values."
        )
    elif drawing is not None:
        is_running = run is not None and run.name == drawing.studies.name
        parts.append(status(drawing, is_running=is_running))
    return box(*parts)


def acts(run: StudyRun | None, looks: str, *, is_new: bool, can_go_on: bool) -> str:
    """Return the buttons at the top of the tab as HTML, with those that say how plots look.

    A study is computed if there is a run, and `can_go_on` if the open one lacks designs.
    """
    if is_missing("study"):
        buttons = extra_button("study") + ("" if is_new else _button("new"))
    elif run is not None:
        buttons = _button("cancel")
    elif is_new:
        buttons = _button("start", is_main=True)
    else:
        buttons = _button("continue", is_main=True) * can_go_on + _button("new")
    return box(f'<div class="ex-ends ex-acts-line">{looks}{buttons}</div>')


def _button(name: str, *, is_main: bool = False) -> str:
    words, hint = BUTTONS[name]
    look = "ex-button is-main" if is_main else "ex-button"
    return press_button(f"studies.{name}", "", words, hint=hint, class_name=look)


def legend(drawing: StudyDrawing) -> str:
    """Return the legend of the plots as HTML."""
    plotted = drawing.plotted
    if plotted is None:
        return ""
    unit = unit_of(plotted.colour, plotted.lengths)
    least, most = (unit.number(end, 3) for end in plotted.ends[plotted.colour])
    bar = f'<span class="ex-legend is-inline" style="--colours:{",".join(SCALE)}"></span>'
    return (
        f'<div class="ex-note ex-dim">{_dot(FRONT)}Pareto front &nbsp; '
        f'<span class="ex-ring" style="--colour:{PICKED}"></span>picked &nbsp; '
        f"others by {escape(title_of(plotted.colour, plotted.lengths))}: {least}{bar}{most}</div>"
    )


def window(rows: IntArray, picked: int | None, indices: IntArray) -> IntArray:
    """Return the rows of the front in the table: those about the picked one, or the first."""
    places = np.flatnonzero(indices[rows] == (-1 if picked is None else picked))
    start = 0 if not len(places) else int(places[0]) - ROWS // 2
    start = max(0, min(start, len(rows) - ROWS))
    return rows[start : start + ROWS]


def table(drawing: StudyDrawing) -> str:
    """Return a part of the front as HTML; each row is a button that opens its design."""
    results, study = drawing.results, drawing.results.study
    rows = window(drawing.front_inside, drawing.studies.picked, results.columns["index"])
    if not len(rows):
        return ""
    objectives = [objective.measure for objective in study.objectives]
    names = tuple(dict.fromkeys((*objectives, *study.variables)))[:MOST_COLUMNS]
    units = {name: unit_of(name, drawing.lengths) for name in names}
    head = "".join(
        f'<span title="{escape(_hint(name, drawing.lengths))}">'
        f"{escape(title_of(name, drawing.lengths))}{_arrow(study, name)}</span>"
        for name in names
    )
    columns = {name: results.columns[name] * unit.factor for name, unit in units.items()}
    # As many decimals as give the largest value on the front four digits.
    largest = {name: np.abs(each[drawing.front]).max(initial=0) for name, each in columns.items()}
    decimals = {
        name: min(6, decimals_for(float(size), 4)) if size > 0 else 0
        for name, size in largest.items()
    }
    lines = "".join(
        _line(
            drawing,
            int(row),
            [format_decimals(float(columns[name][row]), decimals[name]) for name in names],
        )
        for row in rows.tolist()
    )
    count, inside = len(drawing.front), len(drawing.front_inside)
    among = format_number(count)
    if inside < count:
        among = f"{format_number(inside)} of {among}"
    caption = f"Pareto front: {among}, from the best in {label_of(study.objectives[0].measure)}"
    return (
        f'<div class="ex-box ex-front" style="--columns:{len(names)}">'
        f'<div class="ex-row ex-dim ex-small">{escape(caption)}</div>'
        f'<div class="ex-row ex-dim ex-small"><span>design</span>{head}</div>{lines}</div>'
    )


def _line(drawing: StudyDrawing, row: int, values: Sequence[str]) -> str:
    index = int(drawing.results.columns["index"][row])
    cells = "".join(f"<span>{value}</span>" for value in values)
    is_picked = index == drawing.studies.picked
    return press_button(
        "studies.pick",
        index,
        dim(str(index)) + cells,
        hint=f"Open design {index}",
        class_name="ex-row is-picked" if is_picked else "ex-row",
    )


def chips(plan: StudyPlan, design: Design, lengths: Unit) -> str:
    """Return the switches of what a new study around a design varies and measures, as HTML."""
    variables, measures = choices_for(design, plan)
    varying = "".join(
        _chip(
            "vary",
            name,
            f"{'Keep' if name in plan.variables else 'Vary'} {_variable_words(name, lengths)}",
            is_on=name in plan.variables,
        )
        for name in variables
    )
    senses = dict(plan.objectives)
    measured = "".join(
        _chip("measure", name, _hint(name, lengths), senses.get(name), is_on=name in plan.measures)
        for name in measures
    )
    groups = (
        ("Variables that vary; press to choose", varying),
        ("Measures; press to measure, again to maximise ↑, to minimise ↓, to leave out", measured),
    )
    return box(
        *(
            f'<div class="ex-caption ex-small ex-after">{title}</div>'
            f'<div class="ex-flow">{switches}</div>'
            for title, switches in groups
        )
    )


def _chip(press: str, name: str, hint: str, sense: Sense | None = None, *, is_on: bool) -> str:
    arrow = f" <b>{ARROWS[sense]}</b>" if sense else ""
    return press_button(
        f"studies.{press}",
        name,
        escape(label_of(name)) + arrow,
        hint=hint,
        class_name="ex-chip",
        is_on=is_on,
    )


def _arrow(study: Study, name: str) -> str:
    senses = {objective.measure: objective.sense for objective in study.objectives}
    return f" {ARROWS[senses[name]]}" if name in senses else ""


def _hint(name: str, lengths: Unit) -> str:
    measure = measures_in("studies").get(name)
    if measure is None:
        return _variable_words(name, lengths)
    return f"{measure.hint}{'; slow to compute' if measure.cost == 'high' else ''}"


def _variable_words(name: str, lengths: Unit) -> str:
    words = {
        YAW: "the yaw of home [°]",
        REACH: lengths.head("one maximum for all lengths"),
        RADIUS: lengths.head("one radius for all legs"),
        **{
            other: unit_of(other, lengths).head(f"the {each.words}")
            for other, each in MACHINE.items()
        },
    }
    return words.get(name, title_of(name, lengths)) if name in NAMES else name


def _dot(colour: str) -> str:
    return f'<span class="ex-dot" style="--colour:{colour}"></span>'
