"""The controls of the six actuators: forces, speeds, positioning errors and stiffness."""

from __future__ import annotations

from collections.abc import Callable
from operator import itemgetter
from typing import Any, NamedTuple, cast

import msgspec
import viser

from explorer.app.inputs.bindings import At, Condition, ControlBinding, Source
from explorer.app.inputs.controls import Controls
from explorer.app.state.actions import Action, Set
from explorer.app.state.parts import value_at, with_value
from explorer.app.state.state import State
from explorer.mechanism.design import JOINTS
from explorer.mechanism.design_file import STIFFNESS
from explorer.mechanism.machine import Six
from explorer.numerics.number_text import format_number

# A limit of the forces that is switched on begins with this, in N.
FORCE = 100.0
FORCES: Six = (FORCE, FORCE, FORCE, FORCE, FORCE, FORCE)
# Steps of number fields, which show no more decimals.
FINE, MEDIUM = 0.001, 0.01


class MachineControls(Controls):
    """Controls with fields for numbers from 0 on, and switches for values that may be None."""

    def field(
        self,
        label: str,
        hint: str,
        at: Source[float],
        *,
        step: float = MEDIUM,
        visible: Condition | None = None,
    ) -> None:
        """Add a field for a number from 0 on; values far below its step count too."""
        self.number(label, hint, at, least=0.0, step=step, visible=visible)

    def switch(
        self,
        label: str,
        hint: str,
        path: str,
        first: Callable[[State], Any],
        *,
        is_possible: Condition = lambda _: True,
    ) -> None:
        """Add a switch for the value at a path, which is None while it is off.

        The value begins with the first one; the switch is disabled where none is possible.
        """

        def write(state: State, on: bool) -> Action:
            return Set(path, first(state) if on else None, label, "on" if on else "off")

        is_on = ControlBinding(lambda frame: value_at(frame.state, path) is not None, write)
        self.checkbox(label, hint, is_on, disabled=lambda state: not is_possible(state))

    def limit(
        self,
        label: str,
        hint: str,
        field: tuple[str, str],
        path: str,
        first: Callable[[State], float],
        *,
        is_possible: Condition = lambda _: True,
    ) -> None:
        """Add a switch for a limit, and a field (words, hint) for its value while it is on."""
        self.switch(label, hint, path, first, is_possible=is_possible)
        self.field(
            *field,
            At(path, default=first),
            visible=lambda state: value_at(state, path) is not None and is_possible(state),
        )


class ActuatorQuantity(NamedTuple):
    """A number that each of the six actuators has, by its name in `Actuators`.

    The meaning begins the sentence on it; where there is no start, it begins with the push.
    """

    name: str
    word: str
    unit: str
    meaning: str
    step: float
    start: float | None = None

    @property
    def path(self) -> str:
        """The path in the state."""
        return f"design.actuators.{self.name}"

    def given(self, state: State) -> Six | None:
        """Return the six numbers; None for no limit, a pull like the push, or rigid actuators."""
        return value_at(state, self.path)

    def first(self, state: State) -> Six:
        """Return the six numbers; where there are none, those to begin with."""
        six = None if self.start is None else cast("Six", (self.start,) * 6)
        return self.given(state) or six or PUSH.given(state) or FORCES


PUSH = ActuatorQuantity(
    "push_n", "push", "N", "Largest force that increases a joint's value", MEDIUM
)
PULL = ActuatorQuantity("pull_n", "pull", "N", "Largest force that decreases it", MEDIUM)
CONTINUOUS = ActuatorQuantity(
    "continuous_n", "continuous force", "N", "Largest root-mean-square force of a motion", MEDIUM
)
SPEED = ActuatorQuantity("speed_mm_s", "speed", "mm/s", "Largest speed to either side", 1.0, 200.0)
ACCELERATION = ActuatorQuantity(
    "acceleration_mm_s2", "acceleration", "mm/s²", "Largest acceleration either way", 10.0, 2000.0
)
ERROR = ActuatorQuantity(
    "error_mm", "error", "mm", "Largest positioning error to either side", FINE
)
STIFF = ActuatorQuantity(
    "stiffness_n_mm", "stiffness", "N/mm", "Force along the joint per deflection", 1.0, STIFFNESS
)

# Those that are None while a switch is off, with its words.
SWITCHED = (
    (CONTINUOUS, "Limited continuous force", "Limit the force that actuators hold permanently."),
    (SPEED, "Limited speed", "Limit the speeds of the actuators."),
    (ACCELERATION, "Limited acceleration", "Limit the accelerations of the actuators."),
    (STIFF, "Elastic", "Give the actuators a stiffness; off, they are rigid."),
)


def add_actuators(gui: viser.GuiApi, controls: MachineControls) -> None:
    """Add the controls: one number for all six, and in a folder of its own for each."""
    controls.checkbox(
        "Limited forces",
        "Limit the forces of the actuators; off, they push and pull without limit.",
        ControlBinding(lambda frame: _is_limited(frame.state), _limit_forces),
    )
    _add_common(controls, PUSH)
    controls.switch(
        "Pull of its own",
        "Give the pull a limit of its own; off, the largest pull is the largest push.",
        PULL.path,
        PUSH.first,
        is_possible=_is_limited,
    )
    _add_common(controls, PULL)
    for quantity, label, hint in SWITCHED:
        controls.switch(label, hint, quantity.path, quantity.first)
        _add_common(controls, quantity)
    _add_common(controls, ERROR)
    with gui.add_folder("Each of the six", expand_by_default=False):
        for quantity in (PUSH, PULL, CONTINUOUS, SPEED, ACCELERATION, ERROR, STIFF):
            for index, joint in enumerate(JOINTS):
                _add_field(
                    controls,
                    quantity,
                    f"{quantity.word} of {joint}",
                    f"of the actuator of {joint}",
                    itemgetter(index),
                    lambda six, value, index=index: with_value(six, str(index), value),
                )


def _add_common(controls: MachineControls, quantity: ActuatorQuantity) -> None:
    # The number that counts for all six.
    extreme, word = (max, "largest") if quantity is ERROR else (min, "least")
    _add_field(
        controls,
        quantity,
        quantity.word.capitalize(),
        f"the same for all six; of different ones the field shows the {word}",
        extreme,
        lambda _, value: (value,) * 6,
    )


def _add_field(
    controls: MachineControls,
    quantity: ActuatorQuantity,
    words: str,
    which: str,
    read: Callable[[Six], float],
    changed: Callable[[Six, float], object],
) -> None:
    label = f"{words} ({quantity.unit})"

    def write(state: State, value: float) -> Action:
        six = changed(quantity.first(state), value)
        return Set(quantity.path, six, label, format_number(value, 6))

    controls.field(
        label,
        f"{quantity.meaning}, {which}.",
        ControlBinding(lambda frame: read(quantity.first(frame.state)), write),
        step=quantity.step,
        visible=lambda state: quantity.given(state) is not None,
    )


def _is_limited(state: State) -> bool:
    return any(side.given(state) is not None for side in (PUSH, PULL))


def _limit_forces(state: State, on: bool) -> Action:
    push = PUSH.first(state) if on else None
    actuators = msgspec.structs.replace(state.design.actuators, push_n=push, pull_n=None)
    return Set("design.actuators", actuators, "Limited forces", "on" if on else "off")
