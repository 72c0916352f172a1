"""Designs side by side: a row for each figure, a column for each design."""

from __future__ import annotations

from collections.abc import Sequence
from html import escape

from explorer.app.features.compare.columns import Column, best_of, size_of, told, unit_of
from explorer.app.features.compare.feed import LIVE
from explorer.app.widgets.labels import labelled
from explorer.app.widgets.markup import DIM
from explorer.optimise.figures import FIGURES, Figure

LINK = "cursor:pointer;color:var(--mantine-primary-color-filled)"
BORDER = "border-top:1px solid var(--mantine-color-default-border);"
# Rows that begin a group.
FIRSTS = ("reach", "worst margin", "clearance", "yaw of home")


def table(columns: Sequence[Column], deeds: Sequence[tuple[str, str]], *, millimetres: bool) -> str:
    """Return the table in HTML.

    Args:
        columns: The live design first.
        deeds: For each of `SLOTS`, the ids of the buttons that open and unpin what is there.
        millimetres: Whether lengths are told in millimetres, rather than in design units.
    """
    head = "".join(_head(column, deeds) for column in columns)
    rows = "".join(_row(figure, columns, millimetres=millimetres) for figure in FIGURES)
    return (
        '<table style="width:100%;border-collapse:collapse;font-size:12.5px;line-height:1.35">'
        f'<tr style="vertical-align:top"><td></td>{head}</tr>{rows}</table>'
    )


def _head(column: Column, deeds: Sequence[tuple[str, str]]) -> str:
    name = column.design.name
    beside = f'<span style="{DIM}">as it is</span>'
    if column.number != LIVE:
        opens, unpins = deeds[column.number - 1]
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


def _row(figure: Figure, columns: Sequence[Column], *, millimetres: bool) -> str:
    values = [column.value(figure) for column in columns]
    size, best = size_of(values), best_of(figure, values)
    top = BORDER if figure.name in FIRSTS or figure is FIGURES[0] else ""
    unit = unit_of(figure, millimetres=millimetres)
    cells: list[str] = []
    for index, (column, value) in enumerate(zip(columns, values, strict=True)):
        live = values[0]
        change = ""
        if index and value is not None and live is not None and value != live:
            change = told(figure, value - live, size, signed=True)
            change = "" if change == "0" else change
        weight = "font-weight:700;" if index in best else ""
        cells.append(
            f'<td style="text-align:right;padding-left:10px;{weight}{top}" '
            f'title="{_exactly(figure, column)}">{_said(figure, column, value, size)}</td>'
            f'<td style="padding-left:4px;font-size:10.5px;{DIM};{top}">{change}</td>'
        )
    said = f' <span style="{DIM};font-size:11.5px">{unit}</span>' if unit else ""
    better = {"more": "; more is better", "less": "; less is better", None: ""}[figure.better]
    return (
        f'<tr title="{escape(figure.hint + better, quote=True)}">'
        f'<td style="white-space:nowrap;{top}">{escape(figure.name)}{said}</td>'
        f"{''.join(cells)}</tr>"
    )


def _said(figure: Figure, column: Column, value: float | None, size: float) -> str:
    if column.figures is None:
        return "–" if column.problem is not None else "…"
    if figure is FIGURES[0] and not value:
        return "empty"
    return "–" if value is None else told(figure, value, size)


def _exactly(figure: Figure, column: Column) -> str:
    """Return a value in the design's own units and in millimetres."""
    value = None if column.figures is None else figure.of(column.figures)
    if value is None:
        return ""
    own = f"{value:.12g} {unit_of(figure, millimetres=False)}".strip()
    if figure.power == 0:
        return own
    scaled = value * column.design.unit_mm**figure.power
    return f"{own} = {scaled:.12g} {unit_of(figure, millimetres=True)}"
