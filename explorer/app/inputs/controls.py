"""The controls of a panel, each bound to the state, which they show and set."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from functools import partial
from typing import Any, Literal, Protocol, Unpack

import viser

from explorer.app.inputs.bindings import (
    Conditions,
    Control,
    ControlBinding,
    Slider,
    Source,
    Value,
    bound_to,
    in_unit,
    span_in_unit,
    step_in_unit,
)
from explorer.app.inputs.ranges import Intervals, Span
from explorer.app.session.feed import Feed
from explorer.app.session.session import Session, Who
from explorer.app.state.actions import Action
from explorer.app.state.frame import Frame
from explorer.app.state.state import State
from explorer.mechanism.design import Pair
from explorer.mechanism.pose import Triple
from explorer.page.widgets.assigning import Update
from explorer.page.widgets.palette import NO_OPTION, Commands, Key

# Colour of viser by which the stylesheet tells the main button of a tab from the others.
MAIN: Literal["blue"] = "blue"
# Decimals of a field in which values far below its step count.
MOST_DECIMALS = 9


class WithControls(Protocol):
    """A page whose controls have commands and post to a session."""

    @property
    def gui(self) -> viser.GuiApi:
        """The API that adds controls."""
        ...

    @property
    def commands(self) -> Commands:
        """The commands of the page."""
        ...

    @property
    def session(self) -> Session:
        """The session."""
        ...


class Controls:
    """Makes controls and keeps them in step with the state, as a panel or a part of one.

    Most controls name the path of a plain value of the state, such as "view.singular.ball", from
    which reading, writing and the words of the history follow; `At` says more of it. A
    `ControlBinding` binds a control to a value that is not plain.

    Args:
        page: The page, to which the controls are added in the order of the calls.
    """

    def __init__(self, page: WithControls) -> None:
        self._gui, self._session, self._commands = page.gui, page.session, page.commands
        self._controls: list[Control[Any]] = []
        # Folders and controls with the words that name them, and the power of length of their unit.
        self._labels: list[tuple[Any, str, int]] = []
        self._markups: list[tuple[viser.GuiHtmlHandle, Callable[[Frame], str]]] = []
        self._followers: list[tuple[Any, str, Callable[[Frame], object]]] = []

    def markup(self, content: Callable[[Frame], str]) -> viser.GuiHtmlHandle:
        """Add HTML that follows the frame, hidden while there is none."""
        handle = self._gui.add_html("", visible=False)
        self._markups.append((handle, content))
        return handle

    def follow(self, handle: Any, name: str, value: Callable[[Frame], object]) -> None:
        """Have a property of a handle follow the frame, such as "visible"."""
        self._followers.append((handle, name, value))

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
            span = span_in_unit(span, power)
        handle = self._gui.add_slider(label, 0.0, 1.0, 0.01, 0.0, hint=hint, marks=())
        slider = Slider(
            self._session,
            handle,
            self._bound(handle, at, label, power=power),
            span=span,
            closes_up=closes_up,
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
        at: ControlBinding[Pair],
        span: Callable[[State], Span],
        *,
        power: int = 0,
        **conditions: Unpack[Conditions],
    ) -> None:
        """Add a range in one row: a slider with two thumbs, and a number field for each end.

        The binding is to the ends, the lower one first; the fields may be given them in any
        order. Values beyond the track can be typed; `power` is as in `slider`.
        """
        thumbs = self._gui.add_multi_slider(label, 0.0, 1.0, 0.01, (0.0, 1.0), marks=(), hint=hint)
        # The stylesheet puts the fields into the row of the thumbs, and a script names them.
        fields = self._gui.add_vector2(f"{label} ends", (0.0, 1.0), step=0.01, hint=hint)
        untyped: Any = thumbs
        shown, bound = (span_in_unit(span, power), in_unit(at, power)) if power else (span, at)
        self._controls.append(Slider(self._session, untyped, bound, span=shown, **conditions))
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
        """Add a number field; its step may follow the state, and its decimals are shown.

        `power` is as in `slider`; the least value and the step are in design units.
        """
        follows = step_in_unit(step, power) if power else step if callable(step) else None
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
        self._bind(handle, bound, step_in_unit(step, power) if power else None, **conditions)

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
        self._commands.offer(handle, control.toggle, keys=keys)

    def dropdown(
        self,
        label: str,
        hint: str,
        options: Mapping[str, object] | tuple[str, ...],
        at: Source[str],
        *,
        is_in_palette: bool = False,
        **conditions: Unpack[Conditions],
    ) -> viser.GuiDropdownHandle[str]:
        """Add a list to choose from, whose options may all be commands.

        The options have their values if the source of the value is a path.
        """
        handle = self._gui.add_dropdown(label, tuple(options), hint=hint)
        values = options if isinstance(options, Mapping) else {text: text for text in options}
        control = self._bind(handle, bound_to(at, label, values), **conditions)
        for option in [each for each in options if is_in_palette and each != NO_OPTION]:
            self._commands.offer(handle, partial(control.use, option), option=option)
        return handle

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
        """Add a button that does an action, the main one filled, and its command."""

        def act(who: Who) -> None:
            self._session.do(action(), who=who)

        return self.press(label, hint, act, icon=icon, color=MAIN if main else None, keys=keys)

    def press(
        self,
        label: str,
        hint: str,
        act: Callable[[Who], None],
        *,
        icon: viser.IconName | None = None,
        color: Literal["blue", "gray"] | None = None,
        keys: tuple[Key, ...] = (),
    ) -> viser.GuiButtonHandle:
        """Add a button that calls a function for its client, and its command."""
        handle = self._gui.add_button(label, hint=hint, icon=icon, color=color)
        handle.on_click(lambda event: act(event.client_id))
        self._commands.offer(handle, lambda client: act(client.client_id), keys=keys)
        return handle

    def under_way(self, what: str, feed: Feed[Any, Any]) -> None:
        """Add the buttons that stop and repeat the drawing of a feed, such as "workspace"."""
        hint, icon = f"End the present computation of the {what}.", viser.Icon.PLAYER_STOP
        stop = self.press(f"Stop computing the {what}", hint, lambda _: feed.cancel(), icon=icon)
        hint, icon = f"Compute the {what} again after it was stopped.", viser.Icon.REFRESH
        retry = self.press(f"Compute the {what}", hint, lambda _: feed.retry(), icon=icon)
        self.follow(stop, "visible", lambda _: feed.stage is not None)
        self.follow(retry, "visible", lambda _: feed.is_cancelled)

    def _bound(
        self, handle: viser.GuiInputHandle[Any], at: Source[Any], label: str, *, power: int
    ) -> ControlBinding[Any]:
        """Return the binding of a control whose label may have the unit of lengths."""
        name, _, unit = label.partition(" ({unit")
        if unit:
            self._labels.append((handle, label, power))
        bound = bound_to(at, name)
        return in_unit(bound, power) if power else bound

    def _bind(
        self,
        handle: viser.GuiInputHandle[Value],
        bound: ControlBinding[Value],
        step: Callable[[State], float] | None = None,
        **conditions: Unpack[Conditions],
    ) -> Control[Value]:
        """Bind an input that has no range to the state."""
        control = Control(self._session, handle, bound, step=step, **conditions)
        self._controls.append(control)
        return control

    def updates(self, frame: Frame) -> Iterator[Update]:
        """Yield the updates that make every control show the frame."""
        for handle, content_of in self._markups:
            content = content_of(frame)
            yield handle, "visible", content != ""
            if content:
                yield handle, "content", content
        for handle, name, value in self._followers:
            yield handle, name, value(frame)
        for handle, words, power in self._labels:
            yield handle, "label", words.format(unit=frame.state.unit_of(power).name)
        for control in self._controls:
            yield from control.updates(frame)
