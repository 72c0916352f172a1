"""One control bound to the state: it reads its value from a frame and turns changes into actions.

A binding says where a control's value is read, and what sets it. A control posts only that it was
changed; its value is read when the session handles the change. A value is assigned to a control
only if it differs from the one that the user just set, so that a slider never moves under the
pointer.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import KW_ONLY, dataclass, field
from typing import Any, Generic, TypeAlias, TypeVar

import viser

from explorer.app.browser.viser_gaps import MARKS, slider_marks
from explorer.app.inputs.ranges import Intervals, Span, Track, decimals, tint_marks
from explorer.app.session.session import Session
from explorer.app.state.actions import Action, Set
from explorer.app.state.frame import Frame
from explorer.app.state.parts import value_at
from explorer.app.state.state import State
from explorer.app.widgets.assigning import Update
from explorer.app.widgets.markup import colour_strip
from explorer.mechanism.design import Pair
from explorer.mechanism.pose import Triple
from explorer.numerics.number_text import snap_to_decimals

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


def item(
    values: Callable[[Frame], Sequence[float]], index: int, action: Callable[[int, float], Action]
) -> Bound[float]:
    """Return the binding to one of several values, which an action sets by its index."""
    return Bound(lambda frame: values(frame)[index], lambda _, value: action(index, value))


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


Condition = Callable[[State], bool]
"""A function that tells whether a condition holds in a state."""


@dataclass(eq=False)
class Control(Generic[Value]):
    """An input of the page, bound to the state.

    Attributes:
        session: Session to which changes are posted.
        handle: The input.
        bound: Binding of its value.
        disabled: Condition in which it is disabled; None for never.
        visible: Condition in which it is visible; None for always.
        step: Function that returns the step of its buttons; None for a fixed one, or none.
    """

    session: Session
    handle: viser.GuiInputHandle[Value]
    bound: Bound[Value]
    _: KW_ONLY
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

    def _change(self, state: State) -> Action:
        self._last_value = self.handle.value
        self._is_set_here = True
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


@dataclass(eq=False)
class Slider(Control[float]):
    """A slider with a number field, whose range and tinted parts follow the state.

    Attributes:
        track: Its range.
        tinted: Function that returns the tinted parts of its track; None to tint none.
        colours: The strip behind its track and the function that returns the stops of the strip's
            gradient; None for a grey track.
    """

    _: KW_ONLY
    track: Track
    tinted: Callable[[Frame], Intervals] | None
    colours: tuple[viser.GuiHtmlHandle, Callable[[Frame, Span], str]] | None

    def updates(self, frame: Frame) -> Iterator[Update]:
        """Yield the updates that make the slider show the frame, its range first."""
        if self.visible is not None and not self.visible(frame.state):
            yield self.handle, "visible", False
            if self.colours is not None:
                yield self.colours[0], "visible", False
            return
        value = self.bound.read(frame)
        tinted = () if self.tinted is None else self.tinted(frame)
        is_own = self._is_own(value)
        span = self.track.span(frame.state, (value,), tinted, is_own=is_own)
        # A field would show rounding as −0.00, or as 5.00 where 5 was meant.
        size = max(abs(span.low), abs(span.high))
        value = snap_to_decimals(value, decimals(span.step), size)
        yield from self.track.updates(span)
        if self.tinted is not None:
            yield self.handle, MARKS, slider_marks(tint_marks(tinted, span))
        if self.colours is not None:
            strip, stops = self.colours
            yield strip, "visible", True
            yield strip, "content", colour_strip(stops(frame, span))
        yield from self._show(frame.state, value)


@dataclass(eq=False)
class Thumbs(Control[Pair]):
    """The two thumbs of a range, whose `track` follows the state."""

    _: KW_ONLY
    track: Track

    def updates(self, frame: Frame) -> Iterator[Update]:
        """Yield the updates that make the thumbs show the frame, their range first."""
        ends = self.bound.read(frame)
        span = self.track.span(frame.state, ends, is_own=self._is_own(ends))
        yield from self.track.updates(span)
        yield from self._show(frame.state, ends)
