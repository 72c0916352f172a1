"""The scene as files: one HTML page to turn and zoom, and pictures.

The page opens without the explorer. It holds viser's page and the visible scene, without the panels
and the drag handle; its content security policy keeps it from fetching anything. A picture is drawn
by the browser that downloads it: the scene alone, with its labels, its camera and the settings of
the menu Overlays; lines and labels grow with the picture.
"""

from __future__ import annotations

import datetime as dt
import io
import math
from collections.abc import Iterable, Sequence
from html import escape
from itertools import accumulate

import numpy as np
import viser
from numpy.typing import NDArray

from explorer.app.features.mechanism.marks import HANDLE_NAME
from explorer.app.state.frame import Frame
from explorer.app.state.state import State
from explorer.errors import NoAnswerError
from explorer.mechanism.rgb import Rgb
from explorer.numerics.arrays import FloatArray
from explorer.numerics.number_text import format_decimals, format_number
from explorer.page.browser.viser_gaps import SceneMessage, scene_as_html
from explorer.page.look import read_script

# Messages outside the tree of the scene that go into the file.
KEPT = (
    "BackgroundImageMessage",
    "EnableLightsMessage",
    "EnvironmentMapMessage",
    "FogMessage",
    "ThemeConfigurationMessage",
)
# Message of the drag handle, which would move nothing.
HANDLE = "TransformControlsMessage"
VISIBILITY = "SetSceneNodeVisibilityMessage"
# Scripts that draw the scene as it is on the page.
SCRIPTS = ("projection", "labels")
POLICY = (
    "default-src 'none'; script-src 'unsafe-inline' 'unsafe-eval' blob: data:; "
    "worker-src blob: data:; style-src 'unsafe-inline'; img-src blob: data:; "
    "font-src data:; connect-src blob: data:; base-uri 'none'; form-action 'none'"
)
CAPTION_STYLE = (
    "position:fixed;right:16px;bottom:14px;text-align:right;z-index:5;pointer-events:none;"
    "font:12.5px/1.45 system-ui,sans-serif;color:var(--mantine-color-dimmed)"
)


def camera_messages(position: FloatArray, look_at: FloatArray, fov: float) -> list[SceneMessage]:
    """Return the messages that set the camera of the opened file, also when its view is reset.

    Places (3,) are in scene units, the vertical angle of view is in radians.
    """
    return [
        {"type": f"SetCamera{part}Message", field: value, "initial": True}
        for part, field, value in (
            ("Position", "position", tuple(position.tolist())),
            ("LookAt", "look_at", tuple(look_at.tolist())),
            ("UpDirection", "position", (0.0, 0.0, 1.0)),
            ("Fov", "fov", fov),
        )
    ]


def scene_html(
    server: viser.ViserServer,
    state: State,
    camera: Sequence[SceneMessage],
    colours: Sequence[SceneMessage] = (),
    *,
    date: dt.date,
    dark: bool = False,
) -> bytes:
    """Return the scene of a server as one HTML file, with a caption that has the date.

    The messages `colours` give nodes the colours of the theme.
    """
    scripts: list[SceneMessage] = [
        {"type": "RunJavascriptMessage", "source": read_script(name)} for name in SCRIPTS
    ]
    page = scene_as_html(
        server,
        lambda all_: [*visible_messages([*all_, *colours]), *camera, *scripts],
        dark=dark,
    )
    title = f"{state.design.name} – flagged 4-4 manipulator"
    head, title_of_viser, rest = page.partition("<title>Viser</title>")
    body, end, after = rest.rpartition("</body>")
    if not (title_of_viser and end):
        raise RuntimeError(f"the page of viser {viser.__version__} has no title or no end")
    policy = f'<meta http-equiv="Content-Security-Policy" content="{POLICY}">'
    head = head.replace("<head>", f"<head>{policy}", 1)
    caption = f'<div id="caption" style="{CAPTION_STYLE}">{caption_of(state, date)}</div>'
    return f"{head}<title>{escape(title)}</title>{body}{caption}{end}{after}".encode()


def visible_messages(messages: Iterable[SceneMessage]) -> list[SceneMessage]:
    """Return the messages of the visible nodes of a scene, without the drag handle."""
    all_ = list(messages)
    hidden = {m["name"] for m in all_ if m["type"] == VISIBILITY and not m["visible"]}
    hidden |= {m["name"] for m in all_ if m["type"] == HANDLE}
    seen: set[str] = set()
    for message in all_:
        # A frame without axes is invisible, there only for its children.
        is_frame = message["type"] == "FrameMessage" and not message["props"]["show_axes"]
        if "props" in message and not is_frame:
            # The node and its ancestors.
            lineage = list(accumulate(message["name"].split("/"), "{}/{}".format))
            if hidden.isdisjoint(lineage):
                seen.update(lineage)
    return [
        message
        for message in all_
        if (message["name"] in seen if "name" in message else message["type"] in KEPT)
    ]


def caption_of(state: State, date: dt.date) -> str:
    """Return design, unit, pose and date of a scene as HTML."""
    x, y, z = (format_decimals(value, 3) for value in state.position)
    angles = " · ".join(
        f"{name} {format_decimals(value, 2)}°"
        for name, value in zip(("yaw", "pitch", "roll"), state.yaw_pitch_roll, strict=True)
    )
    return (
        f'<b style="font-size:14px">{escape(state.design.name)}</b><br>'
        f"{state.point} at ({x}, {y}, {z}) · {angles} · mode {Frame(state).snapshot.sign_words}<br>"
        f"1 unit = {format_number(state.design.unit_mm, 6)} mm · {date.isoformat()}"
    )


# A software renderer takes many seconds for the largest picture.
PATIENCE_SECONDS = 90.0
# Most pixels of a side; some browsers draw larger pictures only in part.
MOST = 4096
# Widest angle of view, for pictures much higher than wide, in radians.
WIDEST = math.radians(150.0)


def double_size(client: viser.ClientHandle) -> tuple[int, int]:
    """Return twice the width and height of the scene in a browser, within `MOST`, in pixels."""
    sides = (client.camera.image_width, client.camera.image_height)
    factor = min(2.0, MOST / max(sides))
    width, height = (max(round(factor * side), 1) for side in sides)
    return width, height


def view_picture(
    client: viser.ClientHandle, size: tuple[int, int], background: Rgb | None
) -> bytes:
    """Return the view of a browser as PNG without the drag handle, once the browser has drawn it.

    A picture narrower than the view shows more above and below, so that nothing is lost. The
    size is in pixels; without a background the picture is transparent.

    Raises:
        NoAnswerError: The browser is gone, hidden, or cannot draw that much.
    """
    from PIL import Image

    # A node of one browser covers the shared one of the same name.
    cover = client.scene.add_frame(HANDLE_NAME, show_axes=False)
    try:
        picture = Image.fromarray(_draw(client, *size))
    finally:
        cover.remove()
    if background is not None:
        ground = Image.new("RGBA", picture.size, (*background, 255))
        picture = Image.alpha_composite(ground, picture).convert("RGB")
    file = io.BytesIO()
    picture.save(file, "PNG")
    return file.getvalue()


def _draw(client: viser.ClientHandle, width: int, height: int) -> NDArray[np.uint8]:
    """Return the view of a browser, shape (height, width, 4), transparent where it is empty."""
    camera = client.camera
    fov, aspect = float(camera.fov), width / height
    if aspect < camera.aspect:
        fov = 2.0 * math.atan(math.tan(0.5 * fov) * camera.aspect / aspect)
    try:
        pixels = client.get_render(
            height,
            width,
            wxyz=np.array(camera.wxyz),
            position=np.array(camera.position),
            fov=min(fov, WIDEST),
            transport_format="png",
            timeout=PATIENCE_SECONDS,
        )
    except TimeoutError:
        raise NoAnswerError(
            "the browser did not draw the picture in time: keep its tab in sight, or take a "
            "smaller size"
        ) from None
    except RuntimeError:
        pixels = np.empty((0, 0, 4), dtype=np.uint8)
    if pixels.shape != (height, width, 4):
        raise NoAnswerError(
            f"the browser could not draw {width} × {height} pixels; take a smaller size"
        )
    # The labels and the axes are in every picture.
    if not pixels[..., 3].any():
        raise NoAnswerError(
            "the browser draws no scene: switch on graphics acceleration in its settings and load "
            "the page again, or take the figure as SVG"
        )
    return pixels
