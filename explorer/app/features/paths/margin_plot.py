"""The three margins along a path as a chart, with its crossings and the present time."""

from __future__ import annotations

from collections.abc import Iterator
from html import escape
from typing import Any

import numpy as np
import viser
from numpy.typing import NDArray

from explorer.app.features.paths.time_chart import (
    add_time_chart,
    line_at_now,
    no_columns,
    time_scales,
    with_now,
)
from explorer.app.state.frame import Frame
from explorer.app.state.paths import Journey
from explorer.app.widgets.assigning import Update
from explorer.app.widgets.charts import (
    NEUTRAL,
    ORANGE,
    dots,
    line,
)
from explorer.app.widgets.colours import MARGIN_COLOURS
from explorer.app.widgets.markup import format_number, margin_name, signed, swatch
from explorer.mechanism.margins import INCIDENCES, MARGIN_KINDS, margins
from explorer.numerics.arrays import FloatArray
from explorer.numerics.number_text import format_decimals

# Dashes of the margins' lines beside their colours, and the marks of the legend.
DASHES: tuple[tuple[float, ...], ...] = ((), (7.0, 3.0), (2.0, 3.0))
STROKES = ("ex-stroke", "ex-stroke is-dashed", "ex-stroke is-dotted")
HEIGHT = 112
EMPTY = no_columns(6)
# Number of crossings that are listed; the others are counted.
MOST_LISTED = 4


class MarginPlot:
    """The chart and its legend, empty while there is no path."""

    def __init__(self, gui: viser.GuiApi) -> None:
        self._legend = gui.add_html("", visible=False)
        deltas = (
            line(f"δ{index}", colour, dash=dash)
            for index, colour, dash in zip((1, 2, 3), MARGIN_COLOURS, DASHES, strict=True)
        )
        self._chart = add_time_chart(
            gui,
            (
                *deltas,
                line("zero", NEUTRAL, width=1.0),
                dots("singular", ORANGE, 9),
                line("now", NEUTRAL, width=1.5),
            ),
            "δ (units)",
            height=HEIGHT,
            space=26,
        )

    def updates(self, frame: Frame) -> Iterator[Update]:
        """Yield the updates that make the chart and its legend show the frame."""
        journey = frame.state.journey
        columns = EMPTY if journey is None else columns_of(journey)
        # The line at the present time goes from bottom to top.
        top = max(1.0 if journey is None else float(np.nanmax(columns[-1])), 1e-9)
        yield self._chart, "scales", time_scales(float(columns[0][-1]), -top, top)
        yield self._chart, "data", columns
        # viser's chart draws no numbers below it if it appears while it is given data time after
        # time; so it does not wait for a path that is played at once.
        yield self._chart, "visible", True
        yield self._legend, "visible", journey is not None
        if journey is not None:
            yield self._legend, "content", margin_legend(journey)


def columns_of(journey: Journey) -> tuple[NDArray[Any], ...]:
    """Return the columns of the chart: time, δ1 to δ3, zero, crossings, and the present time."""
    trajectory = journey.trajectory
    crossings = [crossing_time(journey, i) for i in range(len(journey.margins.crossings))]
    x, order = with_now(np.concatenate([trajectory.time, crossings]), journey.at)
    deltas = _margins_at(journey, np.interp(x, trajectory.time, trajectory.at))
    zero, crossed = np.zeros(len(x)), np.full(len(x), np.nan)
    first = len(trajectory.time)
    crossed[np.isin(order, np.arange(first, first + len(crossings)))] = 0.0
    top = 1.08 * float(np.abs(deltas).max())
    return (x, *deltas.T, zero, crossed, line_at_now(order, -top, top))


def crossing_time(journey: Journey, index: int) -> float:
    """Return the time of a crossing of the path, in seconds."""
    crossing, trajectory = journey.margins.crossings[index], journey.trajectory
    return float(np.interp(crossing.move + crossing.share, trajectory.at, trajectory.time))


def _margins_at(journey: Journey, at: FloatArray) -> FloatArray:
    """Return the margins (n, 3) at n parameters of the path, interpolated between its samples."""
    samples = journey.margins
    return np.stack([np.interp(at, samples.at, samples.margins[:, i]) for i in range(3)], axis=1)


def margin_legend(journey: Journey) -> str:
    """Return the lines of the chart with the present margins, in one line of HTML."""
    pose = journey.pose
    parts = (
        f'<span class="ex-whole" title="{escape(incidence)}">{swatch(colour, look)}'
        f"{margin_name(index)} <b>{signed(value, 2)}</b></span>"
        for index, (colour, look, incidence, value) in enumerate(
            zip(
                MARGIN_COLOURS,
                STROKES,
                INCIDENCES,
                margins(pose.position, pose.rotation).tolist(),
                strict=True,
            ),
            start=1,
        )
    )
    return f'<div class="ex-note ex-thirds">{"".join(parts)}</div>'


def crossing_words(journey: Journey) -> str:
    """Return where the path is singular, in one line of HTML."""
    along_path = journey.margins
    places = [
        f"δ{c.incidence} = 0 at {format_decimals(crossing_time(journey, i), 2)} s"
        f"{'' if c.changes_sign else ', only touched'}"
        for i, c in enumerate(along_path.crossings)
    ]
    places += [f"δ{index} = 0 along a whole move" for index in along_path.lies_in]
    if not places:
        least = np.abs(along_path.margins).min(axis=0)
        index = int(least.argmin())
        return (
            f'<div class="ex-within" title="{MARGIN_KINDS}">No singular pose; '
            f"least |δ{index + 1}| = {format_number(float(least[index]), 3)} units</div>"
        )
    more = len(places) - MOST_LISTED
    listed = "; ".join(places[:MOST_LISTED]) + (f"; and {more} more" if more > 0 else "")
    times = "once" if len(places) == 1 else f"{len(places)} times"
    dot = swatch(ORANGE, "ex-dot")
    return f"<div>{dot}Singular {times}: {listed}</div>"
