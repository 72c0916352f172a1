"""The few pieces of HTML that the panels share; they follow the light and the dark theme."""

from __future__ import annotations

from html import escape

from explorer.app.colours import OUTLINE, css

DIM = "color:var(--mantine-color-dimmed)"
# What keeps its bounds, and what does not.
WITHIN = "#2b8a57"
BEYOND = "#c43408"


def alert(title: str, body: str) -> str:
    """Return a box that says what is wrong and what would work."""
    return (
        f'<div role="alert" style="margin:6px 10px;padding:7px 10px;border-left:4px solid '
        f"{css(OUTLINE)};background:color-mix(in srgb,{css(OUTLINE)} 9%,transparent);"
        f'border-radius:3px;font-size:12.5px;line-height:1.4"><b>{escape(title)}</b><br>'
        f"{escape(body)}</div>"
    )


def signed(value: float, digits: int = 3) -> str:
    """Return a number with a true minus sign."""
    return f"{value:.{digits}f}".replace("-", "−")


def scientific(value: float, digits: int = 4) -> str:
    """Return a number in the shorter of both notations, with a true minus sign."""
    return f"{value:.{digits}g}".replace("-", "−")
