"""The three margins along a path as a chart, with its crossings and the present time."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
import viser
from numpy.typing import NDArray
from viser import uplot

from explorer.app.state.frame import Frame
from explorer.app.state.paths import Journey
from explorer.app.widgets.assigning import Update
from explorer.app.widgets.charts import (
    NEUTRAL,
    ORANGE,
    add_chart,
    axis,
    dots,
    line,
)
from explorer.app.widgets.colours import MARGIN_COLOURS
from explorer.app.widgets.markup import (
    box,
    dim,
    format_number,
    margin_name,
    row,
    signed,
    swatch,
    table,
)
from explorer.mechanism.margins import INCIDENCES, margins
from explorer.numerics.arrays import FloatArray

# Dashes of the margins' lines beside their colours, and the marks of the legend.
DASHES: tuple[tuple[float, ...], ...] = ((), (7.0, 3.0), (2.0, 3.0))
STROKES = ("ex-stroke", "ex-stroke is-dashed", "ex-stroke is-dotted")
HEIGHT = 200
# Number of crossings that are listed; the others are counted.
MOST_LISTED = 6


class MarginPlot:
    """The chart and its legend, hidden while there is no path."""

    def __init__(self, gui: viser.GuiApi) -> None:
        deltas = (
            line(f"δ{index}", colour, dash=dash)
            for index, colour, dash in zip((1, 2, 3), MARGIN_COLOURS, DASHES, strict=True)
        )
        self._chart = add_chart(
            gui,
            (
                *deltas,
                line("zero", NEUTRAL, width=1.0),
                dots("singular", ORANGE, 9),
                line("now", NEUTRAL, width=1.5),
            ),
            (
                axis("time (s)", label_size=20, size=28),
                axis("δ (units)", label_size=18, size=40, space=26),
            ),
            height=HEIGHT,
            padding=(8, 12, 0, 0),
        )
        self._words = gui.add_html("", visible=False)

    def updates(self, frame: Frame) -> Iterator[Update]:
        """Yield the updates that make the chart and its legend show the frame."""
        journey = frame.state.journey
        for handle in (self._chart, self._words):
            yield handle, "visible", journey is not None
        if journey is None:
            return
        columns = columns_of(journey)
        # The line at the present time goes from bottom to top.
        top = float(np.nanmax(columns[-1]))
        yield self._chart, "scales", _scales(float(columns[0][-1]), top)
        yield self._chart, "data", columns
        yield self._words, "content", path_words(journey)


def columns_of(journey: Journey) -> tuple[NDArray[Any], ...]:
    """Return the columns of the chart: time, δ1 to δ3, zero, crossings, and the present time."""
    trajectory = journey.trajectory
    crossings = [crossing_time(journey, i) for i in range(len(journey.margins.crossings))]
    now = journey.at
    # The present time has two rows, for a line from bottom to top.
    times = np.concatenate([trajectory.time, crossings, [now, now]])
    order = np.argsort(times, kind="stable")
    x = times[order]
    deltas = _margins_at(journey, np.interp(x, trajectory.time, trajectory.at))
    zero, crossed, cursor = np.zeros(len(x)), np.full(len(x), np.nan), np.full(len(x), np.nan)
    first = len(trajectory.time)
    crossed[np.isin(order, np.arange(first, first + len(crossings)))] = 0.0
    top = 1.08 * float(np.abs(deltas).max())
    cursor[order == len(times) - 2] = -top
    cursor[order == len(times) - 1] = top
    return (x, *deltas.T, zero, crossed, cursor)


def crossing_time(journey: Journey, index: int) -> float:
    """Return the time of a crossing of the path, in seconds."""
    crossing, trajectory = journey.margins.crossings[index], journey.trajectory
    return float(np.interp(crossing.move + crossing.share, trajectory.at, trajectory.time))


def _margins_at(journey: Journey, at: FloatArray) -> FloatArray:
    """Return the margins (n, 3) at n parameters of the path, interpolated between its samples."""
    samples = journey.margins
    return np.stack([np.interp(at, samples.at, samples.margins[:, i]) for i in range(3)], axis=1)


def path_words(journey: Journey) -> str:
    """Return the legend with the present margins, and the crossings, as HTML."""
    pose = journey.pose
    legend = (
        row(
            f"{swatch(colour, look)}{margin_name(index)} "
            f'<span class="ex-dim ex-small">{incidence}</span>',
            signed(value),
        )
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
    return box(table(legend), f'<div class="ex-after">{_crossings(journey)}</div>')


def _crossings(journey: Journey) -> str:
    along_path = journey.margins
    lines = [
        f"{crossing_time(journey, i):.2f} s: δ{c.incidence} = 0"
        f"{'' if c.changes_sign else ', only touched'}"
        for i, c in enumerate(along_path.crossings)
    ]
    lines += [f"along a whole move: δ{index} = 0" for index in along_path.lies_in]
    if not lines:
        least = np.abs(along_path.margins).min(axis=0)
        index = int(least.argmin())
        return dim(
            f"No singularity on the path; the closest is δ{index + 1} = 0, with "
            f"|δ{index + 1}| = {format_number(float(least[index]), 3)}."
        )
    dot = swatch(ORANGE, "ex-dot")
    listed = "".join(f"<div>{dot}{line}</div>" for line in lines[:MOST_LISTED])
    more = len(lines) - MOST_LISTED
    rest = f'<div class="ex-dim">and {more} more</div>' if more > 0 else ""
    headline = "Singular once" if len(lines) == 1 else f"Singular {len(lines)} times"
    return f"<b>{headline} on the path</b>{listed}{rest}"


def _scales(duration: float, top: float) -> dict[str, uplot.Scale]:
    return {
        "x": {"time": False, "range": (0.0, max(duration, 1e-9))},
        "y": {"range": (-max(top, 1e-9), max(top, 1e-9))},
    }
