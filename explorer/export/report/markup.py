"""Pieces of HTML and SVG, as trees: text is text, whatever it holds.

Everything that goes into a report is made here, so that no name in a file can become markup.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from typing import TypeAlias
from unicodedata import category
from xml.etree.ElementTree import Element, tostring

Piece: TypeAlias = "Element | str | float | None"
Cell: TypeAlias = "Piece | Sequence[Piece]"

_SUPERSCRIPTS = str.maketrans("0123456789-", "⁰¹²³⁴⁵⁶⁷⁸⁹⁻")
# Below and from here on a number is written with a power of ten.
_LEAST, _MOST = 1e-4, 1e9


def element(tag: str, *pieces: Piece, **attributes: str | float | None) -> Element:
    """Return an element with pieces inside; attributes of None are left out.

    A name of an attribute may end in _, where it is a word of Python; within it _ is a hyphen.
    """
    made = Element(tag)
    for name, value in attributes.items():
        if value is not None:
            words = value if isinstance(value, str) else coordinate(value)
            made.set(name.rstrip("_").replace("_", "-"), printable(words))
    for piece in pieces:
        add(made, piece)
    return made


def add(parent: Element, piece: Piece) -> None:
    """Put a piece at the end of an element: another one, text, or a figure."""
    if piece is None:
        return
    if isinstance(piece, float | int):
        piece = figure(piece)
    if isinstance(piece, Element):
        parent.append(piece)
    elif len(parent):
        parent[-1].tail = (parent[-1].tail or "") + printable(piece)
    else:
        parent.text = (parent.text or "") + printable(piece)


def printable(text: str) -> str:
    """Return text without what no document may hold, such as a NUL."""
    return "".join(
        "\N{REPLACEMENT CHARACTER}" if category(c).startswith("C") and c != "\n" else c
        for c in text
    )


def as_html(root: Element) -> str:
    """Return an element as HTML."""
    return tostring(root, encoding="unicode", method="html")


def power_of_ten(exponent: int) -> str:
    """Return ten to a power as people write it."""
    return f"10{str(exponent).translate(_SUPERSCRIPTS)}"


def coordinate(value: float) -> str:
    """Return a number of a drawing to a hundredth, as short as it can be."""
    text = f"{value:.2f}".rstrip("0").rstrip(".")
    return "0" if text == "-0" else text


def written(value: float, digits: int = 6) -> str:
    """Return a number for people: a true minus, and powers of ten as powers of ten."""
    if math.isnan(value):
        return "–"
    if math.isinf(value):
        return "∞" if value > 0.0 else "−∞"
    shown = float(f"{value:.{digits - 1}e}")
    if value != 0.0 and not _LEAST <= abs(shown) < _MOST:
        mantissa, _, exponent = f"{value:.{digits - 1}e}".partition("e")
        mantissa = mantissa.rstrip("0").rstrip(".")
        return f"{mantissa} × {power_of_ten(int(exponent))}".replace("-", "−")
    if abs(shown) >= 10.0**digits:
        return f"{shown:.0f}".replace("-", "−")
    return f"{value + 0.0:.{digits}g}".replace("-", "−")


def figure(value: float, digits: int = 6) -> Element:
    """Return a number as people read it, with its full value for machines."""
    return element("data", written(value, digits), value=repr(float(value) + 0.0))


def text(
    words: str, x: float, y: float, *, anchor: str = "middle", class_: str = "small"
) -> Element:
    """Return words in a drawing, at a place that is their middle, start or end."""
    return element("text", words, x=x, y=y, class_=class_, text_anchor=anchor)


def count(value: int) -> Element:
    """Return a whole number, its digits in groups of three."""
    return element("data", f"{value:,}".replace(",", "\N{NARROW NO-BREAK SPACE}"), value=str(value))


def table(
    heads: Sequence[str], rows: Iterable[Sequence[Cell]], *, align: str, caption: str | None = None
) -> Element:
    """Return a table.

    Args:
        heads: Of the columns; () for none.
        rows: Cells, each a piece or several.
        align: One letter for each column, "<" for words and ">" for figures.
        caption: Above it.
    """

    def line(tag: str, cells: Sequence[Cell]) -> Element:
        made = element("tr")
        for index, (cell, side) in enumerate(zip(cells, align, strict=True)):
            pieces = cell if isinstance(cell, Sequence) and not isinstance(cell, str) else (cell,)
            is_name = tag == "td" and index == 0
            scope = "row" if is_name else "col" if tag == "th" else None
            kind = "figure" if side == ">" else None
            made.append(element("th" if is_name else tag, *pieces, scope=scope, class_=kind))
        return made

    return element(
        "table",
        element("caption", caption) if caption else None,
        element("thead", line("th", heads)) if heads else None,
        element("tbody", *(line("td", row) for row in rows)),
    )


def paragraph(*pieces: Piece, class_: str | None = None) -> Element:
    """Return a paragraph."""
    return element("p", *pieces, class_=class_)


def illustration(drawing: Element, *caption: Piece) -> Element:
    """Return a drawing with its caption."""
    return element("figure", drawing, element("figcaption", *caption))
