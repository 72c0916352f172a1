"""The guard at the server's door: every request is judged, every message is read strictly.

It stands between websockets, which speaks the protocol, and viser, which serves whoever
comes and believes whatever it is told.
"""

from __future__ import annotations

import asyncio
import functools
import logging
import time
from collections.abc import AsyncGenerator, Awaitable, Callable
from contextlib import AbstractAsyncContextManager, asynccontextmanager, suppress
from http import HTTPStatus
from typing import Any

import viser
from websockets.asyncio.server import Server, ServerConnection
from websockets.datastructures import Headers
from websockets.frames import CloseCode
from websockets.http11 import Request, Response
from websockets.protocol import State

from explorer.app.security.access import Access, Head, Refusal
from explorer.app.security.client_messages import LARGEST_PICTURE, Controls, Inbox

# Tabs at once. Each is sent the whole scene and keeps its messages until it has read them.
MOST_TABS = 100
# What one tab may send: a page sends 20 a second of each control that a hand is on.
MESSAGES_PER_SECOND = 1000.0
MESSAGES_AT_ONCE = 200.0
# While so many changes wait for the session, nobody is listened to.
MOST_WAITING = 200
WAIT_SECONDS = 0.02
# Messages of one client that lie unread in memory; more stay in its network.
MOST_UNREAD = 4
# Turns of the event loop from taking up a connection to its being known to websockets.
TAKE_UP_TURNS = 3

Serve = Callable[..., Any]


class Guard:
    """Stands at the door of one server.

    Args:
        access: Who may come in.
    """

    def __init__(self, access: Access) -> None:
        self._access = access
        self._controls: Controls | None = None
        self._waiting: Callable[[], int] = lambda: 0
        self._tabs: set[ServerConnection] = set()

    def let_in(self, controls: Controls, waiting: Callable[[], int]) -> None:
        """Open the door, once the page is there.

        Args:
            controls: Of the page.
            waiting: Tells how many changes wait for the session.
        """
        self._controls, self._waiting = controls, waiting

    def guarded(self, serve: Serve) -> Serve:
        """Return the function of websockets that serves, with this guard in front."""

        def guarded_serve(handler: Any, *args: Any, **options: Any) -> Any:
            answer = options["process_request"]

            def process_request(connection: ServerConnection, request: Request) -> Response | None:
                return self._answer(connection, request, answer)

            async def handle(connection: ServerConnection) -> None:
                await self._handle(connection, handler)

            options |= {
                "process_request": process_request,
                "create_connection": functools.partial(_Guarded, self),
                "max_size": LARGEST_PICTURE,
                "max_queue": MOST_UNREAD,
                "logger": _logger(),
            }
            return _hung_up(serve(handle, *args, **options))

        return guarded_serve

    async def inbox(self) -> Inbox:
        """Return a new judge of one client's messages, once the page is there."""
        while self._controls is None:
            await asyncio.sleep(WAIT_SECONDS)
        return Inbox(self._controls)

    async def wait_for_room(self) -> None:
        """Wait while too many changes wait for the session."""
        while self._waiting() > MOST_WAITING:
            await asyncio.sleep(WAIT_SECONDS)

    def _answer(
        self,
        connection: ServerConnection,
        request: Request,
        answer: Callable[[ServerConnection, Request], Response | None],
    ) -> Response | None:
        port: int = connection.local_address[1]
        head = _head(request)
        refusal = self._access.judge(head, port)
        if refusal is None and head.upgrade and len(self._tabs) >= MOST_TABS:
            refusal = Refusal(
                HTTPStatus.SERVICE_UNAVAILABLE, f"{MOST_TABS} tabs are open; close one."
            )
        if refusal is not None:
            return _refusing(refusal)
        response = answer(connection, request)
        if response is not None:
            for name, value in self._access.headers(head, port):
                response.headers[name] = value
        return response

    async def _handle(
        self, connection: ServerConnection, handler: Callable[[ServerConnection], Awaitable[None]]
    ) -> None:
        if connection.subprotocol != f"viser-v{viser.__version__}":
            # viser would print what it was told.
            await connection.close(CloseCode.PROTOCOL_ERROR, "Version mismatch: reload the page")
            return
        self._tabs.add(connection)
        try:
            await handler(connection)
        finally:
            self._tabs.discard(connection)


@asynccontextmanager
async def _hung_up(serving: AbstractAsyncContextManager[Server]) -> AsyncGenerator[Server]:
    """Serve, and at the end leave no caller waiting and wait for none.

    asyncio takes up a connection some turns before websockets knows it, and websockets closes
    those that it knows: another would stay open and silent (python/cpython issue 79033). For
    who calls and says nothing, as browsers do to be ready, websockets waits ten seconds.
    """
    async with serving as server:
        yield server
        loop = server.get_loop()
        # Windows' own loop has no such way.
        with suppress(NotImplementedError):
            for listening in server.sockets:
                loop.remove_reader(listening.fileno())
        for _ in range(TAKE_UP_TURNS):
            await asyncio.sleep(0.0)
        for connection in list(server.handlers):
            if connection.request is None:
                connection.transport.abort()


class _Guarded(ServerConnection):
    """A connection that hands on only what its inbox admits, and not faster than it may."""

    def __init__(self, guard: Guard, *args: Any, **options: Any) -> None:
        super().__init__(*args, **options)
        self._guard = guard
        self._inbox: Inbox | None = None
        self._allowance = MESSAGES_AT_ONCE
        self._counted = time.monotonic()

    async def recv(self, decode: bool | None = None) -> Any:
        """Return the next message that is one of the page."""
        while True:
            data = await super().recv(decode)
            await self._pace()
            self._inbox = self._inbox or await self._guard.inbox()
            if self._inbox.admits(data):
                return data
            if self._inbox.is_out_of_patience:
                await self.close(CloseCode.POLICY_VIOLATION, "These are no messages of the page")

    async def _pace(self) -> None:
        now = time.monotonic()
        earned = (now - self._counted) * MESSAGES_PER_SECOND
        self._allowance = min(MESSAGES_AT_ONCE, self._allowance + earned) - 1.0
        self._counted = now
        # What is left of a client that has gone is done with at once.
        if self._allowance < 0.0 and self.state is State.OPEN:
            await asyncio.sleep(-self._allowance / MESSAGES_PER_SECOND)
        await self._guard.wait_for_room()


def _head(request: Request) -> Head:
    def values(name: str) -> list[str]:
        return list(request.headers.get_all(name))

    return Head(
        request.path, values("Host"), values("Origin"), values("Cookie"), bool(values("Upgrade"))
    )


def _refusing(refusal: Refusal) -> Response:
    body = f"{refusal.reason}\n".encode()
    headers = Headers(
        {
            "Content-Type": "text/plain; charset=utf-8",
            "Content-Length": str(len(body)),
            "X-Content-Type-Options": "nosniff",
            "Cache-Control": "no-store",
        }
    )
    return Response(refusal.status.value, refusal.status.phrase, headers, body)


def _logger() -> logging.Logger:
    logger = logging.getLogger("explorer.websockets")
    if not logger.filters:
        # Whoever does not speak HTTP is turned away without a word.
        logger.addFilter(lambda record: record.getMessage() != "opening handshake failed")
    return logger
