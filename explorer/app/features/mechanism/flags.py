"""The flags of base and platform, each a point, a line through it and a plane through the line.

Each element has the colour of its incidence: a1 and the platform plane that of δ1, the two lines
that of δ2, b4 and the base plane that of δ3.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import viser

from explorer.app.features.feature import Services
from explorer.app.features.mechanism.legs import guide_span
from explorer.app.scene.part import NO_POINTS, ScenePart
from explorer.app.scene.placing import Placed
from explorer.app.scene.shapes import Patch, cylinder, sphere, turned_to
from explorer.app.widgets.assigning import Update
from explorer.app.widgets.colours import proximity_colour
from explorer.numerics.arrays import FloatArray

POINT_RADIUS = 0.36
LINE_RADIUS = 0.075
PLANE_OPACITY = 0.2
ALONG_X = turned_to(np.array([[1.0, 0.0, 0.0]]))[0]


class Flag:
    """One flag in its own frame: the point at the origin, the line along x."""

    def __init__(self, scene: viser.SceneApi, root: str, deltas: tuple[int, int, int]) -> None:
        # Indices of the margins that colour the point, the line and the plane.
        self._deltas = deltas
        self._point = scene.add_mesh_simple(
            f"{root}/flag/point", *sphere(), scale=POINT_RADIUS, cast_shadow=False
        )
        self._line = scene.add_mesh_simple(
            f"{root}/flag/line", *cylinder(), wxyz=ALONG_X, cast_shadow=False
        )
        self._patch = Patch(scene, f"{root}/flag", opacity=PLANE_OPACITY)

    def updates(self, placed: Placed, corners: FloatArray, size: float) -> Iterator[Update]:
        """Yield the updates that draw the flag; the first two corners (4, 3) are on its line."""
        state = placed.frame.state
        levels = placed.frame.verdict.levels
        point_colour, line_colour, plane_colour = (
            proximity_colour(levels[index]) for index in self._deltas
        )
        low, high = corners[:2, 0].tolist()
        for handle in (self._point, self._line):
            yield handle, "visible", state.view.flags
        yield from self._patch.show(state.view.flags)
        yield self._point, "color", point_colour
        yield self._point, "scale", POINT_RADIUS * size
        yield self._line, "color", line_colour
        yield self._line, "position", (low, 0.0, 0.0)
        yield self._line, "scale", (LINE_RADIUS * size, LINE_RADIUS * size, high - low)
        yield from self._patch.span(corners, plane_colour)


class Flags(ScenePart):
    """The base's flag and the platform's."""

    def __init__(self, services: Services) -> None:
        scene = services.scene
        self._base = Flag(scene, "/base", deltas=(0, 1, 2))
        self._platform = Flag(scene, "/platform", deltas=(2, 1, 0))

    def updates(self, placed: Placed) -> Iterator[Update]:
        """Yield the updates that draw the flags of this frame."""
        yield from self._base.updates(placed, _base_corners(placed), 1.0)
        yield from self._platform.updates(
            placed, _platform_corners(placed), max(0.6, placed.thickness)
        )

    def corners(self, placed: Placed) -> FloatArray:
        """Return the corners of both planes."""
        if not placed.frame.state.view.flags:
            return NO_POINTS
        rotation = placed.frame.snapshot.rotation
        platform = placed.points["b4"] + _platform_corners(placed) @ rotation.T
        return np.concatenate([_base_corners(placed), platform])


def _base_corners(placed: Placed) -> FloatArray:
    low, high = guide_span(placed)
    return _rectangle(low - 1.0, high + 1.0, 1.2 * float(placed.points["a3"][1]))


def _platform_corners(placed: Placed) -> FloatArray:
    local = placed.platform_points
    stations = [float(local[name][0]) for name in ("b1", "b2", "b3", "b4")]
    beyond = 0.16 * placed.reach
    side = float(local["b1"][1])
    edge = side + float(np.copysign(0.5 * beyond, side))
    return _rectangle(min(stations) - beyond, max(stations) + beyond, edge)


def _rectangle(low: float, high: float, y: float) -> FloatArray:
    """Return the corners of a rectangle between the x-axis and a line at y, shape (4, 3)."""
    return np.array([[low, 0, 0], [high, 0, 0], [high, y, 0], [low, y, 0]], float)
