"""What viser does but offers no public name for; every private name of it is in here."""

from __future__ import annotations

import contextlib
import io
from typing import Any

import viser

Mark = tuple[float, str]


def start_viser(host: str, port: int) -> viser.ViserServer:
    """Return a running server, without the banner that viser prints to standard output."""
    with contextlib.redirect_stdout(io.StringIO()):
        return viser.ViserServer(host=host, port=port, verbose=False)


def stop_viser(server: viser.ViserServer) -> None:
    """Stop a server, without the line that its thread prints to standard output."""
    internals: Any = server
    with contextlib.redirect_stdout(io.StringIO()):
        server.stop()
        thread = getattr(internals._websock_server, "_server_thread", None)
        if thread is not None:
            thread.join(timeout=5.0)


class MarksOf:
    """The marks below a slider: its constructor takes them, its handle does not."""

    def __init__(self, slider: viser.GuiSliderHandle[float]) -> None:
        self._slider: Any = slider

    @property
    def marks(self) -> tuple[Mark, ...]:
        """Position and label of each mark."""
        return tuple((mark.value, mark.label) for mark in self._slider._marks)

    @marks.setter
    def marks(self, marks: tuple[Mark, ...]) -> None:
        from viser import _messages

        self._slider._marks = tuple(_messages.GuiSliderMark(value, label) for value, label in marks)


def refuse_tunnels(server: viser.ViserServer) -> None:
    """Ignore every request for a public tunnel; viser opens one for any client that asks."""
    from viser import _messages

    internals: Any = server
    internals._websock_server.unregister_handler(_messages.ShareUrlRequest)


def element_id(button: viser.GuiButtonHandle) -> str:
    """Return the id that a button has in the page, by which a label of HTML can be for it."""
    internals: Any = button
    return str(internals._impl.uuid)
