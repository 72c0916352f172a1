"""The command palette: all that can be done, found by its name, and by keys."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from typing import Any

import viser

from explorer.app.widgets.assigning import Update
from explorer.app.widgets.commands import ALWAYS, KEYS, STEP, Key, offers, with_keys
from explorer.app.widgets.pieces import Widget, widgets

Run = Callable[[viser.ClientHandle], None]
"""Does something for the browser that asked."""


@dataclass(frozen=True)
class Command:
    """Something that can be done.

    Attributes:
        label: Its name, unlike any other, from the tab to the option.
        does: What it does, in a sentence.
        run: Does it.
        is_ready: Whether it can be done now.
        stands_alone: Whether it has no control that decides about that.
    """

    label: str
    does: str
    run: Run
    is_ready: Callable[[], bool] = lambda: True
    stands_alone: bool = True

    @property
    def keys(self) -> tuple[Key, ...]:
        """The keys that do it."""
        return KEYS.get(self.label, ())


class Palette:
    """Registers what the page's controls offer, and what has no control.

    It is made after all controls that it is to offer.

    Args:
        server: Whose browsers have the palette.
        more: What has no control of its own.
    """

    def __init__(self, server: viser.ViserServer, more: tuple[Command, ...] = ()) -> None:
        self._gui = server.gui
        self._registered: list[tuple[Command, viser.CommandHandle]] = []
        for widget in widgets(server):
            found = tuple(commands_of(widget))
            for command in found:
                self.add(command)
            keys = tuple(key for command in found for key in command.keys)
            if keys:
                widget.handle.hint = with_keys(widget.hint, keys)
        for command in more:
            self.add(command)
        self._passing: dict[str, viser.CommandHandle] = {}

    @property
    def commands(self) -> tuple[Command, ...]:
        """All that stays on offer."""
        return tuple(dict.fromkeys(command for command, _ in self._registered))

    def add(self, command: Command) -> None:
        """Offer something more.

        Raises:
            ValueError: there is a command of that name.
        """
        if any(command.label == known.label for known, _ in self._registered):
            raise ValueError(f"two commands are called {command.label!r}")
        keys = command.keys or (None,)
        for index, key in enumerate(keys):
            # viser's commands have one key each.
            label = command.label if index == 0 else f"{command.label}  ({key})"
            self._register(command, label, key)

    def offer(self, passing: Iterable[Command]) -> None:
        """Offer some commands besides those that stay, and no more those of the last time."""
        wanted = {command.label: command for command in passing}
        for label in self._passing.keys() - wanted.keys():
            self._passing.pop(label).remove()
        for label in wanted.keys() - self._passing.keys():
            self._passing[label] = self._made(wanted[label], label, None)

    def updates(self, *, controls: bool) -> Iterator[Update]:
        """Yield what leaves those to be chosen that can be done.

        Args:
            controls: Whether any control has come into use or gone out of it; without that
                what is the command of a control is left as it is.
        """
        for command, handle in self._registered:
            if controls or command.stands_alone:
                yield handle, "disabled", not command.is_ready()

    def _register(self, command: Command, label: str, key: Key | None) -> None:
        self._registered.append((command, self._made(command, label, key)))

    def _made(self, command: Command, label: str, key: Key | None) -> viser.CommandHandle:
        key_of: Any = key
        handle = self._gui.add_command(
            label,
            description=command.does,
            hotkey=None if key is None else key_of.key,
            modifier=None if key is None else key_of.modifier,
        )

        @handle.on_trigger
        def _(event: viser.CommandEvent) -> None:
            if event.client is not None and command.is_ready():
                command.run(event.client)

        return handle


def commands_of(widget: Widget) -> Iterator[Command]:
    """Yield what a control offers, to be done as if by hand."""
    for label, option in offers(widget).items():
        is_always = widget.label.startswith(ALWAYS)
        yield Command(
            label,
            widget.hint,
            lambda client, option=option: _use(widget, client, option),
            (lambda: True) if is_always else lambda: widget.is_in_use,
            stands_alone=False,
        )


def _use(widget: Widget, client: viser.ClientHandle, option: str | None) -> None:
    widget.use(client, not widget.handle.value if widget.kind == "switch" else option)


def group_of(command: Command) -> str:
    """Return the tab to which a command belongs, or what it is about."""
    return command.label.split(STEP)[0]
