"""The buttons over the scene that point the camera."""

from __future__ import annotations

import viser

from explorer.app.features.feature import Services
from explorer.app.scene.camera import VIEWS, ViewName
from explorer.app.state.frame import Frame
from explorer.app.widgets.buttons import press_button
from explorer.app.widgets.commands import Key, with_keys

PRESS = "view.camera"
FIT = "Fit"
LABELS: dict[str, ViewName] = {name.capitalize(): name for name in VIEWS}
HINTS = {
    **{label: f"Look at the mechanism from the {label.lower()}." for label in LABELS},
    "Isometric": "Look at the mechanism from a corner.",
    FIT: "Show the whole mechanism from where you look.",
}
KEYS = {
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
        services.buttons.on(PRESS, self._point, values=HINTS)
        for label, hint in HINTS.items():
            services.buttons.offer(f"View › {label}", hint, PRESS, label, keys=KEYS[label])
        self._markup = "".join(
            press_button(
                PRESS,
                label,
                label,
                hint=with_keys(hint, KEYS[label]),
                class_name="ex-tool",
            )
            for label, hint in HINTS.items()
        )

    def __call__(self, _: Frame) -> str:
        """Return the buttons as HTML."""
        return f'<span class="ex-views">{self._markup}</span>'

    def _point(self, label: str, client: viser.ClientHandle) -> None:
        if label == FIT:
            self._cameras.fit(client)
        else:
            self._cameras.point(client, LABELS[label])
