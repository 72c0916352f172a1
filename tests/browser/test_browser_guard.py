"""The guard at the door, tried by clients that are no page and by pages from elsewhere."""

from __future__ import annotations

import functools
import http.server
import math
import re
import socket
import socketserver
import threading
import time
from collections.abc import Callable, Generator, Iterator
from contextlib import closing, contextmanager, suppress
from http import HTTPStatus
from typing import Any
from urllib.error import HTTPError
from urllib.request import Request, urlopen

import msgspec
import numpy as np
import pytest
import viser
from client import PROTOCOL, client_of, opened, wait_for
from playwright.sync_api import Browser, expect
from websockets.exceptions import ConnectionClosed, InvalidStatus
from websockets.sync.client import ClientConnection, connect
from websockets.typing import Origin, Subprotocol

from explorer.app.browser.viser_gaps import ServerControls
from explorer.app.browser.viser_server import start_viser, stop_viser
from explorer.app.features.optimise import buttons
from explorer.app.screenshot import PATIENCE_SECONDS
from explorer.app.security import client_messages
from explorer.app.security.access import Access
from explorer.app.security.client_messages import (
    LARGEST_PICTURE,
    LARGEST_UPLOAD,
    MOST_PARTS,
    PATIENCE,
)
from explorer.app.security.guard import MOST_WAITING, Guard
from explorer.app.server import Running, start
from explorer.app.state.frame import Frame
from explorer.errors import ServerError
from explorer.mechanism.design_file import PRESETS

DESIGN = PRESETS["paper-optimal"]
TOKEN = "a-token_of-16-or-more"

# What a script in a page sees of a websocket that it opens.
CONNECT = """url => new Promise(resolve => {
    const socket = new WebSocket(url, ["PROTOCOL"]);
    socket.onopen = () => { socket.close(); resolve("open"); };
    socket.onerror = () => resolve("refused");
})"""


@pytest.fixture
def elsewhere() -> Iterator[str]:
    """A web site of its own, on another port: its address."""

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


@pytest.fixture
def locked() -> Iterator[Running]:
    """An explorer that other machines reach, with a token."""
    running = start(DESIGN, host="0.0.0.0", port=0, token=TOKEN)
    yield running
    running.stop()


def refused(url: str, **headers: str | None) -> int:
    """Return the status with which a websocket is refused."""
    with pytest.raises(InvalidStatus) as refusal:
        opened(url, **headers)
    return refusal.value.response.status_code


def page_status(url: str, **headers: str) -> int:
    """Return the status of the page for a plain request."""
    try:
        with urlopen(Request(url, headers=headers), timeout=30) as response:
            return response.status
    except HTTPError as error:
        with error:
            status, reason = error.code, error.read().decode()
    assert len(reason.splitlines()) == 1
    return status


def closed_with(connection: ClientConnection) -> int | None:
    """Read until the server closes, and return its code."""
    try:
        while True:
            connection.recv(timeout=30)
    except ConnectionClosed as closed:
        return None if closed.rcvd is None else closed.rcvd.code


def test_a_websocket_with_a_foreign_origin_or_none_is_refused(running: Running) -> None:
    near = running.url.replace("127.0.0.1", "localhost")
    for origin in (None, "null", "http://evil.example", near, "file://", "https://127.0.0.1"):
        assert refused(running.url, origin=origin) == HTTPStatus.FORBIDDEN
    with client_of(running):
        assert len(running.viser.get_clients()) == 1


def test_a_foreign_name_that_leads_here_is_refused_with_its_own_origin_too(
    running: Running,
) -> None:
    port = running.viser.get_port()
    origin = f"http://evil.example:{port}"
    assert refused(running.url, host="evil.example", origin=origin) == HTTPStatus.FORBIDDEN
    assert page_status(running.url, Host=f"evil.example:{port}") == HTTPStatus.FORBIDDEN
    assert page_status(running.url, Host=f"localhost:{port}") == HTTPStatus.OK
    opened(running.url, host="localhost", origin=f"http://localhost:{port}").close()


def test_a_page_from_elsewhere_cannot_connect_in_a_real_browser(
    browser: Browser, running: Running, elsewhere: str
) -> None:
    bare = start_viser("127.0.0.1", 0)
    try:
        page = browser.new_page()
        script = CONNECT.replace("PROTOCOL", PROTOCOL)
        own = running.url.replace("http", "ws")
        page.goto(elsewhere)
        # That it is our guard who refuses: viser alone lets anybody in.
        assert page.evaluate(script, f"ws://127.0.0.1:{bare.get_port()}") == "open"
        assert page.evaluate(script, own) == "refused"
        assert page.evaluate(script, own.replace("127.0.0.1", "localhost")) == "refused"
        page.goto(running.url)
        assert page.evaluate(script, own) == "open"
        page.close()
    finally:
        stop_viser(bare)


def test_no_link_turns_the_page_to_another_server(
    browser: Browser, running: Running, elsewhere: str
) -> None:
    other = elsewhere.replace("http", "ws")
    assert page_status(f"{running.url}/?websocket={other}") == HTTPStatus.FORBIDDEN
    assert page_status(f"{running.url}/?playbackPath={elsewhere}/x") == HTTPStatus.FORBIDDEN
    assert page_status(f"{running.url}/?darkMode") == HTTPStatus.OK
    # And should one: the browser itself lets the page connect to nobody else.
    bare = start_viser("127.0.0.1", 0)
    try:
        page = browser.new_page()
        page.goto(running.url)
        script = CONNECT.replace("PROTOCOL", PROTOCOL)
        assert page.evaluate(script, f"ws://127.0.0.1:{bare.get_port()}") == "refused"
        fetched = "url => fetch(url).then(() => 'fetched', () => 'refused')"
        assert page.evaluate(fetched, elsewhere) == "refused"
        page.close()
    finally:
        stop_viser(bare)


def test_with_a_token_nobody_gets_in_without_it(locked: Running) -> None:
    port = locked.viser.get_port()
    bare = f"http://127.0.0.1:{port}"
    assert locked.url == f"{bare}/?token={TOKEN}"
    for url in (bare, f"{bare}/?token=", f"{bare}/?token={TOKEN}x"):
        assert page_status(url) == HTTPStatus.UNAUTHORIZED
        assert refused(url) == HTTPStatus.UNAUTHORIZED
    cookie = f"explorer-token-{port}={TOKEN}"
    assert refused(bare, cookie=cookie[:-1]) == HTTPStatus.UNAUTHORIZED
    assert refused(bare, cookie=cookie, origin="http://evil.example") == HTTPStatus.FORBIDDEN
    assert refused(locked.url, origin=None) == HTTPStatus.FORBIDDEN
    assert page_status(locked.url) == HTTPStatus.OK
    opened(bare, cookie=cookie).close()
    opened(locked.url).close()


def test_with_a_token_the_page_opens_in_a_browser_and_stays_open(
    browser: Browser, locked: Running
) -> None:
    bare = locked.url.partition("?")[0]
    context = browser.new_context()
    page = context.new_page()
    stranger = browser.new_context()
    try:
        answer = page.goto(bare)
        assert answer is not None
        assert answer.status == HTTPStatus.UNAUTHORIZED
        assert "?token=" in page.inner_text("body")
        # Then with the token, and from then on without.
        for count, url in enumerate((locked.url, bare), 1):
            page.goto(url)
            wait_for(lambda count=count: max(locked.viser.get_clients(), default=-1) >= count - 1)
        assert page.evaluate("document.cookie") == ""
        other = stranger.new_page().goto(bare)
        assert other is not None
        assert other.status == HTTPStatus.UNAUTHORIZED
    finally:
        context.close()
        stranger.close()


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


def test_page_through_a_proxy_connects_once_its_name_is_allowed(browser: Browser) -> None:
    running = start(DESIGN, port=0, token=TOKEN, allow_hosts=["lab.localhost"])
    page = browser.new_page()
    try:
        with proxy_before(running, lambda head: head) as proxy:
            other = page.goto(f"http://other.localhost:{proxy.port}/?token={TOKEN}")
            assert other is not None
            assert other.status == HTTPStatus.FORBIDDEN
            assert "--allow-host other.localhost" in page.inner_text("main")
            page.goto(f"http://lab.localhost:{proxy.port}/?token={TOKEN}")
            wait_for(lambda: bool(running.viser.get_clients()))
            assert page.locator(".ex-refused").count() == 0
            page.close()
    finally:
        running.stop()


def hides_host(running: Running) -> Callable[[bytes], bytes]:
    host = f"Host: 127.0.0.1:{running.viser.get_port()}\r\n".encode()
    return lambda head: re.sub(rb"(?i)\r\nhost:[^\r]*\r\n", b"\r\n" + host, head)


def drops_upgrade(_: Running) -> Callable[[bytes], bytes]:
    def change(head: bytes) -> bytes:
        head = re.sub(rb"(?i)\r\nupgrade: [^\r]*", b"", head)
        return re.sub(rb"(?i)\r\nconnection: upgrade", b"\r\nConnection: close", head)

    return change


@pytest.mark.parametrize(
    ("hides", "words"),
    [(hides_host, "--allow-host lab.localhost"), (drops_upgrade, "Upgrade and Connection")],
    ids=["host", "websockets"],
)
def test_page_says_what_a_proxy_does_not_pass_on(
    browser: Browser, hides: Callable[[Running], Callable[[bytes], bytes]], words: str
) -> None:
    running = start(DESIGN, port=0, token=TOKEN, allow_hosts=["lab.localhost"])
    page = browser.new_page()
    try:
        with proxy_before(running, hides(running)) as proxy:
            page.goto(f"http://lab.localhost:{proxy.port}/?token={TOKEN}")
            expect(page.get_by_role("alert").filter(has_text=words)).to_be_visible()
            # The page goes on trying, and connects once it may.
            proxy.change = bytes
            wait_for(lambda: bool(running.viser.get_clients()))
            expect(page.locator(".ex-refused")).to_have_count(0)
            page.close()
    finally:
        running.stop()


def test_open_page_says_that_its_token_has_expired(browser: Browser) -> None:
    running = start(DESIGN, host="0.0.0.0", port=0, token=TOKEN)
    port = running.viser.get_port()
    page = browser.new_page()
    try:
        page.goto(running.url)
        wait_for(lambda: bool(running.viser.get_clients()))
        running.stop()
        running = start(DESIGN, host="0.0.0.0", port=port)
        expect(page.get_by_role("alert").filter(has_text="?token=")).to_be_visible()
    finally:
        page.close()
        running.stop()


NO_MESSAGES: dict[str, bytes | str] = {
    "nothing": b"",
    "text": "hello",
    "noise": bytes(range(256)),
    "no map": msgspec.msgpack.encode([1, 2, 3]),
    "no type": msgspec.msgpack.encode({"uuid": "x"}),
    "a type that is none": msgspec.msgpack.encode({"type": "Nonsense"}),
    "a type that is no word": msgspec.msgpack.encode({"type": ["GuiUpdateMessage"]}),
    "a missing field": msgspec.msgpack.encode({"type": "GuiUpdateMessage"}),
    "a field too many": msgspec.msgpack.encode(
        {"type": "CommandTriggerMessage", "uuid": "x", "more": 1}
    ),
    "deep": b"\x81\xa4type" + b"\x91" * 100_000,
    "a truncated map": msgspec.msgpack.encode({"type": "GuiUpdateMessage", "uuid": "x"})[:-2],
    "a length that lies": b"\xdf\xff\xff\xff\xff",
    "for the server's own use": msgspec.msgpack.encode(
        {"type": "RunJavascriptMessage", "source": "alert(1)"}
    ),
    "a tunnel": msgspec.msgpack.encode({"type": "ShareUrlRequest"}),
    "a form": msgspec.msgpack.encode({"type": "GuiFormDirtyMessage", "uuid": "x"}),
    "a page's reset": msgspec.msgpack.encode({"type": "ResetGuiMessage"}),
    "a new node": msgspec.msgpack.encode({"type": "RemoveSceneNodeMessage", "name": "/platform"}),
}  # fmt: skip


def test_what_is_no_message_of_the_page_changes_nothing_and_ends_the_patience(
    running: Running,
) -> None:
    before = running.page.session.state
    with client_of(running) as watching, client_of(running) as client:
        watching.read_until_quiet(0.3)
        for message in NO_MESSAGES.values():
            client.connection.send(message)
        # Still heard.
        client.update(client.find("x"), 9.0)
        wait_for(lambda: running.page.session.state.pose.position[0] == 9.0)
        for _ in range(PATIENCE - len(NO_MESSAGES)):
            client.connection.send(b"")
        assert closed_with(client.connection) == 1008
        told = {message["type"] for message in watching.read_until_quiet(0.3)}
        assert told.isdisjoint({"RunJavascriptMessage", "ResetGuiMessage", "GuiFormDirtyMessage",
                                "RemoveSceneNodeMessage"})  # fmt: skip
    assert running.page.session.state.design == before.design


def test_a_giant_message_ends_the_connection(running: Running) -> None:
    with client_of(running) as client:
        client.connection.send(b"\0" * (LARGEST_PICTURE + 1))
        assert closed_with(client.connection) == 1009
    with client_of(running):
        pass


def test_a_client_of_another_version_is_told_so(running: Running) -> None:
    address, origin = running.url.replace("http", "ws"), Origin(running.url)
    for protocols in (None, [Subprotocol("viser-v0.2.0")], [Subprotocol("chat")]):
        with (
            connect(address, origin=origin, subprotocols=protocols, proxy=None) as connection,
            pytest.raises(ConnectionClosed, match="reload the page"),
        ):
            connection.recv(timeout=30)


def test_noise_on_the_line_is_passed_over_in_silence(running: Running) -> None:
    for noise in (
        b"\x16\x03\x01\x02\x00\x01\x00",
        b"GET / HTTP/1.1\r\nHost",
        b"POST / HTTP/1.1\r\n\r\n",
        b"GET / HTTP/1.1\r\n" + b"X: y\r\n" * 500,
        b"\r\n\r\n",
        b"GET /" + b"a" * 99_999,
    ):
        with socket.create_connection(("127.0.0.1", running.viser.get_port())) as line:
            line.settimeout(5.0)
            line.sendall(noise)
            line.shutdown(socket.SHUT_WR)
            with quietly():
                while line.recv(4096):
                    pass
    assert page_status(running.url) == HTTPStatus.OK


POISON: dict[str, Any] = {
    "label": "Self-destruct", "visible": False, "disabled": True, "removed": True, "min": 5.0,
    "update_cb": [], "sync_cb": None, "uuid": "x", "props": {}, "__class__": "int", "order": -1.0,
    "hint": "<script>", "update_timestamp": 1e300,
}  # fmt: skip


def test_a_client_changes_no_property_of_a_control_but_its_value(running: Running) -> None:
    with client_of(running) as client, client_of(running) as other:
        # What the worker draws of the first frame comes late.
        assert running.page.wait_until_drawn(60.0)
        client.read_until_quiet()
        other.read_until_quiet()
        uuid = client.find("x")
        for name, value in POISON.items():
            for updates in ({name: value}, {"value": 3.0, name: value}):
                client.send({"type": "GuiUpdateMessage", "uuid": uuid, "updates": updates})
        assert [m for m in other.read_until_quiet() if m["type"].startswith("Gui")] == []
        client.update(uuid, 8.0)
        wait_for(lambda: running.page.session.state.pose.position[0] == 8.0)


ANYTHING: tuple[Any, ...] = (
    math.nan, math.inf, -math.inf, 1e308, -1e308, 1e-320, 0, -1, 2**63, -(2**63), 1e25, 0.1, True,
    False, None, "", "nan", "1e5", "x" * 50_000, "\0", "../../x", "<script>alert(1)</script>", b"1",
    [], [1.0], [math.nan] * 3, [1e308] * 3, [0.0] * 3, ["1"] * 3, [[1.0]] * 3, [0.0] * 10_000,
    {}, {"value": 1.0}, {"__class__": 1},
)  # fmt: skip


def test_whatever_a_client_gives_any_control_the_state_stays_sound(
    running: Running, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(client_messages, "PATIENCE", 10**9)
    session = running.page.session
    with client_of(running) as client:
        client.read_until_quiet(0.3)
        kinds = {props["type"] for props in client.controls.values()}
        assert {"GuiSliderMessage", "GuiNumberMessage", "GuiVector3Message", "GuiCheckboxMessage",
                "GuiDropdownMessage"} <= kinds  # fmt: skip
        # Buttons ask for files and runs, and hold no value.
        inputs = [
            uuid
            for uuid, props in client.controls.items()
            if "value" in props and not props["type"].startswith("GuiButton")
        ]
        assert len(inputs) > 50
        reader = threading.Thread(target=read_until_closed, args=(client.connection,))
        reader.start()
        for turn in range(len(ANYTHING)):
            for count, uuid in enumerate(inputs):
                client.update(uuid, ANYTHING[(turn + count) % len(ANYTHING)])
            assert session.wait_until_idle(60.0)
        client.connection.close()
        reader.join()
    assert session.wait_until_idle(60.0)
    state = session.state
    assert np.isfinite([*state.joints, *state.pose.position, *state.pose.quaternion]).all()
    assert np.isfinite(state.design.variables).all()
    # What is told to those who come later is sound too.
    with client_of(running) as late:
        late.read_until_quiet(0.3)
        numbers = [v for p in late.controls.values() if isinstance(v := p.get("value"), float)]
    assert len(numbers) > 30
    assert np.isfinite(numbers).all()


def test_a_flood_waits_in_the_network_and_not_in_memory(
    running: Running, monkeypatch: pytest.MonkeyPatch
) -> None:
    session = running.page.session
    # Slow enough that presses wait, however fast the machine is.
    draw = running.page._draw  # pyright: ignore[reportPrivateUsage]

    def draw_slowly(frame: Frame) -> None:
        time.sleep(0.005)
        draw(frame)

    monkeypatch.setattr(session, "_draw", draw_slowly)
    most = 0
    with client_of(running) as client:
        client.read_until_quiet(0.3)
        button = client.find("Home pose")
        reader = threading.Thread(target=read_until_closed, args=(client.connection,))
        reader.start()

        def flood() -> None:
            for _ in range(3000):
                client.update(button, True)

        sender = threading.Thread(target=flood)
        sender.start()
        while sender.is_alive() or session.waiting:
            most = max(most, session.waiting)
            time.sleep(0.001)
        client.connection.close()
        sender.join()
        reader.join()
    assert 0 < most <= 3 * MOST_WAITING
    assert session.wait_until_idle(60.0)


def test_uploads_are_bounded_and_those_of_others_untouched(running: Running) -> None:
    taken: list[bytes] = []
    button = running.viser.gui.add_upload_button("Try")
    button.on_upload(lambda _: taken.append(button.value.content))
    pending: dict[str, Any] = running.viser.gui._current_file_upload_states  # pyright: ignore[reportPrivateUsage]

    def beginning(transfer: str, parts: int, size: int, source: str) -> dict[str, Any]:
        return {"type": "FileTransferStartUpload", "source_component_uuid": source,
                "transfer_uuid": transfer, "filename": "../../etc/passwd", "mime_type": "x",
                "part_count": parts, "size_bytes": size}  # fmt: skip

    def part(transfer: str, index: int, content: bytes) -> dict[str, Any]:
        return {"type": "FileTransferPart", "source_component_uuid": source,
                "transfer_uuid": transfer, "part_index": index, "content": content}  # fmt: skip

    with client_of(running) as client, client_of(running) as other:
        client.read_until_quiet(0.3)
        source = client.find("Try")
        for parts, size in ((1, LARGEST_UPLOAD + 1), (MOST_PARTS + 1, 10), (2**40, 10), (-1, 10),
                            (1, -1), (0, 10), (10, 0)):  # fmt: skip
            client.send(beginning(f"bad-{parts}-{size}", parts, size, source))
        client.send(beginning("to-a-slider", 1, 3, client.find("x")))
        for index in range(5):
            client.send(beginning(f"many-{index}", 2, 6, source))
        wait_for(lambda: len(pending) == 2)
        # More than was said, twice the same, and somebody else's.
        client.send(part("many-0", 0, b"x" * 7))
        client.send(part("many-0", 0, b"abc"))
        client.send(part("many-0", 0, b"xyz"))
        other.send(part("many-0", 1, b"666"))
        client.send(part("many-0", 1, b"def"))
        wait_for(lambda: taken == [b"abcdef"])
        assert set(pending) == {"many-1"}
        client.connection.close()
        wait_for(lambda: not pending)


def test_a_file_goes_to_the_tab_that_asked_for_it_alone(running: Running) -> None:
    with client_of(running) as client, client_of(running) as other:
        client.read_until_quiet(0.3)
        other.read_until_quiet(0.3)
        press = msgspec.json.encode({"name": buttons.DESIGN, "value": "", "count": 1})
        client.update(client.find("Presses on markup"), press.decode())
        mine: list[dict[str, Any]] = []
        while not any(message["type"] == "FileTransferPart" for message in mine):
            mine += client.read()
        content = b"".join(m["content"] for m in mine if m["type"] == "FileTransferPart")
        assert b'"paper-optimal"' in content
        others = {message["type"] for message in other.read_until_quiet(1.0)}
        assert not any(kind.startswith("FileTransfer") for kind in others)


def test_an_upload_is_told_of_to_the_tab_that_sends_it_alone(running: Running) -> None:
    button = running.viser.gui.add_upload_button("Try")
    taken: list[object] = []
    button.on_upload(taken.append)
    with client_of(running) as client, client_of(running) as other:
        client.read_until_quiet(0.3)
        other.read_until_quiet(0.3)
        source = client.find("Try")
        start = {"type": "FileTransferStartUpload", "source_component_uuid": source,
                 "filename": "a.json", "mime_type": "x"}  # fmt: skip
        client.send({**start, "transfer_uuid": "empty", "part_count": 0, "size_bytes": 0})
        client.send({**start, "transfer_uuid": "one", "part_count": 1, "size_bytes": 3})
        part = {"type": "FileTransferPart", "source_component_uuid": source,
                "transfer_uuid": "one", "part_index": 0, "content": b"abc"}  # fmt: skip
        client.send(part)
        wait_for(lambda: len(taken) == 2)
        told: list[dict[str, Any]] = []
        while len(told) < 2:
            told += [m for m in client.read() if m["type"] == "FileTransferPartAck"]
        assert {each["transfer_uuid"] for each in told} == {"empty", "one"}
        others = {message["type"] for message in other.read_until_quiet(1.0)}
        assert "FileTransferPartAck" not in others
    with client_of(running) as late:
        kinds = {message["type"] for message in late.read_until_quiet(1.0)}
        assert "FileTransferPartAck" not in kinds


def test_a_viser_that_serves_in_another_way_is_not_used(monkeypatch: pytest.MonkeyPatch) -> None:
    ports: list[int] = []

    def stop(server: viser.ViserServer) -> None:
        ports.append(server.get_port())
        stop_viser(server)

    # As if viser had come to serve from elsewhere.
    monkeypatch.setattr("explorer.app.browser.viser_server.SERVING_MODULE", "viser.elsewhere")
    monkeypatch.setattr("explorer.app.browser.viser_server.stop_viser", stop)
    with pytest.raises(
        ServerError, match=r"^viser [^\n]* does not guard; [^\n]*pip install[^\n]*$"
    ):
        start(DESIGN, port=0)
    assert len(ports) == 1
    with pytest.raises(OSError, match="refused"):
        socket.create_connection(("127.0.0.1", ports[0]))


def test_nobody_is_left_waiting_by_a_server_that_stops() -> None:
    """What was taken up but not known yet when it stopped stayed open without a word."""
    for _ in range(20):
        server = start_viser("127.0.0.1", 0, Guard(Access.to("127.0.0.1", None)).guarded)
        at = ("127.0.0.1", server.get_port())
        callers = [
            threading.Thread(target=call_until_refused, args=at, daemon=True) for _ in range(4)
        ]
        for caller in callers:
            caller.start()
        stop_viser(server)
        for caller in callers:
            caller.join(PATIENCE_SECONDS)
            assert not caller.is_alive()


def call_until_refused(host: str, port: int) -> None:
    """Ask for what is not there, over and over, for as long as somebody answers."""
    while True:
        try:
            line = socket.create_connection((host, port))
        except ConnectionRefusedError:
            return
        except ConnectionResetError:
            # It stopped between taking the call up and answering it.
            continue
        with line, suppress(ConnectionError):
            line.sendall(b"GET /nothing HTTP/1.1\r\n\r\n")
            while line.recv(4096):
                pass


def test_a_server_that_stops_waits_for_nobody_who_says_nothing() -> None:
    """Browsers open lines to be ready; websockets gave each ten seconds to say something."""
    guard = Guard(Access.to("127.0.0.1", None))
    before = set(threading.enumerate())
    server = start_viser(
        "127.0.0.1", 0, lambda serve: guard.guarded(functools.partial(serve, open_timeout=None))
    )
    at = ("127.0.0.1", server.get_port())
    with socket.create_connection(at) as line:
        # Lines are taken up in turn: once this one is answered the silent one is known.
        assert page_status("http://{}:{}/".format(*at)) == HTTPStatus.OK
        stop_viser(server)
        assert set(threading.enumerate()) <= before
        with suppress(ConnectionError):
            assert not line.recv(1)


def test_client_before_the_page_is_served_once_the_page_is_there() -> None:
    guard = Guard(Access.to("127.0.0.1", None))
    server = start_viser("127.0.0.1", 0, guard.guarded)
    try:
        with closing(opened(f"http://127.0.0.1:{server.get_port()}")) as connection:
            with pytest.raises(TimeoutError):
                connection.recv(timeout=0.3)
            guard.let_in(ServerControls(server), lambda: 0)
            assert connection.recv(timeout=PATIENCE_SECONDS)
    finally:
        stop_viser(server)


def test_client_before_the_page_is_let_go_by_a_server_that_stops() -> None:
    server = start_viser("127.0.0.1", 0, Guard(Access.to("127.0.0.1", None)).guarded)
    with closing(opened(f"http://127.0.0.1:{server.get_port()}")) as connection:
        stop_viser(server)
        with pytest.raises(ConnectionClosed):
            connection.recv(timeout=PATIENCE_SECONDS)


@contextmanager
def quietly() -> Generator[None]:
    """Let a connection end as it likes."""
    with suppress(ConnectionClosed, OSError):
        yield


def read_until_closed(connection: ClientConnection) -> None:
    with quietly():
        while True:
            connection.recv()
