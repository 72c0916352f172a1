"""What the table and the bars of a comparison have in common: columns, and values in one unit."""

from __future__ import annotations

import math
from dataclasses import dataclass
from html import escape

from explorer.app.features.compare.feed import LIVE, CompareFeed
from explorer.app.features.optimise.words import decimals_of
from explorer.app.state.compared import SLOTS
from explorer.app.state.state import State
from explorer.app.widgets.colours import COMPARED, Rgb, css
from explorer.app.widgets.markup import LEAST, MOST, format_number
from explorer.mechanism.design import Design
from explorer.optimise.figures import Figure, Figures

# Values that differ by a smaller share are as good as each other.
SAME = 1e-9


@dataclass(frozen=True)
class Column:
    """A design that is compared.

    Attributes:
        number: 0 for the live one, from 1 for those that are pinned.
        design: The design.
        figures: What is known of it.
        factor: By what its lengths are multiplied to be in the unit of the comparison.
        is_current: Whether nothing newer is on its way.
        problem: Why something is missing, None if nothing is.
    """

    number: int
    design: Design
    figures: Figures | None
    factor: float
    is_current: bool = True
    problem: str | None = None

    @property
    def letter(self) -> str:
        """What it is called in short."""
        return "live" if self.number == LIVE else SLOTS[self.number - 1]

    @property
    def colour(self) -> Rgb:
        """Its own."""
        return COMPARED[self.number]

    def value(self, figure: Figure) -> float | None:
        """Return a figure in the unit of the comparison, None if it has none."""
        value = None if self.figures is None else figure.of(self.figures)
        return None if value is None else value * self.factor**figure.power

    def swatch(self) -> str:
        """Return a square of its colour, as HTML."""
        return (
            '<span style="display:inline-block;width:10px;height:10px;border-radius:2px;'
            f'background:{css(self.colour)};margin-right:5px;vertical-align:-1px"></span>'
        )


def columns_of(state: State, feed: CompareFeed) -> tuple[Column, ...]:
    """Return the live design and those that are pinned, with what is known of them."""
    found: list[Column] = []
    for number, design in enumerate((state.design, *state.compared.pinned)):
        if design is None:
            continue
        drawing = feed.drawing(number)
        unit = 1.0 if state.compared.look.millimetres else state.design.unit_mm
        found.append(
            Column(
                number=number,
                design=design,
                figures=None if drawing is None else drawing.figures,
                factor=design.unit_mm / unit,
                is_current=feed.is_current(number),
                problem=feed.problem(number) or (None if drawing is None else drawing.problem),
            )
        )
    return tuple(found)


def unit_of(figure: Figure, *, millimetres: bool) -> str:
    """Return the unit in which a figure is told."""
    if figure.power == 0:
        return figure.unit
    return ("mm" if millimetres else "units") + ("³" if figure.power == 3 else "")


def best_of(figure: Figure, values: list[float | None]) -> set[int]:
    """Return the indices of the best values, none where all are as good or better means nothing."""
    known = [value for value in values if value is not None]
    if figure.better is None or len(known) < 2:
        return set()
    best = max(known) if figure.better == "more" else min(known)
    near = SAME * max(map(abs, known))
    found = {k for k, value in enumerate(values) if value is not None and abs(value - best) <= near}
    return found if len(found) < len(known) else set()


def told(figure: Figure, value: float, size: float, *, signed: bool = False) -> str:
    """Return a value with as many decimals as the largest one of its row has room for."""
    if figure.is_whole:
        text = f"{value:+,.0f}" if signed else f"{value:,.0f}"
        return text.replace(",", "\N{NARROW NO-BREAK SPACE}").replace("-", "−")
    if size != 0.0 and not LEAST <= size < MOST:
        return ("+" if signed and value >= 0.0 else "") + format_number(value)
    digits = decimals_of(size)
    text = f"{value:+.{digits}f}" if signed else f"{value:.{digits}f}"
    if float(text) == 0.0:
        # A difference by rounding is none.
        least = SAME * size if signed else 0.0
        return "0" if abs(value) <= least else format_number(value, 3)
    return text.replace("-", "−")


def size_of(values: list[float | None]) -> float:
    """Return the size of the largest of some values."""
    return max((abs(value) for value in values if value is not None), default=0.0)


def notes(state: State, columns: tuple[Column, ...]) -> list[str]:
    """Return what is to be known of a comparison besides its figures, as HTML."""
    found: list[str] = []
    live = state.design
    for column in columns:
        who = escape(f"{column.letter} ({column.design.name})")
        if column.problem is not None:
            found.append(f"{who}: {escape(column.problem)}.")
        if column.figures is not None and column.figures.empty_because:
            causes = ", ".join(map(escape, column.figures.empty_because))
            found.append(f"{who} has an empty workspace; emptied by: {causes}.")
    others = [each for each in columns if not math.isclose(each.design.unit_mm, live.unit_mm)]
    if others:
        units = ", ".join(f"{each.letter} has {each.design.unit_mm:.6g} mm" for each in others)
        told_in = "millimetres" if state.compared.look.millimetres else "units of the live design"
        found.append(
            f"One unit of the live design is {live.unit_mm:.6g} mm; {units}. Lengths are told in "
            f"{told_in}, and workspaces are drawn to true size."
        )
    return found
