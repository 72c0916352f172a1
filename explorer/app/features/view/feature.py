"""The form and the visible parts of the mechanism, the ground, and the views of the camera."""

from __future__ import annotations

import viser

from explorer.app.features.feature import Feature, InBar, Services, StateCommand, Tab
from explorer.app.features.view.ground import Ground
from explorer.app.features.view.panel import ViewPanel
from explorer.app.scene.camera import VIEWS, ViewName
from explorer.app.state.action import Action
from explorer.app.state.actions import Set
from explorer.app.state.frame import Frame
from explorer.app.state.state import State
from explorer.app.widgets.buttons import press_button
from explorer.app.widgets.commands import Key, shift, with_keys

PRESS = "view.camera"
FIT = "Fit"
LABELS: dict[str, ViewName] = {name.capitalize(): name for name in VIEWS}
CAMERA_HINTS = {
    **{label: f"Look at the mechanism from the {label.lower()}." for label in LABELS},
    "Isometric": "Look at the mechanism from a corner.",
    FIT: "Show the whole mechanism from where you look.",
}
VIEW_KEYS = {
    "Isometric": (Key("0"),),
    "Front": (Key("1"),),
    "Side": (Key("3"),),
    "Top": (Key("7"),),
    FIT: (Key("F"),),
}


class CameraButtons:
    """A button for each of the views that CAD programs offer, and one that fits all."""

    def __init__(self, services: Services) -> None:
        self._cameras = services.cameras
        services.buttons.on(PRESS, self._point, values=CAMERA_HINTS)
        self._markup = ""
        for label, hint in CAMERA_HINTS.items():
            keys = VIEW_KEYS[label]
            services.buttons.offer(f"View › {label}", hint, PRESS, label, keys=keys)
            told = with_keys(hint, keys)
            self._markup += press_button(PRESS, label, label, hint=told, class_name="ex-tool")

    def __call__(self, _: Frame) -> str:
        """Return the buttons as HTML."""
        return f'<span class="ex-views">{self._markup}</span>'

    def _point(self, label: str, client: viser.ClientHandle) -> None:
        if label == FIT:
            self._cameras.fit(client)
        else:
            self._cameras.point(client, LABELS[label])


def _toggle_tetrahedra(state: State) -> Action:
    on = not all(state.view.tetrahedra)
    return Set("view.tetrahedra", (on, on, on), "All tetrahedra", "on" if on else "off")


VIEW = Feature(
    "view",
    tabs=(Tab("build", "Show", ViewPanel, viser.Icon.EYE),),
    bar=(InBar("right", CameraButtons),),
    scene=(Ground,),
    commands=(
        StateCommand(
            "Show › All tetrahedra",
            "Show or hide the three tetrahedra that are flat where the mechanism is singular, and "
            "the gaps that are left to such poses.",
            _toggle_tetrahedra,
            keys=(Key("T"),),
        ),
    ),
    keys={
        "Show › Flags": (shift("F"),),
        "Show › Bodies": (Key("B"),),
        "Show › Legs": (shift("B"),),
        "Show › Labels": (Key("L"),),
        "Show › Grid": (Key("G"),),
        "Show › Drag handle": (shift("H"),),
        "Show › Closest pair": (shift("C"),),
    },
)
