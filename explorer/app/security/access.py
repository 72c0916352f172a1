"""The rule for who may load the page and open a websocket, from a request's head alone.

On loopback every program of this machine may, but no web site: a page from elsewhere that
the user's browser shows has another `Origin`, and a foreign name that resolves to this machine
(DNS rebinding) is another `Host`. On any other address, and where a proxy lets others in, the
explorer requires a token: in the address of the page, then in a cookie, since the page itself
chooses the address of its websocket.
"""

from __future__ import annotations

import hmac
import ipaddress
import re
import secrets
import socket
from collections.abc import Sequence
from dataclasses import dataclass
from http import HTTPStatus

from websockets.datastructures import Headers

from explorer.errors import ServerError

LOOPBACK_NAMES = ("127.0.0.1", "localhost", "[::1]")
# Addresses that stand for every address of this machine, and the loopback address among them.
EVERYWHERE = {"0.0.0.0": "127.0.0.1", "::": "::1"}  # noqa: S104 - a comparison
TOKEN_BYTES = 24
TOKEN = re.compile(r"[A-Za-z0-9_-]{16,128}")
# Plain words, since viser's page would connect to the address of another server in its query.
PLAIN_QUERY = re.compile(r"[A-Za-z0-9_.~,=&-]*")
HOST = re.compile(r"(?P<name>\[[0-9a-f:.]+\]|[a-z0-9._-]+)(:(?P<port>[0-9]{1,5}))?")
HTTP_PORT = 80
# Ports that browsers leave out, by the scheme of the address.
USUAL_PORTS = {"http": "80", "https": "443"}
# Permissions of the page: it connects to no other server than its own, and only pages of notebooks
# on this machine may frame it. Plots of studies come as text that viser's page runs.
POLICY = (
    "default-src 'self' 'unsafe-inline' 'unsafe-eval' blob: data: ws://{host} wss://{host}; "
    "frame-ancestors 'self' http://localhost:* http://127.0.0.1:* https://localhost:* "
    "https://127.0.0.1:* vscode-webview: vscode-file:"
)


@dataclass(frozen=True)
class Head:
    """The head of a request, from which access is decided.

    Attributes:
        target: Path and query, as sent.
        hosts, origins, cookies: All values of these headers.
        upgrade: Whether it requests a websocket, or anything else than a page.
    """

    target: str
    hosts: Sequence[str]
    origins: Sequence[str]
    cookies: Sequence[str]
    upgrade: bool

    @staticmethod
    def of(target: str, headers: Headers) -> Head:
        """Return the head of a request for a target with these headers."""
        hosts, origins, cookies, upgrade = (
            headers.get_all(name) for name in ("Host", "Origin", "Cookie", "Upgrade")
        )
        return Head(target, hosts, origins, cookies, bool(upgrade))


@dataclass(frozen=True)
class Refusal:
    """Why a request is not answered."""

    status: HTTPStatus
    reason: str


@dataclass(frozen=True)
class Access:
    """The rule of one server.

    Attributes:
        host: The address that it listens on.
        token: The token that a request must have; None for no token, on loopback only.
        names: Further hosts that requests may name, those of a proxy before the server; each in
            lower case, with a port or for any port.

    Raises:
        ServerError: A host beyond loopback or a proxy without a token, or an invalid token or name.
    """

    host: str
    token: str | None = None
    names: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        for name in self.names:
            if HOST.fullmatch(name) is None:
                raise ServerError(
                    "a proxy's host is a name such as lab.example.org, or one with a port; "
                    f"got {name!r}"
                )
        if self.token is None and (self.names or not is_loopback(self.host)):
            raise ServerError(f"listening on {self.host!r} needs a token; others could connect")
        if self.token is not None and TOKEN.fullmatch(self.token) is None:
            raise ServerError(
                "a token has 16 to 128 letters, digits, - and _; leave it out to get a random one"
            )

    @staticmethod
    def to(host: str, token: str | None = None, names: Sequence[str] = ()) -> Access:
        """Return the rule for a host, with a new random token where one is needed and not given.

        Raises:
            ServerError: The token or a name cannot be used.
        """
        if token is None and (names or not is_loopback(host)):
            token = secrets.token_urlsafe(TOKEN_BYTES)
        return Access(host, token, tuple(name.lower() for name in names))

    def url(self, port: int, host: str | None = None) -> str:
        """Return the address of the page, token included.

        It is for browsers on this machine unless a name of this machine for others is given.
        """
        address = f"http://{_in_address(host or EVERYWHERE.get(self.host, self.host))}:{port}"
        return address if self.token is None else f"{address}/?token={self.token}"

    def proxy_url(self, name: str) -> str:
        """Return the address of the page behind a proxy that encrypts, token included."""
        return f"https://{name}/?token={self.token}"

    def judge(self, head: Head, port: int) -> Refusal | None:
        """Return why a request to a port of the server is refused; None if it may pass."""
        host = head.hosts[0].lower() if len(head.hosts) == 1 else ""
        if not self._is_own_host(host, port):
            reason = f"The explorer has another address: {self.url(port).partition('/?')[0]}"
            if parts := HOST.fullmatch(host):
                allow = f"explorer --allow-host {parts['name']}"
                reason += f". If a proxy has the name {parts['name']}, allow it: {allow}"
            return Refusal(HTTPStatus.FORBIDDEN, reason)
        _, _, query = head.target.partition("?")
        if PLAIN_QUERY.fullmatch(query) is None:
            return Refusal(
                HTTPStatus.FORBIDDEN,
                "The explorer's page is opened with nothing but its token in the address.",
            )
        if head.upgrade and not self._is_own_page(head.origins, host):
            return Refusal(
                HTTPStatus.FORBIDDEN,
                "Only the explorer's own page may connect: the Origin must be that of this Host, "
                "which a proxy must pass on.",
            )
        if self.token is not None and not self._has_token(query, head.cookies, port):
            return Refusal(
                HTTPStatus.UNAUTHORIZED,
                "This explorer needs a token, another one after each start unless you chose it: "
                "open the whole address that it printed on start, with ?token=...",
            )
        return None

    def headers(self, head: Head, port: int) -> list[tuple[str, str]]:
        """Return the headers of the page, for a request that may pass."""
        host = head.hosts[0].lower()
        headers = [
            ("Content-Security-Policy", POLICY.format(host=host)),
            ("X-Content-Type-Options", "nosniff"),
            ("Referrer-Policy", "no-referrer"),
            ("Cross-Origin-Resource-Policy", "same-origin"),
        ]
        if self.token is not None:
            cookie = f"{_cookie_name(port)}={self.token}; Path=/; HttpOnly; SameSite=Strict"
            headers.append(("Set-Cookie", cookie))
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
                parts["port"] or HTTP_PORT
            )
        # Rebinding takes a name, so any address may pass; a container may map another port.
        own = socket.gethostname().lower()
        is_known = name in (self.host.lower(), "localhost", own) or name.partition(".")[0] == own
        return is_known or _address_of(name.strip("[]")) is not None

    def _is_own_page(self, origins: Sequence[str], host: str) -> bool:
        # A program that is no browser can send any origin, so it can send this one as well.
        if len(origins) != 1:
            return False
        scheme, _, rest = origins[0].lower().partition("://")
        if scheme not in USUAL_PORTS:
            return False
        usual = f":{USUAL_PORTS[scheme]}"
        return rest.removesuffix(usual) == host.removesuffix(usual)

    def _has_token(self, query: str, cookies: Sequence[str], port: int) -> bool:
        pairs = [("token", pair) for pair in query.split("&")]
        pairs += [(_cookie_name(port), pair) for text in cookies for pair in text.split(";")]
        return any(
            hmac.compare_digest(
                pair.strip().encode(errors="replace"), f"{name}={self.token}".encode()
            )
            for name, pair in pairs
        )


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
