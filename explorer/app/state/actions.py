"""Actions: everything that can be done to the state, each a small frozen value.

An action turns one state into the next, or raises an `ExplorerError` and changes nothing.
"""

from __future__ import annotations

import re
from abc import ABC, abstractmethod
from dataclasses import dataclass, replace
from typing import ClassVar, cast

import msgspec

from explorer.app.state.parts import in_unit, parts_kept_on_open, with_value
from explorer.app.state.state import State, open_state
from explorer.app.state.view import DrawnAs
from explorer.mechanism.design import Design
from explorer.numerics.number_text import format_number

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
        """Return the words for the action; "{design}" stands for the design's name after it."""
        if self.template:
            return self.template.format(action=self, design=DESIGN)
        # "SetObjective" reads "Objective".
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
        """Return the next state; refuse while the design is being optimised."""
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
class SetName(Action):
    """Give the design another name."""

    template: ClassVar[str] = "Call it {design}"

    name: str

    def apply(self, state: State) -> State:
        """Return the next state; refuse while the design is being optimised.

        Raises:
            DesignError: The name is blank, or not one printable line.
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
        """Return the next state; refuse a change of the design while it is being optimised."""
        if not self.at.startswith("design"):
            return with_value(state, self.at, self.value)
        state.check_free()
        design = with_value(state, self.at, self.value).design
        if design.required_box == state.design.required_box:
            box = in_unit(design.required_box, state.unit, state.view.unit_for(design))
            design = msgspec.structs.replace(design, required_box=box)
        return replace(state.in_unit_of(design), design=design)

    def words(self) -> str:
        """Return the words for the action."""
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
