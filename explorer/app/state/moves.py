"""The actions that move the platform: to a pose, by one length, or to another assembly mode."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np

from explorer.app.state import state as states
from explorer.app.state.actions import Action
from explorer.app.state.clear_length import clear_length
from explorer.app.state.parts import with_value
from explorer.app.state.state import State, angles_of, joints_of, open_state
from explorer.mechanism.design import JOINTS, Design
from explorer.mechanism.feasible_intervals import feasible_intervals, nearest_feasible
from explorer.mechanism.folds import assembly_modes
from explorer.mechanism.kinematics import ForwardKinematics, discriminants, forward
from explorer.mechanism.margins import mode_name
from explorer.mechanism.pose import Pose, Triple
from explorer.numerics.number_text import format_number

# Degrees, beside which an angle may be a rounding error.
FULL_TURN = 360.0


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
        return assemble(replace(state, joints=joints), solution, state.mode)

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
        """Return the words for the action."""
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
        """Return the words for the action."""
        return f"Assembly mode {self.mode} ({mode_name(self.mode)})"


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


def assemble(state: State, solution: ForwardKinematics, mode: int) -> State:
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
