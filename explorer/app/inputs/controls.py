"""Makes the controls of a panel and keeps them in step with the state."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from typing import Any, Literal, TypedDict, Unpack

import viser

from explorer.app.inputs.control import (
    Bound,
    Condition,
    Control,
    Slider,
    Source,
    Thumbs,
    Value,
    bound_to,
)
from explorer.app.inputs.ranges import Intervals, Span, Track
from explorer.app.session.session import Session
from explorer.app.state.actions import Action
from explorer.app.state.frame import Frame
from explorer.app.state.state import State
from explorer.app.widgets.assigning import Update
from explorer.mechanism.design import Pair
from explorer.mechanism.pose import Triple

# Colour of viser by which the stylesheet tells the main button of a tab from the others.
MAIN: Literal["blue"] = "blue"
# Decimals of a field in which values far below its step count.
MOST_DECIMALS = 9


class Conditions(TypedDict, total=False):
    """In which states a control is disabled, never if missing, and visible, always if missing."""

    disabled: Condition | None
    visible: Condition | None


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
        tinted: Callable[[Frame], Intervals] | None = None,
        coloured: Callable[[Frame, Span], str] | None = None,
        closes_up: bool = False,
        **conditions: Unpack[Conditions],
    ) -> Slider:
        """Add a slider with a number field.

        Args:
            label: Words beside it.
            hint: Sentence on what it sets.
            at: Source of its value.
            span: Range of its track, which may follow the state; values beyond can be typed.
            tinted: Function that returns the feasible parts of the track; None to tint none.
            coloured: Function that returns the colours of the track for its range, as stops of a
                CSS gradient; None for grey.
            closes_up: Whether the track shows only the surroundings of its tinted parts.
            conditions: In which states it is disabled and visible.
        """
        # The stylesheet puts the colours on the track.
        colours = None if coloured is None else (self._gui.add_html(""), coloured)
        handle = self._gui.add_slider(label, 0.0, 1.0, 0.01, 0.0, hint=hint, marks=())
        slider = Slider(
            self._session,
            handle,
            bound_to(at, label),
            track=Track(handle, span, closes_up=closes_up),
            tinted=tinted,
            colours=colours,
            **conditions,
        )
        self._controls.append(slider)
        return slider

    def ends(
        self,
        label: str,
        hint: str,
        at: Bound[Pair],
        span: Callable[[State], Span],
        **conditions: Unpack[Conditions],
    ) -> None:
        """Add a range in one row: a slider with two thumbs, and a number field for each end.

        Args:
            label: Words beside it, short.
            hint: Sentence on what it sets.
            at: Binding of its ends, the lower one first; the fields may be given them in any order.
            span: Function that returns the range of its track; values beyond can be typed.
            conditions: In which states it is disabled and visible.
        """
        thumbs = self._gui.add_multi_slider(label, 0.0, 1.0, 0.01, (0.0, 1.0), marks=(), hint=hint)
        # The stylesheet puts the fields into the row of the thumbs, and a script names them.
        fields = self._gui.add_vector2(f"{label} ends", (0.0, 1.0), step=0.01, hint=hint)
        untyped: Any = thumbs
        self._controls.append(
            Thumbs(self._session, untyped, at, track=Track(thumbs, span), **conditions)
        )

        def step(state: State) -> float:
            return span(state).step

        self._bind(fields, at, step, **conditions)

    def number(
        self,
        label: str,
        hint: str,
        at: Source[float],
        *,
        least: float,
        step: float | Callable[[State], float],
        small: bool = False,
        **conditions: Unpack[Conditions],
    ) -> None:
        """Add a number field; its step may follow the state.

        Args:
            label: Words beside it.
            hint: Sentence on what it sets.
            at: Source of its value.
            least: Least value.
            step: Step of its buttons, whose decimals are shown.
            small: Whether values far below a step that is given count, and have their decimals.
            conditions: In which states it is disabled and visible.
        """
        follows = step if callable(step) else None
        fixed = None if callable(step) else step
        handle = self._gui.add_number(label, least, min=least, step=fixed, hint=hint)
        if small:
            handle.precision = MOST_DECIMALS
        self._bind(handle, bound_to(at, label), follows, **conditions)

    def triple(
        self,
        label: str,
        hint: str,
        at: Source[Triple],
        *,
        step: float,
        small: bool = False,
        **conditions: Unpack[Conditions],
    ) -> None:
        """Add three number fields side by side; `small` as in `number`."""
        handle = self._gui.add_vector3(label, (0.0, 0.0, 0.0), step=step, hint=hint)
        if small:
            handle.precision = MOST_DECIMALS
        self._bind(handle, bound_to(at, label), **conditions)

    def checkbox(
        self, label: str, hint: str, at: Source[bool], **conditions: Unpack[Conditions]
    ) -> None:
        """Add a checkbox."""
        handle = self._gui.add_checkbox(label, initial_value=False, hint=hint)
        self._bind(handle, bound_to(at, label), **conditions)

    def dropdown(
        self,
        label: str,
        hint: str,
        options: Mapping[str, object] | tuple[str, ...],
        at: Source[str],
        **conditions: Unpack[Conditions],
    ) -> None:
        """Add a list to choose from.

        Args:
            label: Words beside the list.
            hint: Sentence on what it chooses.
            options: Words of the options, with their values if `at` is a path.
            at: Source of its value.
            conditions: In which states it is disabled and visible.
        """
        handle = self._gui.add_dropdown(label, tuple(options), hint=hint)
        values = options if isinstance(options, Mapping) else {text: text for text in options}
        self._bind(handle, bound_to(at, label, values), **conditions)

    def text(
        self, label: str, hint: str, at: Source[str], **conditions: Unpack[Conditions]
    ) -> None:
        """Add a line of text."""
        handle = self._gui.add_text(label, "", hint=hint)
        self._bind(handle, bound_to(at, label), **conditions)

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
        step: Callable[[State], float] | None = None,
        **conditions: Unpack[Conditions],
    ) -> None:
        """Bind an input that has no range to the state."""
        self._controls.append(Control(self._session, handle, bound, step=step, **conditions))

    def updates(self, frame: Frame) -> Iterator[Update]:
        """Yield the updates that make every control show the frame."""
        for control in self._controls:
            yield from control.updates(frame)
