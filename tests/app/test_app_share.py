"""What is taken away: the scene as a page, pictures from pixels."""

from __future__ import annotations

import base64
import datetime as dt
import struct
from dataclasses import dataclass
from typing import Any
from unittest.mock import Mock

import msgspec
import numpy as np
import zstandard

from explorer.app.features.sharing.scene_files import (
    MOST,
    camera_messages,
    caption_of,
    double_size,
    scene_html,
    visible_messages,
)
from explorer.app.server import Running
from explorer.app.state.actions import Set
from explorer.app.state.state import open_state
from explorer.app.state.view import View
from explorer.mechanism.design_file import PRESETS

OPTIMAL = PRESETS["paper-optimal"]
DATE = dt.date(2031, 2, 3)
EYE, TARGET, ANGLE = (12.0, -9.0, 7.5), (1.0, 2.0, 3.0), 0.5
CAMERA = camera_messages(np.array(EYE), np.array(TARGET), ANGLE)


@dataclass(frozen=True)
class Packed:
    """What is in a page of a scene: its text, and the messages that it plays."""

    text: str
    messages: list[dict[str, Any]]

    @staticmethod
    def of(data: bytes) -> Packed:
        text = data.decode()
        packed = base64.b64decode(text.split('__VISER_EMBED_DATA__="', 1)[1].split('"', 1)[0])
        (size,) = struct.unpack("<Q", packed[:8])
        inner = zstandard.ZstdDecompressor().decompress(packed[8:], max_output_size=size)
        (length,) = struct.unpack("<Q", inner[:8])
        body = msgspec.msgpack.decode(inner[8 : 8 + length])
        return Packed(text, [message for _, message in body["messages"]])

    def named(self, start: str) -> list[dict[str, Any]]:
        return [m for m in self.messages if m.get("name", "").startswith(start)]


def test_scene_page_holds_what_is_seen_and_nothing_else(running: Running) -> None:
    packed = Packed.of(scene_html(running.viser, running.page.session.state, CAMERA, date=DATE))
    # What draws labels and views without perspective comes along.
    kept = {
        "BackgroundImageMessage",
        "EnableLightsMessage",
        "EnvironmentMapMessage",
        "RunJavascriptMessage",
        "ThemeConfigurationMessage",
    }
    assert kept == {
        m["type"]
        for m in packed.messages
        if "name" not in m and not m["type"].startswith("SetCamera")
    }
    assert packed.named("/legs/")
    labels = {m["name"]: m["props"]["text"] for m in packed.messages if m["type"] == "LabelMessage"}
    del labels["/ground/scale"]
    assert list(labels.values()) == (["δ1", "δ2", "δ3", "a1", "a2", "a3", "b1", "b2", "b3", "b4"])
    for hidden in ("/ghosts/", "/twin/", "/path/", "/workspace/", "/handle"):
        assert not packed.named(hidden)
    cameras = {m["type"]: m for m in packed.messages if m["type"].startswith("SetCamera")}
    assert cameras["SetCameraPositionMessage"]["position"] == [*EYE]
    assert cameras["SetCameraLookAtMessage"]["look_at"] == [*TARGET]
    assert cameras["SetCameraFovMessage"]["fov"] == ANGLE
    assert all(m["initial"] for m in cameras.values())
    assert "<title>paper-optimal – " in packed.text
    assert "2031-02-03" in packed.text
    # No address but names of namespaces of markup, and none of the server.
    assert str(running.viser.get_port()) not in packed.text.split("__VISER_EMBED_DATA__")[0]
    assert "default-src 'none'" in packed.text


def test_scene_page_holds_what_is_shown_by_then_and_ends_its_recording(
    running: Running,
) -> None:
    session = running.page.session
    session.do(Set("view", View(ghosts=True, labels=False)))
    assert session.wait_until_idle()
    packed = Packed.of(scene_html(running.viser, session.state, CAMERA, date=DATE))
    assert packed.named("/ghosts/")
    names = [m["name"] for m in packed.messages if m["type"] == "LabelMessage"]
    assert set(names) == {"/ground/scale", *(f"/ghosts/name/{index}" for index in range(7))}
    session.do(Set("view", View()))
    internals: Any = running.viser
    assert internals._websock_server._record_handles == []


def message(kind: str, name: str) -> dict[str, Any]:
    return {"type": f"{kind}Message", "name": name, "props": {"show_axes": False}}


def test_scene_page_drops_parts_with_what_they_belong_to() -> None:
    sent: list[dict[str, Any]] = [
        message("Frame", "/a"),
        message("Frame", "/a/b"),
        message("Mesh", "/a/b/c"),
        message("Mesh", "/a/bc"),
        message("Mesh", "/ab"),
        message("TransformControls", "/d"),
        message("Mesh", "/d/e"),
        # Holds nothing.
        message("Frame", "/f"),
        {"type": "SetSceneNodeVisibilityMessage", "name": "/a/b", "visible": False},
        {"type": "SetSceneNodeVisibilityMessage", "name": "/a", "visible": True},
        {"type": "SetPositionMessage", "name": "/a/b/c", "position": (1, 2, 3)},
        {"type": "RunJavascriptMessage", "source": "secret"},
        {"type": "GuiSliderMessage", "uuid": "1"},
    ]
    assert [m["name"] for m in visible_messages(sent)] == ["/a", "/a/bc", "/ab", "/a"]


def test_caption_of_a_scene_page_has_names_as_text() -> None:
    design = msgspec.structs.replace(OPTIMAL, name="<script>alert(1)</script>")
    caption = caption_of(open_state(design), DATE)
    assert "<script" not in caption
    assert "&lt;script&gt;" in caption
    assert "b4 at (10.000, 5.000, 9.000)" in caption
    assert "1 unit = 10 mm" in caption


def test_picture_twice_as_shown_is_within_what_browsers_draw() -> None:
    def size(width: int, height: int) -> tuple[int, int]:
        camera = Mock(image_width=width, image_height=height)
        return double_size(Mock(camera=camera))

    assert size(640, 480) == (1280, 960)
    assert size(4096, 1024) == (MOST, 1024)
    assert size(3000, 1500) == (MOST, MOST // 2)
