"""The visible parts of the mechanism."""

from __future__ import annotations

from explorer.app.features.feature import Feature, StateCommand, Tab
from explorer.app.features.view.panel import ViewPanel
from explorer.app.state.action import Action
from explorer.app.state.actions import Set
from explorer.app.state.state import State
from explorer.app.widgets.commands import Key, shift


def _toggle_tetrahedra(state: State) -> Action:
    on = not all(state.view.tetrahedra)
    return Set("view.tetrahedra", (on, on, on), "All tetrahedra", "on" if on else "off")


VIEW = Feature(
    "view",
    tabs=(Tab("main", "View", ViewPanel),),
    commands=(
        StateCommand(
            "View › All tetrahedra",
            "Show or hide the three tetrahedra that are flat where the mechanism is singular.",
            _toggle_tetrahedra,
        ),
    ),
    keys={
        "View › Flags": (shift("F"),),
        "View › Bodies": (Key("B"),),
        "View › Legs": (shift("B"),),
        "View › Labels": (Key("L"),),
        "View › Grid": (Key("G"),),
        "View › Drag handle": (shift("H"),),
        "View › All tetrahedra": (Key("T"),),
        "View › 6-4 twin": (shift("T"),),
        "View › Closest pair": (shift("C"),),
    },
)
