"""The card of all keys."""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterable, Sequence
from html import escape

import viser

from explorer.app.browser.viser_gaps import element_id
from explorer.app.widgets.commands import PAGE, PALETTE_KEY, STEP
from explorer.app.widgets.markup import caption
from explorer.app.widgets.palette import Command, group_of

# Keys and pointers with which viser moves the camera.
CAMERA = (
    ("drag, arrows", "Turn"),
    ("right drag", "Move"),
    ("wheel", "Zoom"),
    ("W A S D Q E", "Fly"),
)
# viser closes a card from the server only. An attribute with this name therefore holds the id of
# the card's close button, which the script `opens` presses.
CLOSED_BY = "data-closed-by"


class KeysCard:
    """The card with all keys, over the page of the browser that opened it."""

    def __init__(self) -> None:
        # Function that closes the card, by browser; presses come on threads of their own.
        self._open: dict[int, Callable[[], None]] = {}
        self._lock = threading.RLock()

    def toggle(self, client: viser.ClientHandle, commands: Sequence[Command]) -> None:
        """Show the keys of these commands, or close the card."""
        with self._lock:
            if client.client_id in self._open:
                self.close(client)
                return
            modal = client.gui.add_modal("Keys")
            self._open[client.client_id] = modal.close
            with modal:
                table = client.gui.add_html("")
                button = client.gui.add_button("Close", hint="Close the card. Keys: K, Escape.")
                table.content = closed_by(element_id(button), keys_table(commands))
            button.on_click(lambda _: self.close(client))

    def close(self, client: viser.ClientHandle) -> None:
        """Close the card."""
        with self._lock:
            close = self._open.pop(client.client_id, None)
            if close is not None:
                close()

    def disconnected(self, client: viser.ClientHandle) -> None:
        """Forget a browser."""
        self._open.pop(client.client_id, None)


def keycap(key: str) -> str:
    """Return a drawn key, as HTML."""
    return f'<kbd class="ex-keycap">{escape(key)}</kbd>'


def closed_by(button: str, content: str) -> str:
    """Return the content of a card, HTML, that names the id of the button that closes it."""
    return f'<div {CLOSED_BY}="{escape(button)}">{content}</div>'


def keys_table(commands: Iterable[Command]) -> str:
    """Return all keys as HTML, in the groups of their commands and in two columns."""
    palette = _row("Search all commands", keycap(str(PALETTE_KEY)))
    groups = {PAGE: [palette]}
    for command in commands:
        if command.keys:
            caps = " ".join(keycap(str(key)) for key in command.keys)
            words = command.label.partition(STEP)[2].replace(STEP, ", ")
            groups.setdefault(group_of(command), []).append(_row(words, caps))
    camera = [_row(words, keycap(keys)) for keys, words in CAMERA]
    blocks = "".join(
        f"<div>{caption(name)}{''.join(rows)}</div>"
        for name, rows in {**groups, "Camera": camera}.items()
    )
    return f'<div class="ex-keys">{blocks}</div>'


def _row(words: str, caps: str) -> str:
    return f'<div class="ex-line"><span>{escape(words)}</span><span>{caps}</span></div>'
