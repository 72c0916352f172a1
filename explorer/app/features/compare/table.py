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
from explorer.app.widgets.labels import labelled
from explorer.app.widgets.markup import DIM
from explorer.measures.catalogue import Measure, measures_in

LINK = "cursor:pointer;color:var(--mantine-primary-color-filled)"
BORDER = "border-top:1px solid var(--mantine-color-default-border);"
# The measures that begin a group of rows.
FIRSTS = ("volume", "reach", "least_margin", "least_clearance", "inverse_condition", "yaw")


def table(
    columns: Sequence[Column], buttons: Sequence[tuple[str, str]], *, millimetres: bool
) -> str:
    """Return the table in HTML.

    Args:
        columns: The live design first.
        buttons: For each of `SLOTS`, the ids of the buttons that open and unpin what is there.
        millimetres: Whether lengths are in millimetres, rather than in design units.
    """
    head = "".join(_head(column, buttons) for column in columns)
    rows = "".join(
        _row(measure, columns, millimetres=millimetres)
        for measure in measures_in("compare").values()
    )
    return (
        '<table style="width:100%;border-collapse:collapse;font-size:12.5px;line-height:1.35">'
        f'<tr style="vertical-align:top"><td></td>{head}</tr>{rows}</table>'
    )


def _head(column: Column, buttons: Sequence[tuple[str, str]]) -> str:
    name = column.design.name
    beside = f'<span style="{DIM}">as it is</span>'
    if column.number != LIVE:
        opens, unpins = buttons[column.number - 1]
        beside = labelled(opens, f"Make {name} the live design", "Open", style=LINK) + labelled(
            unpins, f"Unpin {name}", "Unpin", style=f"{LINK};padding-left:8px"
        )
    wait = "" if column.is_current else f' <span style="{DIM}">…</span>'
    return (
        '<td colspan="2" style="padding:0 0 5px 10px;max-width:110px">'
        f'<div style="white-space:nowrap;overflow:hidden">{column.swatch()}<b>{column.letter}</b>'
        f'<span style="font-size:11.5px;padding-left:8px">{beside}</span></div>'
        '<div style="white-space:nowrap;overflow:hidden;text-overflow:ellipsis" '
        f'title="{escape(name, quote=True)}">{escape(name)}{wait}</div></td>'
    )


def _row(measure: Measure, columns: Sequence[Column], *, millimetres: bool) -> str:
    values = [column.value(measure) for column in columns]
    size, best = size_of(values), best_of(measure, values)
    top = BORDER if measure.name in FIRSTS else ""
    unit = unit_of(measure, millimetres=millimetres)
    cells: list[str] = []
    for index, (column, value) in enumerate(zip(columns, values, strict=True)):
        live = values[0]
        change = ""
        if index and value is not None and live is not None and value != live:
            change = value_text(measure, value - live, size, signed=True)
            change = "" if change == "0" else change
        weight = "font-weight:700;" if index in best else ""
        cells.append(
            f'<td style="text-align:right;padding-left:10px;{weight}{top}" '
            f'title="{_exact_text(measure, column)}">{_cell(measure, column, value, size)}</td>'
            f'<td style="padding-left:4px;font-size:10.5px;{DIM};{top}">{change}</td>'
        )
    unit_html = f' <span style="{DIM};font-size:11.5px">{unit}</span>' if unit else ""
    return (
        f'<tr title="{escape(hint_of(measure), quote=True)}">'
        f'<td style="white-space:nowrap;{top}">{escape(measure.label)}{unit_html}</td>'
        f"{''.join(cells)}</tr>"
    )


def _cell(measure: Measure, column: Column, value: float | None, size: float) -> str:
    if column.measured is None:
        return "–" if column.problem is not None else "…"
    if measure.name == "volume" and not value:
        return "empty"
    return "–" if value is None else value_text(measure, value, size)


def _exact_text(measure: Measure, column: Column) -> str:
    """Return a value in the design's own units and in millimetres."""
    value = column.own_value(measure)
    if value is None:
        return ""
    own = f"{value:.12g} {unit_of(measure, millimetres=False)}".strip()
    if measure.power == 0:
        return own
    scaled = value * column.design.unit_mm**measure.power
    return f"{own} = {scaled:.12g} {unit_of(measure, millimetres=True)}"
