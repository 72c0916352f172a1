"""The line of b4 or of the tool point along the present path, and the singular poses on it."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from explorer.app.features.feature import Services
from explorer.app.scene.part import ScenePart
from explorer.app.scene.placing import Placed
from explorer.app.scene.shapes import Balls, add_lines
from explorer.app.widgets.assigning import Update
from explorer.app.widgets.colours import FAR, SINGULAR
from explorer.mechanism.pose import rotation_from_quaternion
from explorer.mechanism.tool_point import position_of

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
