"""Blocks as lines of text with six digits of each number."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator

from explorer.cli.output import figure, figures, table
from explorer.measures.blocks import block as kinds


def lines(blocks: Iterable[kinds.Block]) -> Iterator[str]:
    """Yield blocks as lines, each below an empty one."""
    for block in blocks:
        yield ""
        match block:
            case kinds.Statement(title, words):
                yield f"{text_of(title)}{': ' if title and words else ''}{text_of(words)}"
            case kinds.Facts(title, facts, hint):
                rows = [(fact.name, text_of(fact.words), text_of(fact.remark)) for fact in facts]
                yield from (*_title(title, hint), table(rows, "<<<"))
            case kinds.Table(title, _, hint, _):
                yield from (*_title(title, hint), _table(block))
            case kinds.Split(title, names, shares):
                parts = (
                    f"{name} {_share(share)}" for name, share in zip(names, shares, strict=True)
                )
                yield f"{title}: {', '.join(parts)}"


def text_of(words: kinds.Words) -> str:
    """Return words with the numbers in them as text."""
    return "".join(map(_part, kinds.parts_of(words)))


def _part(part: str | kinds.Number | kinds.Vector | kinds.Share) -> str:
    match part:
        case str():
            return part
        case kinds.Number():
            return f"{_figure(part.value, part.size or part.span, '∞')}{part.unit}"
        case kinds.Vector():
            return f"{'  '.join(figures(part.values))}{part.unit}"
        case kinds.Share():
            return _share(part.value)


def _share(share: float | None) -> str:
    return kinds.Share(share).text(1).replace("\N{NO-BREAK SPACE}", " ").replace("∞", "infinite")


def _figure(value: float, size: float, infinite: str) -> str:
    return figure(value, size) if math.isfinite(value) else infinite.replace("∞", "infinite")


def _title(title: str, hint: str) -> Iterator[str]:
    yield title
    if hint:
        yield hint


def _table(block: kinds.Table) -> str:
    """Return a table without its bars."""
    columns: list[list[str]] = []
    align = ""
    for column in block.columns:
        match column:
            case kinds.Names(_, words, _):
                cells = [text_of(each) for each in words]
            case kinds.Column():
                cells = [_figure(value, column.size, column.infinite) for value in column.values]
                if not column.has_one_unit:
                    around = zip(column.around, cells, strict=True)
                    cells = [f"{before}{text}{unit}" for (before, unit), text in around]
            case kinds.Shares(_, values):
                cells = [_share(value) for value in values]
            case kinds.Bars():
                continue
        columns.append([kinds.head_of(column), *cells])
        align += "<" if isinstance(column, kinds.Names) else ">"
    return table(list(zip(*columns, strict=True)), align)
