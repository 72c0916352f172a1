"""The margins and the folds along a path as two charts over one time, with singular poses marked.

A fold is drawn without its sign, which is that of its margin: so there are two flat ends, 0° and
180°, and a curve reaches one of them only in a singular pose.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from html import escape
from typing import Any, NamedTuple

import numpy as np
import viser
from numpy.typing import ArrayLike, NDArray
from viser import uplot

from explorer.app.features.paths.time_chart import (
    add_time_chart,
    blank_columns,
    time_columns,
    time_updates,
)
from explorer.app.state.frame import Frame
from explorer.app.state.paths import Journey
from explorer.app.widgets.assigning import Update
from explorer.app.widgets.charts import ORANGE, axis, dots, level_axis, line
from explorer.app.widgets.colours import MARGIN_COLOURS
from explorer.app.widgets.markup import margin_name, signed, swatch
from explorer.mechanism.folds import to_folds
from explorer.mechanism.margins import INCIDENCES, MARGIN_KINDS, margins
from explorer.mechanism.pose import Pose, rotation_from_quaternion
from explorer.numerics.arrays import FloatArray
from explorer.numerics.number_text import format_decimals, format_number

# Dashes of the incidences' lines beside their colours, and the marks of the legend.
DASHES: tuple[tuple[float, ...], ...] = ((), (7.0, 3.0), (2.0, 3.0))
STROKES = ("ex-stroke", "ex-stroke is-dashed", "ex-stroke is-dotted")
# Room above and below the values of a chart, as a share of their span.
ROOM = 0.08
HEIGHT = 78
# Number of crossings that are listed; the others are counted.
MOST_LISTED = 4


class Quantity(NamedTuple):
    """A number of each incidence that a chart shows.

    Attributes:
        name: Its name, with braces for the number of the incidence.
        vertical: The vertical axis.
        flat: Its values where a fold is flat.
        decimals: Decimals of its values in the legend.
        unit: Unit behind them.
        of: Returns the values, shape (..., 3), of positions (..., 3) and rotations (..., 3, 3).
    """

    name: str
    vertical: uplot.Axis
    flat: tuple[float, ...]
    decimals: int
    unit: str
    of: Callable[[ArrayLike, ArrayLike], FloatArray]


def fold_magnitudes(position: ArrayLike, rotation: ArrayLike) -> FloatArray:
    """Return the folds without their signs, in degrees, shape (..., 3).

    Args:
        position: b4 in the base frame, shape (..., 3), in design units.
        rotation: Platform to base, shape (..., 3, 3).
    """
    return np.degrees(np.abs(to_folds(position, rotation)[..., 3:]))


MARGINS = Quantity(
    "δ{}", axis("δ (units)", label_size=18, size=40, space=18), (0.0,), 2, "", margins
)
FOLDS = Quantity(
    "|φ{}|",
    axis("fold |φ| (°)", label_size=18, size=40) | {"splits": (0.0, 90.0, 180.0)},
    (0.0, 180.0),
    0,
    "°",
    fold_magnitudes,
)


class IncidencePlot:
    """The chart of a quantity and its legend, empty while there is no path.

    Args:
        gui: Controls of the page.
        quantity: What it shows.
        has_times: Whether the axis of time has numbers; those of a chart below serve it too.
    """

    def __init__(self, gui: viser.GuiApi, quantity: Quantity, *, has_times: bool = True) -> None:
        self._quantity = quantity
        self._legend = gui.add_html("", visible=False)
        lines = (
            line(quantity.name.format(index), colour, dash=dash)
            for index, colour, dash in zip((1, 2, 3), MARGIN_COLOURS, DASHES, strict=True)
        )
        self._chart = add_time_chart(
            gui,
            (*lines, dots("singular", ORANGE, 9)),
            quantity.vertical,
            level_axis(quantity.flat, "flat", ORANGE),
            height=HEIGHT,
            has_times=has_times,
        )

    def updates(self, frame: Frame) -> Iterator[Update]:
        """Yield the updates that make the chart and its legend show the frame."""
        journey, quantity = frame.state.journey, self._quantity
        yield from time_updates(self._chart, columns_of(journey, quantity))
        # viser's chart draws no numbers below it if it appears while it is given data time after
        # time; so it does not wait for a path that is played at once.
        yield self._chart, "visible", True
        yield self._legend, "visible", journey is not None
        if journey is not None:
            yield self._legend, "content", legend(journey.pose, quantity)


def columns_of(journey: Journey | None, quantity: Quantity) -> tuple[NDArray[Any], ...]:
    """Return the columns of the chart: time, the three values, singular poses, present time."""
    if journey is None:
        return blank_columns(4, span_of(quantity.flat))
    timed, crossings = journey.trajectory, journey.margins.crossings
    poses = [*(crossing.pose for crossing in crossings), journey.pose, journey.pose]
    values = quantity.of(
        np.concatenate([timed.position, [pose.position for pose in poses]]),
        np.concatenate(
            [rotation_from_quaternion(timed.quaternion), [pose.rotation for pose in poses]]
        ),
    )
    singular = np.full(len(values), np.nan)
    for row, crossing in enumerate(crossings, start=len(timed.time)):
        singular[row] = values[row, crossing.incidence - 1]
    crossing_times = [crossing_time(journey, index) for index in range(len(crossings))]
    times = np.concatenate([timed.time, crossing_times])
    # Without the present pose: the axis must not change while the path is played.
    span = span_of(np.append(values[: len(times)], quantity.flat))
    return time_columns(times, (*values.T, singular), journey.at, span)


def span_of(values: ArrayLike) -> tuple[float, float]:
    """Return the bottom and the top of a chart of some values, with room beyond them."""
    low, high = float(np.min(values)), float(np.max(values))
    room = ROOM * (high - low) or 1.0
    return low - room, high + room


def crossing_time(journey: Journey, index: int) -> float:
    """Return the time of a crossing of the path, in seconds."""
    crossing, trajectory = journey.margins.crossings[index], journey.trajectory
    return float(np.interp(crossing.move + crossing.share, trajectory.at, trajectory.time))


def legend(pose: Pose, quantity: Quantity) -> str:
    """Return the lines of the chart with the values of a pose, in one line of HTML."""
    values = quantity.of(pose.position, pose.rotation).tolist()
    parts = (
        f'<span class="ex-whole" title="{escape(incidence)}">{swatch(colour, look)}'
        f"{margin_name(index, quantity.name)} "
        f"<b>{signed(value, quantity.decimals)}{quantity.unit}</b></span>"
        for index, colour, look, incidence, value in zip(
            (1, 2, 3), MARGIN_COLOURS, STROKES, INCIDENCES, values, strict=True
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
        index = int(np.argmin(along_path.least))
        return (
            f'<div class="ex-within" title="{MARGIN_KINDS}">No singular pose; '
            f"least |δ{index + 1}| = {format_number(along_path.least[index], 3)} units</div>"
        )
    more = len(places) - MOST_LISTED
    listed = "; ".join(places[:MOST_LISTED]) + (f"; and {more} more" if more > 0 else "")
    times = "once" if len(places) == 1 else f"{len(places)} times"
    dot = swatch(ORANGE, "ex-dot")
    return f"<div>{dot}Singular {times}: {listed}</div>"
