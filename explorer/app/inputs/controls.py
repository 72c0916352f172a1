"""Controls bound to the state: each reads its value from a frame and turns changes into actions.

A control posts only that it was changed; its value is read when the session handles the change. A
value is assigned to a control only if it differs from the one that the user just set, so that a
slider never moves under the pointer.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from typing import Any, Generic, Literal, cast

import viser

from explorer.app.browser.viser_gaps import Mark, SliderMarks
from explorer.app.inputs.bindings import Bound, Source, Value, bound_to
from explorer.app.inputs.tracks import Intervals, Span, Track, decimals, tint_marks
from explorer.app.session.session import Session
from explorer.app.state.action import Action
from explorer.app.state.frame import Frame
from explorer.app.state.state import State
from explorer.app.widgets.assigning import Update
from explorer.mechanism.design import Pair
from explorer.mechanism.pose import Triple
from explorer.numerics.number_text import drop_rounding

# Colour of viser by which the stylesheet tells the main button of a tab from the others.
MAIN: Literal["blue"] = "blue"
# Decimals of a field in which values far below its step count.
MOST_DECIMALS = 9
Condition = Callable[[State], bool]
"""A function that tells whether a condition holds in a state."""


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
        # Whether the last value came from the control itself.
        self._is_set_here = False
        handle.on_update(self._post_change)

    # A coroutine runs on the thread that reads messages, so that changes and presses keep their
    # order.
    async def _post_change(self, event: viser.GuiEvent[Any]) -> None:
        # Assignments by the explorer itself have no client.
        if event.client_id is None:
            return
        self._session.post(
            self, self._change, stamp=self.handle.update_timestamp, who=event.client_id
        )

    def _change(self, state: State) -> Action:
        self._last_value = self.handle.value
        self._is_set_here = True
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
            self._is_set_here = False
            yield self.handle, "value", value

    def _is_own(self, value: Value) -> bool:
        """Whether a value is the one that was last set with the control itself."""
        return self._is_set_here and (value == self._last_value or self._session.is_waiting(self))


class Slider(Control[float]):
    """A slider with a number field, whose range and tinted parts follow the state."""

    def __init__(
        self,
        session: Session,
        handle: viser.GuiSliderHandle[float],
        bound: Bound[float],
        span: Span | Callable[[State], Span],
        disabled: Condition | None,
        tinted: Callable[[Frame], Intervals] | None,
        ends: Callable[[Frame], tuple[Mark, ...]] | None = None,
        *,
        closes_up: bool = False,
    ) -> None:
        super().__init__(session, handle, bound, disabled=disabled)
        self._track = Track(handle, span, closes_up=closes_up)
        self._tinted = tinted
        self._ends = ends
        self._marks = SliderMarks(handle)

    def updates(self, frame: Frame) -> Iterator[Update]:
        """Yield the updates that make the slider show the frame, its range first."""
        value = self._bound.read(frame)
        tinted = () if self._tinted is None else self._tinted(frame)
        is_own = self._is_own(value)
        span = self._track.span(frame.state, (value,), tinted, is_own=is_own)
        # A field would show rounding as −0.00, or as 5.00 where 5 was meant.
        shown = round(value, decimals(span.step))
        value = shown + drop_rounding(value - shown, max(abs(span.low), abs(span.high)))
        yield from self._track.updates(span)
        if self._tinted is not None:
            yield self._marks, "marks", tint_marks(tinted, span)
        elif self._ends is not None:
            yield self._marks, "marks", self._ends(frame)
        yield from self._show(frame.state, value)


class Ends(Control[Pair]):
    """The two thumbs of a range, or its two number fields."""

    def __init__(
        self,
        session: Session,
        handle: viser.GuiMultiSliderHandle[float] | viser.GuiVector2Handle,
        bound: Bound[Pair],
        span: Callable[[State], Span],
        disabled: Condition | None,
    ) -> None:
        super().__init__(session, cast("Any", handle), bound, disabled=disabled)
        self._thumbs = None
        if isinstance(handle, viser.GuiMultiSliderHandle):
            self._thumbs = Track(handle, span)
        self._span = span

    def updates(self, frame: Frame) -> Iterator[Update]:
        """Yield the updates that make the thumbs or fields show the frame, their range first."""
        ends = self._bound.read(frame)
        if self._thumbs is not None:
            is_own = self._is_own(ends)
            yield from self._thumbs.updates(self._thumbs.span(frame.state, ends, is_own=is_own))
        else:
            step = self._span(frame.state).step
            yield self.handle, "step", step
            yield self.handle, "precision", decimals(step)
        yield from self._show(frame.state, ends)


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
        tinted: Callable[[Frame], Intervals] | None = None,
        ends: Callable[[Frame], tuple[Mark, ...]] | None = None,
        closes_up: bool = False,
    ) -> Slider:
        """Add a slider with a number field.

        Args:
            label: Words beside it.
            hint: Sentence on what it sets.
            at: Source of its value.
            span: Range of its track, which may follow the state; values beyond can be typed.
            disabled: Condition in which it is disabled; None for never.
            tinted: Function that returns the feasible parts of the track; None to tint none.
            ends: Function that returns the ends of these parts with words below them, in place
                of `tinted`; None for no words.
            closes_up: Whether the track shows only the surroundings of its tinted parts.
        """
        handle = self._gui.add_slider(
            label,
            min=0.0,
            max=1.0,
            step=0.01,
            initial_value=0.0,
            hint=hint,
            marks=(),
        )
        bound = bound_to(at, label)
        slider = Slider(
            self._session, handle, bound, span, disabled, tinted, ends, closes_up=closes_up
        )
        self._controls.append(slider)
        return slider

    def ends(
        self,
        label: str,
        hint: str,
        at: Bound[Pair],
        span: Callable[[State], Span],
        *,
        disabled: Condition | None = None,
    ) -> None:
        """Add a range in one row: a slider with two thumbs, and a number field for each end.

        Args:
            label: Words beside it, short.
            hint: Sentence on what it sets.
            at: Binding of its ends, the lower one first; the fields may be given them in any order.
            span: Function that returns the range of its track; values beyond can be typed.
            disabled: Condition in which it is disabled; None for never.
        """
        thumbs = self._gui.add_multi_slider(label, 0.0, 1.0, 0.01, (0.0, 1.0), marks=(), hint=hint)
        # The stylesheet puts the fields into the row of the thumbs, and a script names them.
        fields = self._gui.add_vector2(f"{label} ends", (0.0, 1.0), step=0.01, hint=hint)
        self._controls += [
            Ends(self._session, handle, at, span, disabled) for handle in (thumbs, fields)
        ]

    def number(
        self,
        label: str,
        hint: str,
        at: Source[float],
        *,
        least: float,
        step: float | Callable[[State], float],
        visible: Condition | None = None,
        small: bool = False,
    ) -> None:
        """Add a number field; its step may follow the state.

        Args:
            label: Words beside it.
            hint: Sentence on what it sets.
            at: Source of its value.
            least: Least value.
            step: Step of its buttons, whose decimals are shown.
            visible: Condition in which it is visible; None for always.
            small: Whether values far below a step that is given count, and have their decimals.
        """
        bound = bound_to(at, label)
        if callable(step):
            handle = self._gui.add_number(label, least, min=least, hint=hint)
            self._controls.append(Number(self._session, handle, bound, step, visible))
        else:
            handle = self._gui.add_number(label, least, min=least, step=step, hint=hint)
            if small:
                handle.precision = MOST_DECIMALS
            self._bind(handle, bound, visible=visible)

    def triple(
        self,
        label: str,
        hint: str,
        at: Source[Triple],
        *,
        step: float,
        visible: Condition | None = None,
        small: bool = False,
    ) -> None:
        """Add three number fields side by side; `small` as in `number`."""
        handle = self._gui.add_vector3(label, (0.0, 0.0, 0.0), step=step, hint=hint)
        if small:
            handle.precision = MOST_DECIMALS
        self._bind(handle, bound_to(at, label), visible=visible)

    def checkbox(
        self,
        label: str,
        hint: str,
        at: Source[bool],
        *,
        disabled: Condition | None = None,
        visible: Condition | None = None,
    ) -> None:
        """Add a checkbox."""
        handle = self._gui.add_checkbox(label, initial_value=False, hint=hint)
        self._bind(handle, bound_to(at, label), disabled=disabled, visible=visible)

    def dropdown(
        self,
        label: str,
        hint: str,
        options: Mapping[str, object] | tuple[str, ...],
        at: Source[str],
        *,
        disabled: Condition | None = None,
    ) -> None:
        """Add a list to choose from.

        Args:
            label: Words beside the list.
            hint: Sentence on what it chooses.
            options: Words of the options, with their values if `at` is a path.
            at: Source of its value.
            disabled: Condition in which it is disabled; None for never.
        """
        handle = self._gui.add_dropdown(label, tuple(options), hint=hint)
        values = options if isinstance(options, Mapping) else {text: text for text in options}
        self._bind(handle, bound_to(at, label, values), disabled=disabled)

    def text(
        self, label: str, hint: str, at: Source[str], *, disabled: Condition | None = None
    ) -> None:
        """Add a line of text."""
        handle = self._gui.add_text(label, "", hint=hint)
        self._bind(handle, bound_to(at, label), disabled=disabled)

    def button(
        self,
        label: str,
        hint: str,
        action: Callable[[], Action],
        *,
        icon: viser.IconName | None = None,
        main: bool = False,
    ) -> viser.GuiButtonHandle:
        """Add a button that does an action.

        Args:
            label: Words on it.
            hint: Sentence on what it does.
            action: Function that returns the action.
            icon: Icon before the words.
            main: Whether it is the one filled button of its tab.
        """
        handle = self._gui.add_button(label, hint=hint, icon=icon, color=MAIN if main else None)

        @handle.on_click
        def _(event: viser.GuiEvent[viser.GuiButtonHandle]) -> None:
            self._session.do(action(), who=event.client_id)

        return handle

    def _bind(
        self,
        handle: viser.GuiInputHandle[Value],
        bound: Bound[Value],
        *,
        disabled: Condition | None = None,
        visible: Condition | None = None,
    ) -> None:
        """Bind an input that has no range to the state."""
        control = Control(self._session, handle, bound, disabled=disabled, visible=visible)
        self._controls.append(control)

    def updates(self, frame: Frame) -> Iterator[Update]:
        """Yield the updates that make every control show the frame."""
        for control in self._controls:
            yield from control.updates(frame)
