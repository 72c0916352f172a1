"""The commands of the page, by name and by key.

They are every button, every switch and some lists, as they are made, and what has no control; the
search offers them by name.
Keys are those of other 3D programs: 0, 1, 3 and 7 for the views, F to fit, H for home, letters for
visible parts. None is a key of the browser, and W, A, S, D, Q, E and the arrows move the camera.
"""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Generator
from dataclasses import dataclass
from functools import partial
from typing import Any

import viser

# Separator of the parts of a command's name, from the tab to the option.
STEP = " › "


@dataclass(frozen=True)
class Key:
    """A key by its name in viser, with its modifiers, such as "cmd/ctrl+shift", if it has any."""

    key: str
    modifier: str | None = None

    def __str__(self) -> str:
        parts = [] if self.modifier is None else self.modifier.split("+")
        modifiers = [MODIFIER_NAMES.get(part, part.capitalize()) for part in parts]
        return "+".join([*modifiers, self.key if len(self.key) == 1 else self.key.capitalize()])


MODIFIER_NAMES = {"cmd/ctrl": "Ctrl"}
"""Names of modifiers on the page; on a Mac the Command key does the same as Ctrl."""

PALETTE_KEY = Key("K", "cmd/ctrl")
"""The key that opens the search."""


def shift(key: str) -> Key:
    """Return a key with Shift held down."""
    return Key(key, "shift")


NO_OPTION = "—"
"""The text of a list when none of its options applies."""


def with_keys(hint: str, keys: tuple[Key, ...]) -> str:
    """Return the hint of a control with its keys at the end."""
    if not keys:
        return hint
    return f"{hint} {'Key' if len(keys) == 1 else 'Keys'}: {', '.join(map(str, keys))}."


Run = Callable[[viser.ClientHandle], None]
"""Runs a command for the browser that requested it."""


@dataclass(frozen=True)
class Command:
    """A command of the page.

    Attributes:
        label: Unique name, from the tab to the option.
        does: Sentence on what it does.
        run: Function that runs it.
        is_ready: Function that tells whether it can run now.
        keys: Keys that run it.
    """

    label: str
    does: str
    run: Run
    is_ready: Callable[[], bool] = lambda: True
    keys: tuple[Key, ...] = ()


class Commands:
    """The commands of a page that stay: those of controls first, each in the order of their making.

    A control is a handle of viser, and stands in the tab and the folders of `within`.
    """

    def __init__(self) -> None:
        self._of_controls: list[Command] = []
        self._others: list[Command] = []
        self._titles: tuple[str, ...] = ()

    @property
    def all(self) -> tuple[Command, ...]:
        """All commands so far."""
        return (*self._of_controls, *self._others)

    @contextlib.contextmanager
    def within(self, title: str) -> Generator[None]:
        """Name the commands of the controls that are made meanwhile after a tab, or a folder."""
        before, self._titles = self._titles, (*self._titles, title)
        try:
            yield
        finally:
            self._titles = before

    def offer(
        self, control: Any, run: Run, *, option: str = "", keys: tuple[Key, ...] = ()
    ) -> None:
        """Offer to use a control, whose hint then ends with its keys.

        Args:
            control: The control.
            run: Function that uses it.
            option: The option that this chooses; "" for a control without options.
            keys: Keys that do it.
        """
        words = (" ".join(each.split()) for each in (control.label, option) if each)
        does = str(control.hint)
        if keys:
            control.hint = with_keys(does, keys)
        self._of_controls.append(
            Command(
                STEP.join((*self._titles, *words)),
                does,
                run,
                lambda: control.visible and not control.disabled,
                keys=keys,
            )
        )

    def add(self, command: Command) -> None:
        """Add a command without a control."""
        self._others.append(command)


class Palette:
    """The keys of the commands; it must be made after all controls.

    Args:
        server: Server whose browsers have the keys.
        commands: The commands that stay.

    Raises:
        ValueError: Two commands have one name.
    """

    def __init__(self, server: viser.ViserServer, commands: tuple[Command, ...] = ()) -> None:
        self.commands = commands
        for command in commands:
            if sum(command.label == other.label for other in commands) > 1:
                raise ValueError(f"two commands are called {command.label!r}")
            for key in command.keys:
                # viser's commands have one key each.
                untyped: Any = key
                label, hotkey, modifier = f"{command.label}  ({key})", untyped.key, untyped.modifier
                handle = server.gui.add_command(label, hotkey=hotkey, modifier=modifier)
                handle.on_trigger(partial(_run, command))


def _run(command: Command, event: viser.CommandEvent) -> None:
    if event.client is not None and command.is_ready():
        command.run(event.client)
