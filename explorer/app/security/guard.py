"""Checks of every request before it reaches viser, which serves any client.

The guard is called by websockets, which speaks the protocol. A message that viser cannot read ends
the connection that it came by, and no other.
"""

from __future__ import annotations

import asyncio
import logging
from collections.abc import AsyncGenerator, Awaitable, Callable
from contextlib import AbstractAsyncContextManager, asynccontextmanager
from functools import partial
from typing import Any

import viser
from websockets.asyncio.server import Server, ServerConnection
from websockets.datastructures import Headers
from websockets.frames import CloseCode
from websockets.http11 import Request, Response
from websockets.protocol import State

from explorer.app.security.access import Access, Head, Refusal

# Largest size in bytes of a message, that of a picture of the scene.
LARGEST_MESSAGE = 24_000_000
WAIT_SECONDS = 0.02

Serve = Callable[..., Any]

_LOGGER = logging.getLogger("explorer.websockets")
# Clients that do not speak HTTP are not logged.
_LOGGER.addFilter(lambda record: record.getMessage() != "opening handshake failed")


class Guard:
    """Checks the requests to one server.

    Args:
        access: The rule for requests.
    """

    def __init__(self, access: Access) -> None:
        self._access = access
        self._is_complete = False

    def let_in(self) -> None:
        """Pass connections on from now on, since the page is complete."""
        self._is_complete = True

    def guarded(self, serve: Serve) -> Serve:
        """Return websockets' function that serves, with the checks of this guard."""

        def guarded_serve(handler: Any, *args: Any, **options: Any) -> Any:
            options |= {
                "process_request": partial(self._answer, options["process_request"]),
                "max_size": LARGEST_MESSAGE,
                "logger": _LOGGER,
            }
            return _closing(serve(partial(self._handle, handler), *args, **options))

        return guarded_serve

    def _answer(
        self,
        answer: Callable[[ServerConnection, Request], Response | None],
        connection: ServerConnection,
        request: Request,
    ) -> Response | None:
        port: int = connection.local_address[1]
        head = Head.of(request.path, request.headers)
        refusal = self._access.judge(head, port)
        if refusal is not None:
            return _refuse(refusal)
        response = answer(connection, request)
        if response is not None:
            for name, value in self._access.headers(head, port):
                response.headers[name] = value
        return response

    async def _handle(
        self, handler: Callable[[ServerConnection], Awaitable[None]], connection: ServerConnection
    ) -> None:
        if connection.subprotocol != f"viser-v{viser.__version__}":
            # viser would print the message.
            await connection.close(CloseCode.PROTOCOL_ERROR, "Version mismatch: reload the page")
            return
        # A page that was open before the explorer comes while its server is half made.
        while not self._is_complete and connection.state is State.OPEN:
            await asyncio.sleep(WAIT_SECONDS)
        if self._is_complete:
            await handler(connection)


@asynccontextmanager
async def _closing(serving: AbstractAsyncContextManager[Server]) -> AsyncGenerator[Server]:
    """Serve, and at the end close connections that browsers opened in advance at once.

    websockets would wait ten seconds for their requests.
    """
    async with serving as server:
        yield server
        for connection in list(server.handlers):
            if connection.request is None:
                connection.transport.abort()


def _refuse(refusal: Refusal) -> Response:
    body = f"{refusal.reason}\n".encode()
    headers = {
        "Content-Type": "text/plain; charset=utf-8",
        "Content-Length": str(len(body)),
        "X-Content-Type-Options": "nosniff",
        "Cross-Origin-Resource-Policy": "same-origin",
        "Cache-Control": "no-store",
    }
    return Response(refusal.status.value, refusal.status.phrase, Headers(headers), body)
