"""The actions of comparing designs: pin a copy of a design, and unpin it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from explorer.app.state.action import Action
from explorer.app.state.compared import SLOTS
from explorer.app.state.state import State
from explorer.app.state.values import with_value
from explorer.errors import InputError
from explorer.mechanism.design import Design


@dataclass(frozen=True)
class Pin(Action):
    """Pin a copy of a design beside the live one, in the first free place."""

    template: ClassVar[str] = "Pin {action.design.name}"

    design: Design

    def apply(self, state: State) -> State:
        """Return the next state.

        Raises:
            InputError: the design is pinned already, or no place is free.
        """
        pinned, name = state.compared.pinned, self.design.name
        slot = state.compared.slot_of(self.design)
        if slot is not None:
            raise InputError(
                f"{name} is pinned already, as {SLOTS[slot]}; change it, or pin another design"
            )
        if None not in pinned:
            raise InputError(
                f"{name} cannot be pinned: {', '.join(SLOTS)} are taken; unpin one of them first"
            )
        return with_value(state, f"compared.pinned.{pinned.index(None)}", self.design)


@dataclass(frozen=True)
class Unpin(Action):
    """Remove the pinned design from a place, 0 to 2; do nothing if the place is free."""

    template: ClassVar[str] = "Unpin {action.place}"

    slot: int

    @property
    def place(self) -> str:
        """The letter of the place."""
        return SLOTS[self.slot]

    def apply(self, state: State) -> State:
        """Return the next state."""
        return with_value(state, f"compared.pinned.{self.slot}", None)
