"""The controls of a page as viser holds them: places, words, options, and a way to use one.

The command palette and the tests read them here, so that neither lags behind the page. Gap: viser
lists its controls under private names alone, and has no call that presses one.
"""

from __future__ import annotations

import asyncio
import inspect
import time
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, Literal

import viser

from explorer.app.browser.viser_gaps import resend

Kind = Literal["button", "choice", "switch", "list", "upload", "value"]


@dataclass(frozen=True)
class Widget:
    """A control of the page.

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

        Args:
            client: The browser.
            value: New value; None to leave the value, as with a button.
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
    if isinstance(container, viser.GuiFolderHandle):
        return container.label
    return None
