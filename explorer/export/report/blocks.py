"""Blocks as elements of a report."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from xml.etree.ElementTree import Element

from explorer.export.drawings.markup import Cell, Piece, Row, element, figure, paragraph, table
from explorer.measures.blocks import block as kinds


def elements(blocks: Iterable[kinds.Block]) -> Iterator[Element]:
    """Yield blocks as elements; hints of tables are printed in their captions."""
    for block in blocks:
        match block:
            case kinds.Statement(title, words, look):
                between = (": ",) if title and words else ()
                pieces = (*pieces_of(title), *between, *pieces_of(words))
                yield paragraph(*pieces, class_="note" if look in ("close", "beyond") else None)
            case kinds.Facts(title, facts, hint):
                rows: list[Row] = [
                    (fact.name, pieces_of(fact.words), _remark(fact)) for fact in facts
                ]
                yield table((), rows, align="<><", caption=_caption(title, hint))
            case kinds.Table():
                yield _table(block)
            case kinds.Split(title, names, shares, hint):
                rows = list(zip(names, map(_share, shares), strict=True))
                yield table((), rows, align="<>", caption=_caption(title, hint))


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


def _table(block: kinds.Table) -> Element:
    cells: list[Sequence[Cell]] = []
    heads: list[str] = []
    align = ""
    for column in block.columns:
        match column:
            case kinds.Names():
                cells.append([pieces_of(words) for words in column.words])
            case kinds.Column():
                cells.append([*_numbers(column)])
            case kinds.Shares(_, values):
                cells.append([_share(value) for value in values])
            case kinds.Bars(lengths, _):
                cells.append([_bar(length) for length in lengths])
        heads.append("" if isinstance(column, kinds.Bars) else kinds.head_of(column))
        align += "<" if isinstance(column, kinds.Names | kinds.Bars) else ">"
    rows = list(zip(*cells, strict=True))
    return table(heads, rows, align=align, caption=_caption(block.title, block.hint))


def _numbers(column: kinds.Column) -> Iterator[Cell]:
    for text, value, (before, unit) in zip(column.texts, column.values, column.around, strict=True):
        number = figure(text, value) if math.isfinite(value) else text
        yield number if column.has_one_unit else (before, number, unit)


def _bar(length: float) -> Element:
    """Return a bar whose length is a share of the longest one."""
    bar = element("rect", x=0.0, y=0.0, width=100.0 * length, height=7.0)
    return element("svg", bar, class_="bar", viewBox="0 0 100 7", preserveAspectRatio="none")
