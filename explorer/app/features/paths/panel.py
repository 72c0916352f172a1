"""Paths: between assembly modes, or planned; played, with the margins along them, and exported."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from html import escape

import viser

from explorer.app.features.mechanism.pose_panel import MODES
from explorer.app.features.paths.actions import (
    CancelPlan,
    ChooseModes,
    Plan,
    Play,
    SetPathTime,
    SetPlanSeconds,
    StoreEnd,
    WatchModes,
    chosen_modes,
)
from explorer.app.features.paths.margin_plot import MarginPlot
from explorer.app.session.session import Session
from explorer.app.state.frame import Frame
from explorer.app.state.state import State
from explorer.app.widgets.assigning import Update
from explorer.app.widgets.controls import Controls, Span
from explorer.app.widgets.markup import DIM, alert, signed
from explorer.mechanism.pose import Pose, yaw_pitch_roll_from_rotation

STORE = ("start", "goal")
BOX = (
    '<div style="padding:2px 12px 6px;font-size:12.5px;line-height:1.45;'
    'font-variant-numeric:tabular-nums">'
)


class PathsPanel:
    """Makes paths and plays them.

    Args:
        gui: Where it is added.
        session: To which it posts.
        save: Sends the path at hand as CSV to a client.
    """

    def __init__(
        self, gui: viser.GuiApi, session: Session, save: Callable[[int | None], None]
    ) -> None:
        self._session = session
        self._controls = controls = Controls(gui, session)
        with gui.add_folder("Between assembly modes"):
            controls.dropdown(
                "From",
                "The assembly mode to start from, by the signs of δ1 δ2 δ3.",
                MODES,
                lambda frame: MODES[chosen_modes(frame.state)[0]],
                lambda state, chosen: ChooseModes(MODES.index(chosen), chosen_modes(state)[1]),
            )
            controls.dropdown(
                "To",
                "The assembly mode to end in. Where a sign differs, any path is singular once "
                "at least.",
                MODES,
                lambda frame: MODES[chosen_modes(frame.state)[1]],
                lambda state, chosen: ChooseModes(chosen_modes(state)[0], MODES.index(chosen)),
            )
            controls.button(
                "Watch",
                "Go the straight way from one to the other, from the present leg lengths back "
                "to the same ones.",
                WatchModes,
                icon=viser.Icon.PLAYER_PLAY,
            )
        with gui.add_folder("Without singularity"):
            self._ends = gui.add_html("")
            self.store = gui.add_button_group(
                "Store as", STORE, hint="Keep the present pose as the start or the goal."
            )
            self.store.on_click(self._stored)
            controls.number(
                "Time limit (s)",
                "How long to look for a path.",
                lambda frame: frame.state.paths.seconds,
                lambda _, value: SetPlanSeconds(value),
                least=0.1,
                step=0.1,
            )
            self.plan = controls.button(
                "Plan",
                "Look for a path that keeps all limits, margins and clearances.",
                Plan,
                icon=viser.Icon.ROUTE,
            )
            self.cancel = controls.button(
                "Cancel", "Stop looking.", CancelPlan, icon=viser.Icon.PLAYER_STOP
            )
            self._status = gui.add_html("", visible=False)
        with gui.add_folder("Playback"):
            self._title = gui.add_html("")
            self.time = controls.slider(
                "Time (s)",
                "How far along the path. On a planned one the fastest actuator goes a tenth of the "
                "reach a second.",
                lambda frame: 0.0 if frame.state.journey is None else frame.state.journey.at,
                lambda _, value: SetPathTime(value),
                _time_span,
                disabled=lambda state: state.journey is None,
            )
            self.play = controls.button(
                "Play", "Move along the path.", lambda: Play(True), icon=viser.Icon.PLAYER_PLAY
            )
            self.pause = controls.button(
                "Pause", "Stay here.", lambda: Play(False), icon=viser.Icon.PLAYER_PAUSE
            )
            self._plot = MarginPlot(gui)
            self.export = gui.add_button(
                "Export CSV",
                hint="Time, joints and pose, evenly spaced in time; lengths in design units.",
                icon=viser.Icon.DOWNLOAD,
            )
            self.export.on_click(lambda event: save(event.client_id))

    def _stored(self, event: viser.GuiEvent[viser.GuiButtonGroupHandle]) -> None:
        end = STORE[STORE.index(event.target.value)]
        self._session.do(StoreEnd("start" if end == "start" else "goal"), who=event.client_id)

    def updates(self, frame: Frame) -> Iterator[Update]:
        """Yield what makes the panel show the frame."""
        state = frame.state
        paths, journey = state.paths, state.journey
        yield self._ends, "content", ends_table(state)
        yield self.plan, "visible", not paths.is_planning
        yield self.cancel, "visible", paths.is_planning
        status = plan_words(state)
        yield self._status, "visible", status is not None
        if status is not None:
            yield self._status, "content", status
        playing = journey is not None and journey.is_playing
        yield self.play, "visible", journey is not None and not playing
        yield self.pause, "visible", playing
        yield self.export, "visible", journey is not None
        yield self._title, "content", _title(state)
        yield from self._plot.updates(frame)
        yield from self._controls.updates(frame)


def ends_table(state: State) -> str:
    """Return the stored start and goal as HTML."""
    rows = "".join(
        f'<tr><td style="{DIM};padding:1px 8px 1px 0">{name}</td>{_cells(pose)}</tr>'
        for name, pose in (("start", state.paths.start), ("goal", state.paths.goal))
    )
    return (
        f'{BOX}<table style="width:100%;border-collapse:collapse"><tr style="{DIM}"><td></td>'
        '<td style="text-align:right">x, y, z</td><td style="text-align:right">yaw, pitch, roll'
        f"</td></tr>{rows}</table></div>"
    )


def _cells(pose: Pose | None) -> str:
    if pose is None:
        return f'<td colspan="2" style="text-align:right;{DIM}">move there, then store it</td>'
    place = ", ".join(f"{signed(v, 1)}" for v in pose.position)
    angles = yaw_pitch_roll_from_rotation(pose.rotation).tolist()
    turn = ", ".join(f"{signed(v, 0)}°" for v in angles)
    right = '<td style="text-align:right;white-space:nowrap">'
    return f"{right}{place}</td>{right}{turn}</td>"


def plan_words(state: State) -> str | None:
    """Return how planning goes, or why there is no path, as HTML; None without news."""
    paths = state.paths
    if paths.is_planning:
        return f'{BOX}<span style="{DIM}">Planning, for {paths.seconds:g} s at most …</span></div>'
    if paths.problem is not None:
        problem = paths.problem
        return alert("No path", f"{problem[:1].upper()}{problem[1:]}.")
    return None


def _title(state: State) -> str:
    journey = state.journey
    if journey is None:
        words = "No path at hand: watch one between modes, or plan one."
        return f'{BOX}<span style="{DIM}">{words}</span></div>'
    return (
        f"{BOX}<b>{escape(journey.title)}</b> "
        f'<span style="{DIM}">{journey.trajectory.duration:.2f} s</span></div>'
    )


def _time_span(state: State) -> Span:
    journey = state.journey
    # In whole steps, so that the end of the slider is a round number.
    seconds = 1.0 if journey is None else math.ceil(100.0 * journey.trajectory.duration) / 100.0
    return Span(0.0, max(seconds, 0.01), 0.01)
