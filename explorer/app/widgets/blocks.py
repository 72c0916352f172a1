"""Blocks as HTML for the panels of the page, written as strings for speed."""

from __future__ import annotations

import bisect
from collections.abc import Iterable, Iterator, Mapping
from html import escape

from explorer.app.widgets.markup import box, caption, dim, meter, row, swatch, table
from explorer.measures.blocks import block as kinds
from explorer.measures.blocks.block import UTILISATION_EDGES
from explorer.measures.position_bands import UTILISATION_COLOURS
from explorer.mechanism.rgb import BLUE, NEUTRAL, ORANGE, TEAL, VIOLET, Rgb, css
from explorer.numerics.number_text import format_decimals

KIND_COLOURS: dict[kinds.Kind, Rgb] = {"actuator": BLUE, "dimension": ORANGE}
# Between the components of a vector, which stay on one line.
COMMA = ",\N{NO-BREAK SPACE}"
# Colours of the parts of a whole.
PART_COLOURS = TEAL, VIOLET, BLUE


def render(
    blocks: Iterable[kinds.Block], acts: Mapping[str, str] | None = None, *, corner: str = ""
) -> str:
    """Return blocks as the box of a panel, with a button in its upper right corner, HTML.

    Buttons by the names that blocks have for them are HTML too; those missing are left out.
    """
    return box(corner, *(content_of(block, acts or {}) for block in blocks))


def content_of(block: kinds.Block, acts: Mapping[str, str]) -> str:
    """Return one block as HTML."""
    match block:
        case kinds.Statement():
            return "".join(_statement(block, acts))
        case kinds.Facts():
            rows = [
                row(
                    dim(escape(fact.name)),
                    f"{words_html(fact.words)} "
                    f'<span class="ex-dim ex-whole">{words_html(fact.remark)}</span> '
                    f"{acts.get(fact.act, '')}",
                    hint=fact.hint,
                )
                for fact in block.facts
                if not fact.wide
            ]
            return caption(block.title, block.hint) + table(rows)
        case kinds.Table():
            return caption(block.title, block.hint) + table(*_table(block))
        case kinds.Split():
            return _split(block)


def words_html(words: kinds.Words) -> str:
    """Return words with the numbers in them as HTML."""
    if isinstance(words, str):
        return escape(words)
    return "".join(map(_part, words))


def _part(part: str | kinds.Number | kinds.Vector | kinds.Share) -> str:
    match part:
        case str():
            return escape(part)
        case kinds.Number():
            return f"{part.text}{part.unit}"
        case kinds.Vector():
            return f"{COMMA.join(part.texts)}{part.unit}"
        case kinds.Share():
            return part.text()


def share_colour(share: float | None) -> Rgb:
    """Return the colour of a share of a limit; grey without a limit."""
    if share is None:
        return NEUTRAL
    return UTILISATION_COLOURS[bisect.bisect_left(UTILISATION_EDGES, share)]


def _statement(block: kinds.Statement, acts: Mapping[str, str]) -> Iterator[str]:
    look = f" ex-{block.look}" if block.look else ""
    if block.title:
        yield f'<div class="ex-status{look}">{words_html(block.title)}</div>'
    if block.words:
        words = f"{words_html(block.words)} {acts.get(block.act, '')}"
        title = f' title="{escape(block.hint)}"' if block.hint else ""
        yield f"<div{title}>{words if block.title else dim(words)}</div>"


def _table(block: kinds.Table) -> tuple[list[str], list[str]]:
    """Return the rows of a table, and its heads if a number has no unit."""
    cells: list[list[str]] = []
    heads: list[str] = []
    has_heads = False
    for column in block.columns:
        match column:
            case kinds.Names(head, words, wide):
                if not wide:
                    texts = map(words_html, words)
                    cells.append([*texts] if cells else [dim(text) for text in texts])
                    heads.append(head)
            case kinds.Column():
                if not column.wide:
                    pairs = zip(column.texts, column.around, strict=True)
                    cells.append([f"{before}{text}{unit}" for text, (before, unit) in pairs])
                    heads.append(column.head)
                    has_heads = has_heads or not column.unit
            case kinds.Shares(head, values):
                shares = [_share(value) for value in values]
                cells += [bar for bar, _ in shares], [text for _, text in shares]
                heads += "", head
            case kinds.Bars(lengths, bar_kinds):
                colours = [KIND_COLOURS[kind] for kind in bar_kinds]
                cells.append([*map(meter, (100.0 * length for length in lengths), colours)])
                heads.append("")
    looks = [f"ex-{look}" if look else "" for look in block.looks] or [""] * len(cells[0])
    rows = [row(*each, look=look) for *each, look in zip(*cells, looks, strict=True)]
    return rows, heads if has_heads else []


def _share(share: float | None) -> tuple[str, str]:
    """Return the bar of a share of a limit, and its words."""
    words = kinds.Share(share).text()
    if share is None:
        return "", dim(words)
    bar = meter(min(100.0, 100.0 * share), share_colour(share))
    return bar, f'<span class="ex-{kinds.Share(share).look}">{words}</span>'


def _split(block: kinds.Split) -> str:
    parts = list(zip(block.names, PART_COLOURS, block.shares, strict=True))
    bars = "".join(
        f'<span style="--share:{100.0 * share:.2f}%;--colour:{css(colour)}"></span>'
        for _, colour, share in parts
    )
    words = "".join(
        f"<span>{swatch(colour)} {name} {format_decimals(100.0 * share, 0)}&nbsp;%</span>"
        for name, colour, share in parts
    )
    return (
        f'<div class="ex-stack" title="{escape(block.hint)}">{bars}</div>'
        f'<div class="ex-flow">{words}</div>'
    )
