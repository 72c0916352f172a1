"""The three margins over a path as a chart, its crossings marked, and where the platform is."""

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
from explorer.app.widgets.charts import BLUE, NEUTRAL, ORANGE, TEAL, VIOLET, axis
from explorer.app.widgets.colours import Rgb, css
from explorer.app.widgets.markup import DIM, format_number, signed
from explorer.mechanism.margins import INCIDENCES, margins
from explorer.numerics.arrays import FloatArray

# Told apart by every common deficiency of colour vision, and in grey; none is one that warns.
COLOURS: tuple[Rgb, Rgb, Rgb] = (BLUE, TEAL, VIOLET)
DASHES: tuple[tuple[float, ...], ...] = ((), (7.0, 3.0), (2.0, 3.0))
HEIGHT = 200
# Time, the three margins, zero, crossings, and now.
COLUMNS = 7
BLANK = np.zeros(2)
# In the words below: crossings beyond these are counted only.
MOST_TOLD = 6


class MarginPlot:
    """The chart and its legend with the crossings; hidden while there is no path."""

    def __init__(self, gui: viser.GuiApi) -> None:
        self._chart = gui.add_uplot(
            (BLANK,) * COLUMNS,
            _series(),
            scales=_scales(1.0, 1.0),
            axes=(
                axis("time (s)", label_size=20, size=28),
                axis("δ (units)", label_size=18, size=40, space=26),
            ),
            legend={"show": False},
            cursor={"drag": {"x": False, "y": False}},
            height=HEIGHT,
            padding=(8, 12, 0, 0),
            visible=False,
        )
        self._words = gui.add_html("", visible=False)

    def updates(self, frame: Frame) -> Iterator[Update]:
        """Yield what makes them show the frame."""
        journey = frame.state.journey
        for handle in (self._chart, self._words):
            yield handle, "visible", journey is not None
        if journey is None:
            return
        columns = columns_of(journey)
        top = 1.08 * max(float(np.abs(column).max()) for column in columns[1:4])
        yield self._chart, "scales", _scales(float(columns[0][-1]), top)
        yield self._chart, "data", columns
        yield self._words, "content", path_words(journey)


def columns_of(journey: Journey) -> tuple[NDArray[Any], ...]:
    """Return the columns of the chart: time, δ1 to δ3, zero, crossings, and now."""
    timed, found = journey.trajectory, journey.margins
    crossings = [crossing_time(journey, i) for i in range(len(found.crossings))]
    now = journey.at
    # Now stands twice, for a line from bottom to top.
    times = np.concatenate([timed.time, crossings, [now, now]])
    order = np.argsort(times, kind="stable")
    x = times[order]
    deltas = _margins_at(journey, np.interp(x, timed.time, timed.at))
    zero, crossed, cursor = np.zeros(len(x)), np.full(len(x), np.nan), np.full(len(x), np.nan)
    first = len(timed.time)
    crossed[np.isin(order, np.arange(first, first + len(crossings)))] = 0.0
    top = 1.08 * float(np.abs(deltas).max())
    cursor[order == len(times) - 2] = -top
    cursor[order == len(times) - 1] = top
    return (x, *deltas.T, zero, crossed, cursor)


def crossing_time(journey: Journey, index: int) -> float:
    """Return when the path is at one of its crossings, in seconds."""
    crossing, timed = journey.margins.crossings[index], journey.trajectory
    return float(np.interp(crossing.move + crossing.share, timed.at, timed.time))


def _margins_at(journey: Journey, at: FloatArray) -> FloatArray:
    """Return the margins (n, 3) at places of the path, by interpolation between its samples."""
    known = journey.margins
    return np.stack([np.interp(at, known.at, known.margins[:, i]) for i in range(3)], axis=1)


def path_words(journey: Journey) -> str:
    """Return the legend with the margins here, and the crossings, as HTML."""
    pose = journey.pose
    here = margins(pose.position, pose.rotation).tolist()
    legend = "".join(
        f'<tr><td style="padding:1px 0">{_swatch(index)}δ{index + 1}</td>'
        f'<td style="{DIM}">{INCIDENCES[index]}</td>'
        f'<td style="text-align:right">{signed(value)}</td></tr>'
        for index, value in enumerate(here)
    )
    return (
        '<div style="padding:0 12px 6px;font-size:12px;line-height:1.45;'
        'font-variant-numeric:tabular-nums"><table style="width:100%;border-collapse:collapse">'
        f'{legend}</table><div style="margin-top:5px">{_crossings(journey)}</div></div>'
    )


def _crossings(journey: Journey) -> str:
    found = journey.margins
    lines = [
        f"{crossing_time(journey, i):.2f} s: δ{c.incidence} = 0"
        f"{'' if c.changes_sign else ', only touched'}"
        for i, c in enumerate(found.crossings)
    ]
    lines += [f"all along a move: δ{each} = 0" for each in found.lies_in]
    if not lines:
        least = np.abs(found.margins).min(axis=0)
        index = int(least.argmin())
        return (
            f'<span style="{DIM}">No singularity on the way; the closest is δ{index + 1} = 0, '
            f"with |δ{index + 1}| = {format_number(float(least[index]), 3)}.</span>"
        )
    dot = (
        '<span style="display:inline-block;width:9px;height:9px;border-radius:5px;'
        f'background:{css(ORANGE)};margin-right:6px"></span>'
    )
    told = "".join(f"<div>{dot}{line}</div>" for line in lines[:MOST_TOLD])
    more = len(lines) - MOST_TOLD
    rest = f'<div style="{DIM}">and {more} more</div>' if more > 0 else ""
    word = "Singular once" if len(lines) == 1 else f"Singular {len(lines)} times"
    return f"<b>{word} on the way</b>{told}{rest}"


def _swatch(index: int) -> str:
    style = ("solid", "dashed", "dotted")[index]
    return (
        '<span style="display:inline-block;width:20px;height:0;vertical-align:middle;'
        f'border-top:2.5px {style} {css(COLOURS[index])};margin-right:6px"></span>'
    )


def _series() -> tuple[uplot.Series, ...]:
    lines: list[uplot.Series] = [
        {
            "label": f"δ{index + 1}",
            "stroke": css(colour),
            "width": 2.0,
            "dash": dash,
            "points": {"show": False},
        }
        for index, (colour, dash) in enumerate(zip(COLOURS, DASHES, strict=True))
    ]
    zero: uplot.Series = {
        "label": "zero",
        "stroke": css(NEUTRAL),
        "width": 1.0,
        "points": {"show": False},
    }
    crossings: uplot.Series = {
        "label": "singular",
        "stroke": css(ORANGE),
        "width": 0.0,
        "points": {"show": True, "size": 9, "fill": css(ORANGE)},
    }
    now: uplot.Series = {
        "label": "now",
        "stroke": css(NEUTRAL),
        "width": 1.5,
        "points": {"show": False},
    }
    return ({"label": "time"}, *lines, zero, crossings, now)


def _scales(duration: float, top: float) -> dict[str, uplot.Scale]:
    return {
        "x": {"time": False, "range": (0.0, max(duration, 1e-9))},
        "y": {"range": (-max(top, 1e-9), max(top, 1e-9))},
    }
