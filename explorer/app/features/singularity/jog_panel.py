"""Sliders for the six uncoupled motions, each of which changes one margin and no other."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import get_args

import viser

from explorer.app.features.feature import Services
from explorer.app.features.singularity.actions import Jog, jog_start
from explorer.app.state.frame import Frame
from explorer.app.state.state import State
from explorer.app.state.view import Arrows
from explorer.app.widgets.assigning import Update
from explorer.app.widgets.colours import proximity_colour
from explorer.app.widgets.controls import Bound, Controls, Intervals, Span
from explorer.app.widgets.markup import box, dim, format_number, row, swatch, table
from explorer.app.widgets.ranges import coordinate_span
from explorer.singularity.bruhat import incidences
from explorer.singularity.uncoupled import UNCOUPLED, Travel, UncoupledMotion

FOLDERS = {
    "platform": "Uncoupled motions: platform axes x′, z′",
    "base": "Uncoupled motions: base axes x, z",
}
THROUGH = {"platform": "b4", "base": "a1"}
UNITS = {"translation": "design units", "rotation": "degrees"}
ARROWS: tuple[Arrows, ...] = get_args(Arrows)
TURN_SPAN = Span(-180.0, 180.0, 0.1)


class JogPanel:
    """Six sliders for amounts from the start of each motion, tinted up to singular poses."""

    def __init__(self, services: Services) -> None:
        gui = services.gui
        self._controls = Controls(gui, services.session)
        self._tables: dict[str, viser.GuiHtmlHandle] = {}
        for frame_name, title in FOLDERS.items():
            with gui.add_folder(title):
                for index, motion in enumerate(UNCOUPLED):
                    if motion.frame == frame_name:
                        self._add_motion(index, motion)
                self._tables[frame_name] = gui.add_html("")
                if frame_name == "base":
                    self._controls.dropdown(
                        "Arrows",
                        "Draw the motions as arrows and arcs between their singular poses.",
                        ARROWS,
                        "view.singular.arrows",
                    )

    def _add_motion(self, index: int, motion: UncoupledMotion) -> None:
        def span(state: State) -> Span:
            return TURN_SPAN if motion.kind == "rotation" else coordinate_span(state)

        def tinted(frame: Frame) -> Intervals:
            start, here = jog_start(frame.state, index), frame.state.pose
            travel = frame.travels[index] if start == here else motion.travel(start)
            shown = in_shown_units(motion, travel)
            return ((shown.low, shown.high),)

        self._controls.slider(
            jog_label(motion),
            f"Change δ{motion.incidence} alone: "
            f"{'move' if motion.kind == 'translation' else 'turn'} the platform {motion.name} "
            f"through {THROUGH[motion.frame]}, in {UNITS[motion.kind]} from the start of the "
            "motion; the tinted part ends at singular poses.",
            Bound(lambda frame: jog_amount(frame.state, index), lambda _, value: Jog(index, value)),
            span,
            tinted=tinted,
        )

    def updates(self, frame: Frame) -> Iterator[Update]:
        """Yield the updates that make the panel show the frame."""
        for frame_name, handle in self._tables.items():
            yield handle, "content", travel_table(frame, frame_name)
        yield from self._controls.updates(frame)


def jog_label(motion: UncoupledMotion) -> str:
    """Return the words beside a motion's slider."""
    return f"{_short_name(motion)} (°)" if motion.kind == "rotation" else _short_name(motion)


def _short_name(motion: UncoupledMotion) -> str:
    """Return a name such as "δ1: about x′"; the platform's axes have a prime."""
    preposition = "about" if motion.kind == "rotation" else "along"
    prime = "′" if motion.frame == "platform" else ""
    return f"δ{motion.incidence}: {preposition} {motion.axis}{prime}"


def jog_amount(state: State, index: int) -> float:
    """Return the amount of a motion, in design units or degrees; 0 if it is not in use."""
    jog = state.jog_in_use
    return jog.amount if jog is not None and jog.motion == index else 0.0


def in_shown_units(motion: UncoupledMotion, travel: Travel) -> Travel:
    """Return a travel in degrees if the motion turns, in design units otherwise."""
    if motion.kind == "translation":
        return travel
    return Travel(math.degrees(travel.low), math.degrees(travel.high))


def travel_table(frame: Frame, frame_name: str) -> str:
    """Return the travel of each motion on one frame's axes to its singular poses, as HTML."""
    rows = (_row(frame, motion) for motion in UNCOUPLED if motion.frame == frame_name)
    return box(table(rows, ("to singularity (units, °)", "backward", "forward")))


def _row(frame: Frame, motion: UncoupledMotion) -> str:
    travel = in_shown_units(motion, frame.travels[UNCOUPLED.index(motion)])
    unit = "°" if motion.kind == "rotation" else ""
    colour = proximity_colour(frame.verdict.levels[motion.incidence - 1], 1.0)
    size = 180.0 if motion.kind == "rotation" else frame.state.design.reach
    back, ahead = (_travel_text(end, unit, size) for end in (travel.low, travel.high))
    if motion.incidence in incidences(frame.snapshot.stratum):
        back, ahead = "singular", "here"
    return row(f"{swatch(colour)}{_short_name(motion)}", back, ahead)


def _travel_text(value: float, unit: str, size: float) -> str:
    if math.isinf(value):
        return dim("never")
    return f"{format_number(value, 3, size=size)}{unit}"
