"""Sliders for the six uncoupled motions, each of which changes one margin and no other.

A slider goes from one singular pose of its motion to the other, or as far as other coordinates go;
its ends say how far away they are.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Iterator
from typing import get_args

from explorer.app.browser.viser_gaps import Mark
from explorer.app.features.feature import Services
from explorer.app.features.singularity.actions import Jog, jog_start
from explorer.app.inputs.bindings import Bound
from explorer.app.inputs.controls import Controls
from explorer.app.inputs.ranges import coordinate_span
from explorer.app.inputs.tracks import Span
from explorer.app.state.frame import Frame
from explorer.app.state.state import State
from explorer.app.state.view import Arrows
from explorer.app.widgets.assigning import Update
from explorer.app.widgets.markup import box, dim, fitted
from explorer.singularity.uncoupled import UNCOUPLED, Travel, UncoupledMotion, travels

FRAMES = {
    "platform": "Platform’s axes x′ and z′ through b4",
    "base": "Base’s axes x and z through a1",
}
UNITS = {"translation": "design units", "rotation": "degrees"}
ARROWS: tuple[Arrows, ...] = get_args(Arrows)
TURN_SPAN = Span(-180.0, 180.0, 0.1)
# Share of its size up to which a travel is rounding.
ROUNDING = 1e-9
NEVER, BEYOND, HERE = "never", "beyond", "singular"
"""Labels of the ends of a slider: there is no singular pose, it is farther away, it is here."""


class JogPanel:
    """Six sliders for amounts from the start of each motion."""

    def __init__(self, services: Services) -> None:
        gui = services.gui
        self._controls = Controls(gui, services.session)
        for frame_name, words in FRAMES.items():
            gui.add_html(box(dim(words)))
            for index, motion in enumerate(UNCOUPLED):
                if motion.frame == frame_name:
                    self._add_motion(index, motion)
        self._controls.dropdown(
            "Arrows",
            "Draw the motions as arrows and arcs between their singular poses.",
            ARROWS,
            "view.singular.arrows",
        )

    def _add_motion(self, index: int, motion: UncoupledMotion) -> None:
        self._controls.slider(
            jog_label(motion),
            f"Change δ{motion.incidence} alone: "
            f"{'move' if motion.kind == 'translation' else 'turn'} the platform {motion.name}, "
            f"in {UNITS[motion.kind]} from the start of the motion. It ends at singular poses; "
            f"“{NEVER}” stands where there is none, “{BEYOND}” where it is farther away.",
            Bound(lambda frame: jog_amount(frame.state, index), lambda _, value: Jog(index, value)),
            lambda state: jog_span(state, index),
            ends=lambda frame: travel_marks(frame, index),
        )

    def updates(self, frame: Frame) -> Iterator[Update]:
        """Yield the updates that make the panel show the frame."""
        yield from self._controls.updates(frame)


def jog_label(motion: UncoupledMotion) -> str:
    """Return the words beside a motion's slider; the platform's axes have a prime."""
    preposition = "about" if motion.kind == "rotation" else "along"
    prime = "′" if motion.frame == "platform" else ""
    unit = " (°)" if motion.kind == "rotation" else ""
    return f"δ{motion.incidence}: {preposition} {motion.axis}{prime}{unit}"


def jog_amount(state: State, index: int) -> float:
    """Return the amount of a motion, in design units or degrees; 0 if it is not in use."""
    jog = state.jog_in_use
    return jog.amount if jog is not None and jog.motion == index else 0.0


_travels_from = functools.lru_cache(16)(travels)


def shown_travel(state: State, index: int) -> Travel:
    """Return the travel of a motion from its start to the singular poses, in shown units.

    Both are zero if the start is singular but for rounding.
    """
    travel, size = _travels_from(jog_start(state, index))[index], state.design.reach
    if UNCOUPLED[index].kind == "rotation":
        travel, size = Travel(math.degrees(travel.low), math.degrees(travel.high)), 180.0
    return Travel(0.0, 0.0) if min(-travel.low, travel.high) <= ROUNDING * size else travel


def jog_span(state: State, index: int) -> Span:
    """Return the range of a motion's slider, which ends at its singular poses if they are near."""
    whole = TURN_SPAN if UNCOUPLED[index].kind == "rotation" else coordinate_span(state)
    travel = shown_travel(state, index)
    if travel.low == travel.high:
        return whole
    # In whole steps outwards, so that the start is among the values of the slider.
    low = math.floor(travel.low / whole.step) * whole.step if travel.low > whole.low else whole.low
    high = (
        math.ceil(travel.high / whole.step) * whole.step if travel.high < whole.high else whole.high
    )
    return Span(low, high, whole.step)


def travel_marks(frame: Frame, index: int) -> tuple[Mark, ...]:
    """Return marks at the ends of a motion's slider: how far away its singular poses are."""
    motion, span = UNCOUPLED[index], jog_span(frame.state, index)
    travel = shown_travel(frame.state, index)
    if travel.low == travel.high:
        return ((0.0, HERE), (0.0, ""))
    unit, size = ("°", 180.0) if motion.kind == "rotation" else ("", frame.state.design.reach)

    def mark(end: float, edge: float) -> Mark:
        if math.isinf(end):
            return edge, NEVER
        if abs(end) > abs(edge):
            return edge, BEYOND
        return end, f"{fitted(end, size, 4)}{unit}"

    return mark(travel.low, span.low), mark(travel.high, span.high)
