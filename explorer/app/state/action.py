"""What an action is, and the words of its step in the history.

An action turns one state into the next, or raises an `ExplorerError` and changes nothing.
"""

from __future__ import annotations

import re
from abc import ABC, abstractmethod
from typing import ClassVar, cast

from explorer.app.state.state import State
from explorer.numerics.number_text import format_number

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
            ExplorerError: The change is not possible; the state stays as it was.
        """
        ...

    def words(self) -> str:
        """Return what the action does; "{design}" stands for the name of the design after it."""
        if self.template:
            return self.template.format(action=self, design=DESIGN)
        # "SetRequest" reads "Request".
        name = re.sub("(?<=.)([A-Z])", r" \1", type(self).__name__).lower()
        return name.removeprefix("set ").capitalize()

    def describe(self, before: State, after: State) -> str:  # noqa: ARG002 - overrides may use it
        """Return a description of the step that led from one state to another."""
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
