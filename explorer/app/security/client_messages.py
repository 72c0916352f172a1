"""What a browser may say to the server, read strictly before viser sees it.

viser decodes any of its messages from any client, sets whatever property of a control it is
told to, and keeps uploads of any declared size. Here each message must be one that the page
sends, with all its fields and no other, its numbers finite; a control is only ever given a
value of the type that it holds. What is no such message is dropped, and a client that keeps
sending it is let go.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated, Any, Literal, Protocol, cast

import msgspec

# No honest message is longer, in bytes, but a picture of the scene.
LARGEST_MESSAGE = 1_000_000
LARGEST_PICTURE = 24_000_000
# The page cuts files into parts of 512 KiB. Larger files than these are dropped here; what is
# too large for its purpose is refused in words by whoever reads it.
MOST_PARTS = 64
LARGEST_UPLOAD = MOST_PARTS * 512 * 1024
# Files of one client on their way at once.
MOST_UPLOADS = 2
# A client that sends so much that is no message of the page is not the page.
PATIENCE = 100

Word = Annotated[str, msgspec.Meta(max_length=200)]
Text = Annotated[str, msgspec.Meta(max_length=100_000)]
# Beyond it not every whole number is a number of JavaScript.
LARGEST_WHOLE = 2**53

Pair = tuple[float, float]
Triple = tuple[float, float, float]
Quadruple = tuple[float, float, float, float]
Count = Annotated[int, msgspec.Meta(ge=0, le=2**31)]
Pixels = Annotated[float, msgspec.Meta(ge=0, le=100_000)]


class Message(msgspec.Struct, forbid_unknown_fields=True, tag_field="type", tag=str):
    """A message as the page sends it; each has the name of viser's."""


class ViewerCameraMessage(Message):
    """Where the camera stands."""

    wxyz: Quadruple
    position: Triple
    fov: float
    near: float
    far: float
    image_height: Pixels
    image_width: Pixels
    look_at: Triple
    up_direction: Triple


class TransformControlsUpdateMessage(Message):
    """The handle was dragged."""

    name: Word
    wxyz: Quadruple
    position: Triple
    owner: Word = ""


class TransformControlsDragStartMessage(Message):
    """The handle was taken."""

    name: Word
    owner: Word = ""


class TransformControlsDragEndMessage(Message):
    """The handle was let go."""

    name: Word
    owner: Word = ""


class SceneNodeClickMessage(Message):
    """Something in the scene was clicked."""

    name: Word
    instance_index: int | None
    ray_origin: Triple
    ray_direction: Triple
    screen_pos: Pair
    modifier: Word | None
    owner: Word = ""


class GuiUpdateMessage(Message):
    """A control has a new value, or a button was pressed."""

    uuid: Word
    updates: dict[Literal["value"], Any]


class GuiButtonHoldMessage(Message):
    """A button is held down."""

    uuid: Word
    frequency: float


class CommandTriggerMessage(Message):
    """A command was chosen from the palette."""

    uuid: Word


class GetRenderResponseMessage(Message):
    """A picture of the scene that was asked for."""

    payload: bytes
    render_uuid: Word


class LocalStorageGetItemResponseMessage(Message):
    """What the browser remembers, as it was asked."""

    request_uuid: Word
    value: Text | None
    error: Text | None


class FileTransferStartUpload(Message):
    """A file is about to come."""

    source_component_uuid: Word
    transfer_uuid: Word
    filename: Annotated[str, msgspec.Meta(max_length=255)]
    mime_type: Word
    part_count: Annotated[int, msgspec.Meta(ge=0, le=MOST_PARTS)]
    size_bytes: Annotated[int, msgspec.Meta(ge=0, le=LARGEST_UPLOAD)]


class FileTransferPart(Message):
    """A part of a file."""

    source_component_uuid: Word | None
    transfer_uuid: Word
    part_index: Annotated[int, msgspec.Meta(ge=0, lt=MOST_PARTS)]
    content: bytes


class FileTransferPartAck(Message):
    """A part of a file that was sent has arrived."""

    source_component_uuid: Word | None
    transfer_uuid: Word
    transferred_bytes: Count
    total_bytes: Count


Sendable = (
    ViewerCameraMessage
    | TransformControlsUpdateMessage
    | TransformControlsDragStartMessage
    | TransformControlsDragEndMessage
    | SceneNodeClickMessage
    | GuiUpdateMessage
    | GuiButtonHoldMessage
    | CommandTriggerMessage
    | GetRenderResponseMessage
    | LocalStorageGetItemResponseMessage
    | FileTransferStartUpload
    | FileTransferPart
    | FileTransferPartAck
)
_ANY = msgspec.msgpack.Decoder(Sendable)
_PICTURE = msgspec.msgpack.Decoder(GetRenderResponseMessage)


@dataclass(frozen=True)
class Held:
    """What a control holds.

    Attributes:
        value: Its present value.
        options: Those that it has to be one of; None if it may be any.
    """

    value: object
    options: tuple[str, ...] | None = None


class Controls(Protocol):
    """What is known of the page's controls by their ids."""

    def held(self, uuid: str) -> Held | None:
        """Return what a control holds; None if there is no such control."""
        ...

    def takes_files(self, uuid: str) -> bool:
        """Whether this is a button to upload files with."""
        ...


class Inbox:
    """Judges the messages of one client.

    Args:
        controls: Of the page.
    """

    def __init__(self, controls: Controls) -> None:
        self._controls = controls
        self._uploads: dict[str, _Upload] = {}
        self._patience = PATIENCE

    @property
    def is_out_of_patience(self) -> bool:
        """Whether too much came that was no message of the page."""
        return self._patience <= 0

    def admits(self, data: str | bytes) -> bool:
        """Whether a message may go on to viser; what may not is counted."""
        message = _decoded(data) if isinstance(data, bytes) else None
        if message is not None and self._is_in_place(message):
            return True
        self._patience -= 1
        return False

    def _is_in_place(self, message: Sendable) -> bool:
        match message:
            case GuiUpdateMessage():
                held = self._controls.held(message.uuid)
                # A control may have gone while the message was on its way.
                return held is None or all(fits(v, held) for v in message.updates.values())
            case FileTransferStartUpload():
                return self._starts(message)
            case FileTransferPart():
                return self._takes(message)
            case _:
                return _is_finite(msgspec.structs.astuple(message))

    def _starts(self, message: FileTransferStartUpload) -> bool:
        if (
            not self._controls.takes_files(message.source_component_uuid)
            or len(self._uploads) >= MOST_UPLOADS
            or message.transfer_uuid in self._uploads
            or (message.part_count == 0) != (message.size_bytes == 0)
        ):
            return False
        if message.part_count:
            self._uploads[message.transfer_uuid] = _Upload(message.part_count, message.size_bytes)
        return True

    def _takes(self, part: FileTransferPart) -> bool:
        upload = self._uploads.get(part.transfer_uuid)
        if upload is None or not upload.takes(part.part_index, len(part.content)):
            return False
        if upload.is_complete:
            del self._uploads[part.transfer_uuid]
        return True


class _Upload:
    def __init__(self, part_count: int, size: int) -> None:
        self._missing = set(range(part_count))
        self._left = size

    @property
    def is_complete(self) -> bool:
        return not self._missing

    def takes(self, part: int, size: int) -> bool:
        if part not in self._missing or size > self._left:
            return False
        if self._missing == {part} and size < self._left:
            return False
        self._missing.remove(part)
        self._left -= size
        return True


def fits(value: Any, held: Held) -> bool:
    """Whether a control that holds one value may be given another.

    A number may be any finite one, since ranges change while a hand is on the slider;
    whether it is possible is said by the session.
    """
    if held.options is not None:
        return isinstance(value, str) and value in held.options
    return _is_like(value, held.value)


def _decoded(data: bytes) -> Sendable | None:
    try:
        return (_ANY if len(data) <= LARGEST_MESSAGE else _PICTURE).decode(data)
    except (msgspec.MsgspecError, UnicodeDecodeError, RecursionError):
        return None


def _is_like(value: object, present: object) -> bool:
    if isinstance(present, tuple):
        entries = cast("tuple[object, ...]", present)
        if not isinstance(value, list | tuple):
            return False
        given = cast("Sequence[object]", value)
        return len(given) == len(entries) and all(map(_is_like, given, entries))
    if isinstance(present, bool):
        return isinstance(value, bool)
    if isinstance(present, int | float):
        if isinstance(value, bool) or not isinstance(value, int | float):
            return False
        # viser makes a whole number of what a whole number is given, and can send no larger one.
        largest = LARGEST_WHOLE if isinstance(present, int) else math.inf
        return math.isfinite(value) and abs(value) <= largest
    return isinstance(present, str) and isinstance(value, str)


def _is_finite(value: object) -> bool:
    if isinstance(value, tuple):
        return all(map(_is_finite, cast("tuple[object, ...]", value)))
    return not isinstance(value, float) or math.isfinite(value)
