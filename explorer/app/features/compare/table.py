"""Designs side by side: a row for each measure, a column for each design."""

from __future__ import annotations

from collections.abc import Sequence
from html import escape

from explorer.app.features.compare.columns import (
    Column,
    best_of,
    hint_of,
    size_of,
    unit_of,
    value_text,
)
from explorer.app.features.compare.feed import LIVE
from explorer.app.widgets.buttons import press_button
from explorer.app.widgets.markup import meter, swatch
from explorer.measures.catalogue import Measure, measures_in
from explorer.numerics.number_text import format_number

# The measures that begin a group of rows.
FIRSTS = (
    "volume",
    "reach",
    "least_margin",
    "least_clearance",
    "inverse_condition",
    "home_load_share",
    "yaw",
)


def table(columns: Sequence[Column], *, millimetres: bool) -> str:
    """Return the table in HTML.

    Args:
        columns: Columns of the comparison, the live design first.
        millimetres: Whether lengths are in millimetres, rather than in design units.
    """
    head = "".join(_head(column) for column in columns)
    rows = "".join(
        _row(measure, columns, millimetres=millimetres)
        for measure in measures_in("compare").values()
        if not measure.needs or any(column.has(measure) for column in columns)
    )
    return (
        f'<table class="ex-compare"><tr><td class="ex-head">{progress(columns)}</td>{head}</tr>'
        f"{rows}</table>"
    )


def progress(columns: Sequence[Column]) -> str:
    """Return how many of the designs are measured as HTML; "" once all are."""
    done = sum(column.is_current or column.problem is not None for column in columns)
    if done == len(columns):
        return ""
    share = meter(100.0 * done / len(columns), look="ex-meter is-thin")
    return f'<div class="ex-dim">measured: {done} of {len(columns)}</div>{share}'


def _head(column: Column) -> str:
    name = escape(column.design.name)
    beside = '<span class="ex-dim ex-small">as it is</span>'
    if column.number != LIVE:
        beside = _link(column, "open", "Open", f"Make {column.design.name} the live design")
        beside += _link(column, "unpin", "×", f"Unpin {column.design.name}")
    wait = "" if column.is_current else ' <span class="ex-dim">…</span>'
    # The differences to the live design have a column of their own.
    span = "" if column.number == LIVE else ' colspan="2"'
    return (
        f'<td{span} class="ex-head"><div class="ex-whole">{swatch(column.colour)}'
        f"<b>{column.letter}</b> {beside}</div>"
        f'<div class="ex-cut" title="{name}">{name}{wait}</div></td>'
    )


def _link(column: Column, act: str, words: str, hint: str) -> str:
    return press_button(
        f"compare.{act}", column.letter, words, hint=hint, label=hint, class_name="ex-link"
    )


def _row(measure: Measure, columns: Sequence[Column], *, millimetres: bool) -> str:
    values = [column.value(measure) for column in columns]
    size, best = size_of(values), best_of(measure, values)
    first = ' class="ex-first"' if measure.name in FIRSTS else ""
    unit = unit_of(measure, millimetres=millimetres)
    cells: list[str] = []
    for index, (column, value) in enumerate(zip(columns, values, strict=True)):
        live = values[0]
        change = ""
        if index and value is not None and live is not None and value != live:
            change = value_text(measure, value - live, size, signed=True)
            change = "" if change == "0" else change
        look = "ex-number is-best" if index in best else "ex-number"
        cells.append(
            f'<td class="{look}" title="{_exact_text(measure, column)}">'
            f"{_cell(measure, column, value, size)}</td>"
        )
        if index:
            cells.append(f'<td class="ex-change">{change}</td>')
    unit_html = f' <span class="ex-dim ex-small">{unit}</span>' if unit else ""
    return (
        f'<tr{first} title="{escape(hint_of(measure))}">'
        f"<td>{escape(measure.label)}{unit_html}</td>"
        f"{''.join(cells)}</tr>"
    )


def _cell(measure: Measure, column: Column, value: float | None, size: float) -> str:
    if column.measured is None:
        return "–" if column.problem is not None else "…"
    if measure.name == "volume" and not value:
        return "empty"
    if value is None:
        return "infinite" if measure.name in column.measured.infinite else "–"
    return value_text(measure, value, size)


def _exact_text(measure: Measure, column: Column) -> str:
    """Return a value in the design's own units and in millimetres."""
    value = column.own_value(measure)
    if value is None:
        return ""
    if measure.names:
        return value_text(measure, value, value)
    own = f"{format_number(value, 12)} {unit_of(measure, millimetres=False)}".strip()
    if measure.power == 0:
        return own
    scaled = value * column.design.unit_mm**measure.power
    return f"{own} = {format_number(scaled, 12)} {unit_of(measure, millimetres=True)}"
