"""What the charts over the time of a path share: axes, levels, and the line at the present time."""

from __future__ import annotations

import functools
from collections.abc import Iterable, Iterator
from typing import Any

import numpy as np
import viser
from numpy.typing import NDArray
from viser import uplot

from explorer.app.widgets.assigning import Update
from explorer.app.widgets.charts import NEUTRAL, add_chart, axis, line
from explorer.numerics.arrays import FloatArray


def add_time_chart(
    gui: viser.GuiApi,
    series: tuple[uplot.Series, ...],
    vertical: uplot.Axis,
    levels: uplot.Axis,
    *,
    height: int,
    has_times: bool = True,
) -> viser.GuiUplotHandle:
    """Add a chart without words at its axis of time, which the slider above it names.

    Args:
        gui: Controls of the page.
        series: Its lines and dots, without the line at the present time.
        vertical: Its vertical axis.
        levels: The axis of its levels, at the right.
        height: Height between its axes, in pixels.
        has_times: Whether the axis of time has numbers; those of a chart below serve it too.
    """
    room = 26 if has_times else 8
    time = axis("", label_size=0, size=room)
    if not has_times:
        time["values"] = ()
    return add_chart(
        gui,
        (*series, line("now", NEUTRAL, width=1.5)),
        (time, vertical, levels),
        height=8 + height + room,
        padding=(8, 0, 0, 0),
    )


def time_columns(
    times: FloatArray, curves: Iterable[FloatArray], now: float, span: tuple[float, float]
) -> tuple[NDArray[Any], ...]:
    """Return the columns of a chart: times in their order, the curves, the line at the present.

    Args:
        times: Times of the rows, shape (n,), in seconds.
        curves: Values of the rows, and twice that at the present time, shape (n + 2,) each.
        now: The present time, in seconds.
        span: Values at the bottom and the top of the chart, between which the line goes.
    """
    x = np.concatenate([times, [now, now]])
    order = np.argsort(x, kind="stable")
    present = np.concatenate([np.full(len(times), np.nan), span])
    return tuple(column[order] for column in (x, *curves, present))


@functools.cache
def blank_columns(curves: int, span: tuple[float, float]) -> tuple[NDArray[Any], ...]:
    """Return the columns of a chart while there is no path: a second without values."""
    return time_columns(np.ones(1), np.full((curves, 3), np.nan), 0.0, span)


def time_updates(
    chart: viser.GuiUplotHandle, columns: tuple[NDArray[Any], ...]
) -> Iterator[Update]:
    """Yield the updates that make a chart show its columns."""
    duration = max(float(columns[0][-1]), 1e-9)
    span = float(np.nanmin(columns[-1])), float(np.nanmax(columns[-1]))
    yield chart, "scales", {"x": {"time": False, "range": (0.0, duration)}, "y": {"range": span}}
    yield chart, "data", columns
