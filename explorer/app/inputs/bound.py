"""Inputs of the page, each bound to the state.

An input posts only that it was changed; its value is read when the session handles the change. A
value is assigned to it only if it differs from the one that the user just set, so that a slider
never moves under the pointer.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from typing import Any, Generic, TypedDict

import viser

from explorer.app.inputs.bindings import ControlBinding, Value, parts_of
from explorer.app.inputs.ranges import Intervals, Span, Track, decimals, tint_marks
from explorer.app.session.session import Session
from explorer.app.state.actions import Action
from explorer.app.state.frame import Frame
from explorer.app.state.state import State
from explorer.app.widgets.markup import colour_strip
from explorer.errors import InputError
from explorer.mechanism.design import Pair
from explorer.numerics.number_text import snap_to_decimals
from explorer.page.browser.viser_gaps import MARKS, slider_marks
from explorer.page.widgets.assigning import Update

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

    def _is_own(self, value: Value) -> bool:
        """Whether a value is the one that was last set with the control itself."""
        return self._is_set_here and (value == self._last_value or self.session.is_waiting(self))


@dataclass(eq=False, kw_only=True)
class Slider(Control[Any]):
    """A slider with one thumb or two, whose range and tinted parts follow the state.

    Attributes:
        tinted: Function that returns the tinted parts of its track; None to tint none.
        colours: The strip behind its track and the function that returns the stops of the strip's
            gradient; None for a grey track.
    """

    track: Track
    tinted: Callable[[Frame], Intervals] | None = None
    colours: tuple[viser.GuiHtmlHandle, Callable[[Frame, Span], str]] | None = None

    def updates(self, frame: Frame) -> Iterator[Update]:
        """Yield the updates that make the slider show the frame, its range first."""
        if self.visible is not None and not self.visible(frame.state):
            yield self.handle, "visible", False
            if self.colours is not None:
                yield self.colours[0], "visible", False
            return
        value: float | Pair = self.bound.read(frame)
        ends = value if isinstance(value, tuple) else (value,)
        tinted = () if self.tinted is None else self.tinted(frame)
        span = self.track.span(frame.state, ends, tinted, is_own=self._is_own(value))
        yield from self.track.updates(span)
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


class Conditions(TypedDict, total=False):
    """In which states a control is disabled, never if missing, and visible, always if missing."""

    disabled: Condition | None
    visible: Condition | None
