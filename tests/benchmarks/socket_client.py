"""Bare websocket clients of the page, in a process of their own, that drag and listen.

They speak viser's protocol: messages to the server are MessagePack maps, those from it are
windows of such maps, compressed, with arrays behind them. Sliders are known by their
labels, as in a browser.
"""

from __future__ import annotations

import asyncio
import math
import multiprocessing
import time
from collections.abc import Callable, Generator, Sequence
from concurrent.futures import ProcessPoolExecutor
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

import msgspec
import zstandard
from client import CAMERA, PROTOCOL
from websockets.asyncio.client import ClientConnection, connect
from websockets.typing import Origin

from explorer.mechanism.pose import Pose

EVENTS_PER_SECOND = 30.0
# So long nothing must come before all is known to have come.
QUIET_SECONDS = 1.0
PATIENCE_SECONDS = 120.0


@dataclass(frozen=True)
class SliderDrag:
    """A slider, by its label, and the values that it is dragged to."""

    label: str
    values: Sequence[float]


@dataclass(frozen=True)
class HandleDrag:
    """Transform controls, by their name, and the poses that they are dragged to."""

    name: str
    poses: Sequence[Pose]


Drag = SliderDrag | HandleDrag


def sweep(middle: float, reach: float, count: int) -> list[float]:
    """Return values that swing about the middle, as far as the reach, in periods of two seconds."""
    return [middle + reach * math.sin(k / 10.0) for k in range(1, count + 1)]


@dataclass
class Seen:
    """What one client did and saw; times are those of `time.monotonic`.

    Attributes:
        sent: When its last event was sent.
        drawn: When the last message about the scene came.
    """

    sent: float = 0.0
    drawn: float = 0.0


@contextmanager
def dragging_process() -> Generator[Callable[[str, Sequence[Drag]], list[Seen]]]:
    """Start a process; what is yielded makes it drag as `drag_at_once` and waits for it."""
    context = multiprocessing.get_context("spawn")
    with ProcessPoolExecutor(1, mp_context=context) as pool:
        yield lambda url, drags: pool.submit(drag_at_once, url, drags).result()


def drag_at_once(url: str, drags: Sequence[Drag]) -> list[Seen]:
    """Connect a client for each drag, drag in all of them at once, and wait for quiet."""
    return asyncio.run(_drag_at_once(url, drags))


async def _drag_at_once(url: str, drags: Sequence[Drag]) -> list[Seen]:
    clients = [await _Client.connected(url) for _ in drags]
    readers = [asyncio.create_task(client.read()) for client in clients]
    # Users do not move in step.
    step = 1.0 / (EVENTS_PER_SECOND * len(drags))
    starts = [time.monotonic() + 0.1 + k * step for k in range(len(drags))]
    await asyncio.gather(*(c.drag(d, s) for c, d, s in zip(clients, drags, starts, strict=True)))
    deadline = time.monotonic() + PATIENCE_SECONDS
    while time.monotonic() < deadline:
        latest = max(max(client.seen.drawn, client.seen.sent) for client in clients)
        if time.monotonic() - latest > QUIET_SECONDS:
            break
        await asyncio.sleep(0.05)
    for reader, client in zip(readers, clients, strict=True):
        reader.cancel()
        await client.close()
    return [client.seen for client in clients]


class _Client:
    def __init__(self, connection: ClientConnection) -> None:
        self._connection = connection
        self._decompressor = zstandard.ZstdDecompressor()
        self._uuids: dict[str, str] = {}
        self.seen = Seen()

    @staticmethod
    async def connected(url: str) -> _Client:
        """Connect and read what the page consists of."""
        client = _Client(
            await connect(
                url.replace("http", "ws", 1),
                # As the page itself; others are refused.
                origin=Origin(url),
                subprotocols=[PROTOCOL],
                compression=None,
                max_size=None,
            )
        )
        # viser counts a client as connected once it has told of its camera.
        await client._send(CAMERA)
        while not any(m["type"] == "ReplayDoneMessage" for m in await client._receive()):
            pass
        return client

    async def close(self) -> None:
        await self._connection.close()

    async def read(self) -> None:
        """Read until cancelled, and remember what concerns the scene."""
        while True:
            messages = await self._receive()
            now = time.monotonic()
            if any(not message["type"].startswith("Gui") for message in messages):
                self.seen.drawn = now

    async def drag(self, drag: Drag, start: float) -> None:
        """Send the events of a drag at an even pace from a time on."""
        for count, message in enumerate(self._events(drag)):
            await asyncio.sleep(start + count / EVENTS_PER_SECOND - time.monotonic())
            self.seen.sent = time.monotonic()
            await self._send(message)

    def _events(self, drag: Drag) -> list[dict[str, Any]]:
        if isinstance(drag, SliderDrag):
            uuid = self._uuids[drag.label]
            return [
                {"type": "GuiUpdateMessage", "uuid": uuid, "updates": {"value": value}}
                for value in drag.values
            ]
        return [
            {
                "type": "TransformControlsUpdateMessage",
                "name": drag.name,
                "position": pose.position,
                "wxyz": pose.quaternion,
            }
            for pose in drag.poses
        ]

    async def _send(self, message: dict[str, Any]) -> None:
        await self._connection.send(msgspec.msgpack.encode(message))

    async def _receive(self) -> list[dict[str, Any]]:
        window = await self._connection.recv(decode=False)
        size, compressed = (int.from_bytes(window[i : i + 8], "little") for i in (0, 8))
        packed = self._decompressor.decompress(window[16 : 16 + compressed], size)
        messages: list[dict[str, Any]] = msgspec.msgpack.decode(packed)["messages"]
        for message in messages:
            if message["type"] == "GuiSliderMessage":
                self._uuids[message["props"]["label"]] = message["uuid"]
        return messages
