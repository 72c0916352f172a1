"""viser's server: started and stopped quietly and guarded, with what upstream lacks for that."""

from __future__ import annotations

import asyncio
import contextlib
import io
import warnings
from collections.abc import AsyncGenerator, Callable, Generator, Sequence
from functools import partial
from typing import Any, ClassVar
from weakref import WeakKeyDictionary, WeakValueDictionary

import viser
import viser.infra
import websockets.asyncio.server
from viser._messages import (
    FileTransferPartAck,
    FileTransferStartUpload,
    ShareUrlDisconnect,
    ShareUrlRequest,
)
from viser.infra._async_message_buffer import AsyncMessageBuffer
from viser.infra._messages import Message

from explorer.errors import ServerError
from explorer.page.browser.client_page import ClientPage
from explorer.page.browser.sending import Sending
from explorer.page.security import Serve

# Size in bytes beyond which no upload is read; no purpose of the page needs as much.
LARGEST_UPLOAD = 32_000_000


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
        ServerError: This viser does not serve in the way that is guarded.
    """
    # A tab may close while a message is on its way to it; that needs no warning.
    warnings.filterwarnings("ignore", "Queued a .* on a closed connection")
    # Gap: viser wakes tabs that wait for messages from threads outside of their loop.
    internals: Any = viser.infra
    internals._infra.AsyncMessageBuffer = _Buffer
    page = ClientPage()
    with contextlib.redirect_stdout(io.StringIO()), _serve_through(guarded, page) as is_guarded:
        server = viser.ViserServer(host=host, port=port, verbose=False)
    if not is_guarded():
        stop_viser(server)
        raise ServerError(
            f"viser {viser.__version__} serves in a way that the explorer does not guard; "
            "install the version that it asks for: pip install --force-reinstall flagged-explorer"
        )
    server_internals: Any = server
    messages = server_internals._websock_server.get_message_buffer().message_from_id
    page.count_messages = lambda: len(Sending().backlog(tuple(messages.values())))
    return server


class _LoopEvent(asyncio.Event):
    """An event that only an event loop sets.

    viser sets the event for new messages twice: at once, in the thread that sends, and again in
    the loop. The first is not safe: a tab that begins to wait at that moment is never woken, or
    the thread fails.
    """

    def set(self) -> None:
        with contextlib.suppress(RuntimeError):
            asyncio.get_running_loop()
            super().set()


class _Buffer(AsyncMessageBuffer):
    """Messages to all browsers of a server, or to one of them."""

    # What is sent to each browser, by its number, for each server by its loop.
    _sendings: ClassVar[
        WeakKeyDictionary[asyncio.AbstractEventLoop, WeakValueDictionary[int, Sending]]
    ] = WeakKeyDictionary()

    def __init__(self, event_loop: asyncio.AbstractEventLoop, **options: Any) -> None:
        super().__init__(event_loop, message_event=_LoopEvent(), **options)

    def window_generator(
        self, client_id: int, backlog_done_message: Message | None = None
    ) -> AsyncGenerator[Sequence[Message]]:
        """Yield the messages to a browser as they become due, without those that it can wait for.

        It may begin to wait for the messages to all browsers and for those to itself in any order.
        """
        windows = super().window_generator(client_id, backlog_done_message)
        sendings = self._sendings.setdefault(self.event_loop, WeakValueDictionary())
        return sendings.setdefault(client_id, Sending()).filtered(windows, backlog_done_message)


@contextlib.contextmanager
def _serve_through(
    guarded: Callable[[Serve], Serve] | None, page: ClientPage
) -> Generator[Callable[[], bool]]:
    """Let viser serve our page, through `guarded`; yield a function that says whether it did."""
    websockets_server: Any = websockets.asyncio.server
    plain = websockets_server.serve
    chosen = plain if guarded is None else guarded(plain)
    used: list[bool] = []

    def serve(*args: Any, **options: Any) -> Any:
        used.append(True)
        options["process_request"] = page.answering(options["process_request"])
        return chosen(*args, **options)

    websockets_server.serve = serve
    try:
        yield lambda: bool(used)
    finally:
        websockets_server.serve = plain


def stop_viser(server: viser.ViserServer) -> None:
    """Stop a server, without the line that its thread prints to standard output."""
    # Gap: viser closes its loop without the connections that came while it was stopping.
    internals: Any = server
    loop = internals._websock_server._background_event_loop
    loop.close = partial(_close_with_connections, loop, loop.close)
    with contextlib.redirect_stdout(io.StringIO()):
        server.stop()


def _close_with_connections(loop: Any, close: Callable[[], None]) -> None:
    """Close a loop that has ended, and its open connections before it."""
    for transport in [*getattr(loop, "_transports", {}).values()]:
        transport.abort()
    # One round, in which the connections end.
    loop.stop()
    loop.run_forever()
    close()


def protect(server: viser.ViserServer) -> None:
    """Refuse public tunnels and giant files, and report no uploads."""
    gui: Any = server.gui
    interface = gui._websock_interface
    # Gap: viser opens a public tunnel for any client that asks.
    for kind in (ShareUrlRequest, ShareUrlDisconnect, FileTransferStartUpload):
        interface.unregister_handler(kind)
    # Gap: viser stores uploads of any size, and reports to all browsers, also later ones, that a
    # file has arrived, as a success before it is read.
    queue_for_all, start_upload = interface.queue_message, gui._handle_file_transfer_start

    def queue_message(message: Any) -> None:
        if not isinstance(message, FileTransferPartAck):
            queue_for_all(message)

    def start_small_upload(client_id: int, message: Any) -> None:
        if message.size_bytes <= LARGEST_UPLOAD:
            start_upload(client_id, message)

    interface.queue_message = queue_message
    interface.register_handler(FileTransferStartUpload, start_small_upload)
