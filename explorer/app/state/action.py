"""What an action is, and how a step that changes many values is described.

An action turns one state into the next, or raises an `ExplorerError` and changes nothing.
"""

from __future__ import annotations

import re
from abc import ABC, abstractmethod
from collections.abc import Iterator
from dataclasses import fields, is_dataclass
from typing import ClassVar, cast

from explorer.app.state.state import State
from explorer.numerics.number_text import format_ascii

# A description names so many changes at the most.
MOST_NAMED = 2
DESIGN = "{design}"


class Action(ABC):
    """A change of the state; actions are frozen dataclasses that inherit from this one.

    Attributes:
        template: What the action does, for the history, as a format string of `action` and of
            `design`, the name of the design after it; "" for the name of the class.
        continues: Whether the action belongs to the step before it.
    """

    template: ClassVar[str] = ""
    continues: ClassVar[bool] = False

    @abstractmethod
    def apply(self, state: State) -> State:
        """Return the next state.

        Raises:
            ExplorerError: the change is not possible; the state stays as it was.
        """
        ...

    def words(self) -> str:
        """Return what the action does; "{design}" stands for the name of the design after it."""
        if self.template:
            return self.template.format(action=self, design=DESIGN)
        # "SetWish" reads "Wish".
        name = re.sub("(?<=.)([A-Z])", r" \1", type(self).__name__).lower()
        return name.removeprefix("set ").capitalize()

    def describe(self, before: State, after: State) -> str:  # noqa: ARG002 - some name changes
        """Return a description of the step that led from one state to another."""
        return self.words().replace(DESIGN, after.design.name)


def changes(what: str, before: object, after: object) -> str:
    """Return what differs between two values of one kind, in a few words."""
    named = list(_differences(before, after))
    shown = ", ".join(named[:MOST_NAMED]) + (" …" if len(named) > MOST_NAMED else "")
    return f"{what}: {shown}" if shown else what


def _differences(before: object, after: object) -> Iterator[str]:
    for name in _fields(after):
        was, now = getattr(before, name), getattr(after, name)
        if was == now:
            continue
        spoken = name.replace("_", " ")
        if _fields(now) and type(was) is type(now):
            yield from (f"{spoken} {each}" for each in _differences(was, now))
        else:
            yield f"{spoken} {_value(now)}"


def _fields(value: object) -> tuple[str, ...]:
    if is_dataclass(value):
        return tuple(field.name for field in fields(value))
    return getattr(value, "__struct_fields__", ())


def _value(value: object) -> str:
    if value is None:
        return "by default"
    if isinstance(value, bool):
        return "on" if value else "off"
    if isinstance(value, float):
        return format_ascii(value, 6)
    if isinstance(value, tuple):
        return " ".join(_value(each) for each in cast("tuple[object, ...]", value))
    return str(value)
