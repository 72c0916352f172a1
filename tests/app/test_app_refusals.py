"""Refusals over a real socket: a proxy's host is let in, and whoever may not connect learns why."""

from __future__ import annotations

import socket
import zlib
from collections.abc import Iterator
from contextlib import closing
from http.client import HTTPConnection, HTTPResponse
from urllib.parse import quote

import pytest
from client import PROTOCOL, Client, opened
from websockets.exceptions import InvalidStatus
from websockets.sync.client import ClientConnection, connect
from websockets.typing import Origin

from explorer.app.security import guard
from explorer.app.server import Running, start
from explorer.mechanism.design_file import PRESETS

PROXY = "lab.example.org"
TOKEN = "a-token_of-16-or-more"
BROWSER = {"Accept": "text/html,application/xhtml+xml", "Accept-Encoding": "gzip"}


@pytest.fixture(scope="module")
def behind() -> Iterator[Running]:
    """An explorer behind a proxy."""
    running = start(PRESETS["paper-optimal"], port=0, token=TOKEN, allow_hosts=[PROXY])
    yield running
    running.stop()


def get(running: Running, target: str, **headers: str) -> tuple[HTTPResponse, str]:
    """Return the response to a request and its body, unpacked."""
    connection = HTTPConnection("127.0.0.1", running.viser.get_port(), timeout=60)
    connection.request("GET", target, headers=headers)
    response = connection.getresponse()
    body = response.read()
    connection.close()
    assert int(response.headers["Content-Length"]) == len(body)
    if response.headers.get("Content-Encoding") == "gzip":
        body = zlib.decompress(body, 16 + zlib.MAX_WBITS)
    return response, body.decode()


def ask_reason(running: Running, origin: str, **headers: str) -> tuple[int, str]:
    """Return status and reason that a page of an origin gets when it asks why."""
    response, reason = get(running, f"/connection?origin={quote(origin, safe='')}", **headers)
    assert response.headers["Content-Type"].startswith("text/plain")
    assert len(reason.splitlines()) == 1
    assert TOKEN not in reason
    return response.status, reason


def through_proxy(running: Running, origin: str, token: str = TOKEN) -> ClientConnection:
    """Open a websocket as a proxy passes it on."""
    return connect(
        f"ws://{PROXY}/?token={token}",
        sock=socket.create_connection(("127.0.0.1", running.viser.get_port())),
        origin=Origin(origin),
        subprotocols=[PROTOCOL],
        compression=None,
        max_size=None,
        proxy=None,
    )


def test_websocket_through_a_proxy_needs_its_origin_and_the_token(behind: Running) -> None:
    for scheme in ("http", "https"):
        with closing(through_proxy(behind, f"{scheme}://{PROXY}")) as connection:
            assert Client(connection).find("x")
    for origin, token, status in (
        (f"https://evil.{PROXY}", TOKEN, 403),
        (f"https://{PROXY}:444", TOKEN, 403),
        ("https://evil.example", TOKEN, 403),
        (f"https://{PROXY}", TOKEN[:-1], 401),
    ):
        with pytest.raises(InvalidStatus) as refusal:
            through_proxy(behind, origin, token)
        assert refusal.value.response.status_code == status


def test_page_through_a_proxy_lets_itself_connect_there(behind: Running) -> None:
    response, page = get(behind, f"/?token={TOKEN}", Host=PROXY, **BROWSER)
    assert response.status == 200
    assert f"wss://{PROXY}" in response.headers["Content-Security-Policy"]
    assert "connection?origin=" in page
    # The same with and without packing, but for the added part as viser serves it.
    assert get(behind, f"/?token={TOKEN}", Host=PROXY)[1] == page
    response, page = get(behind, "/", **BROWSER)
    assert response.status == 401
    assert "?token=" in page
    assert "<script" not in get(behind, "/", Host="<script>alert(1)</script>", **BROWSER)[1]


@pytest.mark.parametrize("host", ["evil.example:9", f"{PROXY}.evil.example"])
def test_wrong_host_is_answered_with_a_page_that_names_it_and_the_option(
    behind: Running, running: Running, host: str
) -> None:
    for each in (behind, running):
        response, page = get(each, "/", Host=host, **BROWSER)
        assert response.status == 403
        assert response.headers["Content-Type"].startswith("text/html")
        assert "script" not in page
        assert f"--allow-host {host.partition(':')[0]}" in page
        assert TOKEN not in page
        # A program gets one line.
        response, line = get(each, "/", Host=host)
        assert response.status == 403
        assert line.count("\n") == 1
        assert f"--allow-host {host.partition(':')[0]}" in line


def test_page_is_given_the_reason_why_its_websocket_is_refused(
    behind: Running, running: Running, monkeypatch: pytest.MonkeyPatch
) -> None:
    port = running.viser.get_port()
    own = f"http://127.0.0.1:{port}"
    # A proxy that does not pass on the host: the page loads, its websocket is refused.
    assert get(running, "/", **BROWSER)[0].status == 200
    with pytest.raises(InvalidStatus):
        opened(own, origin=f"https://{PROXY}")
    status, reason = ask_reason(running, f"https://{PROXY}")
    assert status == 403
    assert f"--allow-host {PROXY}" in reason
    # A token that is missing, or of the explorer before.
    name = f"explorer-token-{behind.viser.get_port()}"
    for cookie in ("", f"{name}={TOKEN[:-1]}"):
        status, reason = ask_reason(behind, f"https://{PROXY}", Host=PROXY, Cookie=cookie)
        assert status == 401
        assert "?token=" in reason
    # Where nothing is refused, it is the proxy that passes on no websocket.
    status, reason = ask_reason(behind, f"https://{PROXY}", Host=PROXY, Cookie=f"{name}={TOKEN}")
    assert status == 200
    assert "Upgrade" in reason
    assert ask_reason(running, own)[0] == 200
    monkeypatch.setattr(guard, "MOST_TABS", 0)
    status, reason = ask_reason(running, own)
    assert status == 503
    assert "close one" in reason
