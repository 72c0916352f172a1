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
    blank_columns,
    time_columns,
    time_updates,
)
from explorer.app.state.frame import Frame
from explorer.app.widgets.assigning import Update
from explorer.app.widgets.charts import BLUE, NEUTRAL, ORANGE, axis, level_axis, line
from explorer.numerics.arrays import FloatArray
from explorer.statics.reactions import has_limits

HEIGHT = 62
# Least and greatest top of the chart, in percent; beyond it shares leave the chart.
LEAST_TOP, MOST_TOP = 120.0, 250.0


class LoadPlot:
    """The chart, for designs with limits."""

    def __init__(self, gui: viser.GuiApi, shares: PathShares) -> None:
        self._shares = shares
        self._chart = add_time_chart(
            gui,
            (line("share", BLUE), line("beyond the limit", ORANGE)),
            axis("share (%)", label_size=18, size=40, space=22),
            level_axis((100.0,), "limit", NEUTRAL),
            height=HEIGHT,
        )

    def updates(self, frame: Frame) -> Iterator[Update]:
        """Yield the updates that make the chart show the frame."""
        journey, loads = frame.state.journey, self._shares.of(frame)
        if journey is None or loads is None:
            columns = blank_columns(2, (0.0, LEAST_TOP))
        else:
            columns = columns_of(loads, journey.at)
        yield from time_updates(self._chart, columns)
        # It does not wait for a path, as those of margins and folds.
        yield self._chart, "visible", has_limits(frame.state.design)


def columns_of(loads: JourneyLoads, now: float) -> tuple[NDArray[Any], ...]:
    """Return the columns of the chart: time, share, share beyond the limit, and present time.

    Args:
        loads: The shares over time.
        now: The present time, in seconds.
    """
    # Room above the largest share and the limit, in percent.
    top = float(np.clip(115.0 * loads.path.share, LEAST_TOP, MOST_TOP))
    # Far above the chart a line is as good as at infinity.
    percent: FloatArray = np.minimum(100.0 * loads.path.shares.max(axis=1), 4.0 * top)
    share = np.append(percent, np.interp([now, now], loads.time, percent))
    beyond = np.where(share > 100.0, share, np.nan)
    return time_columns(loads.time, (share, beyond), now, (0.0, top))
