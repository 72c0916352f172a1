"""The HTML that panels share; `look/page.css` describes its classes."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from html import escape
from typing import Literal

from explorer.measures.blocks.block import Look
from explorer.mechanism.rgb import Rgb, css
from explorer.singularity.colours import MARGIN_COLOURS, margin_text


def by_theme(light: str, dark: str) -> str:
    """Return the CSS colour that is `light` on light pages and `dark` on dark ones."""
    return f"light-dark({light},{dark})"


def box(*parts: str) -> str:
    """Return the box of a panel's own markup."""
    return f'<div class="ex-box">{"".join(parts)}</div>'


def status(words: str, look: Look, hint: str = "") -> str:
    """Return the result of a panel in large words, with a sentence on its meaning."""
    return f'<div class="ex-status ex-{look}"{_title(hint)}>{escape(words)}</div>'


def caption(words: str, hint: str = "") -> str:
    """Return the caption of a part of a panel."""
    return f'<div class="ex-caption"{_title(hint)}>{escape(words)}</div>' if words else ""


def dim(content: str) -> str:
    """Return less important content, such as units and notes."""
    return f'<span class="ex-dim">{content}</span>'


def reading(hint: str) -> str:
    """Return the line as HTML in which a script writes what is under the pointer, else a hint."""
    return f'<div class="ex-reading ex-dim" data-hint="{escape(hint)}">{escape(hint)}</div>'


def swatch(colour: Rgb, look: str = "ex-swatch") -> str:
    """Return a mark in a colour: a square, or what another class of the stylesheet draws."""
    return f'<span class="{look}" style="--colour:{css(colour)}"></span>'


def margin_name(incidence: int) -> str:
    """Return the name of the margin with a number, 1 to 3, in its colour."""
    on_light, on_dark = margin_text(incidence)
    text, mark = by_theme(css(on_light), css(on_dark)), css(MARGIN_COLOURS[incidence - 1])
    return f'<b class="ex-margin" style="--colour:{mark};--text:{text}">δ{incidence}</b>'


def table(rows: Iterable[str], head: Sequence[str] = ()) -> str:
    """Return a table of rows made by `row`, below the names of its columns."""
    first = row(*head, look="ex-dim") if head else ""
    return f'<table class="ex-numbers">{first}{"".join(rows)}</table>'


def row(*cells: str, look: str = "", hint: str = "") -> str:
    """Return a row of a table with cells of HTML, classes of the stylesheet, and its hint."""
    classes = f' class="{look}"' if look else ""
    content = "".join(f"<td>{cell}</td>" for cell in cells)
    return f"<tr{classes}{_title(hint)}>{content}</tr>"


def ticks(*places: tuple[float, str]) -> str:
    """Return the values below a legend, each with its place from 0 to 100 %."""
    texts = "".join(
        f'<span{" class=is-end" if left == 100.0 else ""} style="--left:{left:g}%">{text}</span>'
        for left, text in places
    )
    return f'<div class="ex-ticks ex-dim ex-small">{texts}</div>'


def group(name: str, members: Sequence[str]) -> str:
    """Return a mark that makes a group, for screen readers, of as many controls after it."""
    label = escape(f"{name}: {', '.join(members)}")
    return f'<div role="group" aria-label="{label}" data-owns="{len(members)}"></div>'


def beside(count: Literal[2, 3], *, wide: bool = False) -> str:
    """Return a mark in a tab: so many controls after it stand side by side if there is room.

    If they are wide, each needs twice as much room as usual.
    """
    return f'<div class="ex-beside is-{count}{" is-wide" if wide else ""}"></div>'


def note(content: str) -> str:
    """Return a line of less important content below a control."""
    return f'<div class="ex-note ex-dim">{content}</div>'


def meter(
    percent: float,
    colour: Rgb | None = None,
    rest: Rgb | None = None,
    *,
    look: str = "ex-meter",
) -> str:
    """Return a bar filled to a percentage, with classes of the stylesheet.

    The colour of the filled part is the main one of the page if None, that of the rest grey.
    """
    colours = {"--colour": colour, "--ex-track": rest}
    set_colours = "".join(f";{name}:{css(rgb)}" for name, rgb in colours.items() if rgb)
    return f'<div class="{look}" style="--share:{percent:.2f}%{set_colours}"></div>'


def colour_strip(stops: str) -> str:
    """Return the colours of the track of the slider below, as stops of a CSS gradient."""
    return f'<div class="ex-track" style="--colours:{stops}"></div>'


def _title(hint: str) -> str:
    return f' title="{escape(hint)}"' if hint else ""


def alert(title: str, body: str) -> str:
    """Return a box that says what is wrong and what would work, below a title unless it is ""."""
    return _message("alert", "ex-alert", title, body)


def remark(title: str, body: str) -> str:
    """Return a box that says what was done instead of what was requested, titled like `alert`."""
    return _message("status", "ex-remark", title, body)


def _message(role: str, look: str, title: str, body: str) -> str:
    head = f"<b>{escape(title)}</b><br>" if title else ""
    return f'<div role="{role}" class="{look}">{head}{escape(body)}</div>'


def sentence(*messages: str) -> str:
    """Return messages, each with a capital and a full stop."""
    return " ".join(f"{m[:1].upper()}{m[1:]}{'' if m.endswith('.') else '.'}" for m in messages)
