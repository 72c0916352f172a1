"""Bindings of controls to the state: where a control's value is read, and what sets it."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, Generic, TypeAlias, TypeVar

from explorer.app.state.action import Action
from explorer.app.state.actions import Set
from explorer.app.state.frame import Frame
from explorer.app.state.parts import value_at
from explorer.app.state.state import State
from explorer.mechanism.design import Pair
from explorer.mechanism.pose import Triple

Value = TypeVar("Value", float, bool, str, Pair, Triple)


@dataclass(frozen=True)
class Bound(Generic[Value]):
    """The binding of a control to the state.

    Attributes:
        read: Function that returns the control's value in a frame.
        write: Function that returns the action for a new value.
    """

    read: Callable[[Frame], Value]
    write: Callable[[State, Value], Action]


def _identity(value: Any) -> Any:
    return value


@dataclass(frozen=True)
class At:
    """A plain value of the state, shown and set by a control.

    Attributes:
        path: Path of the value, such as "view.warn_below".
        default: Function that returns the control's value where the state has None.
        convert: Function from the control's value to that of the state.
        action: Class of the action that sets the value.
    """

    path: str
    default: Callable[[State], Any] | None = None
    convert: Callable[[Any], Any] = _identity
    action: type[Set] = Set

    def bound(self, name: str, options: Mapping[str, object] | None = None) -> Bound[Any]:
        """Return the binding.

        Args:
            name: Name of the value in the history, such as the label of its control.
            options: Values by the words of a list; None if the control holds the value itself.
        """
        if options is not None:
            texts = {value: text for text, value in options.items()}
            return Bound(
                lambda frame: texts[self._read(frame)],
                lambda _, text: self.action(self.path, options[text], name, text),
            )
        return Bound(self._read, lambda _, value: self.action(self.path, self.convert(value), name))

    def _read(self, frame: Frame) -> Any:
        value = value_at(frame.state, self.path)
        return self.default(frame.state) if value is None and self.default else value


Source: TypeAlias = str | At | Bound[Value]
"""The source of a control's value; a text is the path of a plain value."""


def bound_to(
    at: Source[Value], name: str, options: Mapping[str, object] | None = None
) -> Bound[Value]:
    """Return a binding itself, or the binding to the value at a path."""
    if isinstance(at, Bound):
        return at
    return (At(at) if isinstance(at, str) else at).bound(name, options)
