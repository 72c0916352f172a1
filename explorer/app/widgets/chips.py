"""Commands that change the state, and rows of small buttons that do them.

A button in markup is a switch, an option of which one is on, or neither.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from html import escape

import viser

from explorer.app.session.session import Session
from explorer.app.state.actions import Action, Set
from explorer.app.state.parts import value_at
from explorer.app.state.state import State
from explorer.app.widgets.buttons import Buttons, press_button
from explorer.page.widgets.palette import STEP, Command, Key, with_keys


@dataclass(frozen=True)
class StateCommand:
    """A command that changes the state, and what a button that does it shows.

    Attributes:
        label: Name in the search, from the tab to the option.
        does: Sentence on what it does.
        change: Function from the state to the action; None for none.
        is_on: Function that tells whether a switch or an option is on; None if it is neither.
        is_ready: Function that tells whether a state allows it; if None, whenever there is an
            action, which must be found at once.
        keys: Keys that run it, told in the hint of its button.
        words: Words on its button; the last step of its label if "".
        spoken: Name of its button for screen readers; the words if "".
    """

    label: str
    does: str
    change: Callable[[State], Action | None]
    is_on: Callable[[State], bool] | None = None
    is_ready: Callable[[State], bool] | None = None
    keys: tuple[Key, ...] = ()
    words: str = ""
    spoken: str = ""

    @property
    def own_words(self) -> str:
        """The words on its button."""
        return self.words or self.label.rpartition(STEP)[2]

    def can_run(self, state: State) -> bool:
        """Whether a state allows it."""
        return self.change(state) is not None if self.is_ready is None else self.is_ready(state)

    def html(self, name: str, value: str, look: str, state: State | None = None) -> str:
        """Return its button as HTML, as it is in a state; without one, as if always ready."""
        return press_button(
            name,
            value,
            escape(self.own_words),
            hint=with_keys(self.does, self.keys),
            label=self.spoken,
            class_name=look,
            is_on=None if state is None or self.is_on is None else self.is_on(state),
            is_disabled=state is not None and not self.can_run(state),
        )

    def of(self, session: Session) -> Command:
        """Return the command for a session."""

        def run(client: viser.ClientHandle) -> None:
            session.do(self.change, who=client.client_id)

        return Command(
            self.label, self.does, run, lambda: self.can_run(session.state), keys=self.keys
        )


Effect = tuple[Callable[[State], Action], Callable[[State], bool]]
"""The action of a switch or an option, and whether it is on."""


def turn(at: str, name: str) -> Effect:
    """Return the effect of a switch: a press turns a value of the state on or off.

    The value is given by its path, such as "view.workspace.solid", and its name in the history.
    """
    return lambda state: Set(at, not value_at(state, at), name), lambda state: value_at(state, at)


def choose(at: str, value: str, name: str, words: str = "") -> Effect:
    """Return the effect of an option: a press sets a value of the state.

    The value is given by its path, such as "paths.kind", its name and its words in the history,
    which are the value itself if "".
    """
    action = Set(at, value, name, words or value)
    return lambda _: action, lambda state: value_at(state, at) == value


class Chips:
    """A row of small buttons, registered under a name such as "workspace.show".

    The title stands before the row, "" for buttons in other markup; presses send the keys of
    the commands.
    """

    def __init__(
        self,
        buttons: Buttons,
        session: Session,
        name: str,
        title: str,
        commands: Mapping[str, StateCommand],
    ) -> None:
        self._name, self._title, self._commands = name, title, commands
        buttons.on(
            name,
            lambda value, client: session.do(commands[value].change, who=client.client_id),
            values=commands,
        )
        for each in commands.values():
            buttons.commands.add(each.of(session))

    def html(self, state: State) -> str:
        """Return the row with its title as HTML."""
        return (
            f'<div class="ex-chips" role="group" aria-label="{escape(self._title)}">'
            f'<span class="ex-dim">{escape(self._title)}</span>{self.buttons(state)}</div>'
        )

    def buttons(self, state: State) -> str:
        """Return the buttons alone as HTML."""
        return "".join(
            each.html(self._name, value, "ex-chip", state) for value, each in self._commands.items()
        )
