"""The form and the visible parts of the mechanism, and the views of the camera."""

from __future__ import annotations

import viser

from explorer.app.features.feature import Feature, InBar, StateCommand, Tab
from explorer.app.features.view.camera_buttons import CameraButtons
from explorer.app.features.view.panel import ViewPanel
from explorer.app.features.view.scene import GroundScale
from explorer.app.state.action import Action
from explorer.app.state.actions import Set
from explorer.app.state.state import State
from explorer.app.widgets.commands import Key, shift


def _toggle_tetrahedra(state: State) -> Action:
    on = not all(state.view.tetrahedra)
    return Set("view.tetrahedra", (on, on, on), "All tetrahedra", "on" if on else "off")


VIEW = Feature(
    "view",
    tabs=(Tab("build", "Show", ViewPanel, viser.Icon.EYE),),
    bar=(InBar("right", CameraButtons),),
    scene=(GroundScale,),
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
