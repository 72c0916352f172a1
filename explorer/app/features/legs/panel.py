"""The clearances of the legs in the pose and in the last move, and the effect of their radii."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
import viser

from explorer.app.features.feature import Services
from explorer.app.features.legs.work import RADIUS_FEED, RadiusFeed
from explorer.app.inputs.controls import Controls
from explorer.app.state.frame import Frame
from explorer.app.widgets.assigning import Update
from explorer.app.widgets.blocks import render
from explorer.app.widgets.buttons import CopyButton
from explorer.app.widgets.charts import (
    BLUE,
    ORANGE,
    TEAL,
    VIOLET,
    add_chart,
    axis,
    dots,
    line,
)
from explorer.app.widgets.markup import alert, box, dim, row, sentence, swatch, table
from explorer.app.widgets.under_way import UnderWay, problem, progress
from explorer.legs.clearance import PAIRS
from explorer.measures.blocks.block import Statement
from explorer.measures.blocks.clearances import move_clearances, pose_clearances
from explorer.measures.blocks.source import Source, pose_source
from explorer.mechanism.design import Design
from explorer.numerics.arrays import FloatArray
from explorer.numerics.number_text import format_number
from explorer.singularity.colours import Rgb
from explorer.workspace.accessible.radii import RadiusCurve

# Share of the volume without radii; the largest radius that keeps it is marked.
SHARE = 0.99
# End of the chart, as a multiple of the last radius of the curve and of the largest marked one.
BEYOND_LAST, BEYOND_PRESENT = 1.15, 1.05
HEIGHT = 190


class LegsPanel:
    """The table of clearances, that of the last move, and the radius curve."""

    def __init__(self, services: Services) -> None:
        gui = services.gui
        self._pose = gui.add_html("")

        def source() -> Source:
            state = services.session.latest_state()
            return pose_source("interference", state.design, state.pose)

        self._copy = CopyButton(services.buttons, "Legs", source)
        self._controls = Controls(gui, services.session)
        with gui.add_folder("Last move"):
            self._controls.checkbox(
                "Swept tetrahedra",
                "Draw the tetrahedra that the legs swept in the last move, and compare the paper's "
                "test for interference with the exact one.",
                "view.swept",
            )
            self._move = gui.add_html("", visible=False)
        with gui.add_folder("Leg radius"):
            self._controls.checkbox(
                "Volume against radius",
                "Draw the accessible volume over one radius of all four legs, for the orientation "
                "and the start of the tab Workspace.",
                "view.radius_curve",
            )
            self._plot = RadiusPlot(gui, services.get(RADIUS_FEED))

    def updates(self, frame: Frame) -> Iterator[Update]:
        """Yield the updates that make the panel show the frame."""
        answer = render(pose_clearances(frame.snapshot), corner=self._copy.html)
        yield self._pose, "content", answer
        yield from self._controls.updates(frame)
        yield self._move, "visible", frame.state.view.swept
        if frame.state.view.swept:
            yield self._move, "content", move_table(frame)
        yield from self._plot.updates(frame)


def move_table(frame: Frame) -> str:
    """Return the last move by both tests, the paper's and the exact one, as HTML."""
    move = frame.last_move
    if move is None:
        words = "No move yet. Move the platform: a drag without a pause is one move."
        return render([Statement("", words)])
    return render(move_clearances(move, frame.state.design))


class RadiusMark(NamedTuple):
    """A radius that is marked on the curve: its meaning, its point, and its value or None."""

    label: str
    colour: Rgb
    size: int
    radius: float | None


class RadiusPlot:
    """The accessible volume against one radius of all four legs, as a chart and in numbers."""

    def __init__(self, gui: viser.GuiApi, feed: RadiusFeed) -> None:
        marks = (dots(mark.label, mark.colour, mark.size) for mark in marks_of(None, None))
        self._chart = add_chart(
            gui,
            (line("volume", BLUE), *marks),
            (
                axis("radius of all four legs (units)", label_size=20, size=28),
                axis("accessible volume (units³)", label_size=18, size=46),
            ),
            height=HEIGHT,
            padding=(8, 14, 0, 0),
        )
        self._words = gui.add_html("", visible=False)
        self._feed = feed
        self._under_way = UnderWay(gui, "curve", feed)

    def updates(self, frame: Frame) -> Iterator[Update]:
        """Yield the updates that make the chart and its numbers show the frame."""
        is_visible, feed = frame.state.view.radius_curve, self._feed
        yield from self._under_way.updates()
        yield self._words, "visible", is_visible
        if is_visible:
            yield self._words, "content", radius_words(frame, feed)
        curve = feed.drawing if is_visible and isinstance(feed.drawing, RadiusCurve) else None
        has_chart = curve is not None and float(curve.radii[-1]) > 0.0
        yield self._chart, "visible", has_chart
        if curve is not None and has_chart:
            columns = chart_columns(curve, common_radius(frame.state.design))
            across = {"time": False, "range": (0.0, float(columns[0][-1]))}
            up = {"range": (0.0, 1.08 * float(curve.volumes[0]))}
            yield self._chart, "scales", {"x": across, "y": up}
            yield self._chart, "data", columns


def common_radius(design: Design) -> float | None:
    """Return the radius of all four legs, None if they differ."""
    radii = set(design.limits.leg_radii)
    return radii.pop() if len(radii) == 1 else None


def marks_of(curve: RadiusCurve | None, radius: float | None) -> tuple[RadiusMark, ...]:
    """Return the three marks of a curve, in the order of the chart's columns."""
    almost = None if curve is None else curve.radius_at(SHARE)
    harmless = None if curve is None else curve.harmless
    return (
        RadiusMark("present radius", ORANGE, 10, radius),
        RadiusMark("99 % accessible up to", TEAL, 8, almost),
        RadiusMark("no loss up to", VIOLET, 8, harmless),
    )


def volume_at(curve: RadiusCurve, radius: float) -> float:
    """Return the accessible volume at a radius; 0 beyond the last radius of the curve."""
    return float(np.interp(radius, *_without_drop(curve), right=0.0))


def _without_drop(curve: RadiusCurve) -> tuple[FloatArray, FloatArray]:
    """Return distinct radii and their volumes, without the drop to 0 at the last radius."""
    first = np.append(True, np.diff(curve.radii) > 0.0)
    return curve.radii[first], curve.volumes[first]


def chart_columns(curve: RadiusCurve, radius: float | None) -> tuple[FloatArray, ...]:
    """Return the columns of the chart: radii, volumes, and the three marks.

    Beyond the last radius the volume is 0.
    """
    marks = [mark.radius for mark in marks_of(curve, radius)]
    marked = [mark for mark in marks if mark is not None]
    last = float(curve.radii[-1])
    end = max(BEYOND_LAST * last, BEYOND_PRESENT * max(marked))
    radii, volumes = _without_drop(curve)
    inner = np.unique([*radii, *(mark for mark in marked if mark <= last)])
    outer = np.unique([last, *(mark for mark in marked if mark > last), end])
    x = np.concatenate([inner, outer])
    y = np.concatenate([np.interp(inner, radii, volumes), np.zeros(len(outer))])
    columns = [x, y]
    for mark in marks:
        column = np.full(len(x), np.nan)
        if mark is not None:
            column[np.searchsorted(x, mark)] = volume_at(curve, mark)
        columns.append(column)
    return tuple(columns)


def radius_words(frame: Frame, feed: RadiusFeed) -> str:
    """Return the numbers below the chart, or why there is no chart, as HTML."""
    if feed.problem is not None:
        return problem(feed, "The curve could not be drawn", "Compute the curve")
    curve = feed.drawing
    if curve is None:
        return box(dim(progress(feed).capitalize()))
    note = "" if feed.is_current else f' <span class="ex-dim ex-small">{progress(feed)}</span>'
    if not isinstance(curve, RadiusCurve):
        return alert("Nothing is accessible, even without radii", sentence(curve.reason)) + note
    if float(curve.volumes[0]) <= 0.0:
        return box(dim(f"The workspace is empty.{note}"))
    design = frame.state.design
    marks = marks_of(curve, common_radius(design))
    return box(
        f'<div class="ex-line"><b>Accessible volume</b>{note}</div>',
        table(_row(mark, curve, design.unit_mm) for mark in marks),
        f'<div class="ex-dim ex-after">{first_collision(curve, design.reach)}</div>',
    )


def first_collision(curve: RadiusCurve, reach: float) -> str:
    """Return a sentence on the legs that collide first as their radii grow, and where."""
    least = curve.least
    closest = float(least.clearance.min())
    if not np.isfinite(closest):
        return "No two legs can meet."
    first = np.flatnonzero(least.clearance <= closest)
    meetings = [
        f"legs {i} and {j} at {_position(least.position[pair])}"
        for pair, (i, j) in ((int(pair), PAIRS[pair]) for pair in first)
    ]
    if closest > 0.0:
        return f"First collision within the limits: {'; '.join(meetings)}."
    on_base = np.abs(least.position[first, 2]).max() <= 1e-6 * reach
    where = ", where z = 0" if on_base else ""
    return f"Even without radii legs touch within the limits{where}: {'; '.join(meetings)}."


def _row(mark: RadiusMark, curve: RadiusCurve, unit_mm: float) -> str:
    if mark.radius is None:
        value, note = "they differ", ""
    else:
        value, note = format_number(mark.radius, 3), f"{format_number(mark.radius * unit_mm, 3)} mm"
        if mark.label == "present radius":
            share = volume_at(curve, mark.radius) / float(curve.volumes[0])
            note = f"{format_number(100.0 * share, 3)} %"
    return row(f"{swatch(mark.colour, 'ex-dot')}{mark.label}", value, dim(note))


def _position(position: FloatArray) -> str:
    rounded = np.round(position, 6) + 0.0
    return "(" + ", ".join(format_number(float(x), 3) for x in rounded) + ")"
