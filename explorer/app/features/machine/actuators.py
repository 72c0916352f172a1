"""The controls of the six actuators: forces, positioning errors and stiffness.

`add_field` and `add_switch` serve the other parts of the machine too.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Literal, NamedTuple

import msgspec
import viser

from explorer.app.inputs.bindings import Bound, Source
from explorer.app.inputs.control import Condition
from explorer.app.inputs.controls import Controls
from explorer.app.state.action import Action
from explorer.app.state.actions import Set
from explorer.app.state.parts import value_at
from explorer.app.state.state import State
from explorer.mechanism.design import JOINTS
from explorer.mechanism.design_file import STIFFNESSES
from explorer.mechanism.machine import Six
from explorer.numerics.number_text import format_number

# A limit of the forces that is switched on begins with this, in N.
FORCE = 100.0
FORCES: Six = (FORCE, FORCE, FORCE, FORCE, FORCE, FORCE)
# Steps of number fields, which show no more decimals.
FINE, MEDIUM = 0.001, 0.01


def add_field(
    controls: Controls,
    label: str,
    hint: str,
    at: Source[float],
    *,
    step: float = MEDIUM,
    visible: Condition | None = None,
) -> None:
    """Add a field for a number from 0 on; values far below its step count too."""
    controls.number(label, hint, at, least=0.0, step=step, visible=visible, small=True)


def add_switch(
    controls: Controls,
    label: str,
    hint: str,
    path: str,
    first: Callable[[State], Any],
    *,
    disabled: Condition | None = None,
) -> None:
    """Add a switch for a value that is None while it is off.

    Args:
        controls: Controls of the panel.
        label: Words beside it.
        hint: Sentence on what it does.
        path: Path of the value in the state.
        first: Function that returns the value with which it begins.
        disabled: Condition in which it is disabled; None for never.
    """

    def write(state: State, on: bool) -> Action:
        return Set(path, first(state) if on else None, label, "on" if on else "off")

    is_on = Bound(lambda frame: value_at(frame.state, path) is not None, write)
    controls.checkbox(label, hint, is_on, disabled=disabled)


class Quantity(NamedTuple):
    """A number that each of the six actuators has.

    Attributes:
        name: Field of `Actuators`.
        word: What it is, in the words beside a field.
        unit: Its unit.
        meaning: Beginning of the sentence on it.
        step: Step of its fields.
    """

    name: Literal["push_n", "pull_n", "error_mm", "stiffness_n_mm"]
    word: str
    unit: str
    meaning: str
    step: float

    @property
    def path(self) -> str:
        """The path in the state."""
        return f"design.actuators.{self.name}"

    def given(self, state: State) -> Six | None:
        """Return the six numbers; None for no limit, a pull like the push, or rigid actuators."""
        return value_at(state, self.path)

    def first(self, state: State) -> Six:
        """Return the six numbers; where there are none, those to begin with."""
        given = self.given(state)
        if given is not None:
            return given
        return STIFFNESSES if self is STIFF else PUSH.given(state) or FORCES

    def of_all(self, state: State) -> float:
        """Return the number that counts for all six: the largest error, the least of the others."""
        values = self.first(state)
        return max(values) if self is ERROR else min(values)


PUSH = Quantity("push_n", "push", "N", "Largest force that increases a joint's value", MEDIUM)
PULL = Quantity("pull_n", "pull", "N", "Largest force that decreases it", MEDIUM)
ERROR = Quantity("error_mm", "error", "mm", "Largest positioning error to either side", FINE)
STIFF = Quantity("stiffness_n_mm", "stiffness", "N/mm", "Force along the joint per deflection", 1.0)
QUANTITIES = (PUSH, PULL, ERROR, STIFF)


def add_actuators(gui: viser.GuiApi, controls: Controls) -> None:
    """Add the controls: one number for all six, and in a folder of its own for each."""
    controls.checkbox(
        "Limited forces",
        "Limit the forces of the actuators; off, they push and pull without limit.",
        Bound(lambda frame: _is_limited(frame.state), _limit_forces),
    )
    _add_common(controls, PUSH)
    add_switch(
        controls,
        "Pull of its own",
        "Give the pull a limit of its own; off, the largest pull is the largest push.",
        PULL.path,
        PUSH.first,
        disabled=lambda state: not _is_limited(state),
    )
    _add_common(controls, PULL)
    _add_common(controls, ERROR)
    add_switch(
        controls,
        "Elastic",
        "Give the actuators a stiffness; off, they are rigid.",
        STIFF.path,
        STIFF.first,
    )
    _add_common(controls, STIFF)
    with gui.add_folder("Each of the six", expand_by_default=False):
        for quantity in QUANTITIES:
            for index, joint in enumerate(JOINTS):
                _add_one(controls, quantity, index, joint)


def _add_common(controls: Controls, quantity: Quantity) -> None:
    label = f"{quantity.word.capitalize()} of each ({quantity.unit})"
    add_field(
        controls,
        label,
        f"{quantity.meaning}, the same for all six; of different ones the field shows the "
        f"{'largest' if quantity is ERROR else 'least'}.",
        Bound(
            lambda frame: quantity.of_all(frame.state),
            lambda _, value: Set(quantity.path, (value,) * 6, label, format_number(value, 6)),
        ),
        step=quantity.step,
        visible=lambda state: quantity.given(state) is not None,
    )


def _add_one(controls: Controls, quantity: Quantity, index: int, joint: str) -> None:
    label = f"{quantity.word} of {joint} ({quantity.unit})"

    def write(state: State, value: float) -> Action:
        values = list(quantity.first(state))
        values[index] = value
        return Set(quantity.path, tuple(values), label, format_number(value, 6))

    add_field(
        controls,
        label,
        f"{quantity.meaning}, of the actuator of {joint}.",
        Bound(lambda frame: quantity.first(frame.state)[index], write),
        step=quantity.step,
        visible=lambda state: quantity.given(state) is not None,
    )


def _is_limited(state: State) -> bool:
    return any(side.given(state) is not None for side in (PUSH, PULL))


def _limit_forces(state: State, on: bool) -> Action:
    push = PUSH.first(state) if on else None
    actuators = msgspec.structs.replace(state.design.actuators, push_n=push, pull_n=None)
    return Set("design.actuators", actuators, "Limited forces", "on" if on else "off")
