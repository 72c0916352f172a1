"""The actions on the machine that set more than one plain value of the design."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import ClassVar

import msgspec

from explorer.app.state.action import Action
from explorer.app.state.actions import FULL_TURN, check_free
from explorer.app.state.state import State
from explorer.app.state.values import with_value
from explorer.mechanism.pose import Pose
from explorer.numerics.number_text import format_number

ANGLES = ("yaw", "pitch", "roll")


@dataclass(frozen=True)
class SetToolAngle(Action):
    """Set yaw, pitch or roll of the tool on the platform, 0 to 2, in degrees."""

    axis: int
    value: float

    def apply(self, state: State) -> State:
        """Return the next state, which keeps the angles as they are.

        Raises:
            InputError: the angle is not finite, or the design is being optimised.
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
        return f"tool {ANGLES[self.axis]} = {angle}°"


@dataclass(frozen=True)
class MakeAlike(Action):
    """Give each actuator the least push, pull and stiffness, and the largest error, of the six."""

    template: ClassVar[str] = "All six actuators alike"

    def apply(self, state: State) -> State:
        """Return the next state.

        Raises:
            InputError: the design is being optimised.
        """
        check_free(state)
        actuators = state.design.actuators
        push, pull, stiffness = (
            None if values is None else (min(values),) * 6
            for values in (actuators.push_n, actuators.pull_n, actuators.stiffness_n_mm)
        )
        alike = msgspec.structs.replace(
            actuators,
            push_n=push,
            pull_n=pull,
            error_mm=(max(actuators.error_mm),) * 6,
            stiffness_n_mm=stiffness,
        )
        return with_value(state, "design.actuators", alike)
