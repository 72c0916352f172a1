"""The actions of comparing designs: pin copies of them, let go of them, look at them."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import ClassVar

from explorer.app.state.action import Action, changes
from explorer.app.state.compared import SLOTS, Look, Pinned
from explorer.app.state.state import State
from explorer.errors import InputError
from explorer.mechanism.design import Design


@dataclass(frozen=True)
class Pin(Action):
    """Keep a copy of a design beside the live one, in the first place that is free."""

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
                f"{name} finds no place: {', '.join(SLOTS)} are taken; unpin one of them first"
            )
        return _with_pinned(state, pinned.index(None), self.design)


@dataclass(frozen=True)
class Unpin(Action):
    """Let go of the design in a place, 0 to 2; where there is none, nothing happens."""

    template: ClassVar[str] = "Unpin {action.place}"

    slot: int

    @property
    def place(self) -> str:
        """What people call the place."""
        return SLOTS[self.slot]

    def apply(self, state: State) -> State:
        """Return the next state."""
        return _with_pinned(state, self.slot, None)


@dataclass(frozen=True)
class SetLook(Action):
    """Change how designs are compared."""

    look: Look

    def apply(self, state: State) -> State:
        """Return the next state."""
        return replace(state, compared=replace(state.compared, look=self.look))

    def describe(self, before: State, after: State) -> str:
        """Return what the step did."""
        return changes("Compare", before.compared.look, after.compared.look)


def _with_pinned(state: State, slot: int, design: Design | None) -> State:
    found = list(state.compared.pinned)
    found[slot] = design
    a, b, c = found
    pinned: Pinned = (a, b, c)
    return replace(state, compared=replace(state.compared, pinned=pinned))
