"""A study in words and as a table: how far it is, what failed and why, its Pareto front."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from html import escape

import numpy as np

from explorer.app.features.studies.feed import StudyDrawing
from explorer.app.features.studies.figures import FRONT, PICKED, SCALE
from explorer.app.features.studies.runner import Run
from explorer.app.features.studies.shown import MOST_ROWS
from explorer.app.state.studies import RADIUS, StudyWish, spoken, titled
from explorer.app.widgets.labels import labelled
from explorer.app.widgets.markup import BEYOND, DIM, by_theme, format_number, signed
from explorer.measures.catalogue import measures_in
from explorer.numerics.arrays import FloatArray, IntArray
from explorer.optimise.problem import REACH, YAW
from explorer.sweep.study import NAMES, Sense, Study

ROWS = 10
"""Rows of the table of the front."""

# Reasons that are told; the others are counted.
MOST_REASONS = 4
# Columns of the table besides the index.
MOST_COLUMNS = 9
ARROWS: dict[Sense, str] = {"max": "↑", "min": "↓"}
CHIP = (
    "display:inline-block;padding:1px 8px;margin:2px 3px 2px 0;border-radius:10px;font-size:12px;"
    "cursor:pointer;line-height:1.5;border:1px solid "
)
CHOSEN = "rgba(34,104,212,0.55);background:rgba(34,104,212,0.13)"
FREE = "rgba(128,136,148,0.4)"
BOX = '<div style="padding:2px 12px;font-size:12.5px;line-height:1.45">'


def status(drawing: StudyDrawing, clear: str, resize: str) -> str:
    """Return how far a study is and what is seen of it, as HTML.

    Args:
        drawing: The study as it is drawn.
        clear: HTML that clears all brushes.
        resize: HTML that makes the drawer taller, or lower again.
    """
    study, count = drawing.study, drawing.results.count
    told = f"<b>{count}</b> designs"
    if not drawing.is_complete:
        told = f"<b>{count}</b> of {study.count} designs"
    front, inside = len(drawing.front), int(drawing.inside.sum())
    told += f" · {_dot(FRONT)}<b>{front}</b> on the front" if study.objectives else ""
    if drawing.request.studies.brushes:
        told += f" · <b>{inside}</b> within the brushes {clear}"
    if drawing.shown is not None and drawing.shown.count > MOST_ROWS:
        told += f" · {len(drawing.shown.rows)} of them drawn, the front first"
    if drawing.shown is not None and drawing.shown.lacking[0]:
        lacking, names = drawing.shown.lacking
        told += f" · <b>{lacking}</b> without a line, for want of "
        told += escape(" or ".join(map(spoken, names)))
    if count and drawing.shown is None:
        told += " · nothing to draw yet: the designs that are done differ in fewer than two values"
    wanted = ", ".join(f"{spoken(each.measure)} {ARROWS[each.sense]}" for each in study.objectives)
    unit = f"1 unit (u) = {format_number(study.base.unit_mm, 6)} mm"
    note = f"wanted: {escape(wanted)} · {unit}" if wanted else f"no objectives · {unit}"
    return (
        f'{BOX}<div style="display:flex;gap:10px"><span style="flex:1">{told}</span>{resize}</div>'
        f'<div style="{DIM};font-size:11.5px">{note}</div>{failures(drawing)}</div>'
    )


def failures(drawing: StudyDrawing) -> str:
    """Return how many designs are not done, by reason, as HTML; "" where all are."""
    odd = sum(count for *_, count in drawing.reasons)
    if not odd:
        return ""
    shown = [_reason(*each) for each in drawing.reasons[:MOST_REASONS]]
    rest = drawing.reasons[MOST_REASONS:]
    if rest:
        shown.append(f"{sum(count for *_, count in rest)} for {len(rest)} other reasons")
    listed = "; ".join(shown)
    return f'<div style="color:{BEYOND};font-size:11.5px">{odd} not done: {escape(listed)}</div>'


def _reason(status: str, reason: str, count: int) -> str:
    return f"{count} {status}{f' ({reason})' if reason else ''}"


def run_line(run: Run) -> str:
    """Return how far a study under way is, as HTML."""
    progress = run.progress
    if progress is None:
        words = f"{escape(run.name)}: its process is starting …"
    else:
        words = f"{escape(run.name)}: <b>{progress.done}</b> of {progress.total} designs"
        if progress.rate > 0.0:
            words += f" · {format_number(progress.rate, 3)} a second"
        left = progress.seconds_left
        if left:
            words += f" · {duration(left)} left"
    if run.is_cancelled:
        words += " · ending"
    share = 0.0 if progress is None else progress.done / progress.total
    bar = (
        '<div style="height:6px;border-radius:3px;margin:3px 0 4px;'
        'background:rgba(128,136,148,0.25)"><div style="height:6px;border-radius:3px;'
        f'width:{100.0 * share:.1f}%;background:var(--mantine-primary-color-filled)"></div></div>'
    )
    return f"{BOX}{words}{bar}</div>"


def duration(seconds: float) -> str:
    """Return a duration in the units that suit it."""
    whole = max(1, round(seconds))
    return f"{whole} s" if whole < 60 else f"{whole // 60} min {whole % 60} s"


def legend(drawing: StudyDrawing) -> str:
    """Return what the colours of the plots mean, as HTML."""
    shown = drawing.shown
    if shown is None:
        return ""
    colours = ",".join(map(by_theme, SCALE[False], SCALE[True]))
    bar = (
        '<span style="display:inline-block;width:54px;height:8px;border-radius:4px;margin:0 5px;'
        f'background:linear-gradient(90deg,{colours})"></span>'
    )
    return (
        f'<div style="padding:3px 14px;font-size:11.5px;{DIM}">'
        f"{_dot(FRONT)}Pareto front &nbsp; {bar}other designs, by {escape(spoken(shown.colour))} "
        f"&nbsp; {_ring()}picked<br>Drag along an axis above, or a box below, to brush; "
        "double-click frees it; click a design to make it the live one.</div>"
    )


def window(rows: IntArray, picked: int | None, indices: IntArray) -> IntArray:
    """Return the rows of the front that the table shows: about the picked one, or the first.

    Args:
        rows: Of the front, in order.
        picked: The index of the design that was picked.
        indices: Of all rows.
    """
    found = np.flatnonzero(indices[rows] == (-1 if picked is None else picked))
    start = 0 if not len(found) else int(found[0]) - ROWS // 2
    start = max(0, min(start, len(rows) - ROWS))
    return rows[start : start + ROWS]


def table(drawing: StudyDrawing, ids: Sequence[str]) -> str:
    """Return a part of the front as HTML, each row a label of the button with its id."""
    results, study = drawing.results, drawing.study
    rows = window(drawing.front_inside, drawing.request.studies.picked, results.columns["index"])
    if not study.objectives:
        return ""
    names = columns_shown(study)
    grid = f"display:grid;grid-template-columns:44px repeat({len(names)},1fr);gap:6px;"
    head = "".join(
        f'<span style="text-align:right" title="{escape(_explained(name), quote=True)}">'
        f"{escape(spoken(name))}{_arrow(study, name)}</span>"
        for name in names
    )
    decimals = {name: _decimals(results.columns[name][drawing.front]) for name in names}
    lines = "".join(
        _line(drawing, int(row), decimals, identity, grid)
        for row, identity in zip(rows.tolist(), ids, strict=False)
    )
    count, inside = len(drawing.front), len(drawing.front_inside)
    among = f"{inside} of {count}" if inside < count else str(count)
    told = f"Pareto front: {among}, from the best in {spoken(study.objectives[0].measure)}"
    return (
        '<div style="padding:4px 12px 8px;font-size:12px;line-height:1.3;'
        f'font-variant-numeric:tabular-nums"><div style="{DIM};font-size:11.5px;padding:2px 6px">'
        f'{escape(told)}</div><div style="{grid}{DIM};font-size:11px;padding:2px 6px;'
        f'align-items:end"><span>design</span>{head}</div>{lines}</div>'
    )


def columns_shown(study: Study) -> tuple[str, ...]:
    """Return the columns of the table: the objectives, then what varies."""
    wanted = [each.measure for each in study.objectives]
    return tuple(dict.fromkeys((*wanted, *study.varied)))[:MOST_COLUMNS]


def _decimals(values: FloatArray) -> int:
    """Return how many decimals leave the largest of some values four digits."""
    largest = float(np.abs(values).max(initial=0.0))
    return min(6, max(0, 3 - math.floor(math.log10(largest)))) if largest > 0.0 else 0


def _line(
    drawing: StudyDrawing, row: int, decimals: Mapping[str, int], identity: str, grid: str
) -> str:
    columns = drawing.results.columns
    index = int(columns["index"][row])
    cells = "".join(
        f'<span style="text-align:right">{signed(float(columns[name][row]), digits)}</span>'
        for name, digits in decimals.items()
    )
    look = f"{grid}padding:2px 6px;border-radius:4px;cursor:pointer;"
    if index == drawing.request.studies.picked:
        look += "background:rgba(10,157,108,0.16);font-weight:600;"
    return labelled(
        identity, f"Open design {index}", f'<span style="{DIM}">{index}</span>{cells}', style=look
    )


def chips(wish: StudyWish, variables: Mapping[str, str], measures: Mapping[str, str]) -> str:
    """Return what may vary and what is measured in a new study, as labels of buttons.

    Args:
        wish: The study.
        variables: The ids of buttons by the names of variables.
        measures: Likewise of measures.
    """
    varying = "".join(
        _chip(
            identity,
            f"{'Keep' if name in wish.variables else 'Vary'} {_variable_words(name)}",
            escape(spoken(name)),
            is_chosen=name in wish.variables,
        )
        for name, identity in variables.items()
    )
    measured = "".join(
        _chip(
            identity,
            f"{_explained(name)}. Click: measured, to be large, to be small, left out",
            escape(spoken(name)) + _sense(wish.sense_of(name)),
            is_chosen=name in wish.measures,
        )
        for name, identity in measures.items()
    )
    title = f'<div style="{DIM};font-size:11.5px;margin-top:4px">'
    return (
        f"{BOX}{title}What varies</div>{varying}"
        f"{title}What is measured; ↑ is to be large, ↓ small</div>{measured}</div>"
    )


def _chip(identity: str, name: str, content: str, *, is_chosen: bool) -> str:
    look = CHIP + (CHOSEN if is_chosen else FREE)
    return labelled(identity, name, content, style=look if is_chosen else f"{look};opacity:0.7")


def _sense(sense: Sense | None) -> str:
    return "" if sense is None else f" <b>{ARROWS[sense]}</b>"


def _arrow(study: Study, name: str) -> str:
    senses: dict[str, Sense] = {each.measure: each.sense for each in study.objectives}
    return f" {ARROWS[senses[name]]}" if name in senses else ""


def _explained(name: str) -> str:
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
    return words.get(name, titled(name)) if name in NAMES else name


def _dot(colour: str) -> str:
    return (
        f'<span style="display:inline-block;width:8px;height:8px;border-radius:50%;'
        f'background:{colour};margin-right:4px"></span>'
    )


def _ring() -> str:
    return (
        f'<span style="display:inline-block;width:7px;height:7px;border-radius:50%;'
        f'border:2px solid {PICKED};margin-right:4px;vertical-align:-1px"></span>'
    )
