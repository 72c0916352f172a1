"""viser's server: started and stopped quietly, guarded, and with private parts of it changed."""

from __future__ import annotations

import asyncio
import contextlib
import io
import sys
import threading
import warnings
from collections.abc import Callable, Generator
from typing import Any, cast

import viser
import websockets.asyncio.server

from explorer.app.security.guard import Serve
from explorer.errors import ServerError

# Name of the module of viser that serves.
SERVING_MODULE = "viser.infra._infra"
_serving_lock = threading.Lock()
# Size in bytes beyond which no upload is read; no purpose of the page needs as much.
LARGEST_UPLOAD = 32_000_000
# Number up to which JavaScript represents every whole number.
LARGEST_NUMBER = 2.0**53


def start_viser(
    host: str, port: int, guarded: Callable[[Serve], Serve] | None = None
) -> viser.ViserServer:
    """Return a running server, without the banner that viser prints to standard output.

    Args:
        host: The address to listen on.
        port: The port to listen on; any free one if 0.
        guarded: Returns a replacement for websockets' function by which viser serves; with
            None everybody gets in.

    Raises:
        ServerError: this viser does not serve in the way that is guarded.
    """
    # A tab may close while a message is on its way to it; that needs no warning.
    warnings.filterwarnings("ignore", "Queued a .* on a closed connection")
    _set_events_in_their_loop()
    with contextlib.redirect_stdout(io.StringIO()), _serving_through(guarded) as is_guarded:
        server = viser.ViserServer(host=host, port=port, verbose=False)
    if not is_guarded():
        stop_viser(server)
        raise ServerError(
            f"viser {viser.__version__} serves in a way that the explorer does not guard; "
            "install the version that it asks for: pip install --force-reinstall flagged-explorer"
        )
    return server


class _LoopEvent(asyncio.Event):
    """An event that only its loop sets.

    viser sets the event for new messages twice: at once, in the thread that sends, and again in
    the loop. The first is not safe: a tab that begins to wait at that moment is never woken, or
    the thread fails.

    Args:
        loop: The loop.
    """

    def __init__(self, loop: asyncio.AbstractEventLoop) -> None:
        super().__init__()
        self._own_loop = loop

    def set(self) -> None:
        """Set the event if this runs in its loop, and do nothing otherwise."""
        with contextlib.suppress(RuntimeError):
            if asyncio.get_running_loop() is self._own_loop:
                super().set()


def _set_events_in_their_loop() -> None:
    """Give each buffer of messages that viser makes from now on an event that its loop sets."""
    serving: Any = sys.modules.get(SERVING_MODULE)
    # A viser that serves from elsewhere is refused once it serves.
    if serving is None or serving.AsyncMessageBuffer.__module__ == __name__:
        return
    plain: Any = serving.AsyncMessageBuffer

    class Buffer(plain):
        def __init__(self, event_loop: asyncio.AbstractEventLoop, **options: Any) -> None:
            plain.__init__(self, event_loop, **options)
            self.message_event = _LoopEvent(event_loop)

    serving.AsyncMessageBuffer = Buffer


@contextlib.contextmanager
def _serving_through(guarded: Callable[[Serve], Serve] | None) -> Generator[Callable[[], bool]]:
    """Let viser alone serve through `guarded`; yield a function that returns whether it did."""
    if guarded is None:
        yield lambda: True
        return
    websockets_server: Any = websockets.asyncio.server
    plain = websockets_server.serve
    used: list[Serve] = []

    def serve(handler: Any, *args: Any, **options: Any) -> Any:
        if handler.__module__ != SERVING_MODULE:
            return plain(handler, *args, **options)
        # viser tries port after port; each time it is the same guard.
        used[:] = used or [guarded(plain)]
        return used[0](handler, *args, **options)

    with _serving_lock:
        websockets_server.serve = serve
        try:
            yield lambda: bool(used)
        finally:
            websockets_server.serve = plain


def stop_viser(server: viser.ViserServer) -> None:
    """Stop a server, without the line that its thread prints to standard output."""
    internals: Any = server
    with contextlib.redirect_stdout(io.StringIO()):
        server.stop()
        thread = getattr(internals._websock_server, "_server_thread", None)
        if thread is not None:
            thread.join(timeout=5.0)


def refuse_tunnels(server: viser.ViserServer) -> None:
    """Ignore every request for a public tunnel; viser opens one for any client that asks."""
    from viser import _messages

    internals: Any = server
    for kind in (_messages.ShareUrlRequest, _messages.ShareUrlDisconnect):
        internals._websock_server.unregister_handler(kind)


def restrict_messages(server: viser.ViserServer) -> None:
    """Ignore messages by which one browser could harm all of them.

    viser sets any property of a control, even to a number that it cannot send to any browser, and
    it stores uploads of any size.
    """
    from viser import _messages

    gui: Any = server.gui
    interface = gui._websock_interface

    def is_value(_: int, message: Any) -> bool:
        control = gui._gui_input_handle_from_uuid.get(message.uuid)
        if control is None or [*message.updates] != ["value"]:
            return False
        message.updates = {"value": _bounded(message.updates["value"], control._impl.value)}
        return True

    def is_small_file(_: int, message: Any) -> bool:
        return message.size_bytes <= LARGEST_UPLOAD

    def is_rest_of_file(client_id: int, message: Any) -> bool:
        upload = gui._current_file_upload_states.get(message.transfer_uuid)
        return (
            upload is not None
            and upload["client_id"] == client_id
            and len(message.content) <= upload["total_bytes"] - upload["transferred_bytes"]
        )

    def check(kind: type[Any], is_allowed: Callable[[int, Any], bool]) -> None:
        (handle,) = interface._incoming_handlers[kind]

        async def handle_checked(client_id: int, message: Any) -> None:
            if is_allowed(client_id, message):
                handling = handle(client_id, message)
                if handling is not None:
                    await handling

        interface.unregister_handler(kind)
        interface.register_handler(kind, handle_checked)

    check(_messages.GuiUpdateMessage, is_value)
    check(_messages.FileTransferStartUpload, is_small_file)
    check(_messages.FileTransferPart, is_rest_of_file)


def _bounded(value: Any, present: object) -> Any:
    """Return a value for a control that has another one; a number is bounded, also if it is NaN.

    Raises:
        ValueError, TypeError: it is no number where the control has one.
    """
    if isinstance(present, tuple):
        entries = cast("tuple[object, ...]", present)
        return [_bounded(each, entry) for each, entry in zip(value, entries, strict=True)]
    if isinstance(present, int | float) and not isinstance(present, bool):
        return max(-LARGEST_NUMBER, min(LARGEST_NUMBER, float(value)))
    return value


def report_uploads_to_senders(server: viser.ViserServer) -> None:
    """Report the progress of an upload only to the browser that sends it.

    viser reports it to all browsers, also later ones, which then show a file without a name.
    """
    from viser import _messages

    gui: Any = server.gui
    interface = gui._websock_interface
    queue_for_all = interface.queue_message

    def queue_message(message: Any) -> None:
        if not isinstance(message, _messages.FileTransferPartAck):
            queue_for_all(message)
            return
        upload = gui._current_file_upload_states.get(message.transfer_uuid)
        sender: Any = server.get_clients().get(upload["client_id"]) if upload else None
        if sender is not None:
            sender._websock_connection.queue_message(message)

    interface.queue_message = queue_message
