"""The machine around the mechanism: tool, payload, gravity, actuators, struts and tolerances."""

from __future__ import annotations

import math
from dataclasses import replace

import msgspec
import viser

from explorer.app.features.feature import Feature, Services, Tab
from explorer.app.features.machine.actuators import FINE, FORCE, MachineControls, add_actuators
from explorer.app.features.machine.scene import PayloadScene, ToolScene
from explorer.app.inputs.bindings import At, ControlBinding, item
from explorer.app.inputs.ranges import Span, platform_span
from explorer.app.state.actions import Action, Set, action
from explorer.app.state.frame import Frame
from explorer.app.state.geometry import clear_machine
from explorer.app.state.moves import value_words
from explorer.app.state.parts import with_value
from explorer.app.state.state import State
from explorer.app.widgets.markup import note
from explorer.mechanism.design import DOWN
from explorer.mechanism.machine import Payload, Struts, Tolerances, inertia_problem
from explorer.mechanism.pose import Pose, Triple
from explorer.numerics.number_text import format_number
from explorer.page.widgets.palette import NO_OPTION

# Limits that are switched on begin with these: N m and MPa; the tube in mm.
MOMENT, STRESS = 10.0, 200.0
OUTER, INNER = 12.0, 10.0
# Name of each angle of the tool, what it turns about, and its edge in degrees.
ANGLES = (
    ("yaw", "about the platform's z, the first of three", 180.0),
    ("pitch", "about the y that yaw turned, the second of three", 90.0),
    ("roll", "about the tool's x, the third of three", 180.0),
)
# Dimensions of three lengths that have tolerances, each with the body whose axes they are along.
LENGTHS = dict.fromkeys(("a1", "a3", "guide"), "base") | dict.fromkeys(
    ("b1", "b2", "b3", "b4"), "platform"
)
EVERY_LENGTH, BOTH_TILTS = "Every length (± mm)", "Both tilts (± °)"
TILTS = "design.tolerances.guide_tilt_deg"


@action(value_words([f"tool {name}" for name, *_ in ANGLES]))
def set_tool_angle(state: State, axis: int, value: float) -> State:
    """Set yaw, pitch or roll of the tool on the platform, 0 to 2, in degrees, which stay as set.

    Raises:
        InputError: The angle is not finite, or the design is being optimised.
    """
    state.check_free()
    angles = with_value(state.tool_angles, str(axis), value)
    quaternion = Pose.of_yaw_pitch_roll((0.0, 0.0, 0.0), angles).quaternion
    changed = with_value(state, "design.tool.quaternion", quaternion)
    return replace(changed, set_tool_angles=angles)


class MachinePanel(MachineControls):
    """The controls for the machine around the mechanism."""

    def __init__(self, services: Services) -> None:
        super().__init__(services)
        gui = services.gui
        # Moments of inertia that are being typed, and the payload that cannot have them.
        self._typed: tuple[Payload, Triple] | None = None
        with self.folder("Tool on the platform ({unit}, degrees)"):
            self._add_point("tool", "the tool point", "design.tool.position")
            for axis, (name, about, edge) in enumerate(ANGLES):
                self.slider(
                    f"tool {name} (°)",
                    f"Rotation of the tool on the platform {about}, in degrees.",
                    item(lambda frame: frame.state.tool_angles, axis, set_tool_angle),
                    Span(-edge, edge, 0.1),
                )
        with self.folder("Payload ({unit}, kg, N)"):
            self.field(
                "Mass (kg)",
                "Mass that the platform carries.",
                "design.payload.mass_kg",
                step=FINE,
            )
            self.markup(weight_words)
            self._add_point("centre", "the payload's centre", "design.payload.centre")
            self.triple(
                "Inertia (kg mm²)",
                "Moments of inertia about the payload's centre along the platform's axes; they "
                "count in motions only.",
                ControlBinding(lambda frame: self._inertia(frame.state), self._set_inertia),
                step=FINE,
            )
            self.markup(self._inertia_words)
            self.field(
                "Force on the tool (N)",
                "Largest force of the process, which acts at the tool point in any direction.",
                "design.payload.force_n",
            )
        with gui.add_folder("Gravity", expand_by_default=False):
            self._add_gravity()
        with gui.add_folder("Actuators", expand_by_default=False):
            add_actuators(gui, self)
        with gui.add_folder("Struts of legs 2 and 3", expand_by_default=False):
            self._add_struts()
            self.markup(lambda frame: note(moment_words(frame.state.design.struts)))
        with gui.add_folder("Guide", expand_by_default=False):
            self._add_guide()
        with gui.add_folder("Tolerances", expand_by_default=False):
            self._add_tolerances()
        self.button(
            "Ideal machine",
            "Take tool, payload, actuators, struts, guide, tolerances and radii of the legs away.",
            clear_machine,
        )

    def _inertia_words(self, frame: Frame) -> str:
        problem = inertia_problem(frame.state.design.payload.mass_kg, self._inertia(frame.state))
        return note(f"Not taken yet: the inertia {problem}.") if problem else ""

    def _inertia(self, state: State) -> Triple:
        """Return the moments of inertia, or those typed so far for this payload."""
        payload, typed = state.design.payload, self._typed
        return typed[1] if typed and typed[0] == payload else payload.inertia_kg_mm2

    def _set_inertia(self, state: State, moments: Triple) -> Action | None:
        """Return the action that sets moments of inertia; None while no body has them."""
        payload = state.design.payload
        if min(moments) >= 0.0 and inertia_problem(payload.mass_kg, moments):
            self._typed = payload, moments
            return None
        self._typed = None
        return Set("design.payload.inertia_kg_mm2", moments, "Inertia (kg mm²)")

    def _add_point(self, name: str, point: str, path: str) -> None:
        for axis, letter in enumerate("xyz"):
            self.slider(
                f"{name} {letter}",
                f"The {letter} coordinate of {point} in the platform frame, from b4.",
                f"{path}.{axis}",
                platform_span,
                power=1,
            )

    def _add_gravity(self) -> None:
        self.dropdown(
            "Gravity",
            "Direction of gravity along an axis of the base, for a machine on a wall or overhead.",
            (*DIRECTIONS, NO_OPTION),
            ControlBinding(
                lambda frame: direction_name(frame.state.design.gravity) or NO_OPTION,
                lambda state, name: Set(
                    "design.gravity", DIRECTIONS.get(name, state.design.gravity), "Gravity", name
                ),
            ),
            is_in_palette=True,
        )
        self.triple(
            "Direction",
            "Any other direction of gravity along the axes of the base; its length is kept at 1.",
            ControlBinding(
                lambda frame: frame.state.design.gravity,
                lambda _, direction: Set("design.gravity", direction, "Gravity"),
            ),
            step=FINE,
        )

    def _add_struts(self) -> None:
        self.checkbox(
            "Tubes",
            "Give the struts the size of a tube; off, they are rigid.",
            ControlBinding(lambda frame: _is_tube(frame.state), _make_tubes),
        )
        for label, hint, name in (
            ("Outer diameter (mm)", "Outer diameter of the tube.", "outer_mm"),
            ("Inner diameter (mm)", "Inner diameter of the tube; 0 is a bar.", "inner_mm"),
            ("Young's modulus (GPa)", "Aluminium 70, steel 210, carbon 130.", "modulus_gpa"),
        ):
            size = At(f"design.struts.{name}", default=lambda _: OUTER)
            self.field(label, hint, size, visible=_is_tube)
        self.limit(
            "Limited stress",
            "Limit the bending stress of the tube, and with it the moment.",
            ("Largest stress (MPa)", "Largest bending stress of the tube."),
            "design.struts.stress_mpa",
            lambda _: STRESS,
            is_possible=_is_tube,
        )
        self.limit(
            "Moment given directly",
            "Give the largest bending moment itself, in place of that of tube and stress.",
            ("Largest moment (N m)", "Largest bending moment of a strut."),
            "design.struts.moment_nm",
            _first_moment,
        )

    def _add_guide(self) -> None:
        self.limit(
            "Limited guide force",
            "Limit the force across the guide on each of its two carriages.",
            ("Largest force (N)", "Largest force across the guide on a carriage."),
            "design.guide.force_n",
            lambda _: FORCE,
        )
        self.limit(
            "Limited guide moment",
            "Limit the moment on the guide at each of its two carriages.",
            ("Largest moment on it (N m)", "Largest moment on the guide at a carriage."),
            "design.guide.moment_nm",
            lambda _: MOMENT,
        )

    def _add_tolerances(self) -> None:
        """Add one number for all lengths, one for both tilts, and each by itself."""
        self.field(
            EVERY_LENGTH,
            "Tolerance of all 21 lengths below; the field shows the largest of them.",
            ControlBinding(_largest_length, _set_lengths),
            step=FINE,
        )
        self.field(
            BOTH_TILTS,
            "Tolerance of both tilts of the guide through a1; the field shows the larger one.",
            ControlBinding(
                lambda frame: max(frame.state.design.tolerances.guide_tilt_deg),
                lambda _, value: Set(TILTS, (value, value), BOTH_TILTS, format_number(value, 6)),
            ),
            step=FINE,
        )
        for name, body in LENGTHS.items():
            self.triple(
                f"{name} (± mm)",
                f"Tolerance of {name}, along the axes of the {body}.",
                f"design.tolerances.{name}",
                step=FINE,
            )
        for index, axis in enumerate("yz"):
            hint = f"Tolerance of the guide's turn about {axis} through a1."
            label = f"guide tilt {axis} (± °)"
            self.field(label, hint, f"{TILTS}.{index}", step=FINE)


DIRECTIONS: dict[str, Triple] = {
    "down, −z": DOWN,
    "up, +z": (0.0, 0.0, 1.0),
    "along +x": (1.0, 0.0, 0.0),
    "along −x": (-1.0, 0.0, 0.0),
    "along +y": (0.0, 1.0, 0.0),
    "along −y": (0.0, -1.0, 0.0),
}
"""Directions of gravity along the axes of the base, by their names."""

# Distance of two unit vectors up to which they are the same but for rounding.
SAME_DIRECTION = 1e-12


def direction_name(gravity: Triple) -> str | None:
    """Return the name of a direction of gravity; None where it is along no axis of the base."""
    distances = {name: math.dist(gravity, along) for name, along in DIRECTIONS.items()}
    nearest = min(distances, key=distances.__getitem__)
    return nearest if distances[nearest] <= SAME_DIRECTION else None


def weight_words(frame: Frame) -> str:
    """Return the weight of the payload as HTML; "" without one."""
    weight = frame.state.design.payload.weight_n
    return note(f"Its weight is {format_number(weight)} N.") if weight > 0.0 else ""


def moment_words(struts: Struts) -> str:
    """Return the largest bending moment of the struts in words, and what it comes from."""
    if not math.isfinite(struts.largest_moment):
        return "Their moment has no limit."
    given = struts.moment_nm is not None
    source = "as given" if given else "that of the tube at its largest stress"
    return f"Their largest moment is {format_number(struts.largest_moment)} N m, {source}."


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
    manual="loads.md#The tab Machine",
    tabs=(Tab("build", "Machine", MachinePanel, viser.Icon.CRANE),),
    scene=(ToolScene, PayloadScene),
)
