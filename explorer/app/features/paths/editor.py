"""The list of the poses of a path with its buttons, and the fields of one."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from html import escape

import viser

from explorer.app.features.feature import Services
from explorer.app.features.paths import stops
from explorer.app.features.paths.state import MOST_STOPS, Paths, Stop, StopAt
from explorer.app.inputs.bindings import ControlBinding
from explorer.app.inputs.controls import Controls
from explorer.app.state.actions import Action
from explorer.app.state.state import State
from explorer.app.widgets import markup
from explorer.app.widgets.buttons import press_button
from explorer.errors import InputError
from explorer.mechanism.configuration import position_of
from explorer.mechanism.margins import mode_name
from explorer.mechanism.pose import Pose, Triple
from explorer.numerics.number_text import (
    format_decimals,
    format_fitted,
    format_number,
    snap_to_decimals,
)

PRESENT, TYPED = "Present pose", "Typed numbers"
MODES = tuple(f"Mode {mode}:  {mode_name(mode)}" for mode in range(8))
OPTIONS = (PRESENT, *MODES, TYPED)
# Values of the buttons of the rows.
ROWS = tuple(map(str, range(MOST_STOPS)))
# Decimals of typed angles and coordinates.
DECIMALS = 9
ZERO: Triple = (0.0, 0.0, 0.0)


def add_stops(services: Services, controls: Controls) -> None:
    """Add the list of poses to a panel, and the fields of the one that is chosen."""
    controls.markup(lambda frame: markup.box(list_stops(frame.state), acts))
    controls.dropdown(
        "Pose",
        "The chosen pose of the list: the present one, an assembly mode of the present leg "
        "lengths by the signs of δ1 δ2 δ3, or numbers, typed or by its handle in the scene. "
        "Present, the first one follows the platform, and the others are kept as numbers.",
        OPTIONS,
        ControlBinding(lambda frame: _option(frame.state), _choose),
        visible=_is_chosen,
    )
    for index, words, hint, step in (
        (0, "x, y, z ({unit})", "Coordinates of b4 or of the tool point in the base.", 0.01),
        (1, "angles (°)", "Yaw, pitch and roll of the platform, in degrees.", 0.1),
    ):
        controls.triple(
            f"Pose {words}",
            hint,
            ControlBinding(
                lambda frame, index=index: typed_numbers(frame.state)[index],
                lambda state, triple, index=index: _set_typed(state, index, triple),
            ),
            step=step,
            power=1 - index,
            visible=lambda state: Paths.of(state).edited_pose is not None,
        )
    controls.number(
        "Pause (s)",
        "Time for which the platform rests in the chosen pose.",
        ControlBinding(
            lambda frame: stop.pause if (stop := _stop(frame.state)) else 0.0,
            lambda state, pause: stops.set_stop(
                state, f"pause {format_number(pause)} s", pause=pause
            ),
        ),
        least=0.0,
        step=0.1,
        visible=_is_chosen,
    )
    changes: dict[str, Callable[[State, int], Action | None]] = {
        "choose": lambda _, i: stops.choose_stop(i),
        "copy": stops.copy_stop,
        "lift": stops.lift_stop,
        "remove": stops.remove_stop,
    }

    for name, change in changes.items():
        services.do_on_press(
            f"paths.{name}", lambda row, change=change: partial(_change_row, change, row), ROWS
        )
    links = (
        services.link(
            "paths.add",
            "Paths › Add the present pose",
            "Add the present pose to the path, after the chosen one or as the last.",
            stops.add_present,
        ),
        services.link(
            "paths.close",
            "Paths › Back to the first pose",
            "End the path in its first pose.",
            stops.close_path,
        ),
    )
    acts = f'<div class="ex-ends">{"".join(links)}</div>'

    def take(data: bytes, name: str, client: viser.ClientHandle | None) -> None:
        who = None if client is None else client.client_id

        def change(state: State) -> Action:
            action = stops.stops_in_table(state, data, name)
            services.tell(action.describe(state), who)
            return action

        services.session.do(change, who=who)

    services.add_upload(
        "Poses from a file …",
        "A table of poses such as explorer inverse --poses reads (CSV); a column pause_s has "
        "the pauses.",
        "text/csv",
        take,
    )


def _change_row(
    change: Callable[[State, int], Action | None], row: str, state: State
) -> Action | None:
    return change(state, int(row)) if int(row) < len(stops.stops_of(state)) else None


def list_stops(state: State) -> str:
    """Return the poses of the next path as rows of HTML; the chosen one is marked."""
    listed, own = stops.stops_of(state), len(Paths.of(state).stops)
    chosen = stops.chosen_of(state)
    return "".join(
        _row(state, index, stop, is_chosen=index == chosen, is_own=index < own)
        for index, stop in enumerate(listed)
    )


def _row(state: State, index: int, stop: Stop, *, is_chosen: bool, is_own: bool) -> str:
    number, acts = index + 1, ""
    for name, sign, words, is_there in (
        ("copy", "+", f"Copy pose {number}, to change the copy", True),
        ("lift", "↑", f"Move pose {number} up", index > 0 and is_own),
        ("remove", "×", f"Remove pose {number}", is_own),
    ):
        acts += press_button(
            f"paths.{name}",
            index,
            sign,
            hint=words,
            label=words,
            class_name="ex-link",
            is_disabled=not is_there,
        )
    what = "present" if stop.at is None else f"mode {stop.at}"
    name = "" if isinstance(stop.at, Pose) else f"{what}: "
    pause = f"{format_number(stop.pause)} s at " if stop.pause else ""
    words = press_button(
        "paths.choose",
        index,
        f"{number}. {pause}{name}{numbers_of(state, stop.at)}",
        hint="Change this pose",
        label=f"Pose {number}",
        class_name="ex-fill",
        is_on=is_chosen,
    )
    look = "ex-row is-here" if is_chosen else "ex-row" if is_own else "ex-row ex-dim"
    return f'<div class="{look}">{words}<span class="ex-whole">{acts}</span></div>'


def numbers_of(state: State, at: StopAt) -> str:
    """Return the six numbers of a pose of the path, or why there are none, as HTML."""
    try:
        pose = stops.pose_of(state, at)
    except InputError as error:
        return f'<span class="ex-close">{escape(markup.sentence(str(error)))}</span>'
    there = position_of(state.design, pose, state.view.at)
    unit, size = state.unit, state.unit.convert(state.design.reach)
    position = ", ".join(format_fitted(unit.convert(x), size, 4) for x in there)
    angles = ", ".join(f"{_degrees(angle)}°" for angle in pose.yaw_pitch_roll)
    hint = f"x, y, z of {state.point} in {unit.name}; yaw, pitch, roll"
    return f'<span title="{hint}">{position} · {angles}</span>'


def _degrees(angle: float) -> str:
    return format_decimals(angle, 1).removesuffix(".0")


def typed_numbers(state: State) -> tuple[Triple, Triple]:
    """Return position, of b4 or of the tool point, and angles of the chosen pose, or zeros."""
    pose = Paths.of(state).edited_pose
    if pose is None:
        return ZERO, ZERO
    there = position_of(state.design, pose, state.view.at)
    x, y, z = (snap_to_decimals(coordinate, DECIMALS, state.design.reach) for coordinate in there)
    yaw, pitch, roll = (snap_to_decimals(angle, DECIMALS, 180.0) for angle in pose.yaw_pitch_roll)
    return (x, y, z), (yaw, pitch, roll)


def _set_typed(state: State, index: int, triple: Triple) -> Action | None:
    """Set the position of the chosen pose, or with index 1 its angles."""
    pose, there = Paths.of(state).edited_pose, triple
    if pose is None:
        return None
    if index:
        there = position_of(state.design, pose, state.view.at)
        pose = Pose.of_yaw_pitch_roll(pose.position, triple)
    return stops.set_stop(state, TYPED, at=state.pose_at(there, pose))


def _stop(state: State) -> Stop | None:
    chosen = stops.chosen_of(state)
    return None if chosen is None else stops.stops_of(state)[chosen]


def _is_chosen(state: State) -> bool:
    return stops.chosen_of(state) is not None


def _option(state: State) -> str:
    stop = _stop(state)
    if stop is None or stop.at is None:
        return PRESENT
    return TYPED if isinstance(stop.at, Pose) else MODES[stop.at]


def _choose(state: State, option: str) -> Action | None:
    stop, chosen = _stop(state), stops.chosen_of(state)
    if stop is None:
        return None
    at: StopAt = None
    if option in MODES:
        at = MODES.index(option)
    elif option == TYPED:
        at = stops.pose_of(state, stop.at)
    elif chosen:
        # It is of use once the platform has moved away.
        at = state.pose
    return stops.set_stop(state, option, at=at)
