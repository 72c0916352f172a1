"""Blocks: an answer as plain values, which the page, a report and the command line print.

A function of a value yields the blocks that tell it, so that a word, a unit or a number of digits
is written once. Each of the three has one renderer of blocks: `explorer.app.widgets.blocks`,
`explorer.export.drawings.markup` and `explorer.cli.output`. The page has room for few columns: it
leaves out what is `wide`, and shows a hint where a pointer rests; the others print the hints of
tables. The command line writes six digits of each number, whatever its digits here.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Literal, TypeAlias

import msgspec

from explorer.numerics.number_text import (
    Unit,
    format_column,
    format_decimals,
    format_fitted,
    format_number,
)

Look = Literal["within", "close", "beyond"]
"""Whether a value keeps its bounds, is close to them, or beyond."""

Kind = Literal["actuator", "dimension"]
"""The meaning of a bar, which the page shows in its colour."""

UTILISATION_EDGES = (0.25, 0.5, 0.75, 1.0)
"""Ends of the bands of utilisation of a limit; the last one is the limit."""

CLOSE = UTILISATION_EDGES[-2]
"""Utilisation of a limit from which a load is close to it."""
# Largest share that is told as a number, and distance from the limit up to which with a decimal.
MOST_SHARE, NEAR = 1e4, 0.005


class Number(msgspec.Struct, frozen=True):
    """A number with its unit.

    Attributes:
        value: The number.
        unit: Its unit, with the blank before it if there is one.
        digits: Number of significant digits.
        size: Magnitude of the numbers from which it was computed, see `drop_rounding`.
        span: Size of the largest number expected, which alone sets the decimals, so that the
            number holds still while it changes; 0 for as many as the number needs.
    """

    value: float
    unit: str = ""
    digits: int = 4
    size: float = 0.0
    span: float = 0.0

    @property
    def text(self) -> str:
        """The number for people, without its unit."""
        if self.span:
            return format_fitted(self.value, self.span, self.digits, infinite="∞")
        return format_number(self.value, self.digits, size=self.size, infinite="∞")


class Vector(msgspec.Struct, frozen=True):
    """Components of a vector with their unit, which begins with a blank if there is one.

    The digits are significant ones of the largest component; the span is as for a `Number`.
    """

    values: Sequence[float]
    unit: str = ""
    digits: int = 3
    span: float = 0.0

    @property
    def texts(self) -> list[str]:
        """The components for people, without their unit."""
        return Column("", self.values, digits=self.digits, span=self.span).texts


def quantity(value: float, unit: Unit, digits: int = 4, *, size: float = 0.0) -> Number:
    """Return a number in a unit, given the value and the size in design units."""
    return Number(unit.factor * value, f" {unit.name}", digits, unit.factor * size)


def direction(values: Sequence[float]) -> Vector:
    """Return a unit vector with two decimals."""
    return Vector(values, digits=2, span=0.5)


class Share(msgspec.Struct, frozen=True):
    """The utilisation of a limit, of which 1 is the limit; None without a limit."""

    value: float | None

    @property
    def look(self) -> Look | None:
        """Whether it is within the limit, close to it, or beyond; None without a limit."""
        if self.value is None:
            return None
        return "beyond" if self.value > 1.0 else "close" if self.value > CLOSE else "within"

    def text(self, decimals: int = 0) -> str:
        """Return it in per cent, with a decimal near the limit; one beyond the limit says so."""
        if self.value is None:
            return "no limit"
        if not self.value < MOST_SHARE:
            return "∞"
        if abs(self.value - 1.0) < NEAR:
            decimals = max(decimals, 1)
        words = f"{format_decimals(100.0 * self.value, decimals)}\N{NO-BREAK SPACE}%"
        is_limit = words.startswith("100.") and not words[4:].strip("0\N{NO-BREAK SPACE}%")
        return f"above {words}" if self.value > 1.0 and is_limit else words


Part: TypeAlias = "str | Number | Vector | Share"
Words: TypeAlias = "str | tuple[Part, ...]"


class Names(msgspec.Struct, frozen=True):
    """A column of words; it is wide if it needs more room than the page has."""

    head: str
    words: Sequence[Words]
    wide: bool = False


class Column(msgspec.Struct, frozen=True):
    """A column of numbers with equal decimals.

    Attributes:
        head: Its head.
        values: Its cells.
        unit: Unit of all cells, or that of each, with the blank before it if there is one.
        digits: Number of significant digits of the largest one.
        size: Magnitude of the numbers from which they were computed, see `drop_rounding`.
        span: As for a `Number`.
        before: Sign before each number, such as "± ".
        infinite: Word for infinity.
        wide: Whether it needs more room than the page has.
        hint: Sentence on what it is.
    """

    head: str
    values: Sequence[float]
    unit: str | Sequence[str] = ""
    digits: int = 4
    size: float = 0.0
    span: float = 0.0
    before: str = ""
    infinite: str = "∞"
    wide: bool = False
    hint: str = ""

    @property
    def texts(self) -> list[str]:
        """The cells for people, without their units; equal units have equal decimals."""
        if self.span:
            return [
                format_fitted(value, self.span, self.digits, infinite=self.infinite)
                for value in self.values
            ]
        if isinstance(self.unit, str):
            return format_column(self.values, self.digits, size=self.size, infinite=self.infinite)
        texts = [""] * len(self.values)
        for unit in {*self.unit}:
            rows = [row for row, each in enumerate(self.unit) if each == unit]
            part = msgspec.structs.replace(
                self, values=[self.values[row] for row in rows], unit=unit
            )
            for row, text in zip(rows, part.texts, strict=True):
                texts[row] = text
        return texts

    @property
    def around(self) -> list[tuple[str, str]]:
        """The texts before and behind each number: sign and unit, unless it is infinite."""
        units = [self.unit] * len(self.values) if isinstance(self.unit, str) else self.unit
        return [
            (self.before, unit) if math.isfinite(value) else ("", "")
            for value, unit in zip(self.values, units, strict=True)
        ]

    @property
    def has_one_unit(self) -> bool:
        """Whether the head can have the unit of all cells."""
        return isinstance(self.unit, str)


class Shares(msgspec.Struct, frozen=True):
    """A column of utilisations of limits, each beside a bar; None without a limit."""

    head: str
    values: Sequence[float | None]


class Bars(msgspec.Struct, frozen=True):
    """A column of bars: their lengths, 0 to 1, and what each stands for."""

    lengths: Sequence[float]
    kinds: Sequence[Kind]


class Table(msgspec.Struct, frozen=True):
    """A table, of which the first column names the rows.

    Attributes:
        title: Its title.
        columns: Its columns, all of one length; the page shows heads only above numbers without
            a unit.
        hint: Sentences on what it shows.
        looks: What each row says of bounds, which the page shows in its colour; () if nothing.
    """

    title: str
    columns: Sequence[Names | Column | Shares | Bars]
    hint: str = ""
    looks: Sequence[Look | None] = ()


class Fact(msgspec.Struct, frozen=True):
    """A thing with its name: what is known of it, more of it, and a sentence on what it is.

    The button that stands beside it on the page has a name; it is wide if it needs more room than
    the page has.
    """

    name: str
    words: Words
    remark: Words = ""
    hint: str = ""
    act: str = ""
    wide: bool = False


class Facts(msgspec.Struct, frozen=True):
    """Facts below a title."""

    title: str
    facts: Sequence[Fact]
    hint: str = ""

    def add(self, *facts: Fact) -> Facts:
        """Return these facts with others below them."""
        return Facts(self.title, (*self.facts, *facts), self.hint)


class Statement(msgspec.Struct, frozen=True):
    """A result in a few words, "" for none, and a sentence on it.

    Its look says whether something keeps its bounds; the hint is more of it, and `act` the name of
    the button that stands beside the sentence on the page.
    """

    title: Words
    words: Words = ""
    look: Look | None = None
    hint: str = ""
    act: str = ""


class Split(msgspec.Struct, frozen=True):
    """Parts that make a whole, which is the title: their names, and the share of each."""

    title: str
    names: Sequence[str]
    shares: Sequence[float]
    hint: str = ""


Block: TypeAlias = "Statement | Facts | Table | Split"


def parts_of(words: Words) -> tuple[Part, ...]:
    """Return the parts of words."""
    return (words,) if isinstance(words, str) else words


def head_of(column: Names | Column | Shares) -> str:
    """Return the head of a column with its unit, if all cells have one."""
    if isinstance(column, Column) and isinstance(column.unit, str) and column.unit:
        return f"{column.head}, {column.before}{column.unit.strip()}"
    return column.head
