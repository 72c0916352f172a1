"""The guard in a real browser: pages from elsewhere, tokens and cookies, proxies before it."""

from __future__ import annotations

import http.server
import re
import socket
import socketserver
import threading
from collections.abc import Callable, Generator
from contextlib import contextmanager, suppress
from http import HTTPStatus

import pytest
from client import PROTOCOL, wait_for
from playwright.sync_api import Browser, expect

from explorer.app.browser.viser_server import start_viser, stop_viser
from explorer.app.screenshot import HOLD
from explorer.app.server import Running, start
from explorer.mechanism.design_file import PRESETS

DESIGN = PRESETS["paper-optimal"]
TOKEN = "a-token_of-16-or-more"

# What a script in a page sees of a websocket that it opens.
CONNECT = """url => new Promise(resolve => {
    const socket = new WebSocket(url, ["PROTOCOL"]);
    socket.onopen = () => { socket.close(); resolve("open"); };
    socket.onerror = () => resolve("refused");
})""".replace("PROTOCOL", PROTOCOL)
FETCH = "url => fetch(url).then(() => 'fetched', () => 'refused')"


@contextmanager
def website() -> Generator[str]:
    """Serve a web site of its own, on another port; yield its address."""

    class Site(http.server.BaseHTTPRequestHandler):
        def do_GET(self) -> None:
            self.send_response(200)
            self.send_header("Content-Type", "text/html")
            self.end_headers()
            self.wfile.write(b"<!doctype html><title>Elsewhere</title>")

        def log_message(self, format: str, *args: object) -> None:  # noqa: A002 - its name
            """Say nothing."""

    with http.server.ThreadingHTTPServer(("127.0.0.1", 0), Site) as site:
        thread = threading.Thread(target=site.serve_forever, daemon=True)
        thread.start()
        yield f"http://127.0.0.1:{site.server_address[1]}"
        site.shutdown()
        thread.join()


def test_guard_pages_from_elsewhere_cannot_connect_nor_the_own_page_elsewhere(
    browser: Browser, running: Running
) -> None:
    bare = start_viser("127.0.0.1", 0)
    page = browser.new_page()
    page.add_init_script(HOLD)
    try:
        with website() as elsewhere:
            own = running.url.replace("http", "ws")
            other = f"ws://127.0.0.1:{bare.get_port()}"
            page.goto(elsewhere)
            # That it is our guard who refuses: viser alone lets anybody in.
            assert page.evaluate(CONNECT, other) == "open"
            assert page.evaluate(CONNECT, own) == "refused"
            assert page.evaluate(CONNECT, own.replace("127.0.0.1", "localhost")) == "refused"
            # The browser lets our own page connect to its server alone.
            page.goto(f"{running.url}/?darkMode")
            assert page.evaluate(CONNECT, own) == "open"
            assert page.evaluate(CONNECT, other) == "refused"
            assert page.evaluate(FETCH, elsewhere) == "refused"
    finally:
        page.close()
        stop_viser(bare)


@pytest.mark.long
def test_guard_page_with_a_token_stays_open_until_the_token_expires(browser: Browser) -> None:
    running = start(DESIGN, host="0.0.0.0", port=0, token=TOKEN)
    port = running.viser.get_port()
    bare = running.url.partition("?")[0]
    context, stranger = browser.new_context(), browser.new_context()
    page = context.new_page()
    try:
        answer = page.goto(bare)
        assert answer is not None
        assert answer.status == HTTPStatus.UNAUTHORIZED
        assert "?token=" in page.inner_text("body")
        # Then with the token, and from then on without.
        for number, url in enumerate((running.url, bare)):
            page.goto(url)
            wait_for(lambda number=number: max(running.viser.get_clients(), default=-1) >= number)
        assert page.evaluate("document.cookie") == ""
        answer = stranger.new_page().goto(bare)
        assert answer is not None
        assert answer.status == HTTPStatus.UNAUTHORIZED
        running.stop()
        running = start(DESIGN, host="0.0.0.0", port=port)
        expect(page.get_by_role("alert").filter(has_text="?token=")).to_be_visible()
    finally:
        context.close()
        stranger.close()
        running.stop()


class Proxy(socketserver.ThreadingTCPServer):
    """A proxy before an explorer, which changes the head of each request.

    Args:
        running: The explorer.
        change: Function from the head of a request to the one that is passed on.
    """

    daemon_threads = True
    allow_reuse_address = True

    def __init__(self, running: Running, change: Callable[[bytes], bytes]) -> None:
        super().__init__(("127.0.0.1", 0), _Passing)
        self.running, self.change = running, change

    @property
    def port(self) -> int:
        return int(self.server_address[1])


class _Passing(socketserver.BaseRequestHandler):
    def handle(self) -> None:
        assert isinstance(self.server, Proxy)
        # A browser may end a line at any time.
        with suppress(OSError):
            self._pass(self.server, self.request)

    @staticmethod
    def _pass(proxy: Proxy, line: socket.socket) -> None:
        head = b""
        while b"\r\n\r\n" not in head:
            more = line.recv(4096)
            if not more:
                return
            head += more
        with socket.create_connection(("127.0.0.1", proxy.running.viser.get_port())) as onward:
            onward.sendall(proxy.change(head))
            back = threading.Thread(target=pass_on, args=(onward, line), daemon=True)
            back.start()
            pass_on(line, onward)
            back.join()


def pass_on(source: socket.socket, target: socket.socket) -> None:
    """Pass on what one side says until it ends."""
    with suppress(OSError):
        while data := source.recv(65536):
            target.sendall(data)
        target.shutdown(socket.SHUT_WR)


@contextmanager
def proxy_before(running: Running, change: Callable[[bytes], bytes]) -> Generator[Proxy]:
    with Proxy(running, change) as proxy:
        thread = threading.Thread(target=proxy.serve_forever, daemon=True)
        thread.start()
        yield proxy
        proxy.shutdown()
        thread.join()


def hide_host(running: Running) -> Callable[[bytes], bytes]:
    """Return the change of a head to one with the host of the server behind the proxy."""
    host = f"Host: 127.0.0.1:{running.viser.get_port()}\r\n".encode()
    return lambda head: re.sub(rb"(?i)\r\nhost:[^\r]*\r\n", b"\r\n" + host, head)


def drop_upgrade(head: bytes) -> bytes:
    """Return a head that asks for no websocket."""
    head = re.sub(rb"(?i)\r\nupgrade: [^\r]*", b"", head)
    return re.sub(rb"(?i)\r\nconnection: upgrade", b"\r\nConnection: close", head)


def test_guard_page_behind_a_proxy_says_what_is_missing_and_connects_once_it_is_there(
    browser: Browser,
) -> None:
    running = start(DESIGN, port=0, token=TOKEN, allow_hosts=["lab.localhost"])
    missing = (
        (hide_host(running), "--allow-host lab.localhost"),
        (drop_upgrade, "Upgrade and Connection"),
    )
    page = browser.new_page()
    page.add_init_script(HOLD)
    try:
        with proxy_before(running, lambda head: head) as proxy:
            answer = page.goto(f"http://other.localhost:{proxy.port}/?token={TOKEN}")
            assert answer is not None
            assert answer.status == HTTPStatus.FORBIDDEN
            assert "--allow-host other.localhost" in page.inner_text("main")
            for number, (change, words) in enumerate(missing):
                proxy.change = change
                page.goto(f"http://lab.localhost:{proxy.port}/?token={TOKEN}")
                expect(page.get_by_role("alert").filter(has_text=words)).to_be_visible()
                # The page goes on trying, and connects once it may.
                proxy.change = bytes
                wait_for(
                    lambda number=number: max(running.viser.get_clients(), default=-1) >= number
                )
                expect(page.locator(".ex-refused")).to_have_count(0)
        page.close()
    finally:
        running.stop()
