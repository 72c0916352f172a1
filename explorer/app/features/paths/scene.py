"""The way of b4 along the path at hand, and where it is singular on it."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import viser

from explorer.app.scene.placing import Placed
from explorer.app.scene.shapes import Balls
from explorer.app.widgets.assigning import Update
from explorer.app.widgets.colours import FAR, SINGULAR

# Crossings beyond these are not drawn.
MOST = 24
RADIUS = 0.2


class PathScene:
    """A line, and a ball at each crossing."""

    def __init__(self, scene: viser.SceneApi) -> None:
        self._line = scene.add_line_segments(
            "/path/line",
            np.zeros((1, 2, 3)),
            FAR,
            thickness=2.5,
            thickness_units="screen",
            visible=False,
        )
        self._balls = Balls(scene, "/path/crossings", [SINGULAR] * MOST)

    def updates(self, placed: Placed) -> Iterator[Update]:
        """Yield what draws the path of this frame."""
        journey = placed.frame.state.journey
        yield self._line, "visible", journey is not None
        crossings = () if journey is None else journey.margins.crossings[:MOST]
        yield from self._balls.shown(bool(crossings))
        if journey is None:
            return
        places = placed.scale * journey.trajectory.position
        segments = np.stack([places[:-1], places[1:]], axis=1)
        yield self._line, "points", segments.astype(np.float32)
        if crossings:
            centres, radii = np.zeros((MOST, 3)), np.full(MOST, 1e-6)
            count = len(crossings)
            centres[:count] = [each.pose.position for each in crossings]
            radii[:count] = RADIUS
            yield from self._balls.at(placed.scale * centres, radii)
