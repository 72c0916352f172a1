"""The command palette: all commands of the page, by name and by key.

It offers every button, switch and list of the page; features add commands that have no control.
Keys are those of other 3D programs: 0, 1, 3 and 7 for the views, F to fit, H for home, letters for
visible parts. None is a key of the browser, and W, A, S, D, Q, E and the arrows move the camera.
"""

from __future__ import annotations

import asyncio
import inspect
import time
from collections.abc import Callable, Container, Iterable, Iterator, Mapping
from dataclasses import dataclass, replace
from typing import Any, Literal

import viser

from explorer.page.browser.viser_gaps import resend
from explorer.page.widgets.assigning import Update

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
"""The key that opens the palette, in viser."""


def shift(key: str) -> Key:
    """Return a key with Shift held down."""
    return Key(key, "shift")


NAMED_WITH_FOLDER = frozenset({"Free variables", "Tetrahedra"})
"""Folders whose title is part of the names of their switches."""

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
    """A command of the palette.

    Attributes:
        label: Unique name, from the tab to the option.
        does: Sentence on what it does.
        run: Function that runs it.
        is_ready: Function that tells whether it can run now.
        stands_alone: Whether it has no control, which would decide whether it is ready.
        keys: Keys that run it.
    """

    label: str
    does: str
    run: Run
    is_ready: Callable[[], bool] = lambda: True
    stands_alone: bool = True
    keys: tuple[Key, ...] = ()


class Palette:
    """Registers the commands of the page's controls, and those without a control.

    The palette must be made after all controls.

    Args:
        server: Server whose browsers have the palette.
        more: Commands without a control.
        keys: Keys of controls, by the names of their commands.
        lists: Labels of the lists whose every option is a command.
    """

    def __init__(
        self,
        server: viser.ViserServer,
        more: Iterable[Command] = (),
        keys: Mapping[str, tuple[Key, ...]] | None = None,
        lists: Container[str] = (),
    ) -> None:
        self._gui = server.gui
        keys = keys or dict[str, tuple[Key, ...]]()
        self._registered: list[tuple[Command, viser.CommandHandle]] = []
        for widget in widgets(server):
            widget_keys: tuple[Key, ...] = ()
            for command in commands_of(widget, lists):
                own = keys.get(command.label, ())
                self.add(replace(command, keys=own))
                widget_keys += own
            if widget_keys:
                widget.handle.hint = with_keys(widget.hint, widget_keys)
        for command in more:
            self.add(command)
        # By group: the commands that come and go, and their handles by label.
        self._passing: dict[str, tuple[tuple[Command, ...], dict[str, viser.CommandHandle]]] = {}

    @property
    def commands(self) -> tuple[Command, ...]:
        """The commands that stay in the palette."""
        return tuple(dict.fromkeys(command for command, _ in self._registered))

    def add(self, command: Command) -> None:
        """Add a command that stays.

        Raises:
            ValueError: Another command has this name.
        """
        if any(command.label == known.label for known, _ in self._registered):
            raise ValueError(f"two commands are called {command.label!r}")
        keys = command.keys or (None,)
        for index, key in enumerate(keys):
            # viser's commands have one key each.
            label = command.label if index == 0 else f"{command.label}  ({key})"
            self._registered.append((command, self._add_to_page(command, label, key)))

    def offer(self, group: str, passing: tuple[Command, ...]) -> None:
        """Offer these commands besides those that stay; remove the others of the group.

        The same object as in the last call changes nothing and takes no time.
        """
        before, handles = self._passing.get(group, ((), {}))
        if passing is before:
            return
        self._passing[group] = passing, handles
        commands = {command.label: command for command in passing}
        for label in handles.keys() - commands.keys():
            handles.pop(label).remove()
        for label in commands.keys() - handles.keys():
            handles[label] = self._add_to_page(commands[label], label, None)

    def updates(self, *, controls: bool) -> Iterator[Update]:
        """Yield the updates that enable the commands that are ready, and disable the others.

        Commands of controls stay as they are unless any control was enabled, disabled, shown or
        hidden.
        """
        for command, handle in self._registered:
            if controls or command.stands_alone:
                yield handle, "disabled", not command.is_ready()

    def _add_to_page(self, command: Command, label: str, key: Key | None) -> viser.CommandHandle:
        untyped: Any = key
        handle = self._gui.add_command(
            label,
            description=command.does,
            hotkey=None if key is None else untyped.key,
            modifier=None if key is None else untyped.modifier,
        )

        @handle.on_trigger
        def _(event: viser.CommandEvent) -> None:
            if event.client is not None and command.is_ready():
                command.run(event.client)

        return handle


def commands_of(widget: Widget, lists: Container[str] = ()) -> Iterator[Command]:
    """Yield the commands that use a control as a user would, one for each of its options."""
    label = " ".join(widget.label.split())
    folders = [title for title in widget.path[1:] if title in NAMED_WITH_FOLDER]
    parts = [*widget.path[:1], *folders, label]
    options: dict[str, Any] = {}
    if widget.kind in ("button", "switch"):
        options = {STEP.join(parts): None}
    elif widget.kind == "choice" or (widget.kind == "list" and widget.label in lists):
        chosen = (option for option in widget.options if option != NO_OPTION)
        options = {STEP.join([*parts, " ".join(option.split())]): option for option in chosen}
    for name, option in options.items():

        def use(client: viser.ClientHandle, option: str | None = option) -> None:
            widget.use(client, not widget.handle.value if widget.kind == "switch" else option)

        yield Command(name, widget.hint, use, lambda: widget.is_in_use, stands_alone=False)


Kind = Literal["button", "choice", "switch", "list", "upload", "value"]
KINDS: Mapping[type, Kind] = {
    viser.GuiUploadButtonHandle: "upload",
    viser.GuiButtonGroupHandle: "choice",
    viser.GuiButtonHandle: "button",
    viser.GuiCheckboxHandle: "switch",
    viser.GuiDropdownHandle: "list",
}
"""Kinds of controls by the class of their handles in viser; the others hold a value."""


@dataclass(frozen=True)
class Widget:
    """A control of the page as viser holds it.

    Gap: viser lists its controls under private names alone, and has no call that presses one.

    Attributes:
        handle: Handle of viser.
        kind: A button, a row of buttons ("choice"), a checkbox ("switch"), a list, a button for
            files ("upload"), or a control that holds a value, such as a slider.
        path: Titles of its tab and folders, the outermost first.
        containers: Handles of its folders and tab, from the inside out.
    """

    handle: Any
    kind: Kind
    path: tuple[str, ...]
    containers: tuple[Any, ...] = ()

    @property
    def label(self) -> str:
        """The words beside or on the control."""
        return str(self.handle.label)

    @property
    def hint(self) -> str:
        """The hint that is shown when a pointer rests on the control."""
        return str(getattr(self.handle, "hint", None) or "")

    @property
    def options(self) -> tuple[str, ...]:
        """The options to choose from, if any."""
        return tuple(getattr(self.handle, "options", ()))

    @property
    def is_in_use(self) -> bool:
        """Whether the control is enabled, and visible once its tab is open."""
        return not self.handle.disabled and all(
            getattr(handle, "visible", True) for handle in (self.handle, *self.containers)
        )

    def use(self, client: viser.ClientHandle, value: Any = None) -> None:
        """Use the control as a browser would: the others get its new value, callbacks are called.

        The value is None to leave it, as with a button.
        """
        state: Any = self.handle._impl
        state.update_timestamp = time.time()
        if value is not None:
            state.value = value
            if not state.is_button:
                resend(self.handle, "value")
        for callback in tuple(state.update_cb):
            outcome = callback(viser.GuiEvent(client, client.client_id, self.handle))
            if inspect.iscoroutine(outcome):
                asyncio.run(outcome)


def widgets(server: viser.ViserServer) -> Iterator[Widget]:
    """Yield the controls that all browsers share, in the order in which they were made."""
    gui: Any = server.gui
    for handle in tuple(gui._gui_input_handle_from_uuid.values()):
        containers = tuple(_containers(handle))
        titles = tuple(title for container in containers if (title := _title(container)))
        yield Widget(handle, KINDS.get(handle.__class__, "value"), titles[::-1], containers)


def _containers(handle: Any) -> Iterator[Any]:
    """Yield the folders and the tab of a control, from the inside out."""
    state = handle._impl
    gui, inside = state.gui_api, state.parent_container_id
    while inside is not None:
        container = gui._container_handle_from_uuid.get(inside)
        if container is None:
            return
        yield container
        # A tab stands in its group of tabs.
        state = getattr(getattr(container, "_parent", container), "_impl", None)
        inside = getattr(state, "parent_container_id", None)


def _title(container: Any) -> str | None:
    if isinstance(container, viser.GuiTabHandle):
        return str(getattr(container, "_label"))  # noqa: B009 - private
    return container.label if isinstance(container, viser.GuiFolderHandle) else None
