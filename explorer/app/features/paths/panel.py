"""Paths, straight or planned: the list of poses, and what makes, plays and exports a path."""

from __future__ import annotations

import math
from functools import lru_cache
from html import escape

import viser

from explorer.app.features.feature import Services, html_of
from explorer.app.features.loads.load import Loads
from explorer.app.features.paths import actions, plots, stops
from explorer.app.features.paths.actions import DRIVES_FEED, DrivesDrawing
from explorer.app.features.paths.editor import add_stops
from explorer.app.features.paths.state import PathKind, Paths, journey_of
from explorer.app.inputs.bindings import At, ControlBinding
from explorer.app.inputs.controls import Controls
from explorer.app.inputs.ranges import Span
from explorer.app.state.actions import Set
from explorer.app.state.frame import Frame
from explorer.app.state.state import State
from explorer.app.widgets import markup
from explorer.app.widgets.blocks import render
from explorer.app.widgets.buttons import extra_button, press_button
from explorer.app.widgets.chips import Chips, StateCommand, choose
from explorer.errors import ExplorerError, InputError
from explorer.export.tables import trajectory_csv
from explorer.files.extras import is_missing
from explorer.mechanism.margins import margins, mode_name, mode_of
from explorer.numerics.number_text import format_number
from explorer.page.widgets.palette import Key
from explorer.paths.loads import PathLoads

LAWS = {
    "Slow enough to watch": "watchable",
    "In a given time": "duration",
    "In the shortest time": "shortest",
}
SLOWER = {"Real time": 1.0, "10 times slower": 10.0, "100 times slower": 100.0}
KINDS: dict[PathKind, tuple[str, str]] = {
    "straight": (
        "Straight",
        "Move the point straight from pose to pose; limits and collisions are not checked.",
    ),
    "planned": (
        "Without singularity",
        "Search for a path along the poses that keeps all limits, margins and clearances.",
    ),
}
CANCEL = Set("paths.planning", None, "Planning", "stopped")
CLEAR = Set("paths.journey", None, "Path", "cleared")


class PathsPanel(Controls):
    """The poses and the kind of a path, and the path that was made, in its one time."""

    def __init__(self, services: Services) -> None:
        super().__init__(services)
        gui, self._downloads, self._loads = services.gui, services.downloads, services.get(Loads)
        kinds = {
            kind: StateCommand(f"Paths › {words}", hint, *choose("paths.kind", kind, "Path"))
            for kind, (words, hint) in KINDS.items()
        }
        self._feed = services.get(DRIVES_FEED)
        self._missing = {
            extra: extra_button(extra) if is_missing(extra) else ""
            for extra in ("planning", "timing")
        }
        self._kind_chips = Chips(services.buttons, services.session, "paths.kind", "", kinds)
        gui.add_html(markup.beside(2))
        with gui.add_folder("Path"):
            add_stops(services, self)
            self.markup(self._kinds)
            self.checkbox(
                "Hold the load",
                "Demand that the load of the tab Loads, with the weights chosen there, stays "
                "within the limits of actuators, struts and guide all along the path.",
                "paths.holds_load",
                visible=_is_planned,
            )
            self.markup(lambda frame: plots.demand_note(frame.state))
            self.go = self.button(
                "Go",
                "Make the path along the poses, and play it.",
                actions.go,
                icon=viser.Icon.ROUTE,
                main=True,
                keys=(Key("J"),),
            )
            self.follow(self.go, "disabled", lambda frame: Paths.of(frame.state).is_planning)
            self.number(
                "Time limit (s)",
                "Time after which the search for a path stops without one.",
                "paths.seconds",
                least=0.1,
                step=0.1,
                visible=_is_planned,
            )
        with gui.add_folder("Time"):
            self.dropdown(
                "Time law",
                "Time that the path takes, in playback, charts, files and motors alike. The "
                "platform rests at every pose.",
                LAWS,
                At("paths.law", action=actions.SetLaw),
            )
            self.number(
                "Duration (s)",
                "Time that the path takes with its pauses: in each move the fastest actuator "
                "accelerates over one half of its travel and brakes over the other, always by the "
                "same.",
                At("paths.duration", action=actions.SetLaw),
                least=0.01,
                step=0.01,
                visible=lambda state: Paths.of(state).law == "duration",
            )
            self.dropdown(
                "Playback",
                "Play in the time of the path, or slower, which the bar then tells.",
                SLOWER,
                "paths.slower",
            )
            self.markup(self._title)
            self.time = self.slider(
                "Time (s)",
                "Time on the path.",
                ControlBinding(
                    lambda frame: journey.at if (journey := journey_of(frame.state)) else 0.0,
                    lambda _, value: actions.set_path_time(value),
                ),
                _time_span,
                visible=lambda state: journey_of(state) is not None,
            )
            self.markup(margins_chart)
        with gui.add_folder("Drives"):
            self.markup(self._drives_html)
        services.do_on_press("paths.play", lambda on: actions.play(on == "on"), ("on", "off"))
        self._clear = services.link(
            "paths.clear",
            "Paths › Clear",
            "Remove the path and its line.",
            lambda state: None if journey_of(state) is None else CLEAR,
        )
        services.link(
            "paths.cancel",
            "Paths › Cancel planning",
            "Stop the search for a path.",
            lambda state: CANCEL if Paths.of(state).is_planning else None,
        )
        services.buttons.on("paths.export", self._export)
        services.buttons.offer(
            "Paths › Export CSV",
            "Save time, joints and pose along the path, in equal times of each move.",
            "paths.export",
            is_ready=lambda: journey_of(self._session.state) is not None,
        )

    def _kinds(self, frame: Frame) -> str:
        state = frame.state
        chips = f'<div class="ex-flow">{self._kind_chips.buttons(state)}</div>'
        missing = self._missing["planning"] if _is_planned(state) else ""
        return markup.box(chips, f'<div class="ex-small">{kind_note(state)}</div>', missing)

    def _title(self, frame: Frame) -> str:
        loads = plots.loads_along(journey_of(frame.state), self._loads.of(frame))
        return plan_words(frame.state) or path_title(frame.state, loads, self._clear)

    def _drives_html(self, frame: Frame) -> str:
        state = frame.state
        if journey_of(state) is None:
            return markup.box(markup.dim("What a path asks of the motors, once there is one."))
        if Paths.of(state).law == "shortest" and self._missing["timing"]:
            return self._missing["timing"]
        return html_of(self._feed, drives_html, "Drives")

    def _export(self, _: str, client: viser.ClientHandle) -> None:
        state = self._session.latest_state()
        journey = journey_of(state)
        if journey is not None:
            unit_mm = 1.0 if state.view.lengths == "mm" else None
            data = trajectory_csv(journey.trajectory, unit_mm).encode()
            self._downloads.send(client.client_id, f"{journey.design.name}-path.csv", data)


def margins_chart(frame: Frame) -> str:
    """Return the margins over the path of a frame as HTML; "" without one."""
    journey = journey_of(frame.state)
    return "" if journey is None else plots.margins_html(journey, frame.state.unit)


@lru_cache(2)
def drives_html(drawing: DrivesDrawing | ExplorerError) -> str:
    """Return the actuators' speeds, forces and powers along a path, or why none, as HTML."""
    if isinstance(drawing, ExplorerError):
        return markup.alert("No speeds and forces", markup.sentence(str(drawing)))
    return f'{render(drawing.blocks)}<div class="ex-map ex-drives">{drawing.charts}</div>'


def kind_note(state: State) -> str:
    """Return whether a path of the chosen kind exists along the poses, as HTML."""
    if Paths.of(state).kind == "straight":
        return markup.dim("May pass singular poses, which are marked.")
    try:
        poses = stops.poses_of(state)
    except InputError:
        return ""
    start, *others = (int(mode_of(margins(p.position, p.rotation))) for p in poses)
    goal = next((mode for mode in others if mode != start), start)
    if start == goal:
        return markup.dim(f"All poses are in mode {start} ({mode_name(start)}).")
    words = f"There is none from mode {start} to mode {goal}."
    return f'<span class="ex-close" title="Every path between two modes is singular">{words}</span>'


def plan_words(state: State) -> str | None:
    """Return the progress of planning, or why it led to no path, as HTML; None otherwise."""
    paths = Paths.of(state)
    if paths.is_planning:
        hint = "Stop the search"
        cancel = press_button("paths.cancel", "", "Cancel", hint=hint, class_name="ex-button")
        words = markup.dim(f"Planning, for {format_number(paths.seconds)} s at most …")
        return markup.box(f'<div class="ex-line">{words}{cancel}</div>')
    if paths.problem is not None:
        return markup.alert("No path", markup.sentence(paths.problem))
    return None


def path_title(state: State, loads: PathLoads | None, clear: str = "") -> str:
    """Return the title of the path, its crossings and loads, and its buttons, as HTML."""
    journey = journey_of(state)
    if journey is None:
        return markup.box(markup.dim("No path yet. Add poses and press Go."))
    on, words, hint = (
        ("off", "Pause", "Stop here") if journey.is_playing else ("on", "Play", "Move along it")
    )
    play = press_button("paths.play", on, words, hint=hint, class_name="ex-button ex-play")
    export = press_button(
        "paths.export",
        "",
        "CSV",
        hint="Save time, joints and pose in equal times of each move, and both ends of each pause; "
        "lengths as the page shows them",
        label="Export CSV",
        class_name="ex-button",
    )
    title = escape(journey.title)
    duration = format_number(journey.trajectory.duration, 3)
    times = f"Takes {duration} s" + (f", played {slow}" if (slow := slow_words(state)) else "")
    if journey.problem is not None:
        times += f", slow enough to watch, since it cannot be as asked for: {journey.problem}"
    look = "" if journey.problem is None else "ex-close"
    return markup.box(
        f'<div class="ex-line">{play}<span class="ex-cut ex-fill" title="{title}">{title}</span>'
        f"{export}{clear}</div>",
        f'<div class="{look}">{escape(markup.sentence(times))}</div>',
        plots.crossing_words(journey, state.unit),
        "" if loads is None else plots.load_words(journey, loads),
    )


def slow_words(state: State) -> str:
    """Return by how much playback is slower than the path, in words; "" if it is not."""
    times = Paths.of(state).slower
    return "" if times == 1.0 else f"{format_number(times)} times slower"


def _is_planned(state: State) -> bool:
    return Paths.of(state).kind == "planned"


def _time_span(state: State) -> Span:
    journey = journey_of(state)
    # Rounded up to whole steps, so that the end of the slider is a round number.
    seconds = 1.0 if journey is None else math.ceil(100.0 * journey.trajectory.duration) / 100.0
    return Span(0.0, max(seconds, 0.01), 0.01)
