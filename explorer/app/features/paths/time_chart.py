"""What the charts over the time of a path share: axes, scales, and the line at the present time."""

from __future__ import annotations

from typing import Any

import numpy as np
import viser
from numpy.typing import NDArray
from viser import uplot

from explorer.app.widgets.charts import add_chart, axis
from explorer.numerics.arrays import FloatArray, IntArray


def add_time_chart(
    gui: viser.GuiApi, series: tuple[uplot.Series, ...], label: str, *, height: int, space: int
) -> viser.GuiUplotHandle:
    """Add a chart without words at its axis of time, which the slider above it names.

    Args:
        gui: Controls of the page.
        series: Its lines and dots.
        label: Quantity and unit of its other axis.
        height: Its height, in pixels.
        space: Least distance of two numbers of the other axis, in pixels.
    """
    axes = axis("", label_size=0, size=26), axis(label, label_size=18, size=40, space=space)
    return add_chart(gui, series, axes, height=height, padding=(8, 12, 0, 0))


def no_columns(series: int) -> tuple[NDArray[Any], ...]:
    """Return the columns of a chart while there is no path: a second without values."""
    return (np.array([0.0, 1.0]), *(np.full(2, np.nan) for _ in range(series)))


def time_scales(duration: float, low: float, high: float) -> dict[str, uplot.Scale]:
    """Return the scales of a chart from time 0 to a duration, in seconds."""
    return {
        "x": {"time": False, "range": (0.0, max(duration, 1e-9))},
        "y": {"range": (low, high)},
    }


def with_now(times: FloatArray, now: float) -> tuple[FloatArray, IntArray]:
    """Return times in their order with two rows more at the present one, and this order.

    Args:
        times: Times of the rows, shape (n,), in seconds.
        now: The present time, in seconds.

    Returns:
        The times (n + 2,), and for each the number of its row; those of the present time are n and
        n + 1.
    """
    rows = np.concatenate([times, [now, now]])
    order = np.argsort(rows, kind="stable")
    return rows[order], order


def line_at_now(order: IntArray, low: float, high: float) -> FloatArray:
    """Return the column of the line at the present time, which goes from one value to another.

    Args:
        order: Order of the rows, see `with_now`.
        low: Value at its lower end.
        high: Value at its upper end.
    """
    cursor = np.full(len(order), np.nan)
    cursor[order == len(order) - 2], cursor[order == len(order) - 1] = low, high
    return cursor
