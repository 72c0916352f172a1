"""The controls of a page as they are: where they stand, what they say, and how to use one.

What the command palette offers and what the tests look at is read from the controls
themselves, so that it can lag behind none of them. Beside `explorer.app.browser.viser_gaps` this is
the one module that uses private names of viser.
"""

from __future__ import annotations

import time
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, Literal

import viser

Kind = Literal["button", "choice", "switch", "list", "upload", "value"]


@dataclass(frozen=True)
class Widget:
    """A control of the page.

    Attributes:
        handle: viser's.
        kind: A button, a row of buttons, a checkbox, a list to choose from, a button for
            files, or what holds a value such as a slider.
        path: The titles of what it stands in, the outermost first: its tab, then folders.
        containers: What it stands in, from the inside out.
    """

    handle: Any
    kind: Kind
    path: tuple[str, ...]
    containers: tuple[Any, ...] = ()

    @property
    def label(self) -> str:
        """The words beside it, or on it."""
        return str(self.handle.label)

    @property
    def hint(self) -> str:
        """What is told of it when a pointer rests on it."""
        return str(getattr(self.handle, "hint", None) or "")

    @property
    def options(self) -> tuple[str, ...]:
        """Of which it offers one, if it does."""
        return tuple(getattr(self.handle, "options", ()))

    @property
    def is_in_use(self) -> bool:
        """Whether it can be seen, its tab open, and be used."""
        return not self.handle.disabled and all(
            getattr(each, "visible", True) for each in (self.handle, *self.containers)
        )

    def use(self, client: viser.ClientHandle, value: Any = None) -> None:
        """Use it as this browser would: all others see its new value, and who listens is told.

        Args:
            client: The browser.
            value: That it is given; what it holds if None, as with a button.
        """
        from viser import _messages

        state: Any = self.handle._impl
        state.update_timestamp = time.time()
        if value is not None:
            state.value = value
            if not state.is_button:
                changed = _messages.GuiUpdateMessage(state.uuid, {"value": value})
                state.gui_api._websock_interface.queue_message(changed)
        for callback in tuple(state.update_cb):
            callback(viser.GuiEvent(client, client.client_id, self.handle))


def widgets(server: viser.ViserServer) -> Iterator[Widget]:
    """Yield the controls that all browsers share, in the order in which they were made."""
    gui: Any = server.gui
    for handle in tuple(gui._gui_input_handle_from_uuid.values()):
        containers = tuple(_containers(handle))
        titles = tuple(title for each in containers if (title := _title(each)))
        yield Widget(handle, _kind(handle), titles[::-1], containers)


def _kind(handle: Any) -> Kind:
    match handle:
        case viser.GuiUploadButtonHandle():
            return "upload"
        case viser.GuiButtonGroupHandle():
            return "choice"
        case viser.GuiButtonHandle():
            return "button"
        case viser.GuiCheckboxHandle():
            return "switch"
        case viser.GuiDropdownHandle():
            return "list"
        case _:
            return "value"


def _containers(handle: Any) -> Iterator[Any]:
    """Yield what a control stands in, from the inside out."""
    gui = handle._impl.gui_api
    inside: str | None = handle._impl.parent_container_id
    while inside is not None:
        container = gui._container_handle_from_uuid.get(inside)
        if container is None:
            return
        yield container
        # A tab stands in its group of tabs.
        owner = getattr(container, "_parent", container)
        state = getattr(owner, "_impl", None)
        inside = getattr(state, "parent_container_id", None)


def _title(container: Any) -> str | None:
    if isinstance(container, viser.GuiTabHandle):
        return str(getattr(container, "_label"))  # noqa: B009 - private
    if isinstance(container, viser.GuiFolderHandle):
        return container.label
    return None
