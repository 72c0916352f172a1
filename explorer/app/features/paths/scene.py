"""The line of b4 along the present path, and the singular poses on it."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from explorer.app.features.feature import Services
from explorer.app.scene.part import ScenePart
from explorer.app.scene.placing import Placed
from explorer.app.scene.shapes import Balls, add_lines
from explorer.app.widgets.assigning import Update
from explorer.app.widgets.colours import FAR, SINGULAR

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
        journey = placed.frame.state.journey
        yield self._line, "visible", journey is not None
        crossings = () if journey is None else journey.margins.crossings[:MOST_CROSSINGS]
        yield from self._balls.show(bool(crossings))
        if journey is None:
            return
        points = placed.scale * journey.trajectory.position
        segments = np.stack([points[:-1], points[1:]], axis=1)
        yield self._line, "points", segments.astype(np.float32)
        if crossings:
            centres, radii = np.zeros((MOST_CROSSINGS, 3)), np.full(MOST_CROSSINGS, 1e-6)
            count = len(crossings)
            centres[:count] = [crossing.pose.position for crossing in crossings]
            radii[:count] = RADIUS
            yield from self._balls.at(placed.scale * centres, radii)
