"""Paths between assembly modes and planned paths: to make, play, plot and export them."""

from __future__ import annotations

import math
from collections.abc import Iterator
from html import escape
from typing import Literal

import viser

from explorer.app.features.feature import Services
from explorer.app.features.mechanism.modes import MODES
from explorer.app.features.paths.actions import (
    CancelPlan,
    ChooseModes,
    Plan,
    Play,
    SetPathTime,
    StoreEnd,
    WatchModes,
    chosen_modes,
)
from explorer.app.features.paths.margin_plot import MarginPlot
from explorer.app.session.session import Who
from explorer.app.state.frame import Frame
from explorer.app.state.state import State
from explorer.app.widgets.assigning import Update
from explorer.app.widgets.controls import Bound, Controls, Span
from explorer.app.widgets.markup import alert, box, dim, row, sentence, signed, table
from explorer.export.trajectory import trajectory_csv
from explorer.mechanism.pose import Pose, yaw_pitch_roll_from_rotation

STORE: tuple[Literal["start", "goal"], ...] = ("start", "goal")


class PathsPanel:
    """The controls that make a path, play it and export it, and the margins along it."""

    def __init__(self, services: Services) -> None:
        gui, self._session = services.gui, services.session
        self._downloads = services.downloads
        self._controls = controls = Controls(gui, services.session)
        with gui.add_folder("Between assembly modes"):
            controls.dropdown(
                "From",
                "The assembly mode to start from, by the signs of δ1 δ2 δ3.",
                MODES,
                Bound(
                    lambda frame: MODES[chosen_modes(frame.state)[0]],
                    lambda state, chosen: ChooseModes(MODES.index(chosen), chosen_modes(state)[1]),
                ),
            )
            controls.dropdown(
                "To",
                "The assembly mode to end in. Any path between modes of different signs is "
                "singular at least once.",
                MODES,
                Bound(
                    lambda frame: MODES[chosen_modes(frame.state)[1]],
                    lambda state, chosen: ChooseModes(chosen_modes(state)[0], MODES.index(chosen)),
                ),
            )
            controls.button(
                "Watch",
                "Play the straight path between these modes; its ends have the present leg "
                "lengths.",
                WatchModes,
                icon=viser.Icon.PLAYER_PLAY,
            )
        with gui.add_folder("Without singularity"):
            self._ends = gui.add_html("")
            self.store = gui.add_button_group(
                "Store as", STORE, hint="Store the present pose as the start or the goal."
            )
            self.store.on_click(self._store_end)
            controls.number(
                "Time limit (s)",
                "Time after which planning stops without a path.",
                "paths.seconds",
                least=0.1,
                step=0.1,
            )
            self.plan = controls.button(
                "Plan",
                "Search for a path that keeps all limits, margins and clearances.",
                Plan,
                icon=viser.Icon.ROUTE,
            )
            self.cancel = controls.button(
                "Cancel", "Stop planning.", CancelPlan, icon=viser.Icon.PLAYER_STOP
            )
            self._status = gui.add_html("", visible=False)
        with gui.add_folder("Playback"):
            self._title = gui.add_html("")
            self.time = controls.slider(
                "Time (s)",
                "Time on the path. On a planned path the fastest actuator moves a tenth of the "
                "reach per second.",
                Bound(
                    lambda frame: 0.0 if frame.state.journey is None else frame.state.journey.at,
                    lambda _, value: SetPathTime(value),
                ),
                _time_span,
                disabled=lambda state: state.journey is None,
            )
            self.play = controls.button(
                "Play", "Move along the path.", lambda: Play(True), icon=viser.Icon.PLAYER_PLAY
            )
            self.pause = controls.button(
                "Pause",
                "Stop here.",
                lambda: Play(False),
                icon=viser.Icon.PLAYER_PAUSE,
            )
            self._plot = MarginPlot(gui)
            self.export = gui.add_button(
                "Export CSV",
                hint="Time, joints and pose, evenly spaced in time; lengths in design units.",
                icon=viser.Icon.DOWNLOAD,
            )
            self.export.on_click(lambda event: self._export(event.client_id))

    def _store_end(self, event: viser.GuiEvent[viser.GuiButtonGroupHandle]) -> None:
        self._session.do(StoreEnd(STORE[STORE.index(event.target.value)]), who=event.client_id)

    def _export(self, who: Who) -> None:
        journey = self._session.state.journey
        if journey is not None:
            data = trajectory_csv(journey.trajectory).encode()
            self._downloads.send(who, f"{journey.design.name}-path.csv", data)

    def updates(self, frame: Frame) -> Iterator[Update]:
        """Yield the updates that make the panel show the frame."""
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
    ends = (("start", state.paths.start), ("goal", state.paths.goal))
    rows = (row(dim(name), *_coordinates(pose)) for name, pose in ends)
    return box(table(rows, ("", "x, y, z", "yaw, pitch, roll")))


def _coordinates(pose: Pose | None) -> tuple[str, str]:
    if pose is None:
        return "", dim("not stored")
    position = ", ".join(signed(coordinate, 1) for coordinate in pose.position)
    angles = yaw_pitch_roll_from_rotation(pose.rotation).tolist()
    rotation = ", ".join(f"{signed(angle, 0)}°" for angle in angles)
    return _on_one_line(position), _on_one_line(rotation)


def _on_one_line(text: str) -> str:
    return f'<span class="ex-whole">{text}</span>'


def plan_words(state: State) -> str | None:
    """Return the progress of planning, or why it led to no path, as HTML; None otherwise."""
    paths = state.paths
    if paths.is_planning:
        return box(dim(f"Planning, for {paths.seconds:g} s at most …"))
    if paths.problem is not None:
        return alert("No path", sentence(paths.problem))
    return None


def _title(state: State) -> str:
    journey = state.journey
    if journey is None:
        return box(dim("No path yet: watch one between modes, or plan one."))
    duration = dim(f"{journey.trajectory.duration:.2f} s")
    return box(f"<b>{escape(journey.title)}</b> {duration}")


def _time_span(state: State) -> Span:
    journey = state.journey
    # Rounded up to whole steps, so that the end of the slider is a round number.
    seconds = 1.0 if journey is None else math.ceil(100.0 * journey.trajectory.duration) / 100.0
    return Span(0.0, max(seconds, 0.01), 0.01)
