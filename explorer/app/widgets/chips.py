"""A row of small buttons in markup, bound to the state: switches, or options of which one is on.

Each of them is a command of the palette too.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from html import escape

from explorer.app.session.session import Session
from explorer.app.state.actions import Action, Set
from explorer.app.state.parts import value_at
from explorer.app.state.state import State
from explorer.app.widgets.buttons import Buttons, press_button
from explorer.page.widgets.palette import Key, with_keys


@dataclass(frozen=True)
class Effect:
    """The effect of a chip: the action of a press, and whether the chip is on, by the state."""

    change: Callable[[State], Action]
    is_on: Callable[[State], bool]


def turn(at: str, name: str) -> Effect:
    """Return the effect of a switch: a press turns a value of the state on or off.

    The value is given by its path, such as "view.workspace.solid", and its name in the history.
    """
    return Effect(
        lambda state: Set(at, not value_at(state, at), name), lambda state: value_at(state, at)
    )


def choose(at: str, value: str, name: str) -> Effect:
    """Return the effect of an option, which the history shows: a press sets a value of the state.

    The value is given by its path, such as "paths.kind", and its name in the history.
    """
    return Effect(lambda _: Set(at, value, name, value), lambda state: value_at(state, at) == value)


@dataclass(frozen=True)
class Chip:
    """A small button bound to the state.

    Attributes:
        words: The words on it.
        command: Its name in the palette, from the tab to the option.
        hint: Sentence on what a press does.
        effect: What a press changes, and whether the chip is on.
        is_ready: Function that tells whether it can be pressed.
        is_visible: Function that tells whether it stands in the row.
        keys: Keys that press it, told in its hint.
        label: Name for screen readers; the words if "".
    """

    words: str
    command: str
    hint: str
    effect: Effect
    is_ready: Callable[[State], bool] = lambda _: True
    is_visible: Callable[[State], bool] = lambda _: True
    keys: tuple[Key, ...] = ()
    label: str = ""


class Chips:
    """A row of chips.

    Args:
        buttons: Buttons of the page, among which the chips are registered.
        session: Session to which they post.
        name: Name of the row among the buttons, such as "workspace.show".
        title: Words before the row; "" for chips that stand in other markup.
        chips: The chips by the values that their presses send.
    """

    def __init__(
        self,
        buttons: Buttons,
        session: Session,
        name: str,
        title: str,
        chips: Mapping[str, Chip],
    ) -> None:
        self._name = name
        self._title = title
        self._chips = chips
        buttons.on(
            name,
            lambda value, client: session.do(chips[value].effect.change, who=client.client_id),
            values=chips,
        )
        for value, chip in chips.items():
            is_ready = chip.is_ready
            buttons.offer(
                chip.command,
                chip.hint,
                name,
                value,
                # A default binds the chip of this round.
                lambda is_ready=is_ready: is_ready(session.state),
                keys=chip.keys,
            )

    def html(self, state: State) -> str:
        """Return the row with its title as HTML."""
        return (
            f'<div class="ex-chips" role="group" aria-label="{escape(self._title)}">'
            f'<span class="ex-dim">{escape(self._title)}</span>{self.buttons(state)}</div>'
        )

    def buttons(self, state: State) -> str:
        """Return the chips alone as HTML."""
        return "".join(
            press_button(
                self._name,
                value,
                escape(chip.words),
                hint=with_keys(chip.hint, chip.keys),
                label=chip.label,
                class_name="ex-chip",
                is_on=chip.effect.is_on(state),
                is_disabled=not chip.is_ready(state),
            )
            for value, chip in self._chips.items()
            if chip.is_visible(state)
        )
