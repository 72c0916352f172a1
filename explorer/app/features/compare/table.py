"""Designs side by side: a column for each design, its measures as a table or as bars."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from html import escape

from explorer.app.features.compare.work import LIVE, CompareFeed, drawing_in
from explorer.app.state.compared import SLOTS
from explorer.app.state.state import State
from explorer.app.widgets.buttons import press_button
from explorer.app.widgets.colours import COMPARED
from explorer.app.widgets.markup import swatch
from explorer.measures.catalogue import CATALOGUE, Measure, measures_in
from explorer.measures.measurements import Measurements
from explorer.mechanism.design import Design
from explorer.numerics.number_text import (
    LEAST_SIZE,
    MOST_SIZE,
    decimals_for,
    format_decimals,
    format_number,
)
from explorer.singularity.colours import Rgb, css

# Values that differ by a smaller share are equally good.
SAME = 1e-9
PERCENT = 100.0
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
DRAWN = (
    "volume",
    "volume_per_leg",
    "node_volume",
    "reach",
    "exact_extent_x",
    "exact_extent_y",
    "exact_extent_z",
    "least_clearance",
    "least_margin",
    "mean_margin",
    "home_margin",
    "mean_inverse_condition",
)
"""The measures that are drawn as bars, row by row."""

LOADS = ("home_load_share", "home_largest_payload", "home_largest_bending", "held_volume")
"""The measures of a further row, each drawn if a design has what it needs."""

# Number of drawings in a row.
ACROSS = 4
# Sizes in pixels: a drawing's width, heights of its title, a bar and the gap below it; widths of a
# letter and a number; the space below a drawing.
WIDTH, TITLE, BAR, GAP = 148.0, 17.0, 11.0, 3.0
LETTER, NUMBER, SPACE = 24.0, 52.0, 9.0
LONGEST = WIDTH - LETTER - NUMBER - 8.0


@dataclass(frozen=True)
class Column:
    """A design in the comparison.

    Attributes:
        number: Number of the column: 0 for the live design, from 1 for the pinned ones.
        design: The design.
        measured: Values of its measures; None until they are computed.
        factor: One unit of its lengths in units of the comparison.
        is_current: Whether no newer values are being computed.
        problem: Why something is missing; None if nothing is.
    """

    number: int
    design: Design
    measured: Measurements | None
    factor: float
    is_current: bool = True
    problem: str | None = None

    @property
    def letter(self) -> str:
        """The short name: "live", or the letter of the place."""
        return "live" if self.number == LIVE else SLOTS[self.number - 1]

    @property
    def colour(self) -> Rgb:
        """The colour of the design in tables, bars and the scene."""
        return COMPARED[self.number]

    def own_value(self, measure: Measure) -> float | None:
        """Return a value in the design's own units, shares in per cent; None if it is unknown."""
        value = None if self.measured is None else self.measured[measure.name]
        return PERCENT * value if value is not None and measure.unit == "share" else value

    def has(self, measure: Measure) -> bool:
        """Whether the design has what a measure needs, such as a load."""
        return self.measured is not None and measure.name in self.measured.values

    def value(self, measure: Measure) -> float | None:
        """Return a value in the unit of the comparison; None if it is unknown."""
        value = self.own_value(measure)
        return None if value is None else value * self.factor**measure.power


def columns_of(state: State, feeds: Sequence[CompareFeed]) -> tuple[Column, ...]:
    """Return the columns of the live design and of the pinned ones, given the feed of each."""
    columns: list[Column] = []
    unit = 1.0 if state.compared.look.millimetres else state.design.unit_mm
    designs = (state.design, *state.compared.pinned)
    for number, (design, feed) in enumerate(zip(designs, feeds, strict=True)):
        if design is not None:
            drawing = drawing_in(number, feed)
            measured = None if drawing is None else drawing.measurements
            problem = feed.problem or (None if drawing is None else drawing.problem)
            factor = design.unit_mm / unit
            columns.append(Column(number, design, measured, factor, feed.is_current, problem))
    return tuple(columns)


def notes(state: State, columns: tuple[Column, ...]) -> list[str]:
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
    others = [other for other in columns if not math.isclose(other.design.unit_mm, live.unit_mm)]
    if others:
        others_units = ", ".join(
            f"{other.letter} has {format_number(other.design.unit_mm, 6)} mm" for other in others
        )
        unit = "millimetres" if state.compared.look.millimetres else "units of the live design"
        remarks.append(
            f"One unit of the live design is {format_number(live.unit_mm, 6)} mm; {others_units}. "
            f"Lengths are in {unit}, and workspaces are drawn to true size."
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
        return format_decimals(value, 0, signed=signed)
    if size != 0.0 and not LEAST_SIZE <= size < MOST_SIZE:
        return ("+" if signed and value >= 0.0 else "") + format_number(value)
    decimals = min(MOST_DECIMALS, decimals_for(size, DIGITS)) if size > 0.0 else 1
    text = format_decimals(value, decimals, signed=signed)
    if not text.strip("0."):
        # A difference within rounding counts as none.
        least = SAME * size if signed else 0.0
        return "0" if abs(value) <= least else format_number(value, 3)
    return text


def _size_of(values: list[float | None]) -> float:
    return max((abs(value) for value in values if value is not None), default=0.0)


def _unit_of(measure: Measure, *, millimetres: bool) -> str:
    return "%" if measure.unit == "share" else measure.unit_in("mm" if millimetres else "units")


def _hint_of(measure: Measure) -> str:
    return measure.hint if measure.sense is None else f"{measure.hint}; {measure.sense} is better"


def table(columns: Sequence[Column], *, millimetres: bool) -> str:
    """Return the table in HTML, a row for each measure.

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
    return f'<table class="ex-compare"><tr><td class="ex-head"></td>{head}</tr>{rows}</table>'


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
    size, best, live = _size_of(values), best_of(measure, values), values[0]
    first = ' class="ex-first"' if measure.name in FIRSTS else ""
    unit = _unit_of(measure, millimetres=millimetres)
    cells: list[str] = []
    for index, (column, value) in enumerate(zip(columns, values, strict=True)):
        look = "ex-number is-best" if index in best else "ex-number"
        cells.append(
            f'<td class="{look}" title="{_exact_text(measure, column)}">'
            f"{_cell(measure, column, value, size)}</td>"
        )
        if index:
            change = ""
            if value is not None and live is not None and value != live:
                change = value_text(measure, value - live, size, signed=True)
            cells.append(f'<td class="ex-change">{"" if change == "0" else change}</td>')
    unit_html = f' <span class="ex-dim ex-small">{unit}</span>' if unit else ""
    return (
        f'<tr{first} title="{escape(_hint_of(measure))}">'
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
    own = f"{format_number(value, 12)} {_unit_of(measure, millimetres=False)}".strip()
    if measure.power == 0:
        return own
    scaled = value * column.design.unit_mm**measure.power
    return f"{own} = {format_number(scaled, 12)} {_unit_of(measure, millimetres=True)}"


def bars(columns: Sequence[Column], *, millimetres: bool) -> str:
    """Return some of the measures as bars from zero, an SVG; arguments as of `table`."""
    loads = [name for name in LOADS if any(column.has(CATALOGUE[name]) for column in columns)]
    drawn = (*DRAWN, *loads)
    height = TITLE + len(columns) * (BAR + GAP) + SPACE
    drawings = "".join(
        f'<g transform="translate({(index % ACROSS) * WIDTH:g},{(index // ACROSS) * height:g})">'
        f"{_drawing(CATALOGUE[name], columns, millimetres=millimetres)}</g>"
        for index, name in enumerate(drawn)
    )
    rows = -(-len(drawn) // ACROSS)
    return (
        f'<svg viewBox="0 0 {ACROSS * WIDTH:g} {rows * height:g}" width="100%" '
        'class="ex-bars" role="img" '
        f'aria-label="Measures of the designs as bars">{drawings}</svg>'
    )


def _drawing(measure: Measure, columns: Sequence[Column], *, millimetres: bool) -> str:
    values = [column.value(measure) for column in columns]
    known = [value for value in values if value is not None]
    low, high = min([0.0, *known]), max([0.0, *known])
    scale = LONGEST / (high - low) if high > low else 0.0
    zero = LETTER - low * scale
    best, size = best_of(measure, values), _size_of(values)
    unit = _unit_of(measure, millimetres=millimetres)
    arrow = {"more": " ↑", "less": " ↓", None: ""}[measure.sense]
    # How it was measured only the hint has room to say.
    label = measure.label.removesuffix(" at nodes")
    label = label.removesuffix(" at home") if measure.name in LOADS else label
    title = (
        f"<title>{escape(_hint_of(measure))}</title>"
        f'<text x="0" y="11" font-weight="600">{escape(label)}'
        f'<tspan font-weight="400" fill-opacity="0.6"> {unit}{arrow}</tspan></text>'
    )
    parts = [title]
    for index, (column, value) in enumerate(zip(columns, values, strict=True)):
        y = TITLE + index * (BAR + GAP)
        baseline = y + BAR - 2.0
        parts.append(f'<text x="0" y="{baseline:g}" fill-opacity="0.6">{column.letter}</text>')
        if value is None:
            parts.append(f'<text x="{zero + 4.0:.1f}" y="{baseline:g}" fill-opacity="0.6">–</text>')
            continue
        start, end = sorted((zero, zero + value * scale))
        weight = 700 if index in best else 400
        parts.append(
            f'<rect x="{start:.2f}" y="{y:g}" width="{max(end - start, 0.8):.2f}" '
            f'height="{BAR:g}" rx="1.5" fill="{css(column.colour)}"/>'
            f'<text x="{end + 4.0:.1f}" y="{baseline:g}" font-weight="{weight}">'
            f"{value_text(measure, value, size)}</text>"
        )
    return "".join(parts)
