"""A tab without a browser: it says what it is told to, and reads on a thread of its own."""

from __future__ import annotations

import threading
import uuid
from contextlib import suppress
from typing import Any

import msgspec
from client import CAMERA, opened
from websockets.exceptions import ConnectionClosed


class SocketTab:
    """A websocket client that counts as a tab.

    Args:
        url: Of the explorer.
    """

    def __init__(self, url: str) -> None:
        self._connection = opened(url)
        # viser counts a client as connected once it has told of its camera.
        self.send(CAMERA)
        self.received = 0
        self._reader = threading.Thread(target=self._read, daemon=True)
        self._reader.start()

    def send(self, message: dict[str, Any]) -> None:
        """Send a message, given by its fields; a tab that was shut out says nothing."""
        with suppress(ConnectionClosed):
            self._connection.send(msgspec.msgpack.encode(message))

    def update(self, uuid: str, value: object) -> None:
        """Give a control a value."""
        self.send({"type": "GuiUpdateMessage", "uuid": uuid, "updates": {"value": value}})

    def upload(self, button: str, name: str, content: bytes) -> None:
        """Upload a file by an upload button."""
        transfer = str(uuid.uuid4())
        self.send(
            {
                "type": "FileTransferStartUpload",
                "source_component_uuid": button,
                "transfer_uuid": transfer,
                "filename": name,
                "mime_type": "application/json",
                "part_count": 1,
                "size_bytes": len(content),
            }
        )
        self.send(
            {
                "type": "FileTransferPart",
                "source_component_uuid": button,
                "transfer_uuid": transfer,
                "part_index": 0,
                "content": content,
            }
        )

    def flush(self) -> None:
        """Return once all that was sent has arrived."""
        with suppress(ConnectionClosed):
            self._connection.ping().wait(30.0)

    def close(self) -> None:
        """Close as a browser does."""
        self._connection.close()
        self._reader.join(timeout=5.0)

    def drop(self) -> None:
        """Be gone without a word, as when a cable is pulled."""
        self._connection.socket.close()

    def _read(self) -> None:
        with suppress(ConnectionClosed, OSError):
            while True:
                self.received += len(self._connection.recv())
