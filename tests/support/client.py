"""A bare websocket client that says what it is told to, as no page would."""

from __future__ import annotations

import itertools
import re
import socket
import threading
import time
from collections.abc import Callable, Generator
from contextlib import closing, contextmanager
from html import unescape
from http import HTTPStatus
from typing import Any, Protocol

import msgspec
import viser
import zstandard
from websockets.exceptions import InvalidStatus
from websockets.sync.client import ClientConnection, connect
from websockets.typing import Origin, Subprotocol

from explorer.app.server import Running
from explorer.page.browser.viser_gaps import element_id, mark_broadcasts, run_script_in

_COUNT = itertools.count()
PATIENCE_SECONDS = 60.0
PROTOCOL = Subprotocol(f"viser-v{viser.__version__}")
CAMERA: dict[str, Any] = {
    "type": "ViewerCameraMessage",
    "wxyz": (1.0, 0.0, 0.0, 0.0),
    "position": (0.0, -30.0, 20.0),
    "fov": 0.6,
    "near": 0.1,
    "far": 1000.0,
    "image_height": 400,
    "image_width": 640,
    "look_at": (0.0, 0.0, 0.0),
    "up_direction": (0.0, 0.0, 1.0),
}


def opened(
    url: str, *, origin: str | None = "", host: str | None = None, cookie: str | None = None
) -> ClientConnection:
    """Open a websocket as the page at the url does, or with other headers than the page's.

    Raises:
        InvalidStatus: the server refuses.
    """
    address, _, query = url.partition("/?")
    more = {} if cookie is None else {"Cookie": cookie}
    target = address.replace("http", "ws", 1) + (f"/?{query}" if query else "")
    port = address.rpartition(":")[2]
    named = target if host is None else target.replace(address[7:], f"{host}:{port}")
    # Whoever is called, it is this machine that is connected to.
    machine = "::1" if "[::1]" in address else "127.0.0.1"
    return connect(
        named,
        sock=socket.create_connection((machine, int(port))),
        origin=None if origin is None else Origin(origin or address),
        subprotocols=[PROTOCOL],
        additional_headers=more,
        compression=None,
        max_size=None,
        proxy=None,
    )


def websocket_status(url: str, **headers: str | None) -> int:
    """Return the status with which a websocket is refused; 101 if it is let in."""
    try:
        opened(url, **headers).close()
    except InvalidStatus as refusal:
        return refusal.response.status_code
    return HTTPStatus.SWITCHING_PROTOCOLS


def wait_for(condition: Callable[[], object], seconds: float = PATIENCE_SECONDS) -> None:
    """Wait until a condition holds; fail after so many seconds."""
    deadline = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < deadline, "it never came about"
        time.sleep(0.01)


def presses_in(running: Running) -> list[tuple[str, str]]:
    """Return name and value of every button in the markup that all browsers share."""
    gui: Any = running.viser.gui
    contents = [
        unescape(handle.content)
        for container in gui._container_handle_from_uuid.values()
        for handle in container._children.values()
        if isinstance(handle, viser.GuiHtmlHandle)
    ]
    return [
        (name, value)
        for content in contents
        for name, value in re.findall(r'data-press="([^"]+)"(?: data-value="([^"]*)")?', content)
    ]


def press_update(running: Running, name: str, value: str = "") -> tuple[str, str]:
    """Return the id of the control to which the page sends a press, and what it sends."""
    press = {"name": name, "value": value, "count": next(_COUNT)}
    return element_id(running.page.buttons.inbox), msgspec.json.encode(press).decode()


class Sender(Protocol):
    """A connection that gives controls their values."""

    def update(self, uuid: str, value: object) -> None:
        """Give a control a value."""
        ...


def wait_until_heard(running: Running, *senders: Sender) -> None:
    """Wait until the server has taken all that connections have sent so far, in their order."""
    for sender in senders:
        heard, name = threading.Event(), f"heard.{next(_COUNT)}"
        running.page.buttons.on(name, lambda _, __, heard=heard: heard.set())
        sender.update(*press_update(running, name))
        assert heard.wait(PATIENCE_SECONDS), "the server does not listen"


class Client:
    """A client of an explorer that counts as a tab.

    Args:
        connection: To the explorer.

    Attributes:
        client_id: Its number on the server; -1 until it counts as connected.
    """

    def __init__(self, connection: ClientConnection) -> None:
        self.connection = connection
        self.client_id = -1
        self.controls: dict[str, dict[str, Any]] = {}
        self._decompressor = zstandard.ZstdDecompressor()
        # A client counts once it has told of its camera.
        self.send(CAMERA)
        while not any(message["type"] == "ReplayDoneMessage" for message in self.read()):
            pass

    def send(self, message: dict[str, Any]) -> None:
        """Send a message, given by its fields."""
        self.connection.send(msgspec.msgpack.encode(message))

    def update(self, uuid: str, value: object) -> None:
        """Give a control a value."""
        self.send({"type": "GuiUpdateMessage", "uuid": uuid, "updates": {"value": value}})

    def find(self, label: str) -> str:
        """Return the id of the control with this label."""
        (uuid,) = (u for u, props in self.controls.items() if props.get("label") == label)
        return uuid

    def read(self, timeout: float | None = 60.0) -> list[dict[str, Any]]:
        """Return the next messages.

        Raises:
            TimeoutError: none come in time.
        """
        window = self.connection.recv(timeout=timeout)
        assert isinstance(window, bytes)
        size, compressed = (int.from_bytes(window[i : i + 8], "little") for i in (0, 8))
        packed = self._decompressor.decompress(window[16 : 16 + compressed], size)
        messages: list[dict[str, Any]] = msgspec.msgpack.decode(packed)["messages"]
        for message in messages:
            if message["type"].startswith("Gui") and "props" in message:
                self.controls[message["uuid"]] = message | message["props"]
            elif message["type"] == "GuiUpdateMessage":
                self.controls[message["uuid"]].update(message["updates"])
        return messages

    def read_all_sent(self, running: Running) -> list[dict[str, Any]]:
        """Return the messages up to the last one that was sent to this client before this call."""
        handle = running.viser.get_clients()[self.client_id]
        # What is sent to all clients and what is sent to one are kept in order apart.
        number = -1 - next(_COUNT)
        mark_broadcasts(handle, number)
        run_script_in(handle, f"ownMark = {number};")
        messages: list[dict[str, Any]] = []
        awaited = {f".mark = {number};", f"ownMark = {number};"}
        while awaited:
            messages += self.read()
            sources = [str(message.get("source")) for message in messages]
            awaited = {end for end in awaited if not any(end in s for s in sources)}
        return messages

    def flush(self) -> None:
        """Return once all that was sent has arrived; see `wait_until_heard` for more."""
        assert self.connection.ping().wait(PATIENCE_SECONDS)


@contextmanager
def client_of(running: Running) -> Generator[Client]:
    """Connect as a tab does, and wait until the explorer counts it as one."""
    known = set(running.viser.get_clients())
    with closing(opened(running.url)) as connection:
        client = Client(connection)
        wait_for(lambda: set(running.viser.get_clients()) - known)
        (client.client_id,) = set(running.viser.get_clients()) - known
        yield client
