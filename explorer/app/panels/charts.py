"""What charts on the page have in common."""

from __future__ import annotations

from viser import uplot

FONT = "11px system-ui, sans-serif"


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
