"""The messages that a browser may send to the server, read strictly before viser reads them.

viser decodes any of its messages from any client, sets any property of a control, and stores
uploads of any declared size. Here each message must be one that the page sends, with all its
fields and no other, its numbers finite; a control gets only values of the type that it holds.
Any other message is dropped, and a client that keeps sending such messages is disconnected.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated, Any, Literal, Protocol, TypeVar, cast

import msgspec

# Largest size of a message in bytes, and of a picture of the scene.
LARGEST_MESSAGE = 1_000_000
LARGEST_PICTURE = 24_000_000
# The page cuts files into parts of 512 KiB. Larger files than these are dropped here; the reader
# of a file refuses one that is too large for its purpose with a message.
MOST_PARTS = 64
LARGEST_UPLOAD = MOST_PARTS * 512 * 1024
# Largest number of files that one client uploads at once.
MOST_UPLOADS = 2
# Number of dropped messages after which a client is disconnected.
PATIENCE = 100

Word = Annotated[str, msgspec.Meta(max_length=200)]
# Number up to which JavaScript represents every whole number.
LARGEST_WHOLE = 2**53

Described = TypeVar("Described")

Pair = tuple[float, float]
Triple = tuple[float, float, float]
Quadruple = tuple[float, float, float, float]
Count = Annotated[int, msgspec.Meta(ge=0, le=2**31)]
Pixels = Annotated[float, msgspec.Meta(ge=0, le=100_000)]


class Message(msgspec.Struct, forbid_unknown_fields=True, tag_field="type", tag=str):
    """A message of the page; each class has the name of viser's message."""


class ViewerCameraMessage(Message):
    """The camera has moved."""

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
    """A picture of the scene that the server requested."""

    payload: bytes
    render_uuid: Word


class FileTransferStartUpload(Message):
    """The upload of a file begins."""

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
    | FileTransferStartUpload
    | FileTransferPart
    | FileTransferPartAck
)
_ANY = msgspec.msgpack.Decoder(Sendable)
_PICTURE = msgspec.msgpack.Decoder(GetRenderResponseMessage)


@dataclass(frozen=True)
class ControlValue:
    """The value of a control.

    Attributes:
        value: Its present value.
        options: The values that it may have; None for any.
    """

    value: object
    options: tuple[str, ...] | None = None


class Controls(Protocol):
    """The controls of the page by their ids."""

    def value_of(self, uuid: str) -> ControlValue | None:
        """Return the value of a control; None if there is no such control."""
        ...

    def takes_files(self, uuid: str) -> bool:
        """Whether this is a button that uploads files."""
        ...


class Inbox:
    """Checks the messages of one client.

    Args:
        controls: The controls of the page.
    """

    def __init__(self, controls: Controls) -> None:
        self._controls = controls
        self._uploads: dict[str, _Upload] = {}
        self._patience = PATIENCE

    @property
    def is_out_of_patience(self) -> bool:
        """Whether the client is to be disconnected."""
        return self._patience <= 0

    def admits(self, data: str | bytes) -> bool:
        """Return whether a message may go on to viser; count it if it may not."""
        message = _decoded(data) if isinstance(data, bytes) else None
        if message is not None and self._is_allowed(message):
            return True
        self._patience -= 1
        return False

    def _is_allowed(self, message: Sendable) -> bool:
        match message:
            case GuiUpdateMessage():
                control = self._controls.value_of(message.uuid)
                # A control may be removed while the message is under way.
                return control is None or all(fits(v, control) for v in message.updates.values())
            case FileTransferStartUpload():
                return self._start_upload(message)
            case FileTransferPart():
                return self._take_part(message)
            case _:
                return _is_finite(msgspec.structs.astuple(message))

    def _start_upload(self, message: FileTransferStartUpload) -> bool:
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

    def _take_part(self, part: FileTransferPart) -> bool:
        upload = self._uploads.get(part.transfer_uuid)
        if upload is None or not upload.take(part.part_index, len(part.content)):
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

    def take(self, part: int, size: int) -> bool:
        if part not in self._missing or size > self._left:
            return False
        if self._missing == {part} and size < self._left:
            return False
        self._missing.remove(part)
        self._left -= size
        return True


def fits(value: Any, control: ControlValue) -> bool:
    """Return whether a control that holds one value may be given another.

    A number may be any finite one, since ranges change while a slider is dragged; the session
    refuses impossible values.
    """
    if control.options is not None:
        return isinstance(value, str) and value in control.options
    return _is_like(value, control.value)


def decode_text(text: str, decoder: msgspec.json.Decoder[Described]) -> Described | None:
    """Return what a text of a client describes; None if no script of the page wrote it."""
    try:
        return decoder.decode(text)
    except (msgspec.MsgspecError, UnicodeEncodeError, RecursionError):
        return None


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
        # viser rounds the value of a control of whole numbers, and can send no larger one.
        largest = LARGEST_WHOLE if isinstance(present, int) else math.inf
        return math.isfinite(value) and abs(value) <= largest
    return isinstance(present, str) and isinstance(value, str)


def _is_finite(value: object) -> bool:
    if isinstance(value, tuple):
        return all(map(_is_finite, cast("tuple[object, ...]", value)))
    return not isinstance(value, float) or math.isfinite(value)
