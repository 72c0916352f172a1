"""The messages that a browser may send, checked one by one without a server."""

from __future__ import annotations

import math
from typing import Any

import msgspec
import pytest
from hypothesis import given, strategies as st

from explorer.app.security.client_messages import (
    LARGEST_MESSAGE,
    LARGEST_UPLOAD,
    LARGEST_WHOLE,
    MOST_PARTS,
    MOST_UPLOADS,
    PATIENCE,
    ControlValue,
    Inbox,
    fits,
)

HELD: dict[str, ControlValue] = {
    "slider": ControlValue(1.5),
    "whole": ControlValue(3),
    "checkbox": ControlValue(False),
    "button": ControlValue(True),
    "triple": ControlValue((0.0, 1.0, 2.0)),
    "list": ControlValue("b", ("a", "b")),
    "text": ControlValue("words"),
    "colour": ControlValue((1, 2, 3)),
    "file": ControlValue(object()),
    "nothing": ControlValue(None),
    "empty": ControlValue(()),
}
GOOD: dict[str, list[Any]] = {
    "slider": [0, 1.5, -1e300, 2**63],
    "whole": [0, -7, 2.5],
    "checkbox": [True, False],
    "button": [True],
    "triple": [[1, 2, 3], [0.5, -1e300, 0]],
    "list": ["a", "b"],
    "text": ["", "x" * 5000, "\0"],
    "colour": [[0, 255, 7]],
    "empty": [[]],
}
ANYTHING: list[Any] = [
    None, True, False, 0, 1, -7, 2.5, 1.5, math.nan, math.inf, -math.inf, 2**63, -1e300, "", "a",
    "b", "c", "1.5", "nan", b"a", [], [1, 2, 3], [0.5, -1e300, 0], [1.0, 2.0],
    [1.0, 2.0, math.nan], [[1.0], 2.0, 3.0], ["a"], ["1", "2", "3"], [True, True, True],
    [0, 255, 7], [None] * 3, {}, {"a": 1}, "x" * 5000, "\0",
]  # fmt: skip

CAMERA: dict[str, Any] = {
    "type": "ViewerCameraMessage", "wxyz": [1, 0, 0, 0], "position": [0.0, 1, 2], "fov": 0.6,
    "near": 0.1, "far": 1000, "image_height": 400, "image_width": 640.0, "look_at": [0, 0, 0],
    "up_direction": [0, 0, 1],
}  # fmt: skip


class Known:
    """The controls above."""

    def value_of(self, uuid: str) -> ControlValue | None:
        return HELD.get(uuid)

    def takes_files(self, uuid: str) -> bool:
        return uuid == "file"


def admits(message: Any, inbox: Inbox | None = None) -> bool:
    return (inbox or Inbox(Known())).admits(msgspec.msgpack.encode(message))


def update(uuid: str, value: Any) -> dict[str, Any]:
    return {"type": "GuiUpdateMessage", "uuid": uuid, "updates": {"value": value}}


def upload(transfer: str, parts: int, size: int, source: str = "file") -> dict[str, Any]:
    return {"type": "FileTransferStartUpload", "source_component_uuid": source,
            "transfer_uuid": transfer, "filename": "../x", "mime_type": "", "part_count": parts,
            "size_bytes": size}  # fmt: skip


def part(transfer: str, index: int, size: int) -> dict[str, Any]:
    return {"type": "FileTransferPart", "source_component_uuid": "file", "transfer_uuid": transfer,
            "part_index": index, "content": b"x" * size}  # fmt: skip


@pytest.mark.parametrize("uuid", list(HELD))
def test_control_takes_only_values_of_its_own_type(uuid: str) -> None:
    good = GOOD.get(uuid, [])
    for value in good:
        assert admits(update(uuid, value))
    for value in ANYTHING:
        if is_one_of(value, good):
            continue
        # Numbers are all alike to JavaScript.
        is_number = isinstance(value, int | float) and not isinstance(value, bool)
        same = (
            (uuid == "slider" and is_number and math.isfinite(value))
            or (uuid == "whole" and is_number and abs(value) <= LARGEST_WHOLE)
            or (uuid in ("triple", "colour")
                and value in ([1, 2, 3], [0, 255, 7])
                and not any(isinstance(v, bool) for v in value))
            or (uuid == "triple" and value == [0.5, -1e300, 0])
            or (uuid == "text" and isinstance(value, str))
            or (uuid in ("checkbox", "button") and isinstance(value, bool))
        )  # fmt: skip
        assert admits(update(uuid, value)) == same, value


def is_one_of(value: Any, values: list[Any]) -> bool:
    return any(type(value) is type(other) and value == other for other in values)


def test_message_to_a_removed_control_is_admitted() -> None:
    assert admits(update("gone", math.nan))


@pytest.mark.parametrize("name", ["visible", "label", "disabled", "update_cb", "removed", "min"])
def test_property_other_than_the_value_cannot_be_set(name: str) -> None:
    message = {"type": "GuiUpdateMessage", "uuid": "slider", "updates": {name: 1.0}}
    assert not admits(message)
    message["updates"] = {"value": 1.0, name: 1.0}
    assert not admits(message)


@pytest.mark.parametrize("field", [f for f in CAMERA if f != "type"])
def test_camera_has_finite_numbers_of_the_right_count(field: str) -> None:
    assert admits(CAMERA)
    value = CAMERA[field]
    bad: list[Any] = [None, "1", [], {}, math.nan, math.inf]
    if isinstance(value, list):
        bad += [[*value, 0.0], [math.nan, *value[1:]], [-math.inf, *value[1:]], [None, *value[1:]]]
    for other in bad:
        assert not admits(CAMERA | {field: other})
    assert not admits({name: v for name, v in CAMERA.items() if name != field})
    assert not admits(CAMERA | {"more": 1})


@pytest.mark.parametrize(
    "kind",
    ["ShareUrlRequest", "ShareUrlDisconnect", "RunJavascriptMessage", "ResetGuiMessage",
     "GuiFormDirtyMessage", "GuiFormSubmitMessage", "SetPositionMessage", "GuiRemoveMessage",
     "RemoveSceneNodeMessage", "FileTransferStartDownload", "ThemeConfigurationMessage", "", "x"],
)  # fmt: skip
def test_message_that_no_page_sends_is_dropped(kind: str) -> None:
    assert not admits({"type": kind})
    assert not admits({"type": kind, "uuid": "slider", "name": "/platform", "source": "alert(1)"})


def test_uploads_are_limited_in_size_and_number() -> None:
    inbox = Inbox(Known())
    for parts, size in ((1, LARGEST_UPLOAD + 1), (MOST_PARTS + 1, 9), (-1, 9), (1, -1), (0, 9),
                        (3, 0), (2**62, 2**62)):  # fmt: skip
        assert not admits(upload("t", parts, size), inbox)
    assert not admits(upload("t", 1, 9, source="slider"), inbox)
    for count in range(MOST_UPLOADS):
        assert admits(upload(f"t{count}", 2, 9), inbox)
    assert not admits(upload("one-more", 2, 9), inbox)
    # Parts: none for an unknown one, none twice, none beyond what was said, none too few.
    assert not admits(part("unknown", 0, 4), inbox)
    assert not admits(part("t0", 2, 4), inbox)
    assert not admits(part("t0", 0, 10), inbox)
    assert admits(part("t0", 0, 4), inbox)
    assert not admits(part("t0", 0, 4), inbox)
    assert not admits(part("t0", 1, 6), inbox)
    assert not admits(part("t0", 1, 4), inbox)
    assert admits(part("t0", 1, 5), inbox)
    # Now there is room for the next.
    assert admits(upload("one-more", 1, 1), inbox)
    assert admits(upload("nothing in it", 0, 0))
    # Another client knows nothing of it.
    assert not admits(part("one-more", 0, 1), Inbox(Known()))


def test_large_message_is_dropped_unless_it_is_a_picture() -> None:
    picture = {"type": "GetRenderResponseMessage", "payload": b"x" * LARGEST_MESSAGE,
               "render_uuid": "x"}  # fmt: skip
    assert admits(picture)
    assert not admits(update("text", "x" * LARGEST_MESSAGE))
    assert not admits(update("text", [[]] * LARGEST_MESSAGE))


def test_patience_ends_after_many_dropped_messages() -> None:
    inbox = Inbox(Known())
    for _ in range(PATIENCE):
        assert not inbox.is_out_of_patience
        assert admits(CAMERA, inbox)
        assert not inbox.admits(b"")
    assert inbox.is_out_of_patience


@given(st.binary(max_size=200) | st.text(max_size=50))
def test_noise_is_dropped_without_an_exception(data: str | bytes) -> None:
    assert not Inbox(Known()).admits(data)


@given(st.integers(0, 10_000), st.binary(min_size=1, max_size=3))
def test_message_with_foreign_bytes_is_checked_without_an_exception(at: int, noise: bytes) -> None:
    for message in (CAMERA, update("triple", [1.0, 2.0, 3.0]), upload("t", 2, 9)):
        data = msgspec.msgpack.encode(message)
        place = at % len(data)
        Inbox(Known()).admits(data[:place] + noise + data[place + len(noise) :])


@given(st.sampled_from(list(HELD)), st.floats())
def test_infinite_value_does_not_fit(uuid: str, value: float) -> None:
    held = HELD[uuid]
    assert math.isfinite(value) or not fits(value, held)
    assert math.isfinite(value) or not fits([value, 0.0, 0.0], held)
