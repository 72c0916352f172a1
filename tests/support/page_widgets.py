"""The controls that a page has, each with the tab and the folders that it stands in."""

from __future__ import annotations

import asyncio
import inspect
import time
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any, Literal

import viser

from explorer.page.browser.viser_gaps import resend

Kind = Literal["button", "switch", "list", "value"]
KINDS: Mapping[type, Kind] = {
    viser.GuiUploadButtonHandle: "button",
    viser.GuiButtonGroupHandle: "button",
    viser.GuiButtonHandle: "button",
    viser.GuiCheckboxHandle: "switch",
    viser.GuiDropdownHandle: "list",
}
"""Kinds of controls by the class of their handles in viser; the others hold a value."""


@dataclass(frozen=True)
class Widget:
    """A control of the page as viser holds it.

    Attributes:
        handle: Handle of viser.
        kind: A button or several, a checkbox ("switch"), a list, or a control that holds a value,
            such as a slider.
        path: Titles of its tab and folders, the outermost first.
    """

    handle: Any
    kind: Kind
    path: tuple[str, ...]

    @property
    def label(self) -> str:
        """The words beside or on the control."""
        return str(self.handle.label)

    @property
    def hint(self) -> str:
        """The hint that is shown when a pointer rests on the control."""
        return str(getattr(self.handle, "hint", None) or "")

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
        titles = tuple(title for each in _containers(handle) if (title := _title(each)))
        yield Widget(handle, KINDS.get(handle.__class__, "value"), titles[::-1])


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
