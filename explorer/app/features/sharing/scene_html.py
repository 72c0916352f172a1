"""The scene as one HTML file that anyone can open, turn and zoom, without the explorer.

The file holds viser's page and the scene as it is drawn, and nothing else: what is hidden, the
panels and the drag handle are left out, and a policy of its own keeps it from fetching
anything.
"""

from __future__ import annotations

import datetime as dt
from collections.abc import Iterable
from dataclasses import dataclass
from html import escape

import viser

from explorer.app.browser.viser_gaps import SceneMessage, scene_as_html
from explorer.app.state.frame import Frame
from explorer.app.state.state import State
from explorer.app.widgets.markup import signed
from explorer.numerics.arrays import FloatArray

# Of what has no place in the tree of the scene, only this goes into the file.
KEPT = (
    "BackgroundImageMessage",
    "EnableLightsMessage",
    "EnvironmentMapMessage",
    "FogMessage",
    "ThemeConfigurationMessage",
)
# It would move nothing.
HANDLE = "TransformControlsMessage"
VISIBILITY = "SetSceneNodeVisibilityMessage"
POLICY = (
    "default-src 'none'; script-src 'unsafe-inline' 'unsafe-eval' blob: data:; "
    "worker-src blob: data:; style-src 'unsafe-inline'; img-src blob: data:; "
    "font-src data:; connect-src blob: data:; base-uri 'none'; form-action 'none'"
)
CAPTION_STYLE = (
    "position:fixed;left:16px;bottom:14px;z-index:5;pointer-events:none;"
    "font:12.5px/1.45 system-ui,sans-serif;color:var(--mantine-color-dimmed)"
)


@dataclass(frozen=True)
class Eye:
    """Where the camera stands when the file is opened, in scene units.

    Attributes:
        position: Of the eye, shape (3,).
        look_at: What it looks at, shape (3,).
        fov: Vertical angle of view, in radians.
    """

    position: FloatArray
    look_at: FloatArray
    fov: float

    @staticmethod
    def of(client: viser.ClientHandle) -> Eye:
        """Return that of a browser."""
        camera = client.camera
        return Eye(camera.position, camera.look_at, float(camera.fov))

    def messages(self) -> list[SceneMessage]:
        """Return what puts a camera there, now and when its view is reset."""
        return [
            {"type": f"SetCamera{what}Message", field: value, "initial": True}
            for what, field, value in (
                ("Position", "position", _triple(self.position)),
                ("LookAt", "look_at", _triple(self.look_at)),
                ("UpDirection", "position", (0.0, 0.0, 1.0)),
                ("Fov", "fov", self.fov),
            )
        ]


def scene_html(server: viser.ViserServer, state: State, eye: Eye, *, date: dt.date) -> bytes:
    """Return the scene of a server as one HTML file, in the theme of its page.

    Args:
        server: Whose scene it is.
        state: That is drawn.
        eye: Where the camera stands when it is opened.
        date: For the caption.
    """
    page = scene_as_html(server, lambda all_: [*shown(all_), *eye.messages()])
    title = f"{state.design.name} – flagged 4-4 manipulator"
    head, title_of_viser, rest = page.partition("<title>Viser</title>")
    body, end, after = rest.rpartition("</body>")
    if not (title_of_viser and end):
        raise RuntimeError(f"the page of viser {viser.__version__} has no title or no end")
    policy = f'<meta http-equiv="Content-Security-Policy" content="{POLICY}">'
    head = head.replace("<head>", f"<head>{policy}", 1)
    caption = f'<div id="caption" style="{CAPTION_STYLE}">{caption_of(state, date)}</div>'
    return f"{head}<title>{escape(title)}</title>{body}{caption}{end}{after}".encode()


def shown(messages: Iterable[SceneMessage]) -> list[SceneMessage]:
    """Return of all that makes a scene what is seen, without the handle."""
    all_ = list(messages)
    hidden = {m["name"] for m in all_ if m["type"] == VISIBILITY and not m["visible"]}
    hidden |= {m["name"] for m in all_ if m["type"] == HANDLE}
    seen: set[str] = set()
    for message in all_:
        if "props" in message and not _is_scaffold(message):
            lineage = _lineage(message["name"])
            if hidden.isdisjoint(lineage):
                seen.update(lineage)
    return [
        message
        for message in all_
        if (message["name"] in seen if "name" in message else message["type"] in KEPT)
    ]


def caption_of(state: State, date: dt.date) -> str:
    """Return as HTML what the scene shows: design, unit, pose, date."""
    x, y, z = (signed(value) for value in state.pose.position)
    angles = " · ".join(
        f"{name} {signed(value, 2)}°"
        for name, value in zip(("yaw", "pitch", "roll"), state.yaw_pitch_roll, strict=True)
    )
    return (
        f'<b style="font-size:14px">{escape(state.design.name)}</b><br>'
        f"b4 at ({x}, {y}, {z}) · {angles} · mode {Frame(state).snapshot.sign_words}<br>"
        f"1 unit = {state.design.unit_mm:.6g} mm · {date.isoformat()}"
    )


def _is_scaffold(message: SceneMessage) -> bool:
    """Whether this makes a part that is not seen itself, but has others in it."""
    return message["type"] == "FrameMessage" and not message["props"]["show_axes"]


def _lineage(name: str) -> list[str]:
    """Return the names of a part of the scene and of all that it belongs to."""
    parts = name.split("/")
    return ["/".join(parts[: count + 1]) for count in range(len(parts))]


def _triple(values: FloatArray) -> tuple[float, float, float]:
    x, y, z = (float(value) for value in values)
    return (x, y, z)
