"""Paths between two poses: straight, or planned without a singularity."""

from __future__ import annotations

import viser

from explorer.app.features.feature import Feature, InBar, StateCommand, Tab
from explorer.app.features.paths.actions import Play
from explorer.app.features.paths.bar import path_chip
from explorer.app.features.paths.panel import PathsPanel
from explorer.app.features.paths.runner import PathRunner
from explorer.app.features.paths.scene import PathScene
from explorer.app.widgets.commands import Key

PATHS = Feature(
    "paths",
    tabs=(Tab("work", "Paths", PathsPanel, viser.Icon.ROUTE),),
    bar=(InBar("right", lambda _: path_chip),),
    scene=(PathScene,),
    runners=(PathRunner,),
    commands=(
        StateCommand(
            "Paths › Play or pause",
            "Play the present path, or pause it.",
            lambda state: Play(state.journey is None or not state.journey.is_playing),
            lambda state: state.journey is not None,
            (Key("P"),),
        ),
    ),
    keys={"Paths › Go": (Key("J"),)},
)
