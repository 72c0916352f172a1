"""The margins over the time of a path as a chart, and the shares of the limits under a load."""

from __future__ import annotations

import math
from html import escape
from typing import Any, NamedTuple

import numpy as np
import viser
from numpy.typing import ArrayLike, NDArray

from explorer.app.features.feature import Services, show_html
from explorer.app.features.loads.load import Loads
from explorer.app.features.paths.state import Journey, Paths, journey_of
from explorer.app.state.frame import Frame
from explorer.app.state.state import State
from explorer.app.widgets.charts import (
    NEUTRAL,
    ORANGE,
    add_chart,
    axis,
    dots,
    level_axis,
    line,
)
from explorer.app.widgets.markup import margin_name, note, swatch
from explorer.measures.blocks.block import MOST_SHARE, Share
from explorer.mechanism.margins import INCIDENCES, MARGIN_KINDS, margins
from explorer.mechanism.pose import Pose, rotation_from_quaternion
from explorer.numerics.arrays import FloatArray
from explorer.numerics.number_text import Unit, format_decimals, format_number
from explorer.page.widgets.assigning import Updates
from explorer.paths.loads import DemandedLoad, PathLoads
from explorer.singularity.colours import MARGIN_COLOURS
from explorer.statics.reactions import PART_NAMES, has_limits

# Dashes of the margins' lines beside their colours, and the marks of the legend.
DASHES: tuple[tuple[float, ...], ...] = ((), (7.0, 3.0), (2.0, 3.0))
STROKES = ("ex-stroke", "ex-stroke is-dashed", "ex-stroke is-dotted")
# Room above and below the values of a chart, as a share of their span.
ROOM = 0.08
# Height of the chart, and the room for the numbers of time in it, in pixels.
HEIGHT, TIME_ROOM = 112, 26
# Number of crossings that are listed; the others are counted.
MOST_LISTED = 4


class JourneyLoads(NamedTuple):
    """The shares of the limits along a path, and the times of their samples in seconds."""

    time: FloatArray
    path: PathLoads

    @property
    def seconds(self) -> float:
        """Time at which the largest share occurs."""
        return float(np.interp(self.path.place, self.path.at, self.time))


def load_words(loads: JourneyLoads) -> str:
    """Return the largest share of a limit along a path, its bound and its place, as HTML."""
    share, bound, part = loads.path.utilisation, loads.path.bound, loads.path.part
    at = f"at {format_decimals(loads.seconds, 2)} s"
    hint = ""
    if part is None:
        words = f"Nothing holds a load {at}: singular" if share else "No part bears a load"
    else:
        number = f"{format_number(100.0 * share, 3)} %" if share < MOST_SHARE else "∞"
        most = "no bound" if math.isinf(bound) else f"{format_number(100.0 * bound, 3)} % at most"
        words = f"Largest share {number} ({most}): {PART_NAMES[part]}, {at}"
        hint = f"That of {len(loads.time)} samples; in parentheses a bound of all between them"
    return f'<div class="ex-{Share(share).look}" title="{hint}">{escape(words)}</div>'


def demand_note(state: State) -> str:
    """Return a hint that no limit can be exceeded by the load that a path must hold; else ""."""
    paths = Paths.of(state)
    if has_limits(state.design) or not paths.holds_load or paths.kind != "planned":
        return ""
    return note("No part has a limit, so every load is held: see the tab Machine.")


# The columns of the chart while there is no path: a second without values.
BLANK = (np.ones(2), *np.full((4, 2), np.nan), np.array([-1.0, 1.0]))


class MarginPlot:
    """The chart of the margins over time and its legend, empty while there is no path.

    Its axis of time has no words: the slider above names it.
    """

    def __init__(self, gui: viser.GuiApi) -> None:
        self._legend = gui.add_html("", visible=False)
        lines = (
            line(f"δ{index}", colour, dash=dash)
            for index, colour, dash in zip((1, 2, 3), MARGIN_COLOURS, DASHES, strict=True)
        )
        self._chart = add_chart(
            gui,
            (*lines, dots("singular", ORANGE, 9), line("now", NEUTRAL, width=1.5)),
            (
                axis("", label_size=0, size=TIME_ROOM),
                axis("margin δ", label_size=18, size=40, space=18),
                level_axis((0.0,), "flat", ORANGE),
            ),
            height=HEIGHT,
            padding=(8, 0, 0, 0),
        )

    def updates(self, frame: Frame) -> Updates:
        """Yield the updates that make the chart and its legend show the frame."""
        journey, unit = journey_of(frame.state), frame.state.unit
        columns = BLANK if journey is None else margin_columns(journey, unit)
        duration = max(float(columns[0][-1]), 1e-9)
        span = float(np.nanmin(columns[-1])), float(np.nanmax(columns[-1]))
        scales = {"x": {"time": False, "range": (0.0, duration)}, "y": {"range": span}}
        yield self._chart, "scales", scales
        yield self._chart, "data", columns
        # viser's chart draws no numbers below it if it appears while it is given data time after
        # time; so it does not wait for a path that is played at once.
        yield self._chart, "visible", True
        words = "" if journey is None else legend(journey.pose, unit)
        yield from show_html(self._legend, words)


def margin_columns(journey: Journey, unit: Unit) -> tuple[NDArray[Any], ...]:
    """Return the columns of the chart: time, margins in a unit, singular poses, present time.

    The line at the present goes from the bottom to the top of the chart.
    """
    timed, crossings = journey.trajectory, journey.margins.crossings
    poses = [*(crossing.pose for crossing in crossings), journey.pose, journey.pose]
    values = unit.factor * margins(
        np.concatenate([timed.position, [pose.position for pose in poses]]),
        np.concatenate(
            [rotation_from_quaternion(timed.quaternion), [pose.rotation for pose in poses]]
        ),
    )
    singular, now = np.full((2, len(values)), np.nan)
    for row, crossing in enumerate(crossings, start=len(timed.time)):
        singular[row] = values[row, crossing.incidence - 1]
    crossing_times = [crossing_time(journey, index) for index in range(len(crossings))]
    times = np.concatenate([timed.time, crossing_times, [journey.at, journey.at]])
    # Without the present pose: the axis must not change while the path is played.
    now[-2:] = span_of(np.append(values[:-2], 0.0))
    order = np.argsort(times, kind="stable")
    return tuple(column[order] for column in (times, *values.T, singular, now))


def span_of(values: ArrayLike) -> tuple[float, float]:
    """Return the bottom and the top of a chart of some values, with room beyond them."""
    low, high = float(np.min(values)), float(np.max(values))
    room = ROOM * (high - low) or 1.0
    return low - room, high + room


def crossing_time(journey: Journey, index: int) -> float:
    """Return the time of a crossing of the path, in seconds."""
    crossing, trajectory = journey.margins.crossings[index], journey.trajectory
    return float(np.interp(crossing.move + crossing.share, trajectory.at, trajectory.time))


def legend(pose: Pose, unit: Unit) -> str:
    """Return the lines of the chart with the margins of a pose in a unit, in one line of HTML."""
    values = (unit.factor * margins(pose.position, pose.rotation)).tolist()
    parts = (
        f'<span class="ex-whole" title="{escape(incidence)}">{swatch(colour, look)}'
        f"{margin_name(index)} <b>{format_decimals(value, 2)} {unit.name}</b></span>"
        for index, colour, look, incidence, value in zip(
            (1, 2, 3), MARGIN_COLOURS, STROKES, INCIDENCES, values, strict=True
        )
    )
    return f'<div class="ex-note ex-thirds">{"".join(parts)}</div>'


def crossing_words(journey: Journey, unit: Unit) -> str:
    """Return where the path is singular, in one line of HTML, with a unit of lengths."""
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
            f"least |δ{index + 1}| = {unit.text(float(along_path.least[index]), 3)}</div>"
        )
    more = len(places) - MOST_LISTED
    listed = "; ".join(places[:MOST_LISTED]) + (f"; and {more} more" if more > 0 else "")
    times = "once" if len(places) == 1 else f"{len(places)} times"
    dot = swatch(ORANGE, "ex-dot")
    return f"<div>{dot}Singular {times}: {listed}</div>"


class LoadsAlong:
    """The shares of the limits along the last path, under the last load."""

    def __init__(self, services: Services) -> None:
        self._loads = services.get(Loads)
        self._key: tuple[object, ...] = ()
        self._shares: JourneyLoads | None = None

    def shares(self, frame: Frame) -> JourneyLoads | None:
        """Return the shares along the path of a frame; None without a path or without limits.

        They are computed anew if path or load change.
        """
        journey, loaded = journey_of(frame.state), self._loads.of(frame)
        if journey is None or not has_limits(loaded.design):
            return None
        path = journey.kind, journey.design, journey.poses, journey.tool
        key = *path, loaded.load, loaded.weights
        if key != self._key:
            demanded = DemandedLoad.of(journey.design, loaded.load, loaded.weights)
            along, timed = demanded.over(journey.margins, journey.tool), journey.trajectory
            self._shares = JourneyLoads(np.interp(along.at, timed.at, timed.time), along)
            self._key = key
        return self._shares
