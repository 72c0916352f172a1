"""Checks of every request and every message before they reach viser.

The guard is called by websockets, which speaks the protocol, and calls viser, which serves any
client and trusts any message.
"""

from __future__ import annotations

import asyncio
import functools
import logging
import time
from collections.abc import AsyncGenerator, Awaitable, Callable
from contextlib import AbstractAsyncContextManager, asynccontextmanager, suppress
from dataclasses import replace
from http import HTTPStatus
from typing import Any

import viser
from websockets.asyncio.server import Server, ServerConnection
from websockets.frames import CloseCode
from websockets.http11 import Request, Response
from websockets.protocol import State

from explorer.app.security.access import Access, Head, Refusal
from explorer.app.security.client_messages import LARGEST_PICTURE, Controls, Inbox
from explorer.app.security.refusals import add_explanations, asked_origin, explain, refuse

# Largest number of tabs. Each is sent the whole scene, and unread messages are kept for it.
MOST_TABS = 100
# Limits of one tab's messages: a page sends 20 a second of each control that is dragged.
MESSAGES_PER_SECOND = 1000.0
MESSAGES_AT_ONCE = 200.0
# Number of waiting changes of the session beyond which no message is read.
MOST_WAITING = 200
WAIT_SECONDS = 0.02
# Number of unread messages of one client in memory; more stay in the network.
MOST_UNREAD = 4
# Turns of the event loop between accepting a connection and its handler's start.
ACCEPT_TURNS = 3

Serve = Callable[..., Any]


class Guard:
    """Checks the requests and messages to one server.

    Args:
        access: The rule for requests.
    """

    def __init__(self, access: Access) -> None:
        self._access = access
        self._controls: Controls | None = None
        self._waiting: Callable[[], int] = lambda: 0
        self._tabs: set[ServerConnection] = set()

    def let_in(self, controls: Controls, waiting: Callable[[], int]) -> None:
        """Pass messages on from now on, since the page is complete.

        Args:
            controls: The controls of the page.
            waiting: Returns the number of changes that wait for the session.
        """
        self._controls, self._waiting = controls, waiting

    def guarded(self, serve: Serve) -> Serve:
        """Return websockets' function that serves, with the checks of this guard."""

        def guarded_serve(handler: Any, *args: Any, **options: Any) -> Any:
            answer = options["process_request"]

            def process_request(connection: ServerConnection, request: Request) -> Response | None:
                return self._answer(connection, request, answer)

            async def handle(connection: ServerConnection) -> None:
                await self._handle(connection, handler)

            options |= {
                "process_request": process_request,
                "create_connection": functools.partial(_GuardedConnection, self),
                "max_size": LARGEST_PICTURE,
                "max_queue": MOST_UNREAD,
                "logger": _logger(),
            }
            return _closing(serve(handle, *args, **options))

        return guarded_serve

    async def inbox(self) -> Inbox:
        """Return a new inbox for one client's messages, once the page is complete."""
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
        origin = asked_origin(head.target)
        if origin is not None:
            # The page asks why a websocket of its origin is refused.
            judged = replace(head, target="/", origins=[origin], upgrade=True)
            return explain(self._refusal(judged, port))
        refusal = self._refusal(head, port)
        if refusal is not None:
            return refuse(refusal, as_page="text/html" in request.headers.get("Accept", ""))
        response = answer(connection, request)
        if response is not None:
            add_explanations(response)
            for name, value in self._access.headers(head, port):
                response.headers[name] = value
        return response

    def _refusal(self, head: Head, port: int) -> Refusal | None:
        refusal = self._access.judge(head, port)
        if refusal is None and head.upgrade and len(self._tabs) >= MOST_TABS:
            return Refusal(HTTPStatus.SERVICE_UNAVAILABLE, f"{MOST_TABS} tabs are open; close one.")
        return refusal

    async def _handle(
        self, connection: ServerConnection, handler: Callable[[ServerConnection], Awaitable[None]]
    ) -> None:
        if connection.subprotocol != f"viser-v{viser.__version__}":
            # viser would print the message.
            await connection.close(CloseCode.PROTOCOL_ERROR, "Version mismatch: reload the page")
            return
        # A page that was open before the explorer comes while its server is half made.
        while self._controls is None and connection.state is State.OPEN:
            await asyncio.sleep(WAIT_SECONDS)
        if self._controls is None:
            return
        self._tabs.add(connection)
        try:
            await handler(connection)
        finally:
            self._tabs.discard(connection)


@asynccontextmanager
async def _closing(serving: AbstractAsyncContextManager[Server]) -> AsyncGenerator[Server]:
    """Serve, and at the end close all connections at once.

    asyncio accepts a connection some turns before websockets knows it, and websockets closes
    those that it knows: another would stay open and silent (python/cpython issue 79033). For
    connections without a request, as browsers open them in advance, websockets waits ten seconds.
    """
    async with serving as server:
        yield server
        loop = server.get_loop()
        # The event loop of Windows has no readers.
        with suppress(NotImplementedError):
            for listening in server.sockets:
                loop.remove_reader(listening.fileno())
        for _ in range(ACCEPT_TURNS):
            await asyncio.sleep(0.0)
        for connection in list(server.handlers):
            if connection.request is None:
                connection.transport.abort()


class _GuardedConnection(ServerConnection):
    """A connection that passes on only messages that its inbox admits, at a limited rate."""

    def __init__(self, guard: Guard, *args: Any, **options: Any) -> None:
        super().__init__(*args, **options)
        self._guard = guard
        self._inbox: Inbox | None = None
        self._allowance = MESSAGES_AT_ONCE
        self._counted_at = time.monotonic()

    async def recv(self, decode: bool | None = None) -> Any:
        """Return the next message that the page may send."""
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
        earned = (now - self._counted_at) * MESSAGES_PER_SECOND
        self._allowance = min(MESSAGES_AT_ONCE, self._allowance + earned) - 1.0
        self._counted_at = now
        # The messages of a client that has gone are read without a delay.
        if self._allowance < 0.0 and self.state is State.OPEN:
            await asyncio.sleep(-self._allowance / MESSAGES_PER_SECOND)
        await self._guard.wait_for_room()


def _head(request: Request) -> Head:
    def values(name: str) -> list[str]:
        return list(request.headers.get_all(name))

    return Head(
        request.path, values("Host"), values("Origin"), values("Cookie"), bool(values("Upgrade"))
    )


def _logger() -> logging.Logger:
    logger = logging.getLogger("explorer.websockets")
    if not logger.filters:
        # Clients that do not speak HTTP are not logged.
        logger.addFilter(lambda record: record.getMessage() != "opening handshake failed")
    return logger
