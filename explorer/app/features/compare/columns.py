"""The columns of a comparison: its designs, with the values of their measures in one unit."""

from __future__ import annotations

import math
from dataclasses import dataclass
from html import escape

from explorer.app.features.compare.feed import LIVE, CompareFeed
from explorer.app.features.optimise.words import decimals_of
from explorer.app.state.compared import SLOTS
from explorer.app.state.state import State
from explorer.app.widgets.colours import COMPARED, Rgb
from explorer.measures.catalogue import Measure
from explorer.measures.measurements import Measurements
from explorer.mechanism.design import Design
from explorer.numerics.number_text import LEAST_SIZE, MOST_SIZE, format_decimals, format_number

# Values that differ by a smaller share are equally good.
SAME = 1e-9
PERCENT = 100.0


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
        """Return whether the design has what a measure needs, such as a load."""
        return self.measured is not None and measure.name in self.measured.values

    def value(self, measure: Measure) -> float | None:
        """Return a value in the unit of the comparison; None if it is unknown."""
        value = self.own_value(measure)
        return None if value is None else value * self.factor**measure.power


def columns_of(state: State, feed: CompareFeed) -> tuple[Column, ...]:
    """Return the columns of the live design and of the pinned ones."""
    columns: list[Column] = []
    for number, design in enumerate((state.design, *state.compared.pinned)):
        if design is None:
            continue
        drawing = feed.drawing(number)
        unit = 1.0 if state.compared.look.millimetres else state.design.unit_mm
        columns.append(
            Column(
                number=number,
                design=design,
                measured=None if drawing is None else drawing.measurements,
                factor=design.unit_mm / unit,
                is_current=feed.is_current(number),
                problem=feed.problem(number) or (None if drawing is None else drawing.problem),
            )
        )
    return tuple(columns)


def unit_of(measure: Measure, *, millimetres: bool) -> str:
    """Return the unit in which a comparison writes a measure."""
    return "%" if measure.unit == "share" else measure.unit_in("mm" if millimetres else "units")


def hint_of(measure: Measure) -> str:
    """Return what a measure means, and whether more or less of it is better."""
    return measure.hint if measure.sense is None else f"{measure.hint}; {measure.sense} is better"


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
    text = format_decimals(value, decimals_of(size), signed=signed)
    if not text.strip("0."):
        # A difference within rounding counts as none.
        least = SAME * size if signed else 0.0
        return "0" if abs(value) <= least else format_number(value, 3)
    return text


def size_of(values: list[float | None]) -> float:
    """Return the largest absolute value; 0 if all are unknown."""
    return max((abs(value) for value in values if value is not None), default=0.0)


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
