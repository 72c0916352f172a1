"""Controls bound to the state: each knows how to read its value and what a change means.

A control posts where it was changed and nothing else; its value is read when the session
comes to it. A value goes back to a control only if it is not the one that it just gave,
so that a hand on a slider is never fought.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any, Generic, TypeVar

import viser

from explorer.app.browser.viser_gaps import Mark, MarksOf
from explorer.app.session.session import Session
from explorer.app.state.action import Action
from explorer.app.state.frame import Frame
from explorer.app.state.state import State
from explorer.app.widgets.assigning import Update
from explorer.mechanism.pose import Triple
from explorer.numerics.number_text import drop_rounding

Value = TypeVar("Value", float, bool, str, Triple)


@dataclass(frozen=True)
class Span:
    """The range of a slider, in the unit of its value."""

    low: float
    high: float
    step: float


class Control(Generic[Value]):
    """An input of the page and what it stands for.

    Args:
        session: To which changes are posted.
        handle: The input.
        read: Its value in a frame.
        write: The action that a new value asks for.
        disabled: Whether it is out of use in a state.
        visible: Whether it is there at all in a state.
    """

    def __init__(
        self,
        session: Session,
        handle: viser.GuiInputHandle[Value],
        read: Callable[[Frame], Value],
        write: Callable[[State, Value], Action],
        disabled: Callable[[State], bool] | None = None,
        visible: Callable[[State], bool] | None = None,
    ) -> None:
        self.handle = handle
        self._session = session
        self._read = read
        self._write = write
        self._disabled = disabled
        self._visible = visible
        self._given: Value | None = None
        handle.on_update(self._changed)

    def _changed(self, event: viser.GuiEvent[Any]) -> None:
        # Assignments from here come without a client.
        if event.client_id is None:
            return
        self._session.post(
            self, self._change, stamp=self.handle.update_timestamp, who=event.client_id
        )

    def _change(self, state: State) -> Action:
        self._given = self.handle.value
        return self._write(state, self._given)

    def updates(self, frame: Frame) -> Iterator[Update]:
        """Yield what makes the control show the frame."""
        if self._disabled is not None:
            yield self.handle, "disabled", self._disabled(frame.state)
        if self._visible is not None:
            yield self.handle, "visible", self._visible(frame.state)
        value = self._read(frame)
        # A newer change is on its way: what it says counts.
        if value != self._given and not self._session.is_waiting(self):
            self._given = value
            yield self.handle, "value", value


class Slider(Control[float]):
    """A slider with a number field, whose range follows the state."""

    def __init__(
        self,
        session: Session,
        handle: viser.GuiSliderHandle[float],
        read: Callable[[Frame], float],
        write: Callable[[State, float], Action],
        span: Callable[[State], Span],
        *,
        disabled: Callable[[State], bool] | None = None,
        marks: Callable[[Frame], tuple[Mark, ...]] | None = None,
    ) -> None:

        def shown(frame: Frame) -> float:
            # A field would show rounding as −0.00.
            span_now = span(frame.state)
            return drop_rounding(read(frame), max(abs(span_now.low), abs(span_now.high)))

        super().__init__(session, handle, shown, write, disabled)
        self._slider = handle
        self._span = span
        self._marks = marks
        self._marks_of = MarksOf(handle)
        self._range: tuple[float, float, float] | None = None

    def updates(self, frame: Frame) -> Iterator[Update]:
        """Yield what makes the slider show the frame, its range and marks first."""
        span = self._span(frame.state)
        value = self._read(frame)
        low, high = min(span.low, value), max(span.high, value)
        if (low, high, span.step) != self._range:
            self._range = (low, high, span.step)
            yield self._slider, "min", low
            yield self._slider, "max", high
            yield self._slider, "step", span.step
            yield self._slider, "precision", decimals(span.step)
        if self._marks is not None:
            yield self._marks_of, "marks", self._marks(frame)
        yield from super().updates(frame)


class Number(Control[float]):
    """A number field, whose step follows the state."""

    def __init__(
        self,
        session: Session,
        handle: viser.GuiNumberHandle[float],
        read: Callable[[Frame], float],
        write: Callable[[State, float], Action],
        step: Callable[[State], float],
        *,
        visible: Callable[[State], bool] | None = None,
    ) -> None:
        super().__init__(session, handle, read, write, visible=visible)
        self._number = handle
        self._step = step

    def updates(self, frame: Frame) -> Iterator[Update]:
        """Yield what makes the field show the frame, its step first."""
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
        read: Callable[[Frame], str],
        write: Callable[[State, str], Action],
        options: Callable[[Frame], tuple[str, ...]],
        disabled: Callable[[State], bool] | None,
    ) -> None:
        super().__init__(session, handle, read, write, disabled)
        self._options = options

    def updates(self, frame: Frame) -> Iterator[Update]:
        """Yield what makes the list show the frame, its options first."""
        yield self.handle, "options", self._options(frame)
        yield from super().updates(frame)


class Controls:
    """Makes controls and keeps them in step with the state.

    Args:
        gui: Where they are added, in the order of the calls.
        session: To which they post.
    """

    def __init__(self, gui: viser.GuiApi, session: Session) -> None:
        self._gui = gui
        self._session = session
        self._controls: list[Control[Any]] = []

    def slider(
        self,
        label: str,
        hint: str,
        read: Callable[[Frame], float],
        write: Callable[[State, float], Action],
        span: Callable[[State], Span],
        *,
        disabled: Callable[[State], bool] | None = None,
        marks: Callable[[Frame], tuple[Mark, ...]] | None = None,
    ) -> Slider:
        """Add a slider with a number field."""
        handle = self._gui.add_slider(
            label,
            min=0.0,
            max=1.0,
            step=0.01,
            initial_value=0.0,
            hint=hint,
            marks=() if marks is not None else None,
        )
        slider = Slider(self._session, handle, read, write, span, disabled=disabled, marks=marks)
        self._controls.append(slider)
        return slider

    def number(
        self,
        label: str,
        hint: str,
        read: Callable[[Frame], float],
        write: Callable[[State, float], Action],
        *,
        least: float,
        step: float | Callable[[State], float],
        visible: Callable[[State], bool] | None = None,
    ) -> None:
        """Add a number field, of which the step may follow the state."""
        if callable(step):
            handle = self._gui.add_number(label, least, min=least, hint=hint)
            control = Number(self._session, handle, read, write, step, visible=visible)
        else:
            handle = self._gui.add_number(label, least, min=least, step=step, hint=hint)
            control = Control(self._session, handle, read, write, visible=visible)
        self._controls.append(control)

    def triple(
        self,
        label: str,
        hint: str,
        read: Callable[[Frame], Triple],
        write: Callable[[State, Triple], Action],
        *,
        step: float,
        visible: Callable[[State], bool] | None = None,
    ) -> None:
        """Add three number fields side by side."""
        handle = self._gui.add_vector3(label, (0.0, 0.0, 0.0), step=step, hint=hint)
        self._controls.append(Control(self._session, handle, read, write, visible=visible))

    def checkbox(
        self,
        label: str,
        hint: str,
        read: Callable[[Frame], bool],
        write: Callable[[State, bool], Action],
        *,
        disabled: Callable[[State], bool] | None = None,
    ) -> None:
        """Add a checkbox."""
        handle = self._gui.add_checkbox(label, initial_value=False, hint=hint)
        self._controls.append(Control(self._session, handle, read, write, disabled))

    def dropdown(
        self,
        label: str,
        hint: str,
        options: tuple[str, ...],
        read: Callable[[Frame], str],
        write: Callable[[State, str], Action],
        *,
        disabled: Callable[[State], bool] | None = None,
        more: Callable[[Frame], tuple[str, ...]] | None = None,
    ) -> None:
        """Add a list to choose from; `more` are the options of a frame, where they vary."""
        handle = self._gui.add_dropdown(label, options, hint=hint)
        if more is not None:
            control: Control[str] = Choice(self._session, handle, read, write, more, disabled)
        else:
            control = Control[str](self._session, handle, read, write, disabled)
        self._controls.append(control)

    def text(
        self,
        label: str,
        hint: str,
        read: Callable[[Frame], str],
        write: Callable[[State, str], Action],
        *,
        disabled: Callable[[State], bool] | None = None,
    ) -> None:
        """Add a line of text."""
        handle = self._gui.add_text(label, "", hint=hint)
        self._controls.append(Control[str](self._session, handle, read, write, disabled))

    def button(
        self,
        label: str,
        hint: str,
        action: Callable[[], Action],
        *,
        icon: viser.IconName | None = None,
    ) -> viser.GuiButtonHandle:
        """Add a button that asks for an action."""
        handle = self._gui.add_button(label, hint=hint, icon=icon)

        @handle.on_click
        def _(event: viser.GuiEvent[viser.GuiButtonHandle]) -> None:
            self._session.do(action(), who=event.client_id)

        return handle

    def updates(self, frame: Frame) -> Iterator[Update]:
        """Yield what makes every control show the frame."""
        for control in self._controls:
            yield from control.updates(frame)


def decimals(step: float) -> int:
    """Return how many decimals a step needs."""
    digits = 0
    while digits < 12 and round(step, digits) != step:
        digits += 1
    return digits
