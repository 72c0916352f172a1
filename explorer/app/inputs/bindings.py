"""Bindings of controls to the state: where a control's value is read, and what sets it."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, Generic, TypeAlias, TypeVar, cast

from explorer.app.inputs.ranges import Span, in_whole_steps, unit_step
from explorer.app.state.actions import Action, Set, value_text
from explorer.app.state.frame import Frame
from explorer.app.state.parts import value_at
from explorer.app.state.state import State
from explorer.mechanism.design import Pair
from explorer.mechanism.pose import Triple

Value = TypeVar("Value", float, bool, str, Pair, Triple)


@dataclass(frozen=True)
class ControlBinding(Generic[Value]):
    """The binding of a control: how its value is read in a frame, and written as an action.

    The action is None while the value does not change the state.
    """

    read: Callable[[Frame], Value]
    write: Callable[[State, Value], Action | None]


def item(
    values: Callable[[Frame], Sequence[float]], index: int, action: Callable[[int, float], Action]
) -> ControlBinding[float]:
    """Return the binding to one of several values, which an action sets by its index."""
    return ControlBinding(lambda frame: values(frame)[index], lambda _, value: action(index, value))


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
    convert: Callable[[Any], Any] = lambda value: value
    action: type[Set] = Set

    def bound(self, name: str, options: Mapping[str, object] | None = None) -> ControlBinding[Any]:
        """Return the binding of a control, whose label names the value in the history.

        The options of a list have their values by their words; others hold the value.
        """
        if options is not None:
            texts = {value: text for text, value in options.items()}
            return ControlBinding(
                lambda frame: texts[self._read(frame)],
                lambda _, text: self.action(self.path, options[text], name, text),
            )
        return ControlBinding(
            self._read, lambda _, value: self.action(self.path, self.convert(value), name)
        )

    def _read(self, frame: Frame) -> Any:
        value = value_at(frame.state, self.path)
        return self.default(frame.state) if value is None and self.default else value


Source: TypeAlias = str | At | ControlBinding[Value]
"""The source of a control's value; a text is the path of a plain value."""


def bound_to(
    at: Source[Value], name: str, options: Mapping[str, object] | None = None
) -> ControlBinding[Value]:
    """Return a binding itself, or the binding to the value at a path."""
    if isinstance(at, ControlBinding):
        return at
    return (At(at) if isinstance(at, str) else at).bound(name, options)


def in_unit(bound: ControlBinding[Any], power: int) -> ControlBinding[Any]:
    """Return the binding of a control that shows lengths, or a power of them, in the view's unit.

    Of several values, one that is written back as it was shown keeps its exact value.
    """

    def read(frame: Frame) -> Any:
        unit, value = frame.state.unit_of(power), bound.read(frame)
        values = tuple(map(unit.convert, parts_of(value)))
        return values if isinstance(value, tuple) else values[0]

    def write(state: State, new: Any) -> Action | None:
        frame, unit = Frame(state), state.unit_of(power)
        pairs = zip(parts_of(new), parts_of(bound.read(frame)), parts_of(read(frame)), strict=True)
        values = [old if part == shown else unit.read(part) for part, old, shown in pairs]
        action = bound.write(state, tuple(values) if isinstance(new, tuple) else values[0])
        if isinstance(action, Set) and not action.text:
            text = " to ".join(map(value_text, parts_of(new)))
            return replace(action, text=f"{text} {unit.name}")
        return action

    return ControlBinding(read, write)


def parts_of(value: Any) -> tuple[float, ...]:
    """Return the numbers of a value that is one of them, or several."""
    return cast("tuple[float, ...]", value) if isinstance(value, tuple) else (value,)


def span_in_unit(span: Span | Callable[[State], Span], power: int) -> Callable[[State], Span]:
    """Return the range in the unit of the view of one in design units, to a power of length."""

    def span_of(state: State) -> Span:
        return in_whole_steps(span if isinstance(span, Span) else span(state), state.unit_of(power))

    return span_of


def step_in_unit(step: float | Callable[[State], float], power: int) -> Callable[[State], float]:
    """Return the step in the unit of the view of one in design units, to a power of length."""
    return lambda state: unit_step(step(state) if callable(step) else step, state.unit_of(power))
