"""Controls bound to the state: each reads its value from a frame and turns changes into actions.

A control posts only that it was changed; its value is read when the session handles the change. A
value is assigned to a control only if it differs from the one that the user just set, so that a
slider never moves under the pointer.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any, Generic, TypeAlias, TypeVar

import viser

from explorer.app.browser.viser_gaps import Mark, SliderMarks
from explorer.app.session.session import Session
from explorer.app.state.action import Action
from explorer.app.state.actions import Set
from explorer.app.state.frame import Frame
from explorer.app.state.state import State
from explorer.app.state.values import value_at
from explorer.app.widgets.assigning import Update
from explorer.mechanism.pose import Triple
from explorer.numerics.number_text import drop_rounding

Value = TypeVar("Value", float, bool, str, Triple)
Condition = Callable[[State], bool]
"""A function that tells whether a condition holds in a state."""


@dataclass(frozen=True)
class Span:
    """The range of a slider, in the unit of its value."""

    low: float
    high: float
    step: float


@dataclass(frozen=True)
class Bound(Generic[Value]):
    """The binding of a control to the state.

    Attributes:
        read: Function that returns the control's value in a frame.
        write: Function that returns the action for a new value.
    """

    read: Callable[[Frame], Value]
    write: Callable[[State, Value], Action]


def _unchanged(value: Any) -> Any:
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
    convert: Callable[[Any], Any] = _unchanged
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


class Control(Generic[Value]):
    """An input of the page, bound to the state.

    Args:
        session: Session to which changes are posted.
        handle: The input.
        bound: Binding of its value.
        disabled: Condition in which it is disabled; None for never.
        visible: Condition in which it is visible; None for always.
    """

    def __init__(
        self,
        session: Session,
        handle: viser.GuiInputHandle[Value],
        bound: Bound[Value],
        *,
        disabled: Condition | None = None,
        visible: Condition | None = None,
    ) -> None:
        self.handle = handle
        self._session = session
        self._bound = bound
        self._disabled = disabled
        self._visible = visible
        self._last_value: Value | None = None
        handle.on_update(self._post_change)

    def _post_change(self, event: viser.GuiEvent[Any]) -> None:
        # Assignments by the explorer itself have no client.
        if event.client_id is None:
            return
        self._session.post(
            self, self._change, stamp=self.handle.update_timestamp, who=event.client_id
        )

    def _change(self, state: State) -> Action:
        self._last_value = self.handle.value
        return self._bound.write(state, self._last_value)

    def updates(self, frame: Frame) -> Iterator[Update]:
        """Yield the updates that make the control show the frame."""
        yield from self._show(frame.state, self._bound.read(frame))

    def _show(self, state: State, value: Value) -> Iterator[Update]:
        if self._disabled is not None:
            yield self.handle, "disabled", self._disabled(state)
        if self._visible is not None:
            yield self.handle, "visible", self._visible(state)
        # While a newer change waits, its value counts.
        if value != self._last_value and not self._session.is_waiting(self):
            self._last_value = value
            yield self.handle, "value", value


class Slider(Control[float]):
    """A slider with a number field, whose range follows the state."""

    def __init__(
        self,
        session: Session,
        handle: viser.GuiSliderHandle[float],
        bound: Bound[float],
        span: Span | Callable[[State], Span],
        disabled: Condition | None,
        marks: Callable[[Frame], tuple[Mark, ...]] | None,
    ) -> None:
        super().__init__(session, handle, bound, disabled=disabled)
        self._slider = handle
        self._span = span
        self._marks = marks
        self._marks_of = SliderMarks(handle)
        self._range: tuple[float, float, float] | None = None

    def updates(self, frame: Frame) -> Iterator[Update]:
        """Yield the updates that make the slider show the frame, its range and marks first."""
        span = self._span if isinstance(self._span, Span) else self._span(frame.state)
        # A field would show rounding as −0.00.
        value = drop_rounding(self._bound.read(frame), max(abs(span.low), abs(span.high)))
        low, high = min(span.low, value), max(span.high, value)
        if (low, high, span.step) != self._range:
            self._range = (low, high, span.step)
            yield self._slider, "min", low
            yield self._slider, "max", high
            yield self._slider, "step", span.step
            yield self._slider, "precision", decimals(span.step)
        if self._marks is not None:
            yield self._marks_of, "marks", self._marks(frame)
        yield from self._show(frame.state, value)


class Number(Control[float]):
    """A number field, whose step follows the state."""

    def __init__(
        self,
        session: Session,
        handle: viser.GuiNumberHandle[float],
        bound: Bound[float],
        step: Callable[[State], float],
        visible: Condition | None,
    ) -> None:
        super().__init__(session, handle, bound, visible=visible)
        self._number = handle
        self._step = step

    def updates(self, frame: Frame) -> Iterator[Update]:
        """Yield the updates that make the field show the frame, its step first."""
        step = self._step(frame.state)
        yield self._number, "step", step
        yield self._number, "precision", decimals(step)
        yield from super().updates(frame)


class Choice(Control[str]):
    """A list to choose from, whose options follow the frame."""

    def __init__(
        self,
        session: Session,
        handle: viser.GuiDropdownHandle[str],
        bound: Bound[str],
        options: Callable[[Frame], tuple[str, ...]],
        disabled: Condition | None,
    ) -> None:
        super().__init__(session, handle, bound, disabled=disabled)
        self._options = options

    def updates(self, frame: Frame) -> Iterator[Update]:
        """Yield the updates that make the list show the frame, its options first."""
        yield self.handle, "options", self._options(frame)
        yield from super().updates(frame)


class Controls:
    """Makes controls and keeps them in step with the state.

    Most controls name the path of a plain value of the state, such as "view.singular.ball", from
    which reading, writing and the words of the history follow; `At` says more of it. A `Bound`
    binds a control to a value that is not plain.

    Args:
        gui: Controls of the page, added in the order of the calls.
        session: Session to which they post.
    """

    def __init__(self, gui: viser.GuiApi, session: Session) -> None:
        self._gui = gui
        self._session = session
        self._controls: list[Control[Any]] = []

    def slider(
        self,
        label: str,
        hint: str,
        at: Source[float],
        span: Span | Callable[[State], Span],
        *,
        disabled: Condition | None = None,
        marks: Callable[[Frame], tuple[Mark, ...]] | None = None,
    ) -> Slider:
        """Add a slider with a number field; its range may follow the state."""
        handle = self._gui.add_slider(
            label,
            min=0.0,
            max=1.0,
            step=0.01,
            initial_value=0.0,
            hint=hint,
            marks=() if marks is not None else None,
        )
        slider = Slider(self._session, handle, bound_to(at, label), span, disabled, marks)
        self._controls.append(slider)
        return slider

    def number(
        self,
        label: str,
        hint: str,
        at: Source[float],
        *,
        least: float,
        step: float | Callable[[State], float],
        visible: Condition | None = None,
    ) -> None:
        """Add a number field; its step may follow the state."""
        bound = bound_to(at, label)
        if callable(step):
            handle = self._gui.add_number(label, least, min=least, hint=hint)
            control = Number(self._session, handle, bound, step, visible)
        else:
            handle = self._gui.add_number(label, least, min=least, step=step, hint=hint)
            control = Control(self._session, handle, bound, visible=visible)
        self._controls.append(control)

    def triple(
        self,
        label: str,
        hint: str,
        at: Source[Triple],
        *,
        step: float,
        visible: Condition | None = None,
    ) -> None:
        """Add three number fields side by side."""
        handle = self._gui.add_vector3(label, (0.0, 0.0, 0.0), step=step, hint=hint)
        bound = bound_to(at, label)
        self._controls.append(Control(self._session, handle, bound, visible=visible))

    def checkbox(
        self,
        label: str,
        hint: str,
        at: Source[bool],
        *,
        disabled: Condition | None = None,
    ) -> None:
        """Add a checkbox."""
        handle = self._gui.add_checkbox(label, initial_value=False, hint=hint)
        bound = bound_to(at, label)
        self._controls.append(Control(self._session, handle, bound, disabled=disabled))

    def dropdown(
        self,
        label: str,
        hint: str,
        options: Mapping[str, object] | tuple[str, ...],
        at: Source[str],
        *,
        disabled: Condition | None = None,
        options_of: Callable[[Frame], tuple[str, ...]] | None = None,
    ) -> None:
        """Add a list to choose from.

        Args:
            label: Words beside the list.
            hint: Sentence on what it chooses.
            options: Words of the options, with their values if `at` is a path.
            at: Source of its value.
            disabled: Condition in which it is disabled; None for never.
            options_of: Function that returns the options of a frame; None if they never vary.
        """
        handle = self._gui.add_dropdown(label, tuple(options), hint=hint)
        values = options if isinstance(options, Mapping) else {text: text for text in options}
        bound: Bound[str] = bound_to(at, label, values)
        if options_of is not None:
            control: Control[str] = Choice(self._session, handle, bound, options_of, disabled)
        else:
            control = Control[str](self._session, handle, bound, disabled=disabled)
        self._controls.append(control)

    def text(
        self, label: str, hint: str, at: Source[str], *, disabled: Condition | None = None
    ) -> None:
        """Add a line of text."""
        handle = self._gui.add_text(label, "", hint=hint)
        bound = bound_to(at, label)
        self._controls.append(Control(self._session, handle, bound, disabled=disabled))

    def button(
        self,
        label: str,
        hint: str,
        action: Callable[[], Action],
        *,
        icon: viser.IconName | None = None,
    ) -> viser.GuiButtonHandle:
        """Add a button that does an action."""
        handle = self._gui.add_button(label, hint=hint, icon=icon)

        @handle.on_click
        def _(event: viser.GuiEvent[viser.GuiButtonHandle]) -> None:
            self._session.do(action(), who=event.client_id)

        return handle

    def updates(self, frame: Frame) -> Iterator[Update]:
        """Yield the updates that make every control show the frame."""
        for control in self._controls:
            yield from control.updates(frame)


def decimals(step: float) -> int:
    """Return the number of decimals of a step."""
    digits = 0
    while digits < 12 and round(step, digits) != step:
        digits += 1
    return digits
