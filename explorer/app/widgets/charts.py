"""What charts on the page have in common."""

from __future__ import annotations

from viser import uplot

from explorer.app.widgets.colours import GHOST, Rgb

FONT = "11px system-ui, sans-serif"

# Of lines and points: seen on white and on dark panels alike, since a chart cannot follow the
# theme as words do.
BLUE: Rgb = (46, 116, 208)
TEAL: Rgb = (30, 150, 135)
VIOLET: Rgb = (150, 120, 190)
ORANGE: Rgb = (214, 74, 24)
NEUTRAL: Rgb = GHOST


def axis(label: str, *, label_size: int, size: int, space: int = 30) -> uplot.Axis:
    """Return an axis.

    Args:
        label: What it measures, with its unit.
        label_size: Of the room for that, in pixels.
        size: Of the room for its numbers, in pixels.
        space: Between two numbers, at least, in pixels.
    """
    return {
        "label": label,
        "labelSize": label_size,
        "size": size,
        "gap": 3,
        "ticks": {"size": 5},
        "font": FONT,
        "labelFont": FONT,
        "space": space,
    }
