"""The mechanism: its pose, its design, and how it is drawn."""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial
from typing import get_args

import viser

from explorer.app.features.designs.feature import DesignName
from explorer.app.features.feature import Feature, Services, Tab
from explorer.app.features.mechanism.bodies import Bodies, Flags, Legs, TwinLegs
from explorer.app.features.mechanism.folds import Leaves, add_fold_sliders
from explorer.app.features.mechanism.incidences import Gaps, Tetrahedra
from explorer.app.features.mechanism.marks import DragHandle, Labels
from explorer.app.features.mechanism.modes import MODES, Ghosts, ModesPanel
from explorer.app.inputs import ranges
from explorer.app.inputs.bindings import ControlBinding, item
from explorer.app.inputs.controls import Controls
from explorer.app.inputs.limits import bound_entry, bound_switch, limit_span
from explorer.app.inputs.ranges import Intervals, Span
from explorer.app.state import actions, geometry, moves
from explorer.app.state.frame import Frame
from explorer.app.state.geometry import open_geometry, preset_of, set_unit
from explorer.app.state.moves import set_mode
from explorer.app.state.state import Hold, State
from explorer.app.state.view import LengthName
from explorer.app.widgets.buttons import figure
from explorer.app.widgets.chips import Chips, StateCommand, choose
from explorer.app.widgets.markup import alert, box, group, note, remark
from explorer.mechanism.design import VARIABLES
from explorer.mechanism.design_file import PRESETS
from explorer.page.look import read_file
from explorer.page.widgets.palette import NO_OPTION, Key, shift
from explorer.workspace.limits.table import LIMITS, Limit, LimitSlider, Switch

JOINT_HINTS = {
    "l1  leg 1": "Leg 1: length of the actuator from a1 to b1 (U joint, actuator, ball joint).",
    "d1  leg 2 slide": "Leg 2: position of its carriage on the guide, from a1.",
    "d2  leg 2": "Leg 2: length of the actuator from the guide, perpendicular to it, to b2.",
    "d3  leg 3 slide": "Leg 3: position of its carriage on the guide, from a1.",
    "d4  leg 3": "Leg 3: length of the actuator from the guide, perpendicular to it, to b3.",
    "l4  leg 4": "Leg 4: length of the actuator from a3 to b4 (U joint, actuator, ball joint).",
}
"""Hints by the labels of the joints, in their order."""

ANGLES = (
    ("yaw", "about the base's z, the first of three", 180.0),
    ("pitch", "about the y that yaw turned, the second of three", 90.0),
    ("roll", "about the platform's x, the third of three", 180.0),
)
COORDINATES = {
    "position": ("Pose", "Set the position of a point, and yaw, pitch and roll."),
    "lengths": ("Leg lengths", "Set the six lengths of the actuators."),
    "folds": (
        "Folds",
        "Set a distance, two angles and the folds, each of which changes one margin.",
    ),
}
POINTS = {
    "b4": ("b4", "Set the position of b4, and turn about it."),
    "tool": ("tool point", "Set the position of the design's tool point, and turn about it."),
}
VARIABLE_HINTS = {
    "a3x": "x of a3 in the base frame; leg 4 starts there.",
    "a3y": "y of a3 in the base frame; never zero.",
    "b1x": "x of b1 in the platform frame; leg 1 ends there.",
    "b1y": "y of b1 in the platform frame; never zero.",
    "b2": "x of b2 in the platform frame; leg 2 ends there.",
    "b3": "x of b3 in the platform frame; leg 3 ends there, never at b2.",
}
HOLDS: dict[str, Hold] = {"hold the pose": "pose", "hold the legs": "legs"}


class MovePanel(Controls):
    """Six sliders for the pose, the lengths or the folds, messages on lengths, and the modes."""

    def __init__(self, services: Services) -> None:
        super().__init__(services)
        gui = services.gui
        self._coordinates = _choice(services, "Set by", "view.coordinates", COORDINATES)
        self._points = _choice(services, "Position of", "view.at", POINTS)
        self.markup(self._switch)
        sliders = gui.add_folder("")
        self.follow(sliders, "label", _sliders_title)
        with sliders:
            position = gui.add_html(group("position", "xyz"))
            for axis, name in enumerate("xyz"):
                self.slider(
                    name,
                    f"The {name} coordinate of b4 or of the tool point in the base frame.",
                    item(lambda frame: frame.state.position, axis, moves.set_position),
                    partial(ranges.position_span, axis=axis),
                    power=1,
                    visible=_is_by_position,
                )
            angles = gui.add_html(group("angles", [name for name, _, _ in ANGLES]))
            for mark in (position, angles):
                self.follow(mark, "visible", lambda frame: _is_by_position(frame.state))
            for axis, (name, order, edge) in enumerate(ANGLES):
                self.slider(
                    f"{name} (°)",
                    f"Rotation of the platform {order}, in degrees.",
                    item(lambda frame: frame.state.yaw_pitch_roll, axis, moves.set_angle),
                    Span(-edge, edge, 0.1),
                    visible=_is_by_position,
                )
            for joint, (label, hint) in enumerate(JOINT_HINTS.items()):
                self.slider(
                    label,
                    hint,
                    item(lambda frame: frame.state.joints, joint, moves.set_joint),
                    partial(ranges.joint_span, joint=joint),
                    tinted=partial(closing_values, joint=joint),
                    closes_up=True,
                    power=1,
                    visible=_is_by_lengths,
                )
            add_fold_sliders(self)
            self.markup(lambda frame: message(frame.state) if _is_told(frame.state) else "")
            nearest = self.button(
                "Use the nearest length",
                "Move this leg to the nearest length that closes and stays clear of "
                "singularities; the other legs stay as they are.",
                moves.use_nearest,
                icon=viser.Icon.MAGNET,
                main=True,
                keys=(Key("U"),),
            )
            self.follow(nearest, "visible", lambda frame: _is_told(frame.state))
            self.follow(nearest, "disabled", lambda frame: not _can_close(frame.state))
            self.button(
                "Home pose",
                "Return to the home pose, with which the design opens.",
                moves.go_home,
                icon=viser.Icon.HOME,
                keys=(Key("H"),),
            )

    def _switch(self, frame: Frame) -> str:
        state = frame.state
        buttons, points = self._coordinates.buttons(state), box(self._points.html(state))
        switch = f'<div class="ex-segments" role="toolbar" aria-label="Set by">{buttons}</div>'
        return switch + points * _is_by_position(state)


def _sliders_title(frame: Frame) -> str:
    state = frame.state
    units = state.unit.name if _is_by_lengths(state) else f"{state.unit.name}, degrees"
    return f"{COORDINATES[state.view.coordinates][0]} ({units})"


def _is_told(state: State) -> bool:
    """Whether lengths are told of: what is wrong with one is, whatever the sliders are."""
    return _is_by_lengths(state) or state.unclosed is not None or state.remark is not None


def _can_close(state: State) -> bool:
    return state.unclosed is not None and state.unclosed.nearest is not None


def closing_values(frame: Frame, joint: int) -> Intervals:
    """Return the values of a joint at which the lengths close, in the unit of the view."""
    unit = frame.state.unit.factor
    return tuple((unit * low, unit * high) for low, high in frame.snapshot.intervals[joint])


def _is_by_position(state: State) -> bool:
    return state.view.coordinates == "position"


def _is_by_lengths(state: State) -> bool:
    return state.view.coordinates == "lengths"


def _choice(
    services: Services, title: str, path: str, options: Mapping[str, tuple[str, str]]
) -> Chips:
    """Return the options of the value at a path, with words and hint of each, in a titled row."""
    chips = {
        value: StateCommand(
            f"Pose › {title} › {words}",
            hint,
            *choose(path, value, title, words),
            # Without a tool b4 is the only point.
            lambda state, value=value: value != "tool" or any(state.design.tool.position),
        )
        for value, (words, hint) in options.items()
    }
    return Chips(services.buttons, services.session, path, title, chips)


def message(state: State) -> str:
    """Return the message on the lengths of the legs as HTML, in a box of constant height."""
    if state.unclosed is not None:
        text = alert("", state.unclosed.words(state.unit))
    elif state.remark is not None:
        text = remark("", state.remark)
    else:
        text = note("Tinted: values at which the lengths close, the other joints as they are.")
    return f'<div class="ex-message">{text}</div>'


class DesignPanel(Controls):
    """The controls for all values of a design file."""

    def __init__(self, services: Services) -> None:
        super().__init__(services)
        gui = services.gui
        with gui.add_folder("Design"):
            self.dropdown(
                "Preset",
                "Open one of the designs of the paper's Table 1, in its home pose. The machine, "
                "the radii of the legs, and what is asked and shown stay.",
                (*PRESETS, NO_OPTION),
                ControlBinding(
                    lambda frame: preset_of(frame.state.design) or NO_OPTION,
                    lambda state, name: open_geometry(PRESETS.get(name, state.design), state),
                ),
                is_in_palette=True,
            )
            self.dropdown(
                "On a change",
                "What a change of the design keeps: the pose, or the lengths of the legs.",
                HOLDS,
                "hold",
                is_in_palette=True,
            )
            self.button(
                "Reset",
                "Return to the design as it was opened.",
                actions.reset_design,
                icon=viser.Icon.RESTORE,
            )
        with self.folder("Design variables ({unit})"):
            gui.add_html(read_file("sketch.svg"))
            for index, name in enumerate(VARIABLES):
                self.slider(
                    name,
                    VARIABLE_HINTS[name],
                    ControlBinding(
                        lambda frame, index=index: frame.state.design.variables[index],
                        lambda _, value, name=name: geometry.set_variable(name, value),
                    ),
                    partial(ranges.variable_span, index=index),
                    power=1,
                )
            self.number(
                "1 unit (mm)",
                "Millimetres in one design unit: variables, limits and home grow with it. The "
                "machine, the radii of the legs, and what is asked keep their millimetres.",
                ControlBinding(lambda frame: frame.state.design.unit_mm, set_unit),
                least=1e-6,
                step=0.001,
            )
            self.dropdown(
                "Lengths in",
                "Unit in which lengths are shown and typed, here and everywhere on the page.",
                get_args(LengthName),
                "view.lengths",
                is_in_palette=True,
            )
        with self.folder("Limits ({unit})", is_open=False):
            self._add_limits(in_degrees=False)
        with self.folder("Radii of the legs ({unit})", is_open=False):
            for leg in range(4):
                self.slider(
                    f"leg {leg + 1}",
                    f"Radius of leg {leg + 1}, a capsule about its axis.",
                    f"design.limits.leg_radii.{leg}",
                    ranges.radius_span,
                    power=1,
                )
        with gui.add_folder("Swing of the joints (°)", expand_by_default=False):
            self._add_limits(in_degrees=True)

    def _add_limits(self, *, in_degrees: bool) -> None:
        """Add the controls of those limits that are angles, or of the others."""
        switches: list[Switch] = []
        for limit in LIMITS:
            if in_degrees != any(entry.is_angle for entry in limit.entries):
                continue
            if limit.switch is not None and limit.switch not in switches:
                switches.append(limit.switch)
                words = limit.switch.label, limit.switch.hint
                self.checkbox(*words, bound_switch(limit.switch))
            for entry in limit.entries:
                self._add_entry(limit, entry)

    def _add_entry(self, limit: Limit, entry: LimitSlider) -> None:
        add = self.slider if entry.is_number else self.ends
        add(
            entry.label,
            entry.hint,
            bound_entry(limit, entry),
            lambda state: limit_span(state.base, entry),
            power=int(not entry.is_angle),
            disabled=lambda state: limit.switch is not None and limit.value(state.design) is None,
        )


def limits_figure(frame: Frame) -> str:
    """Return how many limits the pose breaks, as HTML."""
    broken = [each.words(frame.state.unit) for each in frame.snapshot.violations]
    if broken:
        words, look, hint = f"{len(broken)} broken", "ex-beyond", "; ".join(broken)
        hint = f"Outside the limits: {hint}."
    elif frame.snapshot.is_singular:
        words, look = "kept, but singular", ""
        hint = "The pose keeps all limits of the design, but it is singular."
    else:
        words, look, hint = "kept", "ex-within", "The pose keeps all limits of the design."
    return figure("Design", "Limits", words, hint=hint, look=look)


MECHANISM = Feature(
    "mechanism",
    manual="mechanism.md",
    tabs=(
        Tab("build", "Pose", MovePanel, viser.Icon.ARROWS_MOVE),
        Tab("build", "Pose", ModesPanel),
        Tab("build", "Design", DesignPanel, viser.Icon.RULER_2),
    ),
    bar=(("left", DesignName), ("middle", lambda _: limits_figure)),
    verdicts={
        "Limits kept": "The pose keeps all limits of the design.",
        "Limits broken": "The pose is outside limits of the design, such as a length of a leg.",
    },
    # Bodies come first: they make the platform's frame, to which others attach.
    scene=(Bodies, Flags, Legs, TwinLegs, Tetrahedra, Leaves, Gaps, Labels, Ghosts, DragHandle),
    commands=(
        StateCommand(
            "Pose › Next assembly mode",
            "Assemble the same leg lengths in the next of the eight ways.",
            lambda state: set_mode((state.mode + 1) % len(MODES)),
            keys=(Key("N"),),
        ),
        StateCommand(
            "Pose › Previous assembly mode",
            "Assemble the same leg lengths in the previous of the eight ways.",
            lambda state: set_mode((state.mode - 1) % len(MODES)),
            keys=(shift("N"),),
        ),
    ),
)
