"""Elements of HTML and SVG as trees, and blocks as such elements.

A report consists of elements only, whose text is escaped: no name in a design file can become
markup. Looks are classes of `drawing.css`, and of the report's `style.css`.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Iterator, Sequence
from typing import TypeAlias
from unicodedata import category
from xml.etree.ElementTree import Element, tostring

import numpy as np
from numpy.typing import ArrayLike

from explorer.files.packaged import packaged_file
from explorer.measures.blocks import block as kinds
from explorer.numerics.arrays import FloatArray
from explorer.numerics.number_text import format_decimals, format_number

PRECISE = 4
"""Decimals of the numbers of elements; paths with thousands of points have fewer."""

Piece: TypeAlias = "Element | str | float | None"
Cell: TypeAlias = "Piece | Sequence[Piece]"
Row: TypeAlias = tuple[Cell, ...]

# The design unit in the words of a report.
_UNITS = re.compile(r"\b(?:design )?units(?![a-z])|(?<=per )unit\b")


def element(tag: str, *pieces: Piece, **attributes: str | float | None) -> Element:
    """Return an element with pieces inside; attributes of None are left out.

    The name of an attribute may end in _, if Python reserves the word; other _ become hyphens.
    """
    result = Element(tag)
    for name, value in attributes.items():
        if value is not None:
            words = value if isinstance(value, str) else coordinate(value, PRECISE)
            result.set(name.rstrip("_").replace("_", "-"), printable(words))
    for piece in pieces:
        child = number(piece) if isinstance(piece, float | int) else piece
        if isinstance(child, Element):
            result.append(child)
        elif child is not None and len(result):
            result[-1].tail = (result[-1].tail or "") + printable(child)
        elif child is not None:
            result.text = (result.text or "") + printable(child)
    return result


def printable(text: str) -> str:
    """Return text with control characters and lone surrogates replaced, except line breaks."""
    if text.isprintable():
        return text
    return "".join(
        "\N{REPLACEMENT CHARACTER}" if category(c).startswith("C") and c != "\n" else c
        for c in text
    )


def as_html(root: Element) -> str:
    """Return an element as HTML text."""
    return tostring(root, encoding="unicode", method="html")


def coordinate(value: float, decimals: int = 2) -> str:
    """Return a rounded number in the fewest characters."""
    text = f"{value:.{decimals}f}".rstrip("0").rstrip(".")
    return "0" if text == "-0" else text


def path_of(points: FloatArray, end: str = "Z", decimals: int = 2) -> str:
    """Return points (n, 2) as the data of a path, a polygon unless `end` is empty."""
    xy = ((coordinate(x, decimals), coordinate(y, decimals)) for x, y in points.tolist())
    return "M" + "L".join(map(",".join, xy)) + end


def drawing_style() -> str:
    """Return the stylesheet of drawings."""
    return packaged_file("export/drawings", "drawing.css").read_text("utf-8")


def line(ends: ArrayLike, class_: str | None = None, *, stroke: str | None = None) -> Element:
    """Return a straight line of a drawing between two points, shape (2, 2)."""
    (x1, y1), (x2, y2) = np.asarray(ends).tolist()
    return element("line", x1=x1, y1=y1, x2=x2, y2=y2, class_=class_, stroke=stroke)


def drawing_text(
    words: str, x: float, y: float, class_: str | None = "small", *, anchor: str | None = None
) -> Element:
    """Return words that start at (x, y) in a drawing; `anchor` may be their "middle" or "end"."""
    return element("text", words, x=x, y=y, class_=class_, text_anchor=anchor)


def circle(
    at: Sequence[float], radius: float, class_: str | None = None, *, fill: str | None = None
) -> Element:
    """Return a circle of a drawing."""
    x, y = at
    return element("circle", class_=class_, cx=x, cy=y, r=radius, fill=fill)


def page_picture(
    look: str | None, label: str, *pieces: Element | None, **attributes: str | float
) -> str:
    """Return a drawing in the page as SVG text, with its class and its name for screen readers.

    Further attributes are its size, and facts that a script of the page reads.
    """
    named = {"role": "img", "aria-label": label}
    return as_html(element("svg", *pieces, class_=look, **named, **attributes))


def number(value: float, digits: int = 6, *, size: float = 0.0) -> Element:
    """Return an element with a rounded number, whose `value` is the number in full.

    A rounding error of numbers of a size is written as 0.
    """
    return figure(format_number(value, digits, size=size), value)


def figure(text: str, value: float) -> Element:
    """Return an element with a number as text, whose `value` is the number in full."""
    return element("data", text, value=repr(float(value) + 0.0))


def percentage(share: float) -> Element:
    """Return an element with a share in per cent to one decimal."""
    value = 100.0 * share
    return element("span", figure(format_decimals(value, 1), value), " %")


def range_of(values: Sequence[float], unit: str = "", digits: int = 6) -> tuple[Piece, ...]:
    """Return one number that all values are, or the least and the largest, with their unit."""
    low, high = min(values), max(values)
    least = () if low == high else (number(low, digits), " to ")
    return *least, number(high, digits), unit


def vector(values: Sequence[float], digits: int = 3) -> tuple[Piece, ...]:
    """Return the pieces of three numbers with commas between them."""
    x, y, z = (number(value, digits) for value in values)
    return x, ", ", y, ", ", z


def whole(value: int) -> Element:
    """Return an element with a whole number, its digits in groups of three."""
    return element("data", f"{value:,}".replace(",", "\N{NARROW NO-BREAK SPACE}"), value=str(value))


def table(
    heads: Sequence[str], rows: Iterable[Sequence[Cell]], align: str, caption: Piece = None
) -> Element:
    """Return a table; () stands for no headings, and a cell is one piece or several.

    The alignment has one letter per column, "<" for words and ">" for numbers.
    """

    def row_of(tag: str, cells: Sequence[Cell]) -> Element:
        row = element("tr")
        for index, (cell, side) in enumerate(zip(cells, align, strict=True)):
            pieces = cell if isinstance(cell, Sequence) and not isinstance(cell, str) else (cell,)
            is_name = tag == "td" and index == 0
            scope = "row" if is_name else "col" if tag == "th" else None
            kind = "figure" if side == ">" else None
            row.append(element("th" if is_name else tag, *pieces, scope=scope, class_=kind))
        return row

    return element(
        "table",
        None if caption is None else element("caption", caption),
        element("thead", row_of("th", heads)) if heads else None,
        element("tbody", *(row_of("td", row) for row in rows)),
    )


def name_millimetres(root: Element) -> None:
    """Name the design unit, which is 1 mm, by its name; leave out columns that say the same again.

    Design files and commands stay as they are.
    """
    for found in root.iter("table"):
        heads = [head.text or "" for head in found.iterfind("thead/tr/th")]
        for index in reversed(range(len(heads))):
            others = {_UNITS.sub(name, heads[index]) for name in ("mm", "cm")} - {heads[index]}
            same = next((other for other in others if other in heads), None)
            for row in found.iter("tr") if same else ():
                cell, other = row[index], row[heads.index(same or "")]
                # What has no length stands in the first of both columns.
                is_empty = not len(other) and not other.text
                row.remove(other if is_empty else cell)
    for each in root.iter():
        if each.tag != "pre":
            each.text = each.text and _UNITS.sub("mm", each.text)
        each.tail = each.tail and _UNITS.sub("mm", each.tail)


def paragraph(*pieces: Piece, class_: str | None = None) -> Element:
    """Return a paragraph."""
    return element("p", *pieces, class_=class_)


def illustration(drawing: Element, *caption: Piece) -> Element:
    """Return a figure: a drawing with its caption."""
    return element("figure", drawing, element("figcaption", *caption))


def elements(blocks: Iterable[kinds.Block]) -> Iterator[Element]:
    """Yield blocks as elements; hints of tables are printed in their captions."""
    for block in blocks:
        match block:
            case kinds.Statement(title, words, look):
                between = (": ",) if title and words else ()
                pieces = (*pieces_of(title), *between, *pieces_of(words))
                yield paragraph(*pieces, class_="note" if look in ("close", "beyond") else None)
            case kinds.Facts(title, facts, hint):
                rows = [(fact.name, pieces_of(fact.words), _remark(fact)) for fact in facts]
                yield table((), rows, "<><", _caption(title, hint))
            case kinds.Table():
                heads, aligns, cells = zip(*map(_column, block.columns), strict=True)
                caption = _caption(block.title, block.hint)
                yield table(heads, zip(*cells, strict=True), "".join(aligns), caption)
            case kinds.Split(title, names, shares, hint):
                rows = zip(names, map(_share, shares), strict=True)
                yield table((), rows, "<>", _caption(title, hint))


def pieces_of(words: kinds.Words) -> tuple[Piece, ...]:
    """Return words as pieces, their numbers as elements with the number in full."""
    pieces: list[Piece] = []
    for part in kinds.parts_of(words):
        match part:
            case str():
                pieces.append(part)
            case kinds.Number():
                pieces += figure(part.text, part.value), part.unit
            case kinds.Vector():
                for text, value in zip(part.texts, part.values, strict=True):
                    pieces += figure(text, value), ", "
                pieces[-1] = part.unit
            case kinds.Share():
                pieces += _share(part.value)
    return tuple(pieces)


def _remark(fact: kinds.Fact) -> tuple[Piece, ...]:
    between = "; " if fact.remark and fact.hint else ""
    return (*pieces_of(fact.remark), between, element("span", fact.hint, class_="dim"))


def _share(share: float | None) -> tuple[Piece, ...]:
    words = kinds.Share(share).text(1)
    return (words,) if share is None else (figure(words, 100.0 * share),)


def _caption(title: str, hint: str) -> Element:
    return element("span", title, element("span", hint, class_="hint") if hint else None)


def _column(
    column: kinds.Names | kinds.Column | kinds.Shares | kinds.Bars,
) -> tuple[str, str, Sequence[Cell]]:
    """Return the head of a column, the letter of its alignment, and its cells."""
    match column:
        case kinds.Names():
            return column.head, "<", [pieces_of(words) for words in column.words]
        case kinds.Column():
            return kinds.head_of(column), ">", [*_numbers(column)]
        case kinds.Shares(head, values):
            return head, ">", [_share(value) for value in values]
        case kinds.Bars(lengths, _):
            return "", "<", [_bar(length) for length in lengths]


def _numbers(column: kinds.Column) -> Iterator[Cell]:
    for text, value, (before, unit) in zip(column.texts, column.values, column.around, strict=True):
        written = figure(text, value) if math.isfinite(value) else text
        yield written if column.has_one_unit else (before, written, unit)


def _bar(length: float) -> Element:
    """Return a bar whose length is a share of the longest one."""
    bar = element("rect", x=0.0, y=0.0, width=100.0 * length, height=7.0)
    return element("svg", bar, class_="bar", viewBox="0 0 100 7", preserveAspectRatio="none")
