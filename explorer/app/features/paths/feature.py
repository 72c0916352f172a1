"""Paths between two poses: straight, or planned without a singularity."""

from __future__ import annotations

import viser

from explorer.app.features.feature import Feature, InBar, StateCommand, Tab
from explorer.app.features.paths.actions import Play
from explorer.app.features.paths.panel import PathsPanel
from explorer.app.features.paths.runner import PathRunner
from explorer.app.features.paths.scene import PathScene
from explorer.app.state.frame import Frame
from explorer.app.widgets.buttons import press_button, running
from explorer.app.widgets.commands import Key
from explorer.numerics.number_text import format_decimals, format_number


def path_chip(frame: Frame) -> str:
    """Return what is done about a path and the button that ends it, as HTML; "" for nothing."""
    state = frame.state
    if state.paths.is_planning:
        cancel = press_button("paths.cancel", "", "Cancel", class_name="ex-button")
        words = f"{format_number(state.paths.seconds)} s at most"
        return running("Paths", "Planning a path", words, None, cancel)
    journey = state.journey
    if journey is None or not journey.is_playing:
        return ""
    pause = press_button("paths.play", "off", "Pause", class_name="ex-button")
    share = journey.at / journey.trajectory.duration
    return running("Paths", "Playing", f"{format_decimals(journey.at, 1)} s", share, pause)


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
