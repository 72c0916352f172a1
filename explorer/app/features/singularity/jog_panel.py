"""The six uncoupled motions: each moves one margin and no other, up to its singularity."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace
from typing import get_args

import viser

from explorer.app.browser.viser_gaps import Mark
from explorer.app.features.mechanism.pose_panel import interval_marks
from explorer.app.features.singularity.actions import Jog, SetSingularView, jog_start
from explorer.app.session.session import Session
from explorer.app.state.frame import Frame
from explorer.app.state.state import State
from explorer.app.state.view import Arrows
from explorer.app.widgets.assigning import Update
from explorer.app.widgets.colours import css, proximity_colour
from explorer.app.widgets.controls import Controls, Span
from explorer.app.widgets.markup import DIM, format_number, signed
from explorer.app.widgets.ranges import coordinate_span
from explorer.singularity.bruhat import incidences
from explorer.singularity.uncoupled import UNCOUPLED, Travel, UncoupledMotion

FOLDERS = {
    "platform": "One margin: on the platform's x′ and z′",
    "base": "One margin: on the base's x and z",
}
THROUGH = {"platform": "b4", "base": "a1"}
UNITS = {"translation": "design units", "rotation": "degrees"}
ARROWS: tuple[Arrows, ...] = get_args(Arrows)
TURN = Span(-180.0, 180.0, 0.1)


class JogPanel:
    """Six sliders, each from where its motion was first used, marked where it is singular."""

    def __init__(self, gui: viser.GuiApi, session: Session) -> None:
        self._controls = Controls(gui, session)
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
                        "Draw the motions as arrows and arcs, from singularity to singularity.",
                        ARROWS,
                        lambda frame: frame.state.view.singular.arrows,
                        lambda state, chosen: SetSingularView(
                            replace(state.view.singular, arrows=ARROWS[ARROWS.index(chosen)])
                        ),
                    )

    def _add_motion(self, index: int, motion: UncoupledMotion) -> None:
        def span(state: State) -> Span:
            return TURN if motion.kind == "rotation" else coordinate_span(state)

        def marks(frame: Frame) -> tuple[Mark, ...]:
            start, here = jog_start(frame.state, index), frame.state.pose
            travel = frame.travels[index] if start == here else motion.travel(start)
            return travel_marks(in_shown_units(motion, travel), span(frame.state))

        self._controls.slider(
            jog_label(motion),
            f"Moves δ{motion.incidence} and no other margin: "
            f"{'moves' if motion.kind == 'translation' else 'turns'} the platform {motion.name} "
            f"through {THROUGH[motion.frame]}, in {UNITS[motion.kind]} from where this began. The "
            "marks are singular.",
            lambda frame: jog_amount(frame.state, index),
            lambda _, value: Jog(index, value),
            span,
            marks=marks,
        )

    def updates(self, frame: Frame) -> Iterator[Update]:
        """Yield what makes the panel show the frame."""
        for frame_name, handle in self._tables.items():
            yield handle, "content", travel_table(frame, frame_name)
        yield from self._controls.updates(frame)


def jog_label(motion: UncoupledMotion) -> str:
    """Return the words beside a motion's slider."""
    return f"{_short_name(motion)} (°)" if motion.kind == "rotation" else _short_name(motion)


def _short_name(motion: UncoupledMotion) -> str:
    """Return such as "δ1: about x′": the platform's axes have a prime."""
    way = "about" if motion.kind == "rotation" else "along"
    prime = "′" if motion.frame == "platform" else ""
    return f"δ{motion.incidence}: {way} {motion.axis}{prime}"


def jog_amount(state: State, index: int) -> float:
    """Return how far a motion has gone, 0 if it is not in use; in degrees if it turns."""
    jog = state.jog_in_use
    return jog.amount if jog is not None and jog.motion == index else 0.0


def in_shown_units(motion: UncoupledMotion, travel: Travel) -> Travel:
    """Return a travel in degrees if the motion turns, in design units otherwise."""
    if motion.kind == "translation":
        return travel
    return Travel(math.degrees(travel.low), math.degrees(travel.high))


def travel_marks(travel: Travel, span: Span) -> tuple[Mark, ...]:
    """Return marks where a motion is singular, as far as its slider goes."""
    ends = [end for end in (travel.low, travel.high) if span.low <= end <= span.high]
    if len(ends) == 2 and ends[0] != ends[1]:
        return interval_marks(((ends[0], ends[1]),), span)
    return tuple((end, signed(end, 1)) for end in dict.fromkeys(ends))


def travel_table(frame: Frame, frame_name: str) -> str:
    """Return how far each motion on one frame's axes may go from here, as HTML."""
    rows = "".join(_row(frame, motion) for motion in UNCOUPLED if motion.frame == frame_name)
    return (
        '<div style="padding:2px 12px 6px;font-size:12px;line-height:1.45;'
        'font-variant-numeric:tabular-nums"><table style="width:100%;border-collapse:collapse">'
        f'<tr style="{DIM}"><td>to singular, units or °</td><td style="text-align:right">back</td>'
        f'<td style="text-align:right">ahead</td></tr>{rows}</table></div>'
    )


def _row(frame: Frame, motion: UncoupledMotion) -> str:
    travel = in_shown_units(motion, frame.travels[UNCOUPLED.index(motion)])
    unit = "°" if motion.kind == "rotation" else ""
    colour = css(proximity_colour(frame.verdict.levels[motion.incidence - 1], 1.0))
    swatch = (
        '<span style="display:inline-block;width:8px;height:8px;border-radius:2px;'
        f'background:{colour};margin-right:6px"></span>'
    )
    size = 180.0 if motion.kind == "rotation" else frame.state.design.reach
    back, ahead = (_end(end, unit, size) for end in (travel.low, travel.high))
    if motion.incidence in incidences(frame.snapshot.stratum):
        back, ahead = "singular", "here"
    return (
        f"<tr><td>{swatch}{_short_name(motion)}</td>"
        f'<td style="text-align:right">{back}</td><td style="text-align:right">{ahead}</td></tr>'
    )


def _end(value: float, unit: str, size: float) -> str:
    if math.isinf(value):
        return f'<span style="{DIM}">never</span>'
    return f"{format_number(value, 3, size=size)}{unit}"
