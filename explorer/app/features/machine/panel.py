"""The panel of the machine: tool, payload, gravity, actuators, struts, guide and tolerances."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator
from html import escape

import msgspec

from explorer.app.features.feature import Services
from explorer.app.features.machine.actions import ANGLES, SetToolAngle
from explorer.app.features.machine.actuators import FORCE, ActuatorControls
from explorer.app.features.machine.tolerances import add_tolerances
from explorer.app.features.machine.words import DIRECTIONS, direction_name, machine_words
from explorer.app.inputs.bindings import At, Bound
from explorer.app.inputs.control import Condition
from explorer.app.inputs.controls import Controls
from explorer.app.inputs.ranges import platform_span
from explorer.app.inputs.tracks import Span
from explorer.app.state.action import Action
from explorer.app.state.actions import Set
from explorer.app.state.frame import Frame
from explorer.app.state.state import State
from explorer.app.state.values import value_at
from explorer.app.widgets.assigning import Update
from explorer.app.widgets.commands import NO_OPTION
from explorer.app.widgets.markup import box, note
from explorer.mechanism.machine import Struts
from explorer.numerics.number_text import format_number

# Limits that are switched on begin with these: N m and MPa; the tube in mm.
MOMENT, STRESS = 10.0, 200.0
OUTER, INNER = 12.0, 10.0
# Steps of the number fields, which show no more decimals.
FINE, MEDIUM = 0.001, 0.01
# What each angle of the tool turns about, and its edge in degrees.
TURNS = (
    ("about the platform's z, the first of three", 180.0),
    ("about the y that yaw turned, the second of three", 90.0),
    ("about the tool's x, the third of three", 180.0),
)


class MachinePanel:
    """The controls for the machine around the mechanism, under a line that describes it."""

    def __init__(self, services: Services) -> None:
        gui = services.gui
        self._controls = controls = Controls(gui, services.session)
        self._summary = gui.add_html("")
        with gui.add_folder("Tool on the platform (design units, degrees)"):
            self._add_tool()
        with gui.add_folder("Payload (design units, kg, N)"):
            controls.number(
                "Mass (kg)",
                "Mass that the platform carries.",
                "design.payload.mass_kg",
                least=0.0,
                step=FINE,
                small=True,
            )
            self._weight = gui.add_html("", visible=False)
            self._add_payload()
        with gui.add_folder("Gravity", expand_by_default=False):
            self._add_gravity()
        with gui.add_folder("Actuators", expand_by_default=False):
            self._actuators = ActuatorControls(gui, controls)
        with gui.add_folder("Struts of legs 2 and 3", expand_by_default=False):
            self._add_struts()
            self._moment = gui.add_html("")
        with gui.add_folder("Guide", expand_by_default=False):
            self._add_guide()
        with gui.add_folder("Tolerances", expand_by_default=False):
            add_tolerances(controls)

    def updates(self, frame: Frame) -> Iterator[Update]:
        """Yield the updates that make the panel show the frame."""
        state = frame.state
        design = state.design
        yield self._summary, "content", box(_with_units(machine_words(design)))
        weight = design.payload.weight_n
        yield self._weight, "visible", weight > 0.0
        yield (
            self._weight,
            "content",
            note(f"Its weight is {format_number(weight)} N."),
        )
        yield from self._actuators.updates(frame)
        yield self._moment, "content", note(moment_words(design.struts))
        yield from self._controls.updates(frame)

    def _add_tool(self) -> None:
        for axis, name in enumerate("xyz"):
            self._controls.slider(
                f"tool {name}",
                f"The {name} coordinate of the tool point in the platform frame, from b4.",
                f"design.tool.position.{axis}",
                platform_span,
            )
        for axis, (about, edge) in enumerate(TURNS):
            self._add_angle(axis, about, edge)

    def _add_angle(self, axis: int, about: str, edge: float) -> None:
        self._controls.slider(
            f"tool {ANGLES[axis]} (°)",
            f"Rotation of the tool on the platform {about}, in degrees.",
            Bound(
                lambda frame: frame.state.tool_angles[axis],
                lambda _, value: SetToolAngle(axis, value),
            ),
            Span(-edge, edge, 0.1),
        )

    def _add_payload(self) -> None:
        for axis, name in enumerate("xyz"):
            self._controls.slider(
                f"centre {name}",
                f"The {name} coordinate of the payload's centre in the platform frame, from b4.",
                f"design.payload.centre.{axis}",
                platform_span,
            )
        self._controls.number(
            "Force on the tool (N)",
            "Largest force of the process, which acts at the tool point in any direction.",
            "design.payload.force_n",
            least=0.0,
            step=MEDIUM,
            small=True,
        )

    def _add_gravity(self) -> None:
        self._controls.dropdown(
            "Gravity",
            "Direction of gravity along an axis of the base, for a machine on a wall or overhead.",
            (*DIRECTIONS, NO_OPTION),
            Bound(
                lambda frame: direction_name(frame.state.design.gravity) or NO_OPTION,
                lambda state, name: Set(
                    "design.gravity", DIRECTIONS.get(name, state.design.gravity), "Gravity", name
                ),
            ),
        )
        self._controls.triple(
            "Direction",
            "Any other direction of gravity along the axes of the base; its length is kept at 1.",
            Bound(
                lambda frame: frame.state.design.gravity,
                lambda _, direction: Set("design.gravity", direction, "Gravity"),
            ),
            step=FINE,
        )

    def _add_struts(self) -> None:
        controls = self._controls
        controls.checkbox(
            "Tubes",
            "Give the struts the size of a tube; off, they are rigid.",
            Bound(lambda frame: _is_tube(frame.state), _make_tubes),
        )
        self._add_size("Outer diameter (mm)", "Outer diameter of the tube.", "outer_mm")
        self._add_size("Inner diameter (mm)", "Inner diameter of the tube; 0 is a bar.", "inner_mm")
        self._add_size(
            "Young's modulus (GPa)", "Aluminium 70, steel 210, carbon 130.", "modulus_gpa"
        )
        self._add_limit(
            "Limited stress",
            "Limit the bending stress of the tube, and with it the moment.",
            At("design.struts.stress_mpa", default=lambda _: STRESS),
            ("Largest stress (MPa)", "Largest bending stress of the tube."),
            is_possible=_is_tube,
        )
        self._add_limit(
            "Moment given directly",
            "Give the largest bending moment itself, in place of that of tube and stress.",
            At("design.struts.moment_nm", default=_first_moment),
            ("Largest moment (N m)", "Largest bending moment of a strut."),
        )

    def _add_size(self, label: str, hint: str, name: str) -> None:
        self._controls.number(
            label,
            hint,
            At(f"design.struts.{name}", default=lambda _: OUTER),
            least=0.0,
            step=MEDIUM,
            small=True,
            visible=_is_tube,
        )

    def _add_guide(self) -> None:
        self._add_limit(
            "Limited guide force",
            "Limit the force across the guide on each of its two carriages.",
            At("design.guide.force_n", default=lambda _: FORCE),
            ("Largest force (N)", "Largest force across the guide on a carriage."),
        )
        self._add_limit(
            "Limited guide moment",
            "Limit the moment on the guide at each of its two carriages.",
            At("design.guide.moment_nm", default=lambda _: MOMENT),
            ("Largest moment on it (N m)", "Largest moment on the guide at a carriage."),
        )

    def _add_limit(
        self,
        switch: str,
        hint: str,
        at: At,
        number: tuple[str, str],
        *,
        is_possible: Condition | None = None,
    ) -> None:
        """Add a switch for a limit, and a field for its value while it is on.

        Args:
            switch: Words beside the switch.
            hint: Sentence on what it does.
            at: The limit, which the state has as None for none; its default is what it begins with.
            number: Words beside the field, and its hint.
            is_possible: Condition in which there can be a limit; None for always.
        """

        def is_on(state: State) -> bool:
            return value_at(state, at.path) is not None

        def write(state: State, on: bool) -> Action:
            first = None if at.default is None else at.default(state)
            return Set(at.path, first if on else None, switch, "on" if on else "off")

        def can_be(state: State) -> bool:
            return is_possible is None or is_possible(state)

        self._controls.checkbox(
            switch,
            hint,
            Bound(lambda frame: is_on(frame.state), write),
            disabled=lambda state: not can_be(state),
        )
        self._controls.number(
            *number,
            at,
            least=0.0,
            step=MEDIUM,
            small=True,
            visible=lambda state: is_on(state) and can_be(state),
        )


def _with_units(words: str) -> str:
    """Return words as HTML in which no line ends between a number and its unit."""
    return re.sub(r"(?<=\d) (kg|N m|N)\b", _joined_unit, escape(words))


def _joined_unit(unit: re.Match[str]) -> str:
    return unit[0].replace(" ", "&nbsp;")


def moment_words(struts: Struts) -> str:
    """Return the largest bending moment of the struts in words, and what it comes from."""
    if struts.moment_nm is not None:
        return f"Their largest moment is {format_number(struts.moment_nm)} N m, as given."
    if math.isfinite(struts.largest_moment):
        moment = format_number(struts.largest_moment)
        return f"Their largest moment is {moment} N m, that of the tube at its largest stress."
    return "Their moment has no limit."


def _is_tube(state: State) -> bool:
    return state.design.struts.outer_mm is not None


def _make_tubes(state: State, on: bool) -> Action:
    outer, inner = (OUTER, INNER) if on else (None, 0.0)
    struts = msgspec.structs.replace(state.design.struts, outer_mm=outer, inner_mm=inner)
    return Set("design.struts", struts, "Tubes", "on" if on else "off")


def _first_moment(state: State) -> float:
    """Return the moment to begin with: that of tube and stress, if there is one."""
    moment = state.design.struts.largest_moment
    return moment if math.isfinite(moment) else MOMENT
