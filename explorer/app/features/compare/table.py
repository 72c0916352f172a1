"""Designs side by side: a column for each design, a row for each measure."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from html import escape

from explorer.app.features.compare.work import (
    LIVE,
    NAMES,
    Comparable,
    CompareFeed,
    design_in,
    drawing_in,
)
from explorer.app.scene.shapes import COMPARED
from explorer.app.state.state import State
from explorer.app.widgets import markup
from explorer.app.widgets.buttons import press_button
from explorer.measures.blocks.block import Look
from explorer.measures.catalogue import Measure, MeasureValues, measures_in
from explorer.mechanism.design import Design
from explorer.mechanism.rgb import Rgb
from explorer.numerics import number_text
from explorer.numerics.number_text import Unit
from explorer.six_legged.case import OF_TABLES, is_upper_bound
from explorer.six_legged.table import SixLegged

# Values that differ by a smaller share are equally good.
SAME = 1e-9
PER_CENT = Unit("%", 100.0)
# Digits of the largest value of a row, of which four are decimals at most.
DIGITS, MOST_DECIMALS = 6, 4
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


@dataclass(frozen=True)
class ComparedDesign:
    """A design or a table in the comparison, by the number of its column; 0 is the live design.

    Its measures are None until they are computed. The unit of lengths has one name in all
    columns, and the problem says why something is missing.
    """

    number: int
    design: Comparable
    measured: MeasureValues | None
    unit: Unit
    is_current: bool = True
    problem: str | None = None

    @property
    def letter(self) -> str:
        """The short name: "live", or the letter of the place."""
        return NAMES[self.number]

    @property
    def colour(self) -> Rgb:
        """The colour of the design in tables and the scene."""
        return COMPARED[self.number]

    def own_value(self, measure: Measure) -> float | None:
        """Return a value in the design's own units, rounding as 0; None if it is unknown."""
        value = None if self.measured is None else self.measured[measure.name]
        size = self.design.reach**measure.power if measure.power else 0.0
        return None if value is None else number_text.drop_rounding(value, size)

    def has(self, measure: Measure) -> bool:
        """Whether the design has what a measure needs, such as a load."""
        return self.measured is not None and measure.name in self.measured.values

    def value(self, measure: Measure) -> float | None:
        """Return a value in the unit of the comparison; None if it is unknown."""
        value = self.own_value(measure)
        return None if value is None else value * self.unit_of(measure).factor

    def unit_of(self, measure: Measure) -> Unit:
        """Return the unit in which a measure is shown."""
        return PER_CENT if measure.unit == "share" else measure.unit_in(self.unit, math.inf)


def columns_of(state: State, feeds: Sequence[CompareFeed]) -> tuple[ComparedDesign, ...]:
    """Return the columns of the live design and of the pinned ones, given the feed of each."""
    columns: list[ComparedDesign] = []
    for number, feed in enumerate(feeds):
        design = design_in(number, state)
        if design is not None:
            drawing = drawing_in(number, feed)
            measured = None if drawing is None else drawing.measurements
            problem = feed.problem or (None if drawing is None else drawing.problem)
            ratio = design.unit_mm / state.design.unit_mm
            unit = Unit(state.unit.name, state.unit.factor * ratio)
            columns.append(ComparedDesign(number, design, measured, unit, feed.is_current, problem))
    return tuple(columns)


def notes(state: State, columns: tuple[ComparedDesign, ...]) -> list[str]:
    """Return remarks on a comparison: problems, empty workspaces, other units, as HTML."""
    remarks: list[str] = []
    live = state.design
    for column in columns:
        who = escape(f"{column.letter} ({column.design.name})")
        if column.problem is not None:
            remarks.append(f"{who}: {escape(column.problem)}.")
        if column.measured is not None and column.measured.empty_because:
            causes = ", ".join(map(escape, column.measured.empty_because))
            remarks.append(f"{who} has an empty workspace; emptied by: {causes}.")
        if isinstance(column.design, SixLegged) and column.design.source:
            remarks.append(f"{who}: {escape(column.design.source.rstrip('.'))}.")
    if any(isinstance(column.design, SixLegged) for column in columns):
        remarks.append(OF_TABLES)
    if state.view.lengths != "mm" and len({column.design.unit_mm for column in columns}) > 1:
        remarks.append(
            "Lengths are in units of the live design, of "
            f"{live.millimetres.text(1.0)}, and workspaces are drawn to true size."
        )
    return remarks


def best_of(measure: Measure, values: list[float | None]) -> set[int]:
    """Return the indices of the best values; none if all are equal or no value is better."""
    known = [value for value in values if value is not None]
    if measure.sense is None or len(known) < 2:
        return set()
    best = max(known) if measure.sense == "more" else min(known)
    same = SAME * max(map(abs, known))
    equal = {k for k, value in enumerate(values) if value is not None and abs(value - best) <= same}
    return equal if len(equal) < len(known) else set()


def value_text(measure: Measure, value: float, size: float, *, signed: bool = False) -> str:
    """Return a value with the decimals that suit a size, the largest value of its row.

    A value that stands for a thing reads as its name, and a difference of such values as nothing.
    """
    if measure.names:
        return "" if signed else measure.names[round(value) - 1]
    if measure.is_whole:
        return number_text.format_decimals(value, 0, signed=signed)
    if size != 0.0 and not number_text.LEAST_SIZE <= size < number_text.MOST_SIZE:
        return ("+" if signed and value >= 0.0 else "") + number_text.format_number(value)
    decimals = min(MOST_DECIMALS, number_text.decimals_for(size, DIGITS)) if size > 0.0 else 1
    text = number_text.format_decimals(value, decimals, signed=signed)
    if not text.strip("0."):
        # A difference within rounding counts as none.
        least = SAME * size if signed else 0.0
        return "0" if abs(value) <= least else number_text.format_number(value, 3)
    return text


def _hint_of(measure: Measure) -> str:
    return measure.hint if measure.sense is None else f"{measure.hint}; {measure.sense} is better"


def table(columns: Sequence[ComparedDesign]) -> str:
    """Return the table in HTML, a row for each measure; the live design is the first column.

    Beside tables alone, the measures that only designs have are left out.
    """
    are_tables = len(columns) > 1 and all(isinstance(c.design, SixLegged) for c in columns[1:])
    head = "".join(_head(column) for column in columns)
    rows = "".join(
        measure_row(measure, columns, look="ex-first" if measure.name in FIRSTS else "")
        for measure in measures_in("compare").values()
        if (not measure.needs or any(column.has(measure) for column in columns))
        and (measure.for_tables or not are_tables)
    )
    return f'<table class="ex-compare"><tr><td class="ex-head"></td>{head}</tr>{rows}</table>'


def _head(column: ComparedDesign) -> str:
    name = escape(column.design.name)
    beside = '<span class="ex-dim ex-small">as it is</span>'
    if column.number != LIVE:
        beside = ""
        if isinstance(column.design, Design):
            beside = _link(column, "open", "Open", f"Make {column.design.name} the live design")
        beside += _link(column, "unpin", "×", f"Unpin {column.design.name}")
    wait = "" if column.is_current else ' <span class="ex-dim">…</span>'
    # The differences to the live design have a column of their own.
    span = "" if column.number == LIVE else ' colspan="2"'
    return (
        f'<td{span} class="ex-head"><div class="ex-whole">{markup.swatch(column.colour)}'
        f"<b>{column.letter}</b> {beside}</div>"
        f'<div class="ex-cut" title="{name}">{name}{wait}</div></td>'
    )


def _link(column: ComparedDesign, act: str, words: str, hint: str) -> str:
    return press_button(
        f"compare.{act}", column.letter, words, hint=hint, label=hint, class_name="ex-link"
    )


def measure_row(
    measure: Measure,
    columns: Sequence[ComparedDesign],
    *,
    label: str = "",
    hint: str = "",
    look: str = "",
    change: Look | None = None,
) -> str:
    """Return the row of a measure in HTML: its values, and beside each its change from the first.

    Name and meaning of the row are those of the measure if "". `look` has its classes of the
    stylesheet; `change` tells whether the changes keep or break a demand, where that is
    defined.
    """
    values = [column.value(measure) for column in columns]
    best, first = best_of(measure, values), values[0]
    size = max((abs(value) for value in values if value is not None), default=0.0)
    cells: list[str] = []
    for index, (column, value) in enumerate(zip(columns, values, strict=True)):
        is_bound = is_upper_bound(column.design, measure)
        mark = "ex-number is-best" if index in best and not is_bound else "ex-number"
        cells.append(
            f'<td class="{mark}" title="{_exact_text(measure, column)}">'
            f"{_cell(measure, column, value, size)}</td>"
        )
        if index:
            text = ""
            if value is not None and first is not None and value != first and not is_bound:
                text = value_text(measure, value - first, size, signed=True)
            text = f'<span class="ex-{change}">{text}</span>' if change else text
            cells.append(
                f'<td class="ex-change ex-dim ex-small">{"" if text == "0" else text}</td>'
            )
    unit = columns[0].unit_of(measure).name
    unit_html = f' <span class="ex-dim ex-small">{unit}</span>' if unit else ""
    return (
        f'<tr class="{look}" title="{escape(hint or _hint_of(measure))}">'
        f"<td>{escape(label or measure.label)}{unit_html}</td>{''.join(cells)}</tr>"
    )


def _cell(measure: Measure, column: ComparedDesign, value: float | None, size: float) -> str:
    if column.measured is None:
        return "–" if column.problem is not None else "…"
    if measure.name == "volume" and not value:
        return "empty"
    if value is None:
        return "infinite" if measure.name in column.measured.infinite else "–"
    text = value_text(measure, value, size)
    return f"≤ {text}" if is_upper_bound(column.design, measure) else text


def _exact_text(measure: Measure, column: ComparedDesign) -> str:
    """Return a value in the design's own units and in millimetres."""
    value = column.own_value(measure)
    if value is None:
        return ""
    if measure.names:
        return value_text(measure, value, value)
    if measure.power == 0:
        return column.unit_of(measure).text(value, 12)
    size, units = column.design.reach**3, (column.design.millimetres,)
    # The unit of a table is the millimetre.
    if isinstance(column.design, Design):
        units = (number_text.UNITS, *units)
    return " = ".join(unit.to_power(measure.power, size).text(value, 12) for unit in units)
