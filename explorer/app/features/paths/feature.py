"""Paths between two poses: their declaration, what runs in the bar, and the line in the scene."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import viser

from explorer.app.features.feature import Feature, InBar, Services, StateCommand, Tab
from explorer.app.features.paths.actions import Play
from explorer.app.features.paths.panel import PathsPanel
from explorer.app.features.paths.runner import PathRunner
from explorer.app.scene.placing import Placed, ScenePart
from explorer.app.scene.shapes import Balls, add_lines
from explorer.app.state.frame import Frame
from explorer.app.widgets.assigning import Update
from explorer.app.widgets.buttons import press_button, running
from explorer.app.widgets.commands import Key
from explorer.mechanism.configuration import position_of
from explorer.mechanism.pose import rotation_from_quaternion
from explorer.numerics.number_text import format_decimals, format_number
from explorer.singularity.colours import FAR, SINGULAR

# Number of crossings that are drawn at most.
MOST_CROSSINGS = 24
RADIUS = 0.2


class PathScene(ScenePart):
    """A line, and a ball at each crossing of a singularity."""

    def __init__(self, services: Services) -> None:
        scene = services.scene
        self._line = add_lines(scene, "/path/line", 1, FAR, 2.5)
        self._balls = Balls(scene, "/path/crossings", [SINGULAR] * MOST_CROSSINGS)

    def updates(self, placed: Placed) -> Iterator[Update]:
        """Yield the updates that draw the path of this frame."""
        state, journey = placed.frame.state, placed.frame.state.journey
        yield self._line, "visible", journey is not None
        crossings = () if journey is None else journey.margins.crossings[:MOST_CROSSINGS]
        yield from self._balls.show(bool(crossings))
        if journey is None:
            return
        timed = journey.trajectory
        track = timed.position + state.offset(rotation_from_quaternion(timed.quaternion))
        points = placed.scale * track
        segments = np.stack([points[:-1], points[1:]], axis=1)
        yield self._line, "points", segments.astype(np.float32)
        if crossings:
            centres, radii = np.zeros((MOST_CROSSINGS, 3)), np.full(MOST_CROSSINGS, 1e-6)
            count = len(crossings)
            at = state.view.at
            centres[:count] = [position_of(state.design, each.pose, at) for each in crossings]
            radii[:count] = RADIUS
            yield from self._balls.at(placed.scale * centres, radii)


def path_chip(frame: Frame) -> str:
    """Return the path that is planned or played and a button that ends it, as HTML; else ""."""
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
