"""The progress, the failures and the Pareto front of a study as HTML."""

from __future__ import annotations

from collections.abc import Mapping
from html import escape

import numpy as np

from explorer.app.features.studies.feed import StudyDrawing
from explorer.app.features.studies.figures import FRONT, PICKED, SCALE
from explorer.app.features.studies.plot_rows import MOST_ROWS
from explorer.app.features.studies.runner import Run
from explorer.app.state.studies import RADIUS, StudyPlan, label_of, title_of
from explorer.app.widgets.buttons import press_button
from explorer.app.widgets.markup import (
    box,
    by_theme,
    decimals_for,
    dim,
    format_number,
    meter,
    signed,
)
from explorer.measures.catalogue import measures_in
from explorer.numerics.arrays import FloatArray, IntArray
from explorer.optimise.problem import REACH, YAW
from explorer.sweep.study import NAMES, Sense, Study

ROWS = 10
"""Rows of the table of the front."""

# Reasons that are listed; the others are counted.
MOST_REASONS = 4
# Columns of the table besides the index.
MOST_COLUMNS = 9
ARROWS: dict[Sense, str] = {"max": "↑", "min": "↓"}


def status(drawing: StudyDrawing) -> str:
    """Return the progress of a study and the parts of it that are shown, as HTML."""
    study, count = drawing.study, drawing.results.count
    total = "" if drawing.is_complete else f" of {study.count}"
    words = f"<b>{count}</b>{total} designs"
    front, inside = len(drawing.front), int(drawing.inside.sum())
    words += f" · {_dot(FRONT)}<b>{front}</b> on the front" if study.objectives else ""
    if drawing.request.studies.brushes:
        clear = press_button(
            "studies.clear", "", "clear", hint="Clear all brushes", class_name="ex-link"
        )
        words += f" · <b>{inside}</b> within the brushes {clear}"
    if drawing.plotted is not None and drawing.plotted.count > MOST_ROWS:
        words += f" · {len(drawing.plotted.rows)} of them drawn, the front first"
    if drawing.plotted is not None and drawing.plotted.lacking[0]:
        lacking, names = drawing.plotted.lacking
        words += f" · <b>{lacking}</b> without a line, which lack "
        words += escape(" or ".join(map(label_of, names)))
    if count and drawing.plotted is None:
        words += " · nothing to draw yet: the designs done so far differ in fewer than two values"
    objectives = ", ".join(
        f"{label_of(objective.measure)} {ARROWS[objective.sense]}" for objective in study.objectives
    )
    unit = f"1 unit (u) = {format_number(study.base.unit_mm, 6)} mm"
    note = f"{f'objectives: {escape(objectives)}' if objectives else 'no objectives'} · {unit}"
    resize = press_button(
        "studies.taller",
        "",
        "Taller ⇕",
        hint="Make the drawer taller, or lower again",
        class_name="ex-link ex-whole",
    )
    return box(
        f'<div class="ex-line"><span>{words}</span>{resize}</div>',
        f'<div class="ex-dim ex-small">{note}</div>',
        failures(drawing),
    )


def failures(drawing: StudyDrawing) -> str:
    """Return the number of designs that are not done, by reason, as HTML; "" where all are."""
    failed = sum(count for *_, count in drawing.reasons)
    if not failed:
        return ""
    listed = [_reason(*counted) for counted in drawing.reasons[:MOST_REASONS]]
    rest = drawing.reasons[MOST_REASONS:]
    if rest:
        listed.append(f"{sum(count for *_, count in rest)} for {len(rest)} other reasons")
    return f'<div class="ex-beyond ex-small">{failed} not done: {escape("; ".join(listed))}</div>'


def _reason(status: str, reason: str, count: int) -> str:
    return f"{count} {status}{f' ({reason})' if reason else ''}"


def run_line(run: Run) -> str:
    """Return the progress of a study that is being computed, as HTML."""
    progress = run.progress
    if progress is None:
        words = f"{escape(run.name)}: its process is starting …"
    else:
        words = f"{escape(run.name)}: <b>{progress.done}</b> of {progress.total} designs"
        if progress.rate > 0.0:
            words += f" · {format_number(progress.rate, 3)} a second"
        if left := progress.seconds_left:
            words += f" · {duration(left)} left"
    if run.is_cancelled:
        words += " · ending"
    share = 0.0 if progress is None else progress.done / progress.total
    return box(words, meter(100.0 * share))


def duration(seconds: float) -> str:
    """Return a duration in seconds, or in minutes and seconds."""
    whole = max(1, round(seconds))
    return f"{whole} s" if whole < 60 else f"{whole // 60} min {whole % 60} s"


def legend(drawing: StudyDrawing) -> str:
    """Return the legend of the plots and how to use them, as HTML."""
    plotted = drawing.plotted
    if plotted is None:
        return ""
    colours = ",".join(map(by_theme, SCALE[False], SCALE[True]))
    bar = f'<span class="ex-legend is-inline" style="--colours:{colours}"></span>'
    return (
        f'<div class="ex-note ex-dim">{_dot(FRONT)}Pareto front &nbsp; '
        f"{bar}other designs, by {escape(label_of(plotted.colour))} &nbsp; "
        f'<span class="ex-ring" style="--colour:{PICKED}"></span>'
        "picked<br>Drag along an axis above, or a box below, to brush; "
        "double-click frees it; click a design to make it the live one.</div>"
    )


def window(rows: IntArray, picked: int | None, indices: IntArray) -> IntArray:
    """Return the rows of the front in the table: those about the picked one, or the first.

    Args:
        rows: Rows of the front, in order.
        picked: Index of the picked design, or None.
        indices: Indices of the designs of all rows.
    """
    places = np.flatnonzero(indices[rows] == (-1 if picked is None else picked))
    start = 0 if not len(places) else int(places[0]) - ROWS // 2
    start = max(0, min(start, len(rows) - ROWS))
    return rows[start : start + ROWS]


def table(drawing: StudyDrawing) -> str:
    """Return a part of the front as HTML; each row is a button that opens its design."""
    results, study = drawing.results, drawing.study
    rows = window(drawing.front_inside, drawing.request.studies.picked, results.columns["index"])
    if not study.objectives:
        return ""
    names = table_columns(study)
    head = "".join(
        f'<span title="{escape(_hint(name))}">{escape(label_of(name))}{_arrow(study, name)}</span>'
        for name in names
    )
    decimals = {name: _decimals(results.columns[name][drawing.front]) for name in names}
    lines = "".join(_line(drawing, int(row), decimals) for row in rows.tolist())
    count, inside = len(drawing.front), len(drawing.front_inside)
    among = f"{inside} of {count}" if inside < count else str(count)
    caption = f"Pareto front: {among}, from the best in {label_of(study.objectives[0].measure)}"
    return (
        f'<div class="ex-box ex-front" style="--columns:{len(names)}">'
        f'<div class="ex-row ex-dim ex-small">{escape(caption)}</div>'
        f'<div class="ex-row ex-dim ex-small"><span>design</span>{head}</div>{lines}</div>'
    )


def table_columns(study: Study) -> tuple[str, ...]:
    """Return the columns of the table: the objectives, then the varied values."""
    objectives = [objective.measure for objective in study.objectives]
    return tuple(dict.fromkeys((*objectives, *study.varied)))[:MOST_COLUMNS]


def _decimals(values: FloatArray) -> int:
    """Return the decimals that give the largest of some values four digits."""
    largest = float(np.abs(values).max(initial=0.0))
    return min(6, decimals_for(largest, 4)) if largest > 0.0 else 0


def _line(drawing: StudyDrawing, row: int, decimals: Mapping[str, int]) -> str:
    columns = drawing.results.columns
    index = int(columns["index"][row])
    cells = "".join(
        f"<span>{signed(float(columns[name][row]), digits)}</span>"
        for name, digits in decimals.items()
    )
    is_picked = index == drawing.request.studies.picked
    return press_button(
        "studies.pick",
        index,
        dim(str(index)) + cells,
        hint=f"Open design {index}",
        class_name="ex-row is-picked" if is_picked else "ex-row",
    )


def chips(plan: StudyPlan) -> str:
    """Return the switches of the variables and measures of a new study, as HTML."""
    varying = "".join(
        press_button(
            "studies.vary",
            name,
            escape(label_of(name)),
            hint=f"{'Keep' if name in plan.variables else 'Vary'} {_variable_words(name)}",
            class_name="ex-chip",
            is_on=name in plan.variables,
        )
        for name in NAMES
    )
    measured = "".join(
        press_button(
            "studies.measure",
            name,
            escape(label_of(name)) + _sense(plan.sense_of(name)),
            hint=f"{_hint(name)}. Click: measure, maximise, minimise, leave out",
            class_name="ex-chip",
            is_on=name in plan.measures,
        )
        for name in measures_in("studies")
    )
    return box(
        _title("Variables"),
        f'<div class="ex-flow">{varying}</div>',
        _title("Measures; ↑ maximise, ↓ minimise"),
        f'<div class="ex-flow">{measured}</div>',
    )


def _title(words: str) -> str:
    return f'<div class="ex-caption ex-small ex-after">{words}</div>'


def _sense(sense: Sense | None) -> str:
    return "" if sense is None else f" <b>{ARROWS[sense]}</b>"


def _arrow(study: Study, name: str) -> str:
    senses: dict[str, Sense] = {
        objective.measure: objective.sense for objective in study.objectives
    }
    return f" {ARROWS[senses[name]]}" if name in senses else ""


def _hint(name: str) -> str:
    measure = measures_in("studies").get(name)
    if measure is None:
        return _variable_words(name)
    return f"{measure.hint}{'; slow to compute' if measure.cost == 'high' else ''}"


def _variable_words(name: str) -> str:
    words = {
        YAW: "the yaw of home [°]",
        REACH: "one maximum for all lengths [units]",
        RADIUS: "one radius for all legs [units]",
    }
    return words.get(name, title_of(name)) if name in NAMES else name


def _dot(colour: str) -> str:
    return f'<span class="ex-dot" style="--colour:{colour}"></span>'
