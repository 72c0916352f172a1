"""The guard over the wire: what clients that are no page may do to a server, and what not."""

from __future__ import annotations

import functools
import logging
import math
import re
import socket
import threading
from collections.abc import Generator
from contextlib import closing, contextmanager, suppress
from http import HTTPStatus
from types import SimpleNamespace
from typing import Any
from urllib.error import HTTPError
from urllib.request import Request, urlopen

import msgspec
import numpy as np
import pytest
import viser
import websockets.asyncio.server
from client import client_of, opened, press_update, wait_for, wait_until_heard, websocket_status
from websockets.exceptions import ConnectionClosed
from websockets.frames import CloseCode
from websockets.sync.client import ClientConnection

from explorer.app.server import Running, start
from explorer.app.storage.session_file import encode_session
from explorer.errors import ServerError
from explorer.mechanism.design_file import PRESETS
from explorer.page.browser.viser_server import LARGEST_UPLOAD, start_viser, stop_viser
from explorer.page.security import LARGEST_MESSAGE, Access, Guard

DESIGN = PRESETS["paper-optimal"]
PATIENCE_SECONDS = 60.0


def page_status(url: str, **headers: str) -> int:
    """Return the status of the page for a plain request."""
    try:
        with urlopen(Request(url, headers=headers), timeout=PATIENCE_SECONDS) as response:
            return response.status
    except HTTPError as error:
        with error:
            status, reason = error.code, error.read().decode()
    assert len(reason.splitlines()) == 1
    return status


def close_code(connection: ClientConnection) -> int | None:
    """Read until the server closes, and return its code."""
    try:
        while True:
            connection.recv(timeout=PATIENCE_SECONDS)
    except ConnectionClosed as closed:
        return None if closed.rcvd is None else closed.rcvd.code


@contextmanager
def drained(connection: ClientConnection) -> Generator[None]:
    """Read what comes on a thread; in the end close the connection."""

    def read() -> None:
        with suppress(ConnectionClosed, OSError):
            while True:
                connection.recv()

    reader = threading.Thread(target=read)
    reader.start()
    yield
    connection.close()
    reader.join()


def test_guard_request_from_elsewhere_is_refused(running: Running) -> None:
    url, port = running.url, running.viser.get_port()
    near, evil = url.replace("127.0.0.1", "localhost"), f"http://evil.example:{port}"
    for origin in (None, "null", "http://evil.example", near, "file://", "https://127.0.0.1"):
        assert websocket_status(url, origin=origin) == HTTPStatus.FORBIDDEN, origin
    # A foreign name that leads here, with its own origin too, and links that lead elsewhere.
    assert websocket_status(url, host="evil.example", origin=evil) == HTTPStatus.FORBIDDEN
    assert page_status(url, Host=f"evil.example:{port}") == HTTPStatus.FORBIDDEN
    assert page_status(f"{url}/?websocket=ws://127.0.0.1:{port + 1}") == HTTPStatus.FORBIDDEN
    assert page_status(f"{url}/?playbackPath={evil}/x") == HTTPStatus.FORBIDDEN
    assert page_status(f"{url}/?darkMode") == HTTPStatus.OK
    assert page_status(url, Host=f"localhost:{port}") == HTTPStatus.OK
    assert websocket_status(url, host="localhost", origin=near) == HTTPStatus.SWITCHING_PROTOCOLS


NO_MESSAGES: dict[str, bytes | str] = {
    "nothing": b"",
    "text": "hello",
    "noise": bytes(range(256)),
    "no map": msgspec.msgpack.encode([1, 2, 3]),
    "a type that is none": msgspec.msgpack.encode({"type": "Nonsense"}),
    "a missing field": msgspec.msgpack.encode({"type": "GuiUpdateMessage"}),
    "deep": b"\x81\xa4type" + b"\x91" * 100_000,
    "a length that lies": b"\xdf\xff\xff\xff\xff",
    "a list that lies": b"\x82\xa4type\xb0GuiUpdateMessage\xa4uuid\xdd\xff\xff\xff\xff",
}
# For the server's own use.
ORDERS: tuple[dict[str, Any], ...] = (
    {"type": "RunJavascriptMessage", "source": "alert(1)"},
    {"type": "ResetGuiMessage"},
    {"type": "RemoveSceneNodeMessage", "name": "/platform"},
    {"type": "ShareUrlDisconnect"},
)


@pytest.mark.parametrize("message", NO_MESSAGES.values(), ids=NO_MESSAGES)
def test_guard_message_that_cannot_be_read_ends_its_own_connection_alone(
    running: Running, message: bytes | str
) -> None:
    session = running.page.session
    with client_of(running) as other, client_of(running) as client:
        client.connection.send(message)
        assert close_code(client.connection) == CloseCode.INTERNAL_ERROR
        before = session.state.pose.position[0]
        other.update(other.find("x"), 10.0 * (before + 0.25))
        wait_for(lambda: session.state.pose.position[0] == before + 0.25)


def test_guard_orders_of_a_client_reach_no_other_client(running: Running) -> None:
    with client_of(running) as watching, client_of(running) as client:
        watching.read_all_sent(running)
        for order in ORDERS:
            client.send(order)
        wait_until_heard(running, client)
        messages = watching.read_all_sent(running)
    assert not any(each.get("source") == "alert(1)" for each in messages)
    kinds = {message["type"] for message in messages}
    assert kinds.isdisjoint({"ResetGuiMessage", "RemoveSceneNodeMessage"})


def test_guard_giant_message_ends_the_connection(running: Running) -> None:
    with client_of(running) as client:
        client.connection.send(b"\0" * (LARGEST_MESSAGE + 1))
        assert close_code(client.connection) == 1009
    with client_of(running):
        pass


def test_guard_noise_on_the_line_is_passed_over(
    running: Running, capfd: pytest.CaptureFixture[str]
) -> None:
    for noise in (
        b"\x16\x03\x01\x02\x00\x01\x00",
        b"GET / HTTP/1.1\r\nHost",
        b"POST / HTTP/1.1\r\n\r\n",
        b"GET / HTTP/1.1\r\n" + b"X: y\r\n" * 500,
        b"\r\n\r\n",
        b"GET /" + b"a" * 99_999,
    ):
        with socket.create_connection(("127.0.0.1", running.viser.get_port())) as line:
            line.settimeout(PATIENCE_SECONDS)
            with suppress(OSError):
                line.sendall(noise)
                line.shutdown(socket.SHUT_WR)
                while line.recv(4096):
                    pass
    assert page_status(running.url) == HTTPStatus.OK
    assert capfd.readouterr().err == ""


ANYTHING: tuple[Any, ...] = (
    math.nan, math.inf, -math.inf, 1e308, -1e308, 1e-320, 0, -1, 2**63, -(2**63), 1e25, 0.1, True,
    False, None, "", "nan", "1e5", "x" * 50_000, "\0", "../../x", "<script>alert(1)</script>", b"1",
    [], [1.0], [math.nan] * 3, [1e308] * 3, [0.0] * 3, ["1"] * 3, [[1.0]] * 3, [0.0] * 10_000,
    {}, {"value": 1.0}, {"__class__": 1},
)  # fmt: skip
# Each control gets so many of them, each value goes to some controls of each kind.
TURNS = 6


def test_guard_state_stays_sound_whatever_its_controls_are_given(
    caplog: pytest.LogCaptureFixture,
) -> None:
    # viser logs what it cannot set.
    caplog.set_level(logging.CRITICAL)
    running = start(DESIGN, port=0)
    session = running.page.session
    try:
        with client_of(running) as client:
            client.read_all_sent(running)
            # Buttons ask for files and runs, and hold no value.
            inputs = {
                uuid: props
                for uuid, props in client.controls.items()
                if "value" in props and not props["type"].startswith("GuiButton")
            }
            kinds = {props["type"] for props in inputs.values()}
            assert {"GuiSliderMessage", "GuiNumberMessage", "GuiVector3Message",
                    "GuiCheckboxMessage", "GuiDropdownMessage"} <= kinds  # fmt: skip
            numbers: dict[str, Any] = {
                uuid: props["value"]
                for uuid, props in inputs.items()
                if re.search("Slider|Number|Vector", props["type"])
            }
            assert len(inputs) > len(numbers) > 50

            def settle() -> None:
                wait_until_heard(running, client)
                assert session.wait_until_idle(PATIENCE_SECONDS)

            before = encode_session(session.history)
            with drained(client.connection):
                # A number that is not finite is refused by every control.
                for wrong in (math.nan, math.inf, -math.inf):
                    for uuid, value in numbers.items():
                        is_row = hasattr(value, "__len__")
                        client.update(uuid, [wrong] * len(value) if is_row else wrong)
                    settle()
                assert encode_session(session.history) == before
                for turn in range(TURNS):
                    for count, uuid in enumerate(inputs):
                        client.update(uuid, ANYTHING[(7 * turn + count) % len(ANYTHING)])
                    settle()
        state = session.state
        assert np.isfinite([*state.joints, *state.pose.position, *state.pose.quaternion]).all()
        assert np.isfinite(state.design.variables).all()
    finally:
        running.stop()


def test_guard_files_go_to_the_tab_that_asks_alone(running: Running) -> None:
    with client_of(running) as client, client_of(running) as other:
        client.read_all_sent(running)
        client.update(*press_update(running, "export", "Moving page as HTML"))
        mine: list[dict[str, Any]] = []
        while not any(message["type"] == "FileTransferPart" for message in mine):
            mine += client.read()
        content = b"".join(m["content"] for m in mine if m["type"] == "FileTransferPart")
        assert b"paper-optimal" in content
        kinds = {message["type"] for message in other.read_all_sent(running)}
        assert not any(kind.startswith("FileTransfer") for kind in kinds)


def test_guard_upload_is_taken_whole_unless_it_is_too_large_and_acknowledged_to_nobody(
    running: Running,
) -> None:
    button = running.viser.gui.add_upload_button("Try")
    taken: list[bytes] = []
    button.on_upload(lambda _: taken.append(button.value.content))
    begin = {"type": "FileTransferStartUpload", "filename": "../../etc/passwd", "mime_type": "x"}
    try:
        with client_of(running) as client, client_of(running) as other:
            client.read_all_sent(running)
            source = client.find("Try")

            def part(transfer: str, index: int, content: bytes) -> dict[str, Any]:
                return {"type": "FileTransferPart", "source_component_uuid": source,
                        "transfer_uuid": transfer, "part_index": index,
                        "content": content}  # fmt: skip

            begin["source_component_uuid"] = source
            # What is too large to be read is ignored.
            large = {"part_count": 1, "size_bytes": LARGEST_UPLOAD + 1}
            client.send({**begin, "transfer_uuid": "large", **large})
            client.send(part("large", 0, b"large"))
            client.send({**begin, "transfer_uuid": "empty", "part_count": 0, "size_bytes": 0})
            # The button has one value, so the next upload would replace it before it is read.
            wait_for(lambda: taken == [b""])
            client.send({**begin, "transfer_uuid": "two", "part_count": 2, "size_bytes": 6})
            client.send(part("two", 0, b"abc"))
            client.send(part("two", 1, b"def"))
            wait_for(lambda: taken == [b"", b"abcdef"])
            # It is told as a success before the file is read.
            for each in (client, other):
                kinds = {message["type"] for message in each.read_all_sent(running)}
                assert "FileTransferPartAck" not in kinds
    finally:
        button.remove()


def test_viser_that_serves_in_another_way_is_not_used(monkeypatch: pytest.MonkeyPatch) -> None:
    ports: list[int] = []

    def stop(server: viser.ViserServer) -> None:
        ports.append(server.get_port())
        stop_viser(server)

    # As if viser had come to serve by another function.
    asyncio_server = SimpleNamespace(serve=websockets.asyncio.server.serve)
    elsewhere = SimpleNamespace(asyncio=SimpleNamespace(server=asyncio_server))
    monkeypatch.setattr("viser.infra._infra.websockets", elsewhere)
    monkeypatch.setattr("explorer.page.browser.viser_server.stop_viser", stop)
    with pytest.raises(
        ServerError, match=r"^viser [^\n]* does not guard; [^\n]*pip install[^\n]*$"
    ):
        start(DESIGN, port=0)
    assert len(ports) == 1
    with pytest.raises(OSError, match="refused"):
        socket.create_connection(("127.0.0.1", ports[0]))


def test_server_that_stops_does_not_wait_for_a_silent_connection() -> None:
    """Browsers open connections in advance, for which websockets waits ten seconds."""
    guard = Guard(Access("127.0.0.1", None))
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


@pytest.mark.parametrize("stops", [False, True])
def test_client_before_the_page_is_served_with_the_page_or_let_go(*, stops: bool) -> None:
    guard = Guard(Access("127.0.0.1", None))
    server = start_viser("127.0.0.1", 0, guard.guarded)
    try:
        with closing(opened(f"http://127.0.0.1:{server.get_port()}")) as connection:
            assert connection.ping().wait(PATIENCE_SECONDS)
            if stops:
                stop_viser(server)
                with pytest.raises(ConnectionClosed):
                    connection.recv(timeout=PATIENCE_SECONDS)
            else:
                with pytest.raises(TimeoutError):
                    connection.recv(timeout=0.0)
                guard.let_in()
                assert connection.recv(timeout=PATIENCE_SECONDS)
    finally:
        if not stops:
            stop_viser(server)
