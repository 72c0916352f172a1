"""Actions: everything that can be done to the state, each a small frozen value.

An action turns one state into the next, or raises an `ExplorerError` and changes nothing.
"""

from __future__ import annotations

import re
from abc import ABC, abstractmethod
from dataclasses import dataclass, replace
from typing import ClassVar, cast

import msgspec
import numpy as np

from explorer.app.state import state as states
from explorer.app.state.clear_length import clear_length
from explorer.app.state.parts import in_unit, parts_kept_on_open, with_value
from explorer.app.state.state import State, angles_of, joints_of, open_state
from explorer.app.state.view import DrawnAs
from explorer.errors import InputError
from explorer.mechanism.design import JOINTS, VARIABLES, Design
from explorer.mechanism.feasible_intervals import feasible_intervals, nearest_feasible
from explorer.mechanism.folds import assembly_modes
from explorer.mechanism.kinematics import ForwardKinematics, discriminants, forward
from explorer.mechanism.margins import mode_name
from explorer.mechanism.pose import Pose, Triple
from explorer.numerics.number_text import format_number

# Degrees, beside which an angle may be a rounding error.
FULL_TURN = 360.0
DESIGN = "{design}"


class Action(ABC):
    """A change of the state; actions are frozen dataclasses that inherit from this one.

    Attributes:
        template: What the action does, for the history, as a format string of `action` and of
            `design`, the name of the design after it; "" for the name of the class.
        continues: Whether the action belongs to the step before it.
        repeats: Whether it belongs to the step before it if both have the same words.
        is_jump: Whether the platform did not move from the pose before to that after it.
    """

    template: ClassVar[str] = ""
    continues: ClassVar[bool] = False
    repeats: ClassVar[bool] = False
    is_jump: ClassVar[bool] = False

    @abstractmethod
    def apply(self, state: State) -> State:
        """Return the next state.

        Raises:
            ExplorerError: The change is not possible; the state stays as it was.
        """
        ...

    def words(self) -> str:
        """Return what the action does; "{design}" stands for the name of the design after it."""
        if self.template:
            return self.template.format(action=self, design=DESIGN)
        # "SetRequest" reads "Request".
        name = re.sub("(?<=.)([A-Z])", r" \1", type(self).__name__).lower()
        return name.removeprefix("set ").capitalize()

    def describe(self, after: State) -> str:
        """Return a description of the step that led to a state."""
        return self.words().replace(DESIGN, after.design.name)


def value_text(value: object) -> str:
    """Return a value in a few words."""
    if value is None:
        return "by default"
    if isinstance(value, bool):
        return "on" if value else "off"
    if isinstance(value, float):
        return format_number(value, 6)
    if isinstance(value, tuple):
        return " ".join(value_text(entry) for entry in cast("tuple[object, ...]", value))
    return str(value)


@dataclass(frozen=True)
class Open(Action):
    """Open a design in its home pose; parts of the state stay as they declare."""

    template: ClassVar[str] = "Open {design}"
    is_jump: ClassVar[bool] = True

    design: Design

    def apply(self, state: State) -> State:
        """Return the next state.

        Raises:
            InputError: The design is being optimised.
        """
        state.check_free()
        kept = parts_kept_on_open(state.in_unit_of(self.design))
        return replace(open_state(self.design), **kept)


@dataclass(frozen=True)
class Reset(Action):
    """Return to the design as it was opened, in its home pose."""

    template: ClassVar[str] = "Reset to {design} as it was opened"
    is_jump: ClassVar[bool] = True

    def apply(self, state: State) -> State:
        """Return the next state."""
        return Open(state.base).apply(state)


@dataclass(frozen=True)
class GoHome(Action):
    """Move to the home pose."""

    template: ClassVar[str] = "Home pose"

    def apply(self, state: State) -> State:
        """Return the next state."""
        return move_to(state, open_state(state.design).pose)


@dataclass(frozen=True)
class SetJoint(Action):
    """Set one joint, named by its index in `JOINTS`; the others stay."""

    joint: int
    value: float

    def apply(self, state: State) -> State:
        """Return the next state; where the lengths cannot close, with the last pose."""
        joints = with_value(state.joints, str(self.joint), self.value)
        solution = forward(state.design, joints)
        if not solution.feasible:
            return replace(
                state, joints=joints, unclosed=_unclosed_error(state.design, joints, self)
            )
        return _assemble(replace(state, joints=joints), solution, state.mode)

    def describe(self, after: State) -> str:
        """Return which joint has which value."""
        return f"{JOINTS[self.joint]} = {after.unit.text(self.value, 6, size=after.design.reach)}"


@dataclass(frozen=True)
class UseNearest(Action):
    """Set the nearest length that closes and stays clear, in place of one that does not close."""

    template: ClassVar[str] = "Nearest usable length"

    def apply(self, state: State) -> State:
        """Return the next state, with a remark on why this length was taken."""
        unclosed = state.unclosed
        if unclosed is None:
            return state
        nearest = clear_length(state)
        if nearest is None:
            return move_to(state, state.pose)
        value, words = nearest
        after = SetJoint(unclosed.joint, value).apply(state)
        return replace(after, taken=(after.joints, words))


@dataclass(frozen=True)
class SetPosition(Action):
    """Set one coordinate of b4 or of the tool point, 0 to 2."""

    axis: int
    value: float

    def apply(self, state: State) -> State:
        """Return the next state."""
        # The other coordinates are kept to the last bit.
        value = self.value - float(state.offset(state.pose.rotation)[self.axis])
        position = with_value(state.pose.position, str(self.axis), value)
        return move_to(state, Pose(position, state.pose.quaternion), state.yaw_pitch_roll)

    def describe(self, after: State) -> str:
        """Return which coordinate has which value."""
        name = "xyz"[self.axis]
        if after.view.at != "b4":
            name += f" of {after.point}"
        return f"{name} = {after.unit.text(self.value, 6, size=after.design.reach)}"


@dataclass(frozen=True)
class SetAngle(Action):
    """Set yaw, pitch or roll, 0 to 2, in degrees; the point that the position is of stays."""

    axis: int
    value: float

    def apply(self, state: State) -> State:
        """Return the next state."""
        angles = with_value(state.yaw_pitch_roll, str(self.axis), self.value)
        orientation = Pose.of_yaw_pitch_roll(state.pose.position, angles)
        return move_to(state, state.pose_at(state.position, orientation), angles)

    def words(self) -> str:
        """Return what the action does."""
        angle = format_number(self.value, 6, size=FULL_TURN)
        return f"{('yaw', 'pitch', 'roll')[self.axis]} = {angle}°"


@dataclass(frozen=True)
class SetPose(Action):
    """Set the whole pose, for instance by the drag handle."""

    pose: Pose

    def apply(self, state: State) -> State:
        """Return the next state."""
        return move_to(state, self.pose)

    def describe(self, after: State) -> str:
        """Return where the platform is."""
        unit, size = after.unit, after.design.reach
        place = (unit.number(x, size=size) for x in after.position)
        return f"Move {after.point} to {', '.join(place)} {unit.name}"


@dataclass(frozen=True)
class StartThere(Action):
    """Move to a pose, and let the accessible workspace start there."""

    template: ClassVar[str] = "Start where nothing is in the way"

    pose: Pose

    def apply(self, state: State) -> State:
        """Return the next state."""
        workspace = replace(state.view.workspace, start="pose")
        return move_to(replace(state, view=replace(state.view, workspace=workspace)), self.pose)


@dataclass(frozen=True)
class SetMode(Action):
    """Jump to another assembly mode of the same joints."""

    is_jump: ClassVar[bool] = True

    mode: int

    def apply(self, state: State) -> State:
        """Return the next state."""
        positions, rotations = assembly_modes(state.pose.position, state.pose.rotation)
        pose = Pose.of(positions[self.mode], rotations[self.mode])
        return replace(move_to(state, pose), mode=self.mode)

    def words(self) -> str:
        """Return what the action does."""
        return f"Assembly mode {self.mode} ({mode_name(self.mode)})"


@dataclass(frozen=True)
class SetVariable(Action):
    """Set one design variable, named as in `VARIABLES`; `State.hold` says what stays."""

    name: str
    value: float

    def apply(self, state: State) -> State:
        """Return the next state.

        Raises:
            DesignError: The design would be degenerate.
            InputError: The legs are held and cannot close in the new design, or the
                design is being optimised.
        """
        state.check_free()
        design = state.design.with_variable(self.name, self.value)
        if state.hold == "pose":
            return move_to(replace(state, design=design), state.pose, state.yaw_pitch_roll)
        solution = forward(design, state.joints)
        if not solution.feasible:
            present = state.design.variables[VARIABLES.index(self.name)]
            raise InputError(
                f"{self.name} = {state.unit.text(self.value, 6)} cannot be assembled while the "
                f"legs are held; it stays {state.unit.text(present, 6)}. Hold the pose to go "
                "further."
            )
        return _assemble(replace(state, design=design), solution, state.mode)

    def describe(self, after: State) -> str:
        """Return which variable has which value."""
        return f"{self.name} = {after.unit.text(self.value, 6)}"


@dataclass(frozen=True)
class SetName(Action):
    """Give the design another name."""

    template: ClassVar[str] = "Call it {design}"

    name: str

    def apply(self, state: State) -> State:
        """Return the next state.

        Raises:
            DesignError: The name is blank, or not one printable line.
            InputError: The design is being optimised.
        """
        state.check_free()
        return replace(state, design=msgspec.structs.replace(state.design, name=self.name))


@dataclass(frozen=True)
class MarkSaved(Action):
    """Take a design that has been saved as the one to which reset returns."""

    continues: ClassVar[bool] = True

    design: Design

    def apply(self, state: State) -> State:
        """Return the next state; the design has the name under which it was saved."""
        renamed = msgspec.structs.replace(state.design, name=self.design.name)
        if renamed != self.design:
            # The design was changed while it was being saved.
            return replace(state, base=self.design)
        return replace(state, design=renamed, base=self.design)


@dataclass(frozen=True)
class Set(Action):
    """Set one value of the state.

    Attributes:
        at: Path of the value in the state, such as "view.singular.ball".
        value: The new value.
        name: Name of the value in the history; the last name in the path if empty.
        text: The new value in the history; made from the value if empty.
    """

    at: str
    value: object
    name: str = ""
    text: str = ""

    def apply(self, state: State) -> State:
        """Return the next state.

        Raises:
            InputError: The state refuses the value, or it belongs to a design that is being
                optimised.
        """
        if not self.at.startswith("design"):
            return with_value(state, self.at, self.value)
        state.check_free()
        design = with_value(state, self.at, self.value).design
        if design.required_box == state.design.required_box:
            box = in_unit(design.required_box, state.unit, state.view.unit_for(design))
            design = msgspec.structs.replace(design, required_box=box)
        return replace(state.in_unit_of(design), design=design)

    def words(self) -> str:
        """Return what the action does."""
        name = self.name or self.at.rpartition(".")[2].replace("_", " ").capitalize()
        if self.text:
            return f"{name}: {self.text}"
        if isinstance(self.value, msgspec.Struct):
            return f"{name} changed"
        text = value_text(self.value)
        return f"{name} {text}" if isinstance(self.value, bool) else f"{name} = {text}"


def draw_as(form: DrawnAs) -> Set:
    """Return the action that draws another form of the mechanism."""
    return Set("view.drawn_as", form, "Drawn as", "parts" if form == "prototype" else form)


def move_to(state: State, pose: Pose, yaw_pitch_roll: Triple | None = None) -> State:
    """Return the state in another pose, with the joints and the mode of that pose."""
    return replace(
        state,
        pose=pose,
        yaw_pitch_roll=angles_of(pose) if yaw_pitch_roll is None else yaw_pitch_roll,
        joints=joints_of(state.design, pose),
        mode=states.mode_at(pose, state.mode),
        unclosed=None,
    )


def _assemble(state: State, solution: ForwardKinematics, mode: int) -> State:
    """Return the state in one of the eight poses that its joints have."""
    pose = Pose.of(solution.position[mode], solution.rotation[mode])
    return replace(state, pose=pose, yaw_pitch_roll=angles_of(pose), mode=mode, unclosed=None)


def _unclosed_error(design: Design, joints: states.Joints, cause: SetJoint) -> states.Unclosed:
    values = np.array(joints)
    squares = discriminants(design, values)
    failing = tuple(int(i) for i in np.flatnonzero(squares < 0.0))
    intervals = feasible_intervals(design, values)[cause.joint]
    return states.Unclosed(
        joint=cause.joint,
        asked=cause.value,
        nearest=nearest_feasible(design, values, cause.joint, intervals),
        failing=failing,
    )
