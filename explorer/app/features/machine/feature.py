"""The machine around the mechanism: tool, payload, gravity, actuators, struts and tolerances."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator
from dataclasses import dataclass, replace
from html import escape

import msgspec
import viser

from explorer.app.features.feature import Feature, Services, Tab
from explorer.app.features.machine.actuators import FINE, FORCE, MachineControls, add_actuators
from explorer.app.features.machine.scene import PayloadScene, ToolScene
from explorer.app.features.machine.words import DIRECTIONS, direction_name, machine_words
from explorer.app.inputs.controls import At, Bound
from explorer.app.inputs.ranges import Span, platform_span
from explorer.app.state.actions import FULL_TURN, Action, Set, check_free
from explorer.app.state.frame import Frame
from explorer.app.state.parts import with_value
from explorer.app.state.state import State
from explorer.app.widgets.assigning import Update
from explorer.app.widgets.markup import box, note
from explorer.app.widgets.palette import NO_OPTION
from explorer.mechanism.machine import Struts, Tolerances
from explorer.mechanism.pose import Pose
from explorer.numerics.number_text import format_number

# Limits that are switched on begin with these: N m and MPa; the tube in mm.
MOMENT, STRESS = 10.0, 200.0
OUTER, INNER = 12.0, 10.0
# Name of each angle of the tool, what it turns about, and its edge in degrees.
ANGLES = (
    ("yaw", "about the platform's z, the first of three", 180.0),
    ("pitch", "about the y that yaw turned, the second of three", 90.0),
    ("roll", "about the tool's x, the third of three", 180.0),
)
# Dimensions of three lengths that have tolerances, each with the words for its hint.
LENGTHS = {
    "a1": "the base joint of leg 1, along the axes of the base",
    "a3": "the base joint of leg 4, along the axes of the base",
    "guide": "the guide's offset, along the axes of the base",
    "b1": "b1, along the axes of the platform",
    "b2": "b2, along the axes of the platform",
    "b3": "b3, along the axes of the platform",
    "b4": "b4, along the axes of the platform",
}
EVERY_LENGTH, BOTH_TILTS = "Every length (± mm)", "Both tilts (± °)"
TILTS = "design.tolerances.guide_tilt_deg"


@dataclass(frozen=True)
class SetToolAngle(Action):
    """Set yaw, pitch or roll of the tool on the platform, 0 to 2, in degrees."""

    axis: int
    value: float

    def apply(self, state: State) -> State:
        """Return the next state, which keeps the angles as they are.

        Raises:
            InputError: The angle is not finite, or the design is being optimised.
        """
        check_free(state)
        angles = list(state.tool_angles)
        angles[self.axis] = self.value
        yaw, pitch, roll = angles
        quaternion = Pose.of_yaw_pitch_roll((0.0, 0.0, 0.0), angles).quaternion
        changed = with_value(state, "design.tool.quaternion", quaternion)
        return replace(changed, set_tool_angles=(yaw, pitch, roll))

    def words(self) -> str:
        """Return what the action does."""
        angle = format_number(self.value, 6, size=FULL_TURN)
        return f"tool {ANGLES[self.axis][0]} = {angle}°"


class MachinePanel:
    """The controls for the machine around the mechanism, under a line that describes it."""

    def __init__(self, services: Services) -> None:
        gui = services.gui
        self._controls = controls = MachineControls(gui, services.session)
        self._summary = gui.add_html("")
        with gui.add_folder("Tool on the platform (design units, degrees)"):
            self._add_point("tool", "the tool point", "design.tool.position")
            for axis in range(len(ANGLES)):
                self._add_angle(axis)
        with gui.add_folder("Payload (design units, kg, N)"):
            controls.field(
                "Mass (kg)",
                "Mass that the platform carries.",
                "design.payload.mass_kg",
                step=FINE,
            )
            self._weight = gui.add_html("", visible=False)
            self._add_point("centre", "the payload's centre", "design.payload.centre")
            controls.field(
                "Force on the tool (N)",
                "Largest force of the process, which acts at the tool point in any direction.",
                "design.payload.force_n",
            )
        with gui.add_folder("Gravity", expand_by_default=False):
            self._add_gravity()
        with gui.add_folder("Actuators", expand_by_default=False):
            add_actuators(gui, controls)
        with gui.add_folder("Struts of legs 2 and 3", expand_by_default=False):
            self._add_struts()
            self._moment = gui.add_html("")
        with gui.add_folder("Guide", expand_by_default=False):
            self._add_guide()
        with gui.add_folder("Tolerances", expand_by_default=False):
            self._add_tolerances()

    def updates(self, frame: Frame) -> Iterator[Update]:
        """Yield the updates that make the panel show the frame."""
        state = frame.state
        design = state.design
        yield self._summary, "content", box(_with_units(machine_words(design)))
        weight = design.payload.weight_n
        yield self._weight, "visible", weight > 0.0
        yield self._weight, "content", note(f"Its weight is {format_number(weight)} N.")
        yield self._moment, "content", note(moment_words(design.struts))
        yield from self._controls.updates(frame)

    def _add_point(self, name: str, point: str, path: str) -> None:
        for axis, letter in enumerate("xyz"):
            self._controls.slider(
                f"{name} {letter}",
                f"The {letter} coordinate of {point} in the platform frame, from b4.",
                f"{path}.{axis}",
                platform_span,
            )

    def _add_angle(self, axis: int) -> None:
        name, about, edge = ANGLES[axis]
        self._controls.slider(
            f"tool {name} (°)",
            f"Rotation of the tool on the platform {about}, in degrees.",
            Bound(
                lambda frame: frame.state.tool_angles[axis],
                lambda _, value: SetToolAngle(axis, value),
            ),
            Span(-edge, edge, 0.1),
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
        self._controls.checkbox(
            "Tubes",
            "Give the struts the size of a tube; off, they are rigid.",
            Bound(lambda frame: _is_tube(frame.state), _make_tubes),
        )
        for label, hint, name in (
            ("Outer diameter (mm)", "Outer diameter of the tube.", "outer_mm"),
            ("Inner diameter (mm)", "Inner diameter of the tube; 0 is a bar.", "inner_mm"),
            ("Young's modulus (GPa)", "Aluminium 70, steel 210, carbon 130.", "modulus_gpa"),
        ):
            size = At(f"design.struts.{name}", default=lambda _: OUTER)
            self._controls.field(label, hint, size, visible=_is_tube)
        self._controls.limit(
            "Limited stress",
            "Limit the bending stress of the tube, and with it the moment.",
            ("Largest stress (MPa)", "Largest bending stress of the tube."),
            "design.struts.stress_mpa",
            lambda _: STRESS,
            is_possible=_is_tube,
        )
        self._controls.limit(
            "Moment given directly",
            "Give the largest bending moment itself, in place of that of tube and stress.",
            ("Largest moment (N m)", "Largest bending moment of a strut."),
            "design.struts.moment_nm",
            _first_moment,
        )

    def _add_guide(self) -> None:
        self._controls.limit(
            "Limited guide force",
            "Limit the force across the guide on each of its two carriages.",
            ("Largest force (N)", "Largest force across the guide on a carriage."),
            "design.guide.force_n",
            lambda _: FORCE,
        )
        self._controls.limit(
            "Limited guide moment",
            "Limit the moment on the guide at each of its two carriages.",
            ("Largest moment on it (N m)", "Largest moment on the guide at a carriage."),
            "design.guide.moment_nm",
            lambda _: MOMENT,
        )

    def _add_tolerances(self) -> None:
        """Add one number for all lengths, one for both tilts, and each by itself."""
        self._controls.field(
            EVERY_LENGTH,
            "Tolerance of all 21 lengths below; the field shows the largest of them.",
            Bound(_largest_length, _set_lengths),
            step=FINE,
        )
        self._controls.field(
            BOTH_TILTS,
            "Tolerance of both tilts of the guide through a1; the field shows the larger one.",
            Bound(
                lambda frame: max(frame.state.design.tolerances.guide_tilt_deg),
                lambda _, value: Set(TILTS, (value, value), BOTH_TILTS, format_number(value, 6)),
            ),
            step=FINE,
        )
        for name, meaning in LENGTHS.items():
            self._controls.triple(
                f"{name} (± mm)",
                f"Tolerance of {meaning}.",
                f"design.tolerances.{name}",
                step=FINE,
                small=True,
            )
        for index, axis in enumerate("yz"):
            hint = f"Tolerance of the guide's turn about {axis} through a1."
            label = f"guide tilt {axis} (± °)"
            self._controls.field(label, hint, f"{TILTS}.{index}", step=FINE)


def _with_units(words: str) -> str:
    """Return words as HTML in which no line ends between a number and its unit."""
    return re.sub(
        r"(?<=\d) (kg|N m|N)\b", lambda unit: unit[0].replace(" ", "&nbsp;"), escape(words)
    )


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


def _largest_length(frame: Frame) -> float:
    tolerances = frame.state.design.tolerances
    return max(value for name in LENGTHS for value in getattr(tolerances, name))


def _set_lengths(state: State, value: float) -> Action:
    lengths = dict.fromkeys(LENGTHS, (value, value, value))
    tolerances: Tolerances = msgspec.structs.replace(state.design.tolerances, **lengths)
    return Set("design.tolerances", tolerances, EVERY_LENGTH, format_number(value, 6))


MACHINE = Feature(
    "machine",
    tabs=(Tab("build", "Machine", MachinePanel, viser.Icon.CRANE),),
    scene=(ToolScene, PayloadScene),
    lists=("Gravity",),
)
