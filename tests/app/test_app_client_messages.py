"""The messages that a browser may send, checked one by one without a server."""

from __future__ import annotations

import math
from typing import Any

import msgspec
import pytest
from client import CAMERA
from hypothesis import given, strategies as st

from explorer.app.security.client_messages import (
    LARGEST_MESSAGE,
    LARGEST_UPLOAD,
    LARGEST_WHOLE,
    MOST_UPLOADS,
    ControlValue,
    Inbox,
)

CONTROLS: dict[str, ControlValue] = {
    "slider": ControlValue(1.5),
    "whole": ControlValue(3),
    "checkbox": ControlValue(value=False),
    "triple": ControlValue((0.0, 1.0, 2.0)),
    "list": ControlValue("b", ("a", "b")),
    "text": ControlValue("words"),
    "file": ControlValue(object()),
}


class Controls:
    """The controls above."""

    def value_of(self, uuid: str) -> ControlValue | None:
        return CONTROLS.get(uuid)

    def takes_files(self, uuid: str) -> bool:
        return uuid == "file"


def admits(message: Any, inbox: Inbox | None = None) -> bool:
    return (inbox or Inbox(Controls())).admits(msgspec.msgpack.encode(message))


def update(uuid: str, value: Any) -> dict[str, Any]:
    return {"type": "GuiUpdateMessage", "uuid": uuid, "updates": {"value": value}}


def upload(transfer: str, parts: int, size: int, source: str = "file") -> dict[str, Any]:
    return {"type": "FileTransferStartUpload", "source_component_uuid": source,
            "transfer_uuid": transfer, "filename": "../x", "mime_type": "", "part_count": parts,
            "size_bytes": size}  # fmt: skip


def part(transfer: str, index: int, size: int) -> dict[str, Any]:
    return {"type": "FileTransferPart", "source_component_uuid": "file", "transfer_uuid": transfer,
            "part_index": index, "content": b"x" * size}  # fmt: skip


CASES: list[tuple[str, list[Any], list[Any]]] = [
    ("slider", [0, 1.5, -1e300, 2**63], [True, "1.5", None, [1.5], math.nan, math.inf]),
    ("whole", [0, -7, 2.5], [LARGEST_WHOLE + 1, False, "3", math.nan]),
    ("checkbox", [True, False], [0, 1, "", None]),
    ("triple", [[1, 2, 3], [0.5, -1e300, 0]], [[1, 2], [1, 2, math.nan], [[1], 2, 3], "abc"]),
    ("list", ["a", "b"], ["c", "", 0, ["a"]]),
    ("text", ["", "x" * 5000, "\0"], [b"a", None, 0]),
    ("file", [], [None, {}, ""]),
    ("removed", [math.nan, "", None], []),
]


@pytest.mark.parametrize(("uuid", "good", "bad"), CASES)
def test_control_gets_only_finite_values_of_its_own_type(
    uuid: str, good: list[Any], bad: list[Any]
) -> None:
    for value in good + bad:
        assert admits(update(uuid, value)) == any(value is each for each in good)


def test_message_with_foreign_or_missing_fields_is_dropped() -> None:
    assert admits(CAMERA)
    for message in (
        {"type": "GuiUpdateMessage", "uuid": "slider", "updates": {"value": 1.0, "visible": True}},
        CAMERA | {"fov": math.nan},
        CAMERA | {"position": [0.0, 1.0]},
        CAMERA | {"more": 1},
        {name: value for name, value in CAMERA.items() if name != "near"},
        {"type": "RunJavascriptMessage", "source": "alert(1)"},
        {"type": "ShareUrlRequest"},
        {"type": ""},
    ):
        assert not admits(message), message


def test_uploads_are_limited_in_size_and_number() -> None:
    inbox = Inbox(Controls())
    for parts, size in ((1, LARGEST_UPLOAD + 1), (-1, 9), (0, 9), (3, 0)):
        assert not admits(upload("t", parts, size), inbox)
    assert not admits(upload("t", 1, 9, source="slider"), inbox)
    for count in range(MOST_UPLOADS):
        assert admits(upload(f"t{count}", 2, 9), inbox)
    assert not admits(upload("one-more", 2, 9), inbox)
    # Each part comes once, and all parts together have the declared size.
    parts = [("unknown", 0, 4), ("t0", 0, 4), ("t0", 0, 4), ("t0", 1, 4), ("t0", 1, 5)]
    passed = [admits(part(*each), inbox) for each in parts]
    assert passed == [False, True, False, False, True]
    assert admits(upload("one-more", 1, 1), inbox)


def test_large_message_is_dropped_unless_it_is_a_picture() -> None:
    content = b"x" * LARGEST_MESSAGE
    assert admits({"type": "GetRenderResponseMessage", "payload": content, "render_uuid": "x"})
    assert not admits(update("text", content.decode()))


@given(st.integers(0, 10_000), st.binary(min_size=1, max_size=200) | st.text(max_size=50))
def test_noise_is_dropped_without_an_exception(at: int, noise: bytes | str) -> None:
    assert not Inbox(Controls()).admits(noise)
    if isinstance(noise, str):
        return
    for message in (CAMERA, update("triple", [1.0, 2.0, 3.0]), upload("t", 2, 9)):
        data = msgspec.msgpack.encode(message)
        place = at % len(data)
        Inbox(Controls()).admits(data[:place] + noise + data[place + len(noise) :])
