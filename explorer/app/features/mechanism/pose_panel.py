"""The panel that moves the mechanism, by its joints, its pose or its assembly mode."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping

import viser

from explorer.app.features.feature import Services
from explorer.app.features.mechanism.folds import add_fold_sliders
from explorer.app.features.mechanism.modes import ModesPanel
from explorer.app.inputs.bindings import Bound
from explorer.app.inputs.controls import Controls
from explorer.app.inputs.ranges import joint_span, position_span
from explorer.app.inputs.tracks import Span
from explorer.app.state.actions import (
    GoHome,
    Set,
    SetAngle,
    SetJoint,
    SetPosition,
    UseNearest,
)
from explorer.app.state.frame import Frame
from explorer.app.state.parts import value_at
from explorer.app.state.state import State
from explorer.app.widgets.assigning import Update
from explorer.app.widgets.chips import Chip, Chips, Effect
from explorer.app.widgets.markup import alert, box, note, remark
from explorer.mechanism.design import JOINTS

JOINT_HINTS = {
    "l1": "Leg 1: length of the actuator from a1 to b1 (U joint, actuator, ball joint).",
    "d1": "Leg 2: position of its carriage on the guide, from a1.",
    "d2": "Leg 2: length of the actuator from the guide, perpendicular to it, to b2.",
    "d3": "Leg 3: position of its carriage on the guide, from a1.",
    "d4": "Leg 3: length of the actuator from the guide, perpendicular to it, to b3.",
    "l4": "Leg 4: length of the actuator from a3 to b4 (U joint, actuator, ball joint).",
}
JOINT_LABELS = {
    "l1": "l1  leg 1",
    "d1": "d1  leg 2 slide",
    "d2": "d2  leg 2",
    "d3": "d3  leg 3 slide",
    "d4": "d4  leg 3",
    "l4": "l4  leg 4",
}
ANGLES = (
    ("yaw", "about the base's z, the first of three", 180.0),
    ("pitch", "about the y that yaw turned, the second of three", 90.0),
    ("roll", "about the platform's x, the third of three", 180.0),
)
COORDINATES: dict[str, tuple[str, str]] = {
    "position": (
        "Position and angles",
        "Show and set the position of a point, and yaw, pitch and roll.",
    ),
    "folds": (
        "Folds",
        (
            "Show and set a distance, two angles and the three folds, each of which changes one "
            "margin alone. The ends of the sliders are singular."
        ),
    ),
}
POINTS: dict[str, tuple[str, str]] = {
    "b4": ("b4", "Show and set the position of b4, and turn about it."),
    "tool": (
        "tool point",
        (
            "Show and set the position of the tool point, and turn about it. It is b4 until the "
            "design has a tool elsewhere."
        ),
    ),
}


class MovePanel:
    """Sliders for joints and pose, the table of modes, and messages on lengths."""

    def __init__(self, services: Services) -> None:
        gui = services.gui
        self._controls = controls = Controls(gui, services.session)
        with gui.add_folder("Legs (design units)"):
            for joint, name in enumerate(JOINTS):
                self._add_joint(joint, name)
            self._message = gui.add_html("")
            self._nearest = controls.button(
                "Use the nearest length",
                "Move this leg to the nearest length that closes and stays clear of "
                "singularities; the other legs stay as they are.",
                UseNearest,
                icon=viser.Icon.MAGNET,
                main=True,
            )
        self._coordinates = _choice(
            services, ("pose.coordinates", "Set as", "view.coordinates"), COORDINATES
        )
        self._points = _choice(
            services,
            ("pose.point", "Position of", "view.at"),
            POINTS,
            lambda state, at: at == "b4" or any(state.design.tool.position),
        )
        self._pose = gui.add_folder("")
        with self._pose:
            self._choices = gui.add_html("")
            add_fold_sliders(controls)
            for axis, name in enumerate("xyz"):
                self._add_position(axis, name)
            for axis, (name, order, edge) in enumerate(ANGLES):
                self._add_angle(axis, name, order, edge)
            controls.button(
                "Home pose",
                "Return to the pose that the design opens with.",
                GoHome,
                icon=viser.Icon.HOME,
            )
        self._mode_folder = gui.add_folder("")
        with self._mode_folder:
            self._modes = ModesPanel(services)

    def _add_joint(self, joint: int, name: str) -> None:
        self._controls.slider(
            JOINT_LABELS[name],
            JOINT_HINTS[name],
            Bound(lambda frame: frame.state.joints[joint], lambda _, value: SetJoint(joint, value)),
            lambda state: joint_span(state, joint),
            tinted=lambda frame: frame.snapshot.intervals[joint],
            closes_up=True,
        )

    def _add_position(self, axis: int, name: str) -> None:
        self._controls.slider(
            name,
            f"The {name} coordinate of b4 or of the tool point in the base frame.",
            Bound(
                lambda frame: frame.state.position[axis],
                lambda _, value: SetPosition(axis, value),
            ),
            lambda state: position_span(state, axis),
            visible=_is_by_position,
        )

    def _add_angle(self, axis: int, name: str, order: str, edge: float) -> None:
        self._controls.slider(
            f"{name} (°)",
            f"Rotation of the platform {order}, in degrees.",
            Bound(
                lambda frame: frame.state.yaw_pitch_roll[axis],
                lambda _, value: SetAngle(axis, value),
            ),
            Span(-edge, edge, 0.1),
            visible=_is_by_position,
        )

    def updates(self, frame: Frame) -> Iterator[Update]:
        """Yield the updates that make the panel show the frame."""
        state, unclosed = frame.state, frame.state.unclosed
        is_by_position = _is_by_position(state)
        pose = f"Pose of {state.point}" if is_by_position else "Pose by its folds"
        choices = self._coordinates.html(state) + (self._points.html(state) * is_by_position)
        yield self._pose, "label", f"{pose} (design units, degrees)"
        yield self._mode_folder, "label", f"Assembly modes: {state.point} (design units)"
        yield self._choices, "content", box(choices)
        yield self._message, "content", message(state)
        yield self._nearest, "disabled", unclosed is None or unclosed.nearest is None
        yield from self._controls.updates(frame)
        yield from self._modes.updates(frame)


def _is_by_position(state: State) -> bool:
    return state.view.coordinates == "position"


def _choice(
    services: Services,
    row: tuple[str, str, str],
    options: Mapping[str, tuple[str, str]],
    is_ready: Callable[[State, str], bool] = lambda _, __: True,
) -> Chips:
    """Return the options of a value of the state.

    Args:
        services: Services of the page.
        row: Name of the row among the buttons, its title, and path of the value.
        options: Words and hint of each option, by its value.
        is_ready: Function that tells whether a state allows an option.
    """
    name, title, path = row

    def chip(value: str, words: str, hint: str) -> Chip:
        effect = Effect(
            lambda _: Set(path, value, title, words), lambda state: value_at(state, path) == value
        )
        command = f"Pose › {title} › {words}"
        return Chip(words, command, hint, effect, lambda state: is_ready(state, value))

    chips = {value: chip(value, words, hint) for value, (words, hint) in options.items()}
    return Chips(services.buttons, services.session, name, title, chips)


def message(state: State) -> str:
    """Return the message on the lengths of the legs as HTML, in a box of constant height."""
    if state.unclosed is not None:
        text = alert("", str(state.unclosed))
    elif state.remark is not None:
        text = remark("", state.remark)
    else:
        text = note("Tinted: values at which the lengths close, the other joints as they are.")
    return f'<div class="ex-message">{text}</div>'
