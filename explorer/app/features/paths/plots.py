"""The margins over the time of a path as a chart, and the shares of the limits under a load."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import lru_cache
from html import escape
from itertools import groupby
from xml.etree.ElementTree import Element

import numpy as np

from explorer.app.features.paths.state import Journey, Paths
from explorer.app.state.state import State
from explorer.app.widgets.markup import margin_name, note, swatch
from explorer.export.drawings.charts import Chart, ends_of
from explorer.export.drawings.markup import circle, drawing_text, line, page_picture
from explorer.measures.blocks.block import MOST_SHARE, Share
from explorer.mechanism.design import Design
from explorer.mechanism.machine import Six
from explorer.mechanism.margins import INCIDENCES, MARGIN_KINDS, margins, mode_of
from explorer.mechanism.pose import Pose, Triple, rotation_from_quaternion
from explorer.mechanism.rgb import ORANGE, css
from explorer.motion.weights import MovingBodies
from explorer.numerics.arrays import FloatArray
from explorer.numerics.number_text import Unit, format_decimals, format_number
from explorer.paths.crossings import path_margins
from explorer.paths.loads import DemandedLoad, PathLoads
from explorer.singularity.colours import MARGIN_COLOURS
from explorer.statics.loaded import LoadedPose
from explorer.statics.reactions import PART_NAMES, has_limits

# Dashes of the margins' lines beside their colours, and the marks of the legend.
DASHES = (None, "7 3", "2 3")
STROKES = ("ex-stroke", "ex-stroke is-dashed", "ex-stroke is-dotted")
# Width and height of the chart with its axes, and its place in that, in pixels.
SIZE, PLACE = "0 0 280 112", (46.0, 204.0, 6.0, 82.0)
# Number of crossings that are listed; the others are counted.
MOST_LISTED = 4


def load_words(journey: Journey, loads: PathLoads) -> str:
    """Return the largest share of a limit along a path, its bound and its time, as HTML."""
    share, bound, part = loads.utilisation, loads.bound, loads.part
    at = f"at {format_decimals(journey.time_at(loads.place), 2)} s"
    hint = ""
    if part is None:
        words = f"Nothing holds a load {at}: singular" if share else "No part bears a load"
    else:
        number = f"{format_number(100.0 * share, 3)} %" if share < MOST_SHARE else "∞"
        most = "no bound" if math.isinf(bound) else f"{format_number(100.0 * bound, 3)} % at most"
        words = f"Largest share {number} ({most}): {PART_NAMES[part]}, {at}"
        hint = f"That of {len(loads.at)} samples; in parentheses a bound of all between them"
    return f'<div class="ex-{Share(share).look}" title="{hint}">{escape(words)}</div>'


def demand_note(state: State) -> str:
    """Return a hint that no limit can be exceeded by the load that a path must hold; else ""."""
    paths = Paths.of(state)
    if has_limits(state.design) or not paths.holds_load or paths.kind != "planned":
        return ""
    return note("No part has a limit, so every load is held: see the tab Machine.")


def margins_html(journey: Journey, unit: Unit) -> str:
    """Return the margins of the present pose of a path in a unit, and their chart, as HTML."""
    chart, pieces = _chart_of(replace(journey, at=0.0, is_playing=False), unit)
    now = line(chart.place([(journey.at, end) for end in chart.up]), "now")
    words = "Margins over the time of the path"
    drawn = page_picture("ex-map ex-course", words, *pieces, now, viewBox=SIZE)
    return legend(journey.pose, unit) + drawn


@lru_cache(maxsize=1)
def _chart_of(journey: Journey, unit: Unit) -> tuple[Chart, tuple[Element, ...]]:
    """Return the chart of the margins over a path, which is at its start, and its drawing.

    Its axis of time has no words: the slider above names it.
    """
    time, values, singular = margins_over(journey, unit)
    chart = Chart((0.0, float(time[-1])), ends_of([*values.ravel(), 0.0]), *PLACE)
    (x, y), level = chart.place((time[-1], 0.0)).tolist(), chart.level(0.0, "level")
    flat = level, drawing_text("flat", x + 5.0, y + 4.0)
    curves = (
        chart.curve(np.column_stack([time, row]), stroke=css(colour), stroke_dasharray=dash)
        for row, colour, dash in zip(values.T, MARGIN_COLOURS, DASHES, strict=True)
    )
    marks = (circle(at, 4.5, fill=css(ORANGE)) for at in chart.place(singular).tolist())
    return chart, (*chart.axes("", up_name="δ"), *flat, *curves, *marks)


def margins_over(journey: Journey, unit: Unit) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return times (n,) along a path, the margins (n, 3) then, and its singular poses (k, 2).

    A singular pose is given by its time, which is among the others, and the margin that vanishes.
    """
    timed, crossings = journey.trajectory, journey.margins.crossings
    times = np.array([crossing_time(journey, index) for index in range(len(crossings))])
    places = np.reshape([each.pose.position for each in crossings], (-1, 3))
    turns = np.reshape([each.pose.rotation for each in crossings], (-1, 3, 3))
    there = unit.factor * margins(places, turns)
    along = unit.factor * margins(timed.position, rotation_from_quaternion(timed.quaternion))
    vanishing = [row[each.incidence - 1] for row, each in zip(there, crossings, strict=True)]
    time = np.concatenate([timed.time, times])
    order = np.argsort(time, kind="stable")
    values = np.concatenate([along, there])[order]
    return time[order], values, np.column_stack([times, vanishing])


def crossing_time(journey: Journey, index: int) -> float:
    """Return the time of a crossing of the path, in seconds."""
    crossing = journey.margins.crossings[index]
    return journey.time_at(crossing.move + crossing.share)


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
    """Return where the path is singular, and through which modes it goes, in one line of HTML."""
    along_path = journey.margins
    places = [
        f"δ{c.incidence} = 0 at {format_decimals(crossing_time(journey, i), 2)} s"
        f"{'' if c.changes_sign else ', only touched'}"
        for i, c in enumerate(along_path.crossings)
    ]
    places += [f"δ{index} = 0 along a whole move" for index in along_path.lies_in]
    modes = [int(mode_of(margins(p.position, p.rotation))) for p in journey.poses]
    along = [mode for mode, _ in groupby(modes)]
    closed = "Closed path" if journey.is_closed else ""
    if len(along) > 1:
        closed = f"{closed or 'Path'} through modes {' → '.join(map(str, along))}"
    closed = f"{closed}. " if closed else ""
    if not places:
        index = int(np.argmin(along_path.least))
        return (
            f'<div class="ex-within" title="{MARGIN_KINDS}">{closed}No singular pose; '
            f"least |δ{index + 1}| = {unit.text(float(along_path.least[index]), 3)}</div>"
        )
    more = len(places) - MOST_LISTED
    listed = "; ".join(places[:MOST_LISTED]) + (f"; and {more} more" if more > 0 else "")
    times = "once" if len(places) == 1 else f"{len(places)} times"
    dot = swatch(ORANGE, "ex-dot")
    return f"<div>{dot}{closed}Singular {times}: {listed}</div>"


def loads_along(journey: Journey | None, loaded: LoadedPose) -> PathLoads | None:
    """Return the shares of the limits along a path; None without a path or without limits."""
    if journey is None or not has_limits(loaded.design):
        return None
    load = journey.design, loaded.load, loaded.weights
    return _loads_along(journey.poses, journey.tool, *load)


@lru_cache(maxsize=1)
def _loads_along(
    poses: tuple[Pose, ...], tool: Triple | None, design: Design, load: Six, weights: MovingBodies
) -> PathLoads:
    return DemandedLoad.of(design, load, weights).over(path_margins(poses, tool=tool), tool)
