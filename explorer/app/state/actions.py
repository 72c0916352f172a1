"""Actions: everything that can be done to the state, each a small frozen value.

An action turns one state into the next, or raises an `ExplorerError` and changes nothing. Most are
functions that `action` makes into actions; `Set` sets one value.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from typing import Any, Concatenate, ParamSpec, cast

import msgspec

from explorer.app.state.parts import in_unit, parts_kept_on_open, with_value
from explorer.app.state.state import State, open_state
from explorer.app.state.view import DrawnAs
from explorer.mechanism.design import Design
from explorer.numerics.number_text import format_number


@dataclass(frozen=True)
class Action(ABC):
    """A change of the state.

    Attributes:
        continues: Whether the action belongs to the step before it.
        repeats: Whether it belongs to the step before it if both have the same words.
        is_jump: Whether the platform did not move from the pose before to that after it.
    """

    continues: bool = field(default=False, kw_only=True)
    repeats: bool = field(default=False, kw_only=True)
    is_jump: bool = field(default=False, kw_only=True)

    @abstractmethod
    def apply(self, state: State) -> State:
        """Return the next state.

        Raises:
            ExplorerError: The change is not possible; the state stays as it was.
        """
        ...

    def describe(self, after: State, /) -> str:
        """Return a description of the step that led to a state; "" for an action that ends none."""
        del after
        return ""


Words = str | Callable[..., str]
"""What an action does, for the history: words, in which "{design}" stands for the name of the
design after it, or a function that returns them for the state after it and the arguments."""

Arguments = ParamSpec("Arguments")


@dataclass(frozen=True)
class Act(Action):
    """A function of the state with its other arguments, and its words."""

    change: Callable[..., State]
    arguments: tuple[object, ...]
    named: Mapping[str, object]
    words: Words

    def apply(self, state: State) -> State:
        """Return what the function makes of a state."""
        return self.change(state, *self.arguments, **self.named)

    def describe(self, after: State, /) -> str:
        """Return the words for the action."""
        words: Any = self.words
        if callable(words):
            words = words(after, *self.arguments, **self.named)
        return str(words).replace("{design}", after.design.name)


def action(
    words: Words, **kind: bool
) -> Callable[[Callable[Concatenate[State, Arguments], State]], Callable[Arguments, Act]]:
    """Make a function from a state and other arguments to the next state an action of these.

    Its words are given, and what else `Action` says of it.
    """

    def decorate(
        change: Callable[Concatenate[State, Arguments], State],
    ) -> Callable[Arguments, Act]:
        def make(*arguments: Arguments.args, **named: Arguments.kwargs) -> Act:
            return Act(change, arguments, named, words, **kind)

        make.__name__, make.__doc__ = change.__name__, change.__doc__
        return make

    return decorate


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


@action("Open {design}", is_jump=True)
def open_design(state: State, design: Design) -> State:
    """Open a design in its home pose, unless one is being optimised; parts stay as they declare."""
    state.check_free()
    return replace(open_state(design), **parts_kept_on_open(state.in_unit_of(design)))


@action("Reset to {design} as it was opened", is_jump=True)
def reset_design(state: State) -> State:
    """Return to the design as it was opened, in its home pose."""
    return open_design(state.base).apply(state)


@action("Call it {design}")
def set_name(state: State, name: str) -> State:
    """Give the design another name, unless it is being optimised.

    Raises:
        DesignError: The name is blank, or not one printable line.
    """
    state.check_free()
    return with_value(state, "design.name", name)


@action("", continues=True)
def mark_saved(state: State, saved: Design) -> State:
    """Take a design that has been saved as the one to which reset returns, with its name."""
    renamed = msgspec.structs.replace(state.design, name=saved.name)
    # The design may have been changed while it was being saved.
    return replace(state, design=renamed if renamed == saved else state.design, base=saved)


@dataclass(frozen=True)
class Set(Action):
    """Set one value of the state.

    Attributes:
        at: Path of the value in the state, such as "view.singular.ball".
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

    def describe(self, _: State, /) -> str:
        """Return the name and the value."""
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
