"""The controls of the six actuators: forces, positioning errors and stiffness."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Literal

import msgspec
import viser

from explorer.app.features.machine.actions import MakeAlike
from explorer.app.inputs.bindings import Bound
from explorer.app.inputs.controls import Controls
from explorer.app.state.action import Action
from explorer.app.state.actions import Set
from explorer.app.state.frame import Frame
from explorer.app.state.state import State
from explorer.app.state.values import value_at
from explorer.app.widgets.assigning import Update
from explorer.mechanism.design import JOINTS
from explorer.mechanism.machine import Six
from explorer.mechanism.typical import STIFFNESSES
from explorer.numerics.number_text import format_number

Name = Literal["push_n", "pull_n", "error_mm", "stiffness_n_mm"]

# A limit of the forces that is switched on begins with this, in N.
FORCE = 100.0
FORCES: Six = (FORCE, FORCE, FORCE, FORCE, FORCE, FORCE)


@dataclass(frozen=True)
class Quantity:
    """A number that each of the six actuators has.

    Attributes:
        name: Field of `Actuators`.
        word: What it is, in the words beside a field.
        unit: Its unit.
        meaning: Beginning of the sentence on it.
        step: Step of its fields.
    """

    name: Name
    word: str
    unit: str
    meaning: str
    step: float


PUSH = Quantity("push_n", "push", "N", "Largest force that increases a joint's value", 0.01)
PULL = Quantity("pull_n", "pull", "N", "Largest force that decreases it", 0.01)
ERROR = Quantity("error_mm", "error", "mm", "Largest positioning error to either side", 0.001)
STIFF = Quantity("stiffness_n_mm", "stiffness", "N/mm", "Force along the joint per deflection", 1.0)
QUANTITIES = (PUSH, PULL, ERROR, STIFF)


class ActuatorControls:
    """The folder of the actuators: one number for all six, and in a folder of its own for each."""

    def __init__(self, gui: viser.GuiApi, controls: Controls) -> None:
        self._controls = controls
        controls.checkbox(
            "Limited forces",
            "Limit the forces of the actuators; off, they push and pull without limit.",
            Bound(lambda frame: _is_limited(frame.state), _limit_forces),
        )
        self._add_common(PUSH)
        controls.checkbox(
            "Pull of its own",
            "Give the pull a limit of its own; off, the largest pull is the largest push.",
            Bound(lambda frame: _given(frame.state, PULL) is not None, _give_own_pull),
            disabled=lambda state: not _is_limited(state),
        )
        self._add_common(PULL)
        self._add_common(ERROR)
        controls.checkbox(
            "Elastic",
            "Give the actuators a stiffness; off, they are rigid.",
            Bound(lambda frame: _given(frame.state, STIFF) is not None, _make_elastic),
        )
        self._add_common(STIFF)
        with gui.add_folder("Each of the six", expand_by_default=False):
            for quantity in QUANTITIES:
                for index, joint in enumerate(JOINTS):
                    self._add_one(quantity, index, joint)
        self._alike = controls.button(
            "Make all six alike",
            "Give all six actuators the least push, pull and stiffness, and the largest error, "
            "of them all.",
            MakeAlike,
        )

    def updates(self, frame: Frame) -> Iterator[Update]:
        """Yield the updates beside those of the controls."""
        alike = all(_are_alike(frame.state, quantity) for quantity in QUANTITIES)
        yield self._alike, "visible", not alike

    def _add_common(self, quantity: Quantity) -> None:
        label = f"{quantity.word.capitalize()} of each ({quantity.unit})"
        self._controls.number(
            label,
            f"{quantity.meaning}, the same for all six.",
            Bound(
                lambda frame: _shown(frame.state, quantity)[0],
                lambda _, value: Set(_path(quantity), (value,) * 6, label, format_number(value, 6)),
            ),
            least=0.0,
            step=quantity.step,
            small=True,
            visible=lambda state: (
                _given(state, quantity) is not None and _are_alike(state, quantity)
            ),
        )

    def _add_one(self, quantity: Quantity, index: int, joint: str) -> None:
        label = f"{quantity.word} of {joint}"

        def write(state: State, value: float) -> Action:
            values = list(_shown(state, quantity))
            values[index] = value
            named = f"{label} ({quantity.unit})"
            return Set(_path(quantity), tuple(values), named, format_number(value, 6))

        self._controls.number(
            f"{label} ({quantity.unit})",
            f"{quantity.meaning}, of the actuator of {joint}.",
            Bound(lambda frame: _shown(frame.state, quantity)[index], write),
            least=0.0,
            step=quantity.step,
            small=True,
            visible=lambda state: _given(state, quantity) is not None,
        )


def _path(quantity: Quantity) -> str:
    return f"design.actuators.{quantity.name}"


def _given(state: State, quantity: Quantity) -> Six | None:
    """Return the six numbers; None for no limit, a pull like the push, or rigid actuators."""
    return value_at(state, _path(quantity))


def _shown(state: State, quantity: Quantity) -> Six:
    """Return the numbers that the fields hold; where there are none, those to begin with."""
    given = _given(state, quantity)
    if given is not None:
        return given
    return STIFFNESSES if quantity is STIFF else _given(state, PUSH) or FORCES


def _are_alike(state: State, quantity: Quantity) -> bool:
    return len(set(_shown(state, quantity))) == 1


def _is_limited(state: State) -> bool:
    return any(_given(state, side) is not None for side in (PUSH, PULL))


def _limit_forces(state: State, on: bool) -> Action:
    push = _shown(state, PUSH) if on else None
    actuators = msgspec.structs.replace(state.design.actuators, push_n=push, pull_n=None)
    return Set("design.actuators", actuators, "Limited forces", "on" if on else "off")


def _give_own_pull(state: State, on: bool) -> Action:
    pull = _shown(state, PUSH) if on else None
    return Set(_path(PULL), pull, "Pull of its own", "on" if on else "off")


def _make_elastic(state: State, on: bool) -> Action:
    stiffness = _shown(state, STIFF) if on else None
    return Set(_path(STIFF), stiffness, "Elastic", "on" if on else "off")
