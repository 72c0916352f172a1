"""The few pieces of HTML that the panels share; they follow the light and the dark theme."""

from __future__ import annotations

import math
from html import escape

from explorer.app.widgets.colours import OUTLINE, css
from explorer.numerics.number_text import drop_rounding, format_fixed, format_number, set_true_minus


def by_theme(light: str, dark: str) -> str:
    """Return the colour of CSS that is one on light pages and another on dark ones."""
    return f"light-dark({light},{dark})"


# On light panels and on dark ones, each legible there.
GREY = ("#5f666e", "#a3a9b1")
GREEN = ("#1f7a4a", "#5fca90")
RED = ("#c43408", "#ff8f66")
AMBER = ("#96590a", "#f0b04c")

DIM = "color:var(--mantine-color-dimmed)"
# What keeps its bounds, and what does not.
WITHIN = by_theme(*GREEN)
BEYOND = by_theme(*RED)
# What is close to its bounds.
CLOSE = by_theme(*AMBER)


def alert(title: str, body: str) -> str:
    """Return a box that says what is wrong and what would work."""
    return (
        f'<div role="alert" style="margin:6px 10px;padding:7px 10px;border-left:4px solid '
        f"{css(OUTLINE)};background:color-mix(in srgb,{css(OUTLINE)} 9%,transparent);"
        f'border-radius:3px;font-size:12.5px;line-height:1.4"><b>{escape(title)}</b><br>'
        f"{escape(body)}</div>"
    )


def remark(title: str, body: str) -> str:
    """Return a box that says what was done, where that is not quite what was asked for."""
    return (
        '<div role="status" style="margin:6px 10px;padding:7px 10px;border-left:4px solid '
        f"{CLOSE};border-radius:3px;font-size:12.5px;line-height:1.4;"
        'background:color-mix(in srgb,currentColor 6%,transparent)">'
        f"<b>{escape(title)}</b><br>{escape(body)}</div>"
    )


def signed(value: float, digits: int = 3) -> str:
    """Return a number with a true minus sign."""
    return set_true_minus(format_fixed(value, digits))


# Beyond these sizes numbers are told with a power of ten.
LEAST, MOST = 1e-3, 1e7


def decimals_for(size: float, digits: int) -> int:
    """Return how many decimals give a number of a size so many digits."""
    return max(0, digits - 1 - math.floor(math.log10(size))) if size > 0.0 else digits - 1


def fitted(value: float, size: float, digits: int) -> str:
    """Return a number with as many decimals as others of a size have, so that it holds still.

    Args:
        value: The number.
        size: Of the largest that is to be expected.
        digits: That one of this size has.
    """
    if size != 0.0 and not LEAST <= size < MOST:
        return format_number(value, digits, size=size)
    return signed(value, decimals_for(size, digits))


def share(value: float) -> str:
    """Return a number from 0 to 1 with four decimals, or more where it would look like 0."""
    value = drop_rounding(value, 1.0)
    return format_number(value, 3) if 0.0 < value < LEAST else format_fixed(value, 4)
