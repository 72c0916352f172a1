"""Paths, straight or planned: their ends, and the controls that make, play and export them."""

from __future__ import annotations

import math
from html import escape
from typing import Literal

import viser

from explorer.app.features.feature import Services, show_html
from explorer.app.features.paths import actions, plots
from explorer.app.features.paths.drives import DrivesPanel
from explorer.app.features.paths.state import End, PathKind, Paths, journey_of
from explorer.app.inputs.bindings import ControlBinding
from explorer.app.inputs.controls import Controls
from explorer.app.inputs.ranges import Span
from explorer.app.state.actions import Action, Set
from explorer.app.state.frame import Frame
from explorer.app.state.state import State, angles_of
from explorer.app.widgets import markup
from explorer.app.widgets.buttons import extra_button, press_button
from explorer.app.widgets.chips import Chips, StateCommand, choose
from explorer.errors import InputError
from explorer.export.tables import trajectory_csv
from explorer.files.extras import is_missing
from explorer.mechanism.configuration import position_of
from explorer.mechanism.margins import margins, mode_name, mode_of
from explorer.mechanism.pose import Pose, Triple
from explorer.numerics.number_text import (
    format_decimals,
    format_fitted,
    format_number,
    snap_to_decimals,
)
from explorer.page.widgets.assigning import Updates
from explorer.page.widgets.palette import Key

EndName = Literal["start", "goal"]
ENDS: tuple[EndName, ...] = ("start", "goal")
HINTS: dict[EndName, str] = {
    "start": (
        "The pose in which the path begins: the present one, an assembly mode of the present leg "
        "lengths by the signs of δ1 δ2 δ3, or typed numbers, which begin with those shown."
    ),
    "goal": (
        "The pose in which the path ends: an assembly mode of the present leg lengths by the "
        "signs of δ1 δ2 δ3, the present pose, which is kept as numbers, or typed numbers."
    ),
}
PRESENT, TYPED = "Present pose", "Typed numbers"
MODES = tuple(f"Mode {mode}:  {mode_name(mode)}" for mode in range(8))
OPTIONS: dict[EndName, tuple[str, ...]] = {
    "start": (PRESENT, *MODES, TYPED),
    "goal": (*MODES, PRESENT, TYPED),
}
KINDS: dict[PathKind, tuple[str, str]] = {
    "straight": (
        "Straight",
        "Move the point straight from start to goal; limits and collisions are not checked.",
    ),
    "planned": (
        "Without singularity",
        "Search for a path that keeps all limits, margins and clearances.",
    ),
}
CANCEL = Set("paths.planning", None, "Planning", "stopped")
CLEAR = Set("paths.journey", None, "Path", "cleared")
# Decimals of typed angles and coordinates.
DECIMALS = 9


class PathsPanel:
    """The ends and the kind of a path, and the path that was made, with its margins."""

    def __init__(self, services: Services) -> None:
        gui, self._session = services.gui, services.session
        self._loads = plots.LoadsAlong(services)
        self._downloads, self._controls = services.downloads, Controls(services)
        kinds = {
            kind: StateCommand(f"Paths › {words}", hint, *choose("paths.kind", kind, "Path"))
            for kind, (words, hint) in KINDS.items()
        }
        self._missing = extra_button("planning") if is_missing("planning") else ""
        self._kind_chips = Chips(services.buttons, services.session, "paths.kind", "", kinds)
        gui.add_html(markup.beside(2))
        with gui.add_folder("Path"):
            self._numbers = [self._add_end(gui, end) for end in ENDS]
            self._kinds = gui.add_html("")
            self._controls.checkbox(
                "Hold the load",
                "Demand that the load of the tab Loads, with the weights chosen there, stays "
                "within the limits of actuators, struts and guide all along the path.",
                "paths.holds_load",
                visible=_is_planned,
            )
            self._demand = gui.add_html("")
            self.go = self._controls.button(
                "Go",
                "Make the path from the start to the goal, and play it.",
                actions.Go,
                icon=viser.Icon.ROUTE,
                main=True,
                keys=(Key("J"),),
            )
            self._controls.number(
                "Time limit (s)",
                "Time after which the search for a path stops without one.",
                "paths.seconds",
                least=0.1,
                step=0.1,
                visible=_is_planned,
            )
        with gui.add_folder("Playback"):
            self._title = gui.add_html("")
            self.time = self._controls.slider(
                "Time (s)",
                "Time on the path. A straight path takes 8 s; on a planned one the fastest "
                "actuator moves a tenth of the reach per second.",
                ControlBinding(
                    lambda frame: journey.at if (journey := journey_of(frame.state)) else 0.0,
                    lambda _, value: actions.SetPathTime(value),
                ),
                _time_span,
                disabled=lambda state: journey_of(state) is None,
            )
            self._margins = gui.add_html("", visible=False)
        with gui.add_folder("Drives"):
            self._drives = DrivesPanel(services, self._controls)
        services.do_on_press("paths.play", lambda word: actions.Play(word == "on"), ("on", "off"))
        services.do_on_press("paths.cancel", lambda _: CANCEL)
        self._clear = services.link(
            "paths.clear",
            StateCommand(
                "Paths › Clear",
                "Remove the path and its line.",
                lambda state: None if journey_of(state) is None else CLEAR,
            ),
        )
        buttons = services.buttons
        buttons.on("paths.export", self._export)
        buttons.offer(
            "Paths › Cancel planning",
            "Stop the search for a path.",
            "paths.cancel",
            is_ready=lambda: Paths.of(self._session.state).is_planning,
        )
        buttons.offer(
            "Paths › Export CSV",
            "Save time, joints and pose along the path, evenly spaced in time.",
            "paths.export",
            is_ready=lambda: journey_of(self._session.state) is not None,
        )

    def updates(self, frame: Frame) -> Updates:
        """Yield the updates that make the panel show the frame."""
        state = frame.state
        for end, handle in zip(ENDS, self._numbers, strict=True):
            is_typed = _is_typed(state, end)
            yield from show_html(handle, "" if is_typed else end_numbers(state, end))
        chips = f'<div class="ex-flow">{self._kind_chips.buttons(state)}</div>'
        missing = self._missing if Paths.of(state).kind == "planned" else ""
        kinds = markup.box(chips, f'<div class="ex-small">{kind_note(state)}</div>', missing)
        yield self._kinds, "content", kinds
        yield self.go, "disabled", Paths.of(state).is_planning
        title = plan_words(state) or path_title(state, self._loads.shares(frame), self._clear)
        yield self._title, "content", title
        yield from show_html(self._demand, plots.demand_note(state))
        journey = journey_of(state)
        margins = "" if journey is None else plots.margins_html(journey, state.unit)
        yield from show_html(self._margins, margins)
        yield from self._drives.updates(frame)
        yield from self._controls.updates(frame)

    def _add_end(self, gui: viser.GuiApi, end: EndName) -> viser.GuiHtmlHandle:
        title = end.capitalize()
        self._controls.dropdown(
            title,
            HINTS[end],
            OPTIONS[end],
            ControlBinding(
                lambda frame: _option(frame.state, end),
                lambda state, chosen: _choose(state, end, chosen),
            ),
        )
        numbers = gui.add_html("")
        place = "Coordinates of b4 or of the tool point in the base frame."
        turn = "Yaw, pitch and roll of the platform, in degrees."
        for index, words, hint, step in (
            (0, "x, y, z ({unit})", place, 0.01),
            (1, "angles (°)", turn, 0.1),
        ):
            self._controls.triple(
                f"{title} {words}",
                hint,
                ControlBinding(
                    lambda frame, index=index: typed_numbers(frame.state, end)[index],
                    lambda state, triple, index=index: _set_typed(state, end, index, triple),
                ),
                step=step,
                power=1 - index,
                visible=lambda state: _is_typed(state, end),
            )
        return numbers

    def _export(self, _: str, client: viser.ClientHandle) -> None:
        state = self._session.latest_state()
        journey = journey_of(state)
        if journey is not None:
            unit_mm = 1.0 if state.view.lengths == "mm" else None
            data = trajectory_csv(journey.trajectory, unit_mm).encode()
            self._downloads.send(client.client_id, f"{journey.design.name}-path.csv", data)


def end_numbers(state: State, end: EndName) -> str:
    """Return the six numbers of an end that is not typed, as HTML."""
    try:
        pose = actions.pose_of_end(state, _end(state, end))
    except InputError as error:
        return f'<div class="ex-note ex-close">{escape(markup.sentence(str(error)))}</div>'
    there = position_of(state.design, pose, state.view.at)
    unit, size = state.unit, state.unit.convert(state.design.reach)
    position = ", ".join(format_fitted(unit.convert(x), size, 4) for x in there)
    angles = ", ".join(f"{format_decimals(angle, 1)}°" for angle in angles_of(pose))
    hint = f"x, y, z of {state.point}; yaw, pitch, roll"
    return markup.note(f'<span title="{hint}">{position} {unit.name} · {angles}</span>')


def kind_note(state: State) -> str:
    """Return whether a path of the chosen kind exists between the ends, as HTML."""
    if Paths.of(state).kind == "straight":
        return markup.dim("May pass singular poses, which are marked.")
    try:
        ends = actions.ends_of(state)
    except InputError:
        return ""
    start, goal = (int(mode_of(margins(end.position, end.rotation))) for end in ends)
    if start == goal:
        return markup.dim(f"Both ends are in mode {start} ({mode_name(start)}).")
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


def path_title(state: State, loads: plots.JourneyLoads | None, clear: str = "") -> str:
    """Return the title of the path, its crossings and loads, and its buttons, as HTML."""
    journey = journey_of(state)
    if journey is None:
        return markup.box(markup.dim("No path yet. Choose a goal and press Go."))
    on, words, hint = (
        ("off", "Pause", "Stop here") if journey.is_playing else ("on", "Play", "Move along it")
    )
    play = press_button("paths.play", on, words, hint=hint, class_name="ex-button ex-play")
    export = press_button(
        "paths.export",
        "",
        "CSV",
        hint="Save time, joints and pose, evenly spaced in time; lengths in design units",
        label="Export CSV",
        class_name="ex-button",
    )
    title = escape(journey.title)
    return markup.box(
        f'<div class="ex-line">{play}<span class="ex-cut ex-fill" title="{title}">{title}</span>'
        f"{export}{clear}</div>",
        plots.crossing_words(journey, state.unit),
        "" if loads is None else plots.load_words(loads),
    )


def _end(state: State, end: EndName) -> End:
    return Paths.of(state).start if end == "start" else actions.goal_of(state)


def _option(state: State, end: EndName) -> str:
    chosen = _end(state, end)
    if chosen is None:
        return PRESENT
    return TYPED if isinstance(chosen, Pose) else MODES[chosen]


def _choose(state: State, end: EndName, option: str) -> Action:
    value: End = None
    if option in MODES:
        value = MODES.index(option)
    elif option == TYPED:
        value = actions.pose_of_end(state, _end(state, end))
    elif end == "goal":
        # It is of use once the platform has moved away.
        value = state.pose
    return actions.SetEnd(f"paths.{end}", value, end.capitalize(), option)


def _is_typed(state: State, end: EndName) -> bool:
    return isinstance(_end(state, end), Pose)


def typed_numbers(state: State, end: EndName) -> tuple[Triple, Triple]:
    """Return position, of b4 or of the tool point, and angles of a typed end; zeros for another."""
    chosen = _end(state, end)
    if not isinstance(chosen, Pose):
        return (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)
    there = position_of(state.design, chosen, state.view.at)
    x, y, z = (snap_to_decimals(coordinate, DECIMALS, state.design.reach) for coordinate in there)
    yaw, pitch, roll = (snap_to_decimals(angle, DECIMALS, 180.0) for angle in angles_of(chosen))
    return (x, y, z), (yaw, pitch, roll)


def _set_typed(state: State, end: EndName, index: int, triple: Triple) -> Action:
    """Set the position of an end, or with index 1 its angles."""
    pose, there = actions.pose_of_end(state, _end(state, end)), triple
    if index:
        there = position_of(state.design, pose, state.view.at)
        pose = Pose.of_yaw_pitch_roll(pose.position, triple)
    return actions.SetEnd(f"paths.{end}", state.pose_at(there, pose), end.capitalize(), TYPED)


def _is_planned(state: State) -> bool:
    return Paths.of(state).kind == "planned"


def _time_span(state: State) -> Span:
    journey = journey_of(state)
    # Rounded up to whole steps, so that the end of the slider is a round number.
    seconds = 1.0 if journey is None else math.ceil(100.0 * journey.trajectory.duration) / 100.0
    return Span(0.0, max(seconds, 0.01), 0.01)
