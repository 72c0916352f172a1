"""The guard in a real browser: pages from elsewhere, tokens and cookies."""

from __future__ import annotations

import http.server
import threading
from collections.abc import Generator
from contextlib import contextmanager
from http import HTTPStatus

import pytest
from client import PROTOCOL, wait_for
from playwright.sync_api import Browser

from explorer.app.screenshot import HOLD
from explorer.app.server import Running, start
from explorer.mechanism.design_file import PRESETS
from explorer.page.browser.viser_server import start_viser, stop_viser

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
    finally:
        context.close()
        stranger.close()
        running.stop()
