"""Elements of HTML and SVG as trees.

A report consists of elements only, whose text is escaped: no name in a design file can become
markup. Looks are classes of `style.css`.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import TypeAlias
from unicodedata import category
from xml.etree.ElementTree import Element, tostring

from explorer.numerics.number_text import format_decimals, format_number

Piece: TypeAlias = "Element | str | float | None"
Cell: TypeAlias = "Piece | Sequence[Piece]"
Row: TypeAlias = tuple[Cell, ...]


def element(tag: str, *pieces: Piece, **attributes: str | float | None) -> Element:
    """Return an element with pieces inside; attributes of None are left out.

    The name of an attribute may end in _, if Python reserves the word; other _ become hyphens.
    """
    result = Element(tag)
    for name, value in attributes.items():
        if value is not None:
            words = value if isinstance(value, str) else coordinate(value)
            result.set(name.rstrip("_").replace("_", "-"), printable(words))
    for piece in pieces:
        add(result, piece)
    return result


def add(parent: Element, piece: Piece) -> None:
    """Append a piece to an element: an element, text, or a number."""
    if piece is None:
        return
    if isinstance(piece, float | int):
        piece = number(piece)
    if isinstance(piece, Element):
        parent.append(piece)
    elif len(parent):
        parent[-1].tail = (parent[-1].tail or "") + printable(piece)
    else:
        parent.text = (parent.text or "") + printable(piece)


def printable(text: str) -> str:
    """Return text with control characters and lone surrogates replaced, except line breaks."""
    return "".join(
        "\N{REPLACEMENT CHARACTER}" if category(c).startswith("C") and c != "\n" else c
        for c in text
    )


def as_html(root: Element) -> str:
    """Return an element as HTML text."""
    return tostring(root, encoding="unicode", method="html")


def coordinate(value: float) -> str:
    """Return a number rounded to a hundredth, in the fewest characters."""
    text = f"{value:.2f}".rstrip("0").rstrip(".")
    return "0" if text == "-0" else text


def number(value: float, digits: int = 6) -> Element:
    """Return an element with a rounded number, whose `value` is the number in full."""
    return figure(format_number(value, digits), value)


def figure(text: str, value: float) -> Element:
    """Return an element with a number as text, whose `value` is the number in full."""
    return element("data", text, value=repr(float(value) + 0.0))


def percentage(share: float) -> Element:
    """Return an element with a share in per cent to one decimal."""
    value = 100.0 * share
    return element("span", element("data", format_decimals(value, 1), value=repr(value)), " %")


def drawing_text(
    words: str, x: float, y: float, *, anchor: str = "middle", class_: str = "small"
) -> Element:
    """Return words in a drawing; `anchor` says whether (x, y) is their middle, start or end."""
    return element("text", words, x=x, y=y, class_=class_, text_anchor=anchor)


def ends(low: float, high: float) -> Cell:
    """Return the pieces of a range of numbers."""
    return number(low), " to ", number(high)


def range_of(values: Sequence[float], unit: str, digits: int = 4) -> Cell:
    """Return one number that all values are, or the least and the largest, with their unit."""
    low, high = min(values), max(values)
    if low == high:
        return number(low, digits), f" {unit}"
    return number(low, digits), " to ", number(high, digits), f" {unit}"


def vector(values: Sequence[float], digits: int = 3) -> tuple[Piece, ...]:
    """Return the pieces of three numbers with commas between them."""
    x, y, z = (number(value, digits) for value in values)
    return x, ", ", y, ", ", z


def whole(value: int) -> Element:
    """Return an element with a whole number, its digits in groups of three."""
    return element("data", f"{value:,}".replace(",", "\N{NARROW NO-BREAK SPACE}"), value=str(value))


def table(
    heads: Sequence[str], rows: Iterable[Sequence[Cell]], *, align: str, caption: Piece = None
) -> Element:
    """Return a table.

    Args:
        heads: Headings of the columns; () for none.
        rows: Rows of cells; a cell is one piece or several.
        align: One letter per column, "<" for words and ">" for numbers.
        caption: Caption above the table.
    """

    def line(tag: str, cells: Sequence[Cell]) -> Element:
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
        element("thead", line("th", heads)) if heads else None,
        element("tbody", *(line("td", row) for row in rows)),
    )


def paragraph(*pieces: Piece, class_: str | None = None) -> Element:
    """Return a paragraph."""
    return element("p", *pieces, class_=class_)


def illustration(drawing: Element, *caption: Piece) -> Element:
    """Return a figure: a drawing with its caption."""
    return element("figure", drawing, element("figcaption", *caption))
