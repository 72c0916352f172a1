"""The largest share of a limit along a path as a chart, with the limit and the present time."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
import viser
from numpy.typing import NDArray

from explorer.app.features.paths.loads import JourneyLoads, PathShares
from explorer.app.features.paths.time_chart import (
    add_time_chart,
    line_at_now,
    no_columns,
    time_scales,
    with_now,
)
from explorer.app.state.frame import Frame
from explorer.app.widgets.assigning import Update
from explorer.app.widgets.charts import BLUE, NEUTRAL, ORANGE, line

HEIGHT = 96
EMPTY = no_columns(4)
# Least and greatest top of the chart, in percent; beyond it shares leave the chart.
LEAST_TOP, MOST_TOP = 120.0, 250.0


class LoadPlot:
    """The chart, for designs with limits."""

    def __init__(self, gui: viser.GuiApi, shares: PathShares) -> None:
        self._shares = shares
        self._chart = add_time_chart(
            gui,
            (
                line("limit", NEUTRAL, width=1.0, dash=(4.0, 3.0)),
                line("share", BLUE),
                line("beyond the limit", ORANGE),
                line("now", NEUTRAL, width=1.5),
            ),
            "share (%)",
            height=HEIGHT,
            space=22,
        )

    def updates(self, frame: Frame) -> Iterator[Update]:
        """Yield the updates that make the chart show the frame."""
        journey, loads = frame.state.journey, self._shares.of(frame)
        columns, top = EMPTY, LEAST_TOP
        if journey is not None and loads is not None:
            top = top_of(loads)
            columns = columns_of(loads, journey.at, top)
        yield self._chart, "scales", time_scales(float(columns[0][-1]), 0.0, top)
        yield self._chart, "data", columns
        # It does not wait for a path, as that of the margins.
        yield self._chart, "visible", self._shares.is_limited(frame)


def top_of(loads: JourneyLoads) -> float:
    """Return the top of the chart, in percent: room above the largest share and the limit."""
    return float(np.clip(115.0 * loads.largest.share, LEAST_TOP, MOST_TOP))


def columns_of(loads: JourneyLoads, now: float, top: float) -> tuple[NDArray[Any], ...]:
    """Return the columns of the chart: time, limit, share, share beyond it, and present time.

    Args:
        loads: The shares over time.
        now: The present time, in seconds.
        top: Top of the chart, in percent.
    """
    # The largest share has a row of its own.
    times = np.concatenate([loads.time, [loads.seconds]])
    x, order = with_now(times, now)
    own = np.concatenate([loads.shares, [loads.largest.share]])
    known = np.argsort(times, kind="stable")
    # Far above the chart a line is as good as at infinity.
    percent = np.minimum(100.0 * own[known], 4.0 * top)
    share = np.interp(x, times[known], percent)
    beyond = np.where(share > 100.0, share, np.nan)
    return x, np.full(len(x), 100.0), share, beyond, line_at_now(order, 0.0, top)
