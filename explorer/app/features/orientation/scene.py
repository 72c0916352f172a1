"""The greatest tilts at nodes, and the workspaces over a range of tilts."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from explorer.app.features.feature import Services
from explorer.app.features.orientation.feeds import RangeFeed, TiltsFeed
from explorer.app.features.orientation.scale import colours_of, most_of
from explorer.app.features.orientation.tasks import RangeDrawing, TiltsDrawing
from explorer.app.scene.part import NO_POINTS, ScenePart
from explorer.app.scene.placing import Placed
from explorer.app.scene.shapes import NO_MESH, add_translucent
from explorer.app.widgets.assigning import Update
from explorer.app.widgets.colours import Rgb
from explorer.measures.size import corners_of
from explorer.numerics.arrays import FloatArray
from explorer.workspace.solids.solid import Solid

COLOURS: dict[str, Rgb] = {"reachable": (96, 140, 196), "dexterous": (30, 150, 135)}
OPACITY = 0.22
# Size of a point over the distance of nodes.
POINT_SHARE = 0.12


class OrientationScene(ScenePart):
    """Points in the colours of their tilts, and the solid of a range."""

    def __init__(self, services: Services) -> None:
        scene = services.scene
        self._tilts, self._ranges = services.get(TiltsFeed), services.get(RangeFeed)
        self._points = scene.add_point_cloud(
            "/orientation/tilts",
            np.zeros((1, 3), dtype=np.float32),
            np.zeros((1, 3), dtype=np.uint8),
            point_size=0.1,
            point_shape="circle",
            visible=False,
        )
        self._solid = add_translucent(scene, "/orientation/range", NO_MESH, OPACITY)
        # What was scaled last, so that updates compare it by identity.
        self._drawn: tuple[TiltsDrawing | None, float] = None, 0.0
        self._cloud = np.zeros((0, 3), dtype=np.float32), np.zeros((0, 3), dtype=np.uint8)
        self._ranged: tuple[RangeDrawing | None, str, float] = None, "", 0.0
        self._mesh = np.zeros((0, 3), dtype=np.float32), np.zeros((0, 3), dtype=np.uint32)

    def updates(self, placed: Placed) -> Iterator[Update]:
        """Yield the updates that draw tilts and range of a frame."""
        view, scale = placed.frame.state.view.orientation, placed.scale
        drawing = self._tilts.drawing if view.tilts else None
        if self._drawn[0] is not drawing or self._drawn[1] != scale:
            self._drawn = drawing, scale
            if drawing is not None:
                positions = np.asarray(scale * drawing.positions, dtype=np.float32)
                self._cloud = positions, colours_of(drawing.tilts, most_of(drawing))
        is_shown = drawing is not None and len(self._cloud[0]) > 0
        yield self._points, "visible", is_shown
        if drawing is not None and is_shown:
            yield self._points, "points", self._cloud[0]
            yield self._points, "colors", self._cloud[1]
            yield self._points, "point_size", POINT_SHARE * scale * drawing.step
        solid = self._solid_of(placed)
        ranged = self._ranges.drawing
        if self._ranged != (ranged, view.over, scale):
            self._ranged = ranged, view.over, scale
            if solid is not None:
                vertices = np.asarray(scale * solid.vertices, dtype=np.float32)
                self._mesh = vertices, np.asarray(solid.faces, dtype=np.uint32)
        yield self._solid, "visible", solid is not None
        if solid is not None:
            yield self._solid, "color", COLOURS[view.over]
            yield self._solid, "vertices", self._mesh[0]
            yield self._solid, "faces", self._mesh[1]

    def corners(self, placed: Placed) -> FloatArray:
        """Return the corners of the box about the solid of the range."""
        solid = self._solid_of(placed)
        if solid is None:
            return NO_POINTS
        ends = solid.vertices.min(axis=0), solid.vertices.max(axis=0)
        return corners_of(placed.scale * np.array(ends))

    def _solid_of(self, placed: Placed) -> Solid | None:
        """Return the solid that is drawn, or None."""
        drawing, over = self._ranges.drawing, placed.frame.state.view.orientation.over
        if drawing is None or over == "none":
            return None
        solid = drawing.reachable if over == "reachable" else drawing.dexterous
        return None if solid is None or solid.is_empty else solid
