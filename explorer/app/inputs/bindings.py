"""Bindings of controls to the state, and the inputs of the page that have them.

A binding says where a control's value is read, and what sets it. An input posts only that it was
changed; its value is read when the session handles the change. A value is assigned to it only if it
differs from the one that the user just set, so that a slider never moves under the pointer.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, Generic, TypeAlias, TypedDict, TypeVar, cast

import viser

from explorer.app.inputs.ranges import (
    Intervals,
    Span,
    close_up,
    decimals,
    in_whole_steps,
    tint_marks,
    unit_step,
)
from explorer.app.session.session import Session
from explorer.app.state.actions import Action, Set, value_text
from explorer.app.state.frame import Frame
from explorer.app.state.parts import value_at
from explorer.app.state.state import State
from explorer.app.widgets.markup import colour_strip
from explorer.errors import InputError
from explorer.mechanism.design import Pair
from explorer.mechanism.pose import Triple
from explorer.numerics.number_text import snap_to_decimals
from explorer.page.browser.viser_gaps import MARKS, slider_marks
from explorer.page.widgets.assigning import Update

Value = TypeVar("Value", float, bool, str, Pair, Triple)


@dataclass(frozen=True)
class ControlBinding(Generic[Value]):
    """How a control's value is read in a frame, and written as an action; None for no change."""

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


Condition = Callable[[State], bool]
"""A function that tells whether a condition holds in a state."""


@dataclass(eq=False)
class Control(Generic[Value]):
    """An input of the page, bound to the state.

    Attributes:
        disabled: Condition in which it is disabled; None for never.
        visible: Condition in which it is visible; None for always.
        step: Function that returns the step of its buttons; None for a fixed one, or none.
    """

    session: Session
    handle: viser.GuiInputHandle[Value]
    bound: ControlBinding[Value]
    disabled: Condition | None = None
    visible: Condition | None = None
    step: Callable[[State], float] | None = None
    _last_value: Value | None = field(default=None, init=False)
    # Whether the last value came from the control itself.
    _is_set_here: bool = field(default=False, init=False)

    def __post_init__(self) -> None:
        self.handle.on_update(self._post_change)

    # A coroutine runs on the thread that reads messages, so that changes and presses keep their
    # order.
    async def _post_change(self, event: viser.GuiEvent[Any]) -> None:
        # Assignments by the explorer itself have no client.
        if event.client_id is not None:
            stamp = self.handle.update_timestamp
            self.session.post(self, self._change, stamp=stamp, who=event.client_id)

    def use(self, value: Value, client: viser.ClientHandle) -> None:
        """Set another value, as a command of a client does."""
        self.session.post(self, lambda state: self.bound.write(state, value), who=client.client_id)

    def toggle(self: Control[bool], client: viser.ClientHandle) -> None:
        """Set the other one of two values, as a command of a client does."""
        # What the handle shows may be older than the state.
        self.session.do(
            lambda state: self.bound.write(state, not self.bound.read(Frame(state))),
            who=client.client_id,
        )

    def _change(self, state: State) -> Action | None:
        self._last_value = self.handle.value
        self._is_set_here = True
        for number in parts_of(self._last_value):
            # No session file could hold it.
            if isinstance(number, float) and not math.isfinite(number):
                raise InputError(f"a value must be a finite number; got {number}")
        return self.bound.write(state, self._last_value)

    def updates(self, frame: Frame) -> Iterator[Update]:
        """Yield the updates that make the control show the frame, its step first."""
        if self.step is not None:
            step = self.step(frame.state)
            yield self.handle, "step", step
            yield self.handle, "precision", decimals(step)
        yield from self._show(frame.state, self.bound.read(frame))

    def _show(self, state: State, value: Value) -> Iterator[Update]:
        if self.disabled is not None:
            yield self.handle, "disabled", self.disabled(state)
        if self.visible is not None:
            yield self.handle, "visible", self.visible(state)
        # While a newer change waits, its value counts.
        if value != self._last_value and not self.session.is_waiting(self):
            self._last_value = value
            self._is_set_here = False
            yield self.handle, "value", value


@dataclass(eq=False, kw_only=True)
class Slider(Control[Any]):
    """A slider with one thumb or two, whose range and tinted parts follow the state.

    Attributes:
        span: Range of its track, or the function that returns it.
        closes_up: Whether the track shows only the surroundings of its tinted parts.
        tinted: Function that returns the tinted parts of its track; None to tint none.
        colours: The strip behind its track and the function that returns the stops of the strip's
            gradient; None for a grey track.
    """

    span: Span | Callable[[State], Span]
    closes_up: bool = False
    tinted: Callable[[Frame], Intervals] | None = None
    colours: tuple[viser.GuiHtmlHandle, Callable[[Frame, Span], str]] | None = None
    _shown: Span | None = field(default=None, init=False)
    _whole: Span | None = field(default=None, init=False)

    def updates(self, frame: Frame) -> Iterator[Update]:
        """Yield the updates that make the slider show the frame, its range first."""
        if self.visible is not None and not self.visible(frame.state):
            yield self.handle, "visible", False
            if self.colours is not None:
                yield self.colours[0], "visible", False
            return
        value: float | Pair = self.bound.read(frame)
        tinted = () if self.tinted is None else self.tinted(frame)
        span = self._range(frame.state, value, tinted)
        if span != self._shown:
            self._shown = span
            yield self.handle, "min", span.low
            yield self.handle, "max", span.high
            yield self.handle, "step", span.step
            yield self.handle, "precision", decimals(span.step)
        if self.tinted is not None:
            yield self.handle, MARKS, slider_marks(tint_marks(tinted, span))
        if self.colours is not None:
            strip, stops = self.colours
            yield strip, "visible", True
            yield strip, "content", colour_strip(stops(frame, span))
        if not isinstance(value, tuple):
            # A field would show rounding as −0.00, or as 5.00 where 5 was meant.
            size = max(abs(span.low), abs(span.high))
            value = snap_to_decimals(value, decimals(span.step), size)
        yield from self._show(frame.state, value)

    def _range(self, state: State, value: float | Pair, tinted: Intervals) -> Span:
        """Return the range of the track, which holds the values of the thumbs.

        After a change of the slider itself it may only grow, so that it holds still under the
        pointer, unless the range in the state has changed.
        """
        whole = self.span if isinstance(self.span, Span) else self.span(state)
        span = close_up(whole, tinted, self._shown) if self.closes_up else whole
        low, high = min(span.low, *parts_of(value)), max(span.high, *parts_of(value))
        is_own = self._is_set_here and (value == self._last_value or self.session.is_waiting(self))
        if is_own and self._shown is not None and whole == self._whole:
            low, high = min(low, self._shown.low), max(high, self._shown.high)
        self._whole = whole
        return Span(low, high, span.step)


class Conditions(TypedDict, total=False):
    """In which states a control is disabled, never if missing, and visible, always if missing."""

    disabled: Condition | None
    visible: Condition | None
