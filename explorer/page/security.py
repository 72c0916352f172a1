"""Who may load the page and open a websocket: checks of each request before it reaches viser.

On loopback every program of this machine may, but no web site: a page from elsewhere that
the user's browser shows has another `Origin`, and a foreign name that resolves to this machine
(DNS rebinding) is another `Host`. On any other address, and where a proxy lets others in, the
explorer requires a token: in the address of the page, then in a cookie, since the page itself
chooses the address of its websocket. A message that viser cannot read ends the connection that it
came by, and no other.
"""

from __future__ import annotations

import asyncio
import hmac
import ipaddress
import logging
import re
import secrets
import socket
from collections.abc import AsyncGenerator, Awaitable, Callable, Sequence
from contextlib import AbstractAsyncContextManager, asynccontextmanager
from functools import partial
from http import HTTPStatus
from typing import Any

from websockets.asyncio.server import Server, ServerConnection
from websockets.datastructures import Headers
from websockets.http11 import Request, Response
from websockets.protocol import State

from explorer.errors import ServerError

LOOPBACK_NAMES = ("127.0.0.1", "localhost", "[::1]")
# Addresses that stand for every address of this machine, and the loopback address among them.
EVERYWHERE = {"0.0.0.0": "127.0.0.1", "::": "::1"}  # noqa: S104 - a comparison
TOKEN_BYTES = 24
TOKEN = re.compile(r"[A-Za-z0-9_-]{16,128}")
# Plain words, since viser's page would connect to the address of another server in its query.
PLAIN_QUERY = re.compile(r"[A-Za-z0-9_.~,=&-]*")
HOST = re.compile(r"(?P<name>\[[0-9a-f:.]+\]|[a-z0-9._-]+)(:(?P<port>[0-9]{1,5}))?")
# Ports that browsers leave out, by the scheme of the address.
USUAL_PORTS = {"http": "80", "https": "443"}
# Permissions of the page: it connects to no other server than its own, and only pages of notebooks
# on this machine may frame it. Plots of studies come as text that viser's page runs.
POLICY = (
    "default-src 'self' 'unsafe-inline' 'unsafe-eval' blob: data: ws://{host} wss://{host}; "
    "frame-ancestors 'self' http://localhost:* http://127.0.0.1:* https://localhost:* "
    "https://127.0.0.1:* vscode-webview: vscode-file:"
)
# Headers of all answers.
HEADERS = {"X-Content-Type-Options": "nosniff", "Cross-Origin-Resource-Policy": "same-origin"}
# Largest size in bytes of a message, that of a picture of the scene.
LARGEST_MESSAGE = 24_000_000
WAIT_SECONDS = 0.02

Serve = Callable[..., Any]
Refusal = tuple[HTTPStatus, str]
"""The status and the reason with which a request is refused."""

_LOGGER = logging.getLogger("explorer.websockets")
# Clients that do not speak HTTP are not logged.
_LOGGER.addFilter(lambda record: record.getMessage() != "opening handshake failed")


class Access:
    """The rule of one server for who may connect.

    Args:
        host: The address that it listens on.
        token: The token that a request must have; if None a random one, but none on loopback
            without a proxy.
        names: Further hosts that requests may name, those of a proxy before the server, each with
            a port or for any port.

    Raises:
        ServerError: The token or a name cannot be used.
    """

    def __init__(self, host: str, token: str | None = None, names: Sequence[str] = ()) -> None:
        self.host = host
        self.names = tuple(name.lower() for name in names)
        for name in self.names:
            if HOST.fullmatch(name) is None:
                raise ServerError(
                    "a proxy's host is a name such as lab.example.org, or one with a port; "
                    f"got {name!r}"
                )
        if token is None and (names or not is_loopback(host)):
            token = secrets.token_urlsafe(TOKEN_BYTES)
        if token is not None and TOKEN.fullmatch(token) is None:
            raise ServerError(
                "a token has 16 to 128 letters, digits, - and _; leave it out to get a random one"
            )
        self.token = token

    def url(self, port: int, host: str | None = None) -> str:
        """Return the address with the token, for browsers here unless another host is given."""
        address = f"http://{_in_address(host or EVERYWHERE.get(self.host, self.host))}:{port}"
        return address if self.token is None else f"{address}/?token={self.token}"

    def judge(self, request: Request, port: int) -> Refusal | None:
        """Return why a request to a port of the server is refused; None if it may pass."""
        hosts, origins, cookies, upgrade = (
            request.headers.get_all(name) for name in ("Host", "Origin", "Cookie", "Upgrade")
        )
        host = hosts[0].lower() if len(hosts) == 1 else ""
        if not self._is_own_host(host, port):
            reason = f"The explorer has another address: {self.url(port).partition('/?')[0]}"
            if parts := HOST.fullmatch(host):
                allow = f"explorer --allow-host {parts['name']}"
                reason += f". If a proxy has the name {parts['name']}, allow it: {allow}"
            return HTTPStatus.FORBIDDEN, reason
        _, _, query = request.path.partition("?")
        if PLAIN_QUERY.fullmatch(query) is None:
            reason = "The explorer's page is opened with nothing but its token in the address."
            return HTTPStatus.FORBIDDEN, reason
        if upgrade and not _is_own_page(origins, host):
            reason = (
                "Only the explorer's own page may connect: the Origin must be that of this Host, "
                "which a proxy must pass on."
            )
            return HTTPStatus.FORBIDDEN, reason
        if self.token is not None and not self._has_token(query, cookies, port):
            reason = (
                "This explorer needs a token, another one after each start unless you chose it: "
                "open the whole address that it printed on start, with ?token=..."
            )
            return HTTPStatus.UNAUTHORIZED, reason
        return None

    def headers(self, request: Request, port: int) -> dict[str, str]:
        """Return the headers of the page, for a request that may pass."""
        policy = POLICY.format(host=request.headers["Host"].lower())
        headers = {**HEADERS, "Content-Security-Policy": policy, "Referrer-Policy": "no-referrer"}
        if self.token is not None:
            cookie = f"{_cookie_name(port)}={self.token}; Path=/; HttpOnly; SameSite=Strict"
            headers["Set-Cookie"] = cookie
        return headers

    def _is_own_host(self, host: str, port: int) -> bool:
        parts = HOST.fullmatch(host)
        if parts is None:
            return False
        name = parts["name"]
        ports = (parts["port"],) if parts["port"] else USUAL_PORTS.values()
        if not {name, *(f"{name}:{each}" for each in ports)}.isdisjoint(self.names):
            return True
        if self.token is None:
            return name in {*LOOPBACK_NAMES, _in_address(self.host).lower()} and port == int(
                parts["port"] or USUAL_PORTS["http"]
            )
        # Rebinding takes a name, so any address may pass; a container may map another port.
        own = socket.gethostname().lower()
        is_known = name in (self.host.lower(), "localhost", own) or name.partition(".")[0] == own
        return is_known or _address_of(name.strip("[]")) is not None

    def _has_token(self, query: str, cookies: Sequence[str], port: int) -> bool:
        pairs = [("token", pair) for pair in query.split("&")]
        pairs += [(_cookie_name(port), pair) for text in cookies for pair in text.split(";")]
        return any(
            hmac.compare_digest(
                pair.strip().encode(errors="replace"), f"{name}={self.token}".encode()
            )
            for name, pair in pairs
        )


def _is_own_page(origins: Sequence[str], host: str) -> bool:
    # A program that is no browser can send any origin, so it can send this one as well.
    if len(origins) != 1:
        return False
    scheme, _, rest = origins[0].lower().partition("://")
    if scheme not in USUAL_PORTS:
        return False
    usual = f":{USUAL_PORTS[scheme]}"
    return rest.removesuffix(usual) == host.removesuffix(usual)


def is_loopback(host: str) -> bool:
    """Whether only this machine reaches a server that listens on this host."""
    address = _address_of(host)
    return host == "localhost" or (address is not None and address.is_loopback)


def _address_of(name: str) -> ipaddress.IPv4Address | ipaddress.IPv6Address | None:
    try:
        return ipaddress.ip_address(name)
    except ValueError:
        return None


def _cookie_name(port: int) -> str:
    # Browsers keep cookies apart by host, but not by port.
    return f"explorer-token-{port}"


def _in_address(host: str) -> str:
    return f"[{host}]" if ":" in host else host


class Guard:
    """Applies a rule to the requests to one server, which websockets takes."""

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
        refusal = self._access.judge(request, port)
        if refusal is not None:
            return _refuse(*refusal)
        response = answer(connection, request)
        if response is not None:
            for name, value in self._access.headers(request, port).items():
                response.headers[name] = value
        return response

    async def _handle(
        self, handler: Callable[[ServerConnection], Awaitable[None]], connection: ServerConnection
    ) -> None:
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


def _refuse(status: HTTPStatus, reason: str) -> Response:
    body = f"{reason}\n".encode()
    headers = {
        **HEADERS,
        "Content-Type": "text/plain; charset=utf-8",
        "Content-Length": str(len(body)),
        "Cache-Control": "no-store",
    }
    return Response(status.value, status.phrase, Headers(headers), body)
