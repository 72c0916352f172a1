"""The parts that charts on the page share: axes, lines, dots and their colours."""

from __future__ import annotations

import numpy as np
import viser
from viser import uplot

from explorer.mechanism.rgb import Rgb, css

FONT = "11px system-ui, sans-serif"

# Colours of lines and points, visible on light and dark panels alike: a chart cannot follow the
# theme as words do.
BLUE: Rgb = (46, 116, 208)
TEAL: Rgb = (30, 150, 135)
VIOLET: Rgb = (150, 120, 190)
ORANGE: Rgb = (214, 74, 24)
NEUTRAL: Rgb = (120, 134, 156)

BLANK = np.zeros(2)
"""A column to begin with: no chart of viser is without data."""


def axis(label: str, *, label_size: int, size: int, space: int = 30) -> uplot.Axis:
    """Return an axis, labelled with its quantity and unit.

    The room for the label, that for its numbers, and the least distance of two of these are in
    pixels.
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


def level_axis(levels: tuple[float, ...], name: str, colour: Rgb) -> uplot.Axis:
    """Return a vertical axis at the right whose levels are lines with one name beside each."""
    return {
        "side": 1,
        "splits": levels,
        "values": (name,) * len(levels),
        "stroke": css(colour),
        "size": 32,
        "gap": 3,
        "font": FONT,
        "grid": {"stroke": css(colour), "width": 1.0},
        "ticks": {"show": False},
    }


def line(
    label: str, colour: Rgb, *, width: float = 2.0, dash: tuple[float, ...] = ()
) -> uplot.Series:
    """Return a series that is drawn as a line, with its name and colour.

    Its width, and the lengths of dashes and gaps, none for a solid line, are in pixels.
    """
    return {
        "label": label,
        "stroke": css(colour),
        "width": width,
        "dash": dash,
        "points": {"show": False},
    }


def dots(label: str, colour: Rgb, size: float) -> uplot.Series:
    """Return a series that is drawn as dots of a size in pixels."""
    return {
        "label": label,
        "stroke": css(colour),
        "width": 0.0,
        "points": {"show": True, "size": size, "fill": css(colour)},
    }


def add_chart(
    gui: viser.GuiApi,
    series: tuple[uplot.Series, ...],
    axes: tuple[uplot.Axis, ...],
    *,
    height: int,
    padding: tuple[int, int, int, int],
) -> viser.GuiUplotHandle:
    """Add a chart of series, without the column of the horizontal axis, hidden until it has data.

    The horizontal axis comes before the vertical ones. The height, and the room above, at the
    right, below and at the left, are in pixels.
    """
    return gui.add_uplot(
        (BLANK,) * (1 + len(series)),
        ({}, *series),
        scales={"x": {"time": False}, "y": {}},
        axes=axes,
        legend={"show": False},
        cursor={"drag": {"x": False, "y": False}},
        height=height,
        padding=padding,
        visible=False,
    )
