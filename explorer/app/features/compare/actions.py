"""The actions of comparing designs: pin a copy of a design, and unpin it."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import ClassVar

from explorer.app.state.action import Action
from explorer.app.state.compared import SLOTS, Pinned
from explorer.app.state.state import State
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
        return _with_pinned(state, pinned.index(None), self.design)


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
        return _with_pinned(state, self.slot, None)


def _with_pinned(state: State, slot: int, design: Design | None) -> State:
    places = list(state.compared.pinned)
    places[slot] = design
    a, b, c = places
    pinned: Pinned = (a, b, c)
    return replace(state, compared=replace(state.compared, pinned=pinned))
