"""The controls of a panel, each bound to the state, which they show and set.

A binding says where a control's value is read, and what sets it. A control posts only that it was
changed; its value is read when the session handles the change. A value is assigned to a control
only if it differs from the one that the user just set, so that a slider never moves under the
pointer.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Any, Generic, Literal, Protocol, TypeAlias, TypedDict, TypeVar, Unpack, cast

import viser

from explorer.app.inputs.ranges import (
    Intervals,
    Span,
    Track,
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
from explorer.page.widgets.palette import NO_OPTION, Key, WithCommands

# Colour of viser by which the stylesheet tells the main button of a tab from the others.
MAIN: Literal["blue"] = "blue"
# Decimals of a field in which values far below its step count.
MOST_DECIMALS = 9

Value = TypeVar("Value", float, bool, str, Pair, Triple)


@dataclass(frozen=True)
class Bound(Generic[Value]):
    """The binding of a control: how its value is read in a frame, and written as an action.

    The action is None while the value does not change the state.
    """

    read: Callable[[Frame], Value]
    write: Callable[[State, Value], Action | None]


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


def in_unit(bound: Bound[Any], power: int) -> Bound[Any]:
    """Return the binding of a control that shows lengths, or a power of them, in the view's unit.

    Of several values, one that is written back as it was shown keeps its exact value.
    """

    def read(frame: Frame) -> Any:
        unit, value = frame.state.unit_of(power), bound.read(frame)
        values = tuple(map(unit.convert, _parts(value)))
        return values if isinstance(value, tuple) else values[0]

    def write(state: State, new: Any) -> Action | None:
        frame, unit = Frame(state), state.unit_of(power)
        pairs = zip(_parts(new), _parts(bound.read(frame)), _parts(read(frame)), strict=True)
        values = [old if part == shown else unit.read(part) for part, old, shown in pairs]
        action = bound.write(state, tuple(values) if isinstance(new, tuple) else values[0])
        if isinstance(action, Set) and not action.text:
            text = " to ".join(map(value_text, _parts(new)))
            return replace(action, text=f"{text} {unit.name}")
        return action

    return Bound(read, write)


def _parts(value: Any) -> tuple[float, ...]:
    return cast("tuple[float, ...]", value) if isinstance(value, tuple) else (value,)


def _span_in_unit(span: Span | Callable[[State], Span], power: int) -> Callable[[State], Span]:
    def span_of(state: State) -> Span:
        return in_whole_steps(span if isinstance(span, Span) else span(state), state.unit_of(power))

    return span_of


def _step_in_unit(step: float | Callable[[State], float], power: int) -> Callable[[State], float]:
    return lambda state: unit_step(step(state) if callable(step) else step, state.unit_of(power))


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

    def _change(self, state: State) -> Action | None:
        self._last_value = self.handle.value
        self._is_set_here = True
        for number in _parts(self._last_value):
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
        track: Its range.
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


class WithControls(WithCommands, Protocol):
    """A page whose controls post to a session."""

    @property
    def session(self) -> Session:
        """The session."""
        ...


class Controls:
    """Makes controls and keeps them in step with the state.

    Most controls name the path of a plain value of the state, such as "view.singular.ball", from
    which reading, writing and the words of the history follow; `At` says more of it. A `Bound`
    binds a control to a value that is not plain.

    Args:
        page: The page, to which the controls are added in the order of the calls.
    """

    def __init__(self, page: WithControls) -> None:
        self._gui, self._session, self._commands = page.gui, page.session, page.commands
        self._controls: list[Control[Any]] = []
        # Folders and controls with the words that name them, and the power of length of their unit.
        self._labels: list[tuple[Any, str, int]] = []

    def folder(self, title: str, *, is_open: bool = True) -> viser.GuiFolderHandle:
        """Add a folder, in whose title "{unit}" stands for the unit of lengths."""
        handle = self._gui.add_folder(title, expand_by_default=is_open)
        self._labels.append((handle, title, 1))
        return handle

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
        power: int = 0,
        **conditions: Unpack[Conditions],
    ) -> Slider:
        """Add a slider with a number field.

        Args:
            label: Words beside it, in which "{unit}" stands for the unit of lengths.
            hint: Sentence on what it sets.
            at: Source of its value.
            span: Range of its track, which may follow the state; values beyond can be typed.
            tinted: Function that returns the feasible parts of the track; None to tint none.
            coloured: Function that returns the colours of the track for its range, as stops of a
                CSS gradient; None for grey.
            closes_up: Whether the track shows only the surroundings of its tinted parts.
            power: Exponent of length in the unit of the value, 0 if it is plain: a length or a
                volume is shown in the unit of the view; the range is in design units.
            conditions: In which states it is disabled and visible.
        """
        # The stylesheet puts the colours on the track.
        colours = None if coloured is None else (self._gui.add_html(""), coloured)
        if power:
            span = _span_in_unit(span, power)
        handle = self._gui.add_slider(label, 0.0, 1.0, 0.01, 0.0, hint=hint, marks=())
        slider = Slider(
            self._session,
            handle,
            self._bound(handle, at, label, power=power),
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
        *,
        power: int = 0,
        **conditions: Unpack[Conditions],
    ) -> None:
        """Add a range in one row: a slider with two thumbs, and a number field for each end.

        Args:
            label: Words beside it, short.
            hint: Sentence on what it sets.
            at: Binding of its ends, the lower one first; the fields may be given them in any order.
            span: Function that returns the range of its track; values beyond can be typed.
            power: Exponent of length, as in `slider`.
            conditions: In which states it is disabled and visible.
        """
        thumbs = self._gui.add_multi_slider(label, 0.0, 1.0, 0.01, (0.0, 1.0), marks=(), hint=hint)
        # The stylesheet puts the fields into the row of the thumbs, and a script names them.
        fields = self._gui.add_vector2(f"{label} ends", (0.0, 1.0), step=0.01, hint=hint)
        untyped: Any = thumbs
        shown, bound = (_span_in_unit(span, power), in_unit(at, power)) if power else (span, at)
        self._controls.append(
            Slider(self._session, untyped, bound, track=Track(thumbs, shown), **conditions)
        )
        self._bind(fields, bound, lambda state: shown(state).step, **conditions)

    def number(
        self,
        label: str,
        hint: str,
        at: Source[float],
        *,
        least: float,
        step: float | Callable[[State], float],
        power: int = 0,
        **conditions: Unpack[Conditions],
    ) -> None:
        """Add a number field; its step may follow the state.

        Args:
            label: Words beside it, in which "{unit}" stands for the unit of lengths.
            hint: Sentence on what it sets.
            at: Source of its value.
            least: Least value.
            step: Step of its buttons, whose decimals are shown.
            power: Exponent of length, as in `slider`; least value and step are in design units.
            conditions: In which states it is disabled and visible.
        """
        follows = _step_in_unit(step, power) if power else step if callable(step) else None
        fixed = None if callable(step) else step
        handle = self._gui.add_number(label, least, min=least, step=fixed, hint=hint)
        handle.precision = MOST_DECIMALS
        bound = self._bound(handle, at, label, power=power)
        self._bind(handle, bound, follows, **conditions)

    def triple(
        self,
        label: str,
        hint: str,
        at: Source[Triple],
        *,
        step: float,
        power: int = 0,
        **conditions: Unpack[Conditions],
    ) -> None:
        """Add three number fields side by side; `power` as in `number`."""
        handle = self._gui.add_vector3(label, (0.0, 0.0, 0.0), step=step, hint=hint)
        handle.precision = MOST_DECIMALS
        bound = self._bound(handle, at, label, power=power)
        self._bind(handle, bound, _step_in_unit(step, power) if power else None, **conditions)

    def checkbox(
        self,
        label: str,
        hint: str,
        at: Source[bool],
        *,
        keys: tuple[Key, ...] = (),
        **conditions: Unpack[Conditions],
    ) -> None:
        """Add a checkbox, and its command, which may have keys."""
        handle = self._gui.add_checkbox(label, initial_value=False, hint=hint)
        control = self._bind(handle, bound_to(at, label), **conditions)
        self._commands.offer(
            handle, lambda client: control.use(not handle.value, client), keys=keys
        )

    def dropdown(
        self,
        label: str,
        hint: str,
        options: Mapping[str, object] | tuple[str, ...],
        at: Source[str],
        *,
        is_in_palette: bool = False,
        **conditions: Unpack[Conditions],
    ) -> None:
        """Add a list to choose from.

        Args:
            label: Words beside the list.
            hint: Sentence on what it chooses.
            options: Words of the options, with their values if `at` is a path.
            at: Source of its value.
            is_in_palette: Whether every option is a command.
            conditions: In which states it is disabled and visible.
        """
        handle = self._gui.add_dropdown(label, tuple(options), hint=hint)
        values = options if isinstance(options, Mapping) else {text: text for text in options}
        control = self._bind(handle, bound_to(at, label, values), **conditions)
        for option in [each for each in options if is_in_palette and each != NO_OPTION]:
            self._commands.offer(handle, partial(control.use, option), option=option)

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
        keys: tuple[Key, ...] = (),
    ) -> viser.GuiButtonHandle:
        """Add a button that does an action.

        Args:
            label: Words on it.
            hint: Sentence on what it does.
            action: Function that returns the action.
            icon: Icon before the words.
            main: Whether it is the one filled button of its tab.
            keys: Keys of its command.
        """
        handle = self._gui.add_button(label, hint=hint, icon=icon, color=MAIN if main else None)

        @handle.on_click
        def _(event: viser.GuiEvent[viser.GuiButtonHandle]) -> None:
            self._session.do(action(), who=event.client_id)

        self._commands.offer(
            handle, lambda client: self._session.do(action(), who=client.client_id), keys=keys
        )
        return handle

    def _bound(
        self, handle: viser.GuiInputHandle[Any], at: Source[Any], label: str, *, power: int
    ) -> Bound[Any]:
        """Return the binding of a control whose label may have the unit of lengths."""
        name, _, unit = label.partition(" ({unit")
        if unit:
            self._labels.append((handle, label, power))
        bound = bound_to(at, name)
        return in_unit(bound, power) if power else bound

    def _bind(
        self,
        handle: viser.GuiInputHandle[Value],
        bound: Bound[Value],
        step: Callable[[State], float] | None = None,
        **conditions: Unpack[Conditions],
    ) -> Control[Value]:
        """Bind an input that has no range to the state."""
        control = Control(self._session, handle, bound, step=step, **conditions)
        self._controls.append(control)
        return control

    def updates(self, frame: Frame) -> Iterator[Update]:
        """Yield the updates that make every control show the frame."""
        for handle, words, power in self._labels:
            yield handle, "label", words.format(unit=frame.state.unit_of(power).name)
        for control in self._controls:
            yield from control.updates(frame)
