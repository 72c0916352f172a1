"""The greatest tilts at nodes, and the workspaces over a range of tilts."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from explorer.app.features.feature import Services
from explorer.app.features.orientation.feeds import RangeFeed, TiltsFeed
from explorer.app.features.orientation.scale import colours_of, most_of
from explorer.app.features.orientation.tasks import RangeDrawing, TiltsDrawing
from explorer.app.features.workspace.slice_map import AXES, keeps_above, level_within
from explorer.app.scene.part import NO_POINTS, ScenePart
from explorer.app.scene.placing import Placed
from explorer.app.scene.shapes import NO_MESH, add_translucent
from explorer.app.state.view import WorkspaceView
from explorer.app.widgets.assigning import Update
from explorer.app.widgets.colours import Rgb
from explorer.measures.size import corners_of
from explorer.numerics.arrays import BoolArray, FloatArray

COLOURS: dict[str, Rgb] = {"inclusive": (96, 140, 196), "total": (30, 150, 135)}
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
        self._drawn: tuple[TiltsDrawing | None, tuple[object, ...]] = None, ()
        self._cloud = np.zeros((0, 3), dtype=np.float32), np.zeros((0, 3), dtype=np.uint8)
        self._ranged: tuple[RangeDrawing | None, float] = None, 0.0
        self._mesh = np.zeros((0, 3), dtype=np.float32), np.zeros((0, 3), dtype=np.uint32)

    def updates(self, placed: Placed) -> Iterator[Update]:
        """Yield the updates that draw tilts and range of a frame."""
        view, scale = placed.frame.state.view.orientation, placed.scale
        drawing = self._tilts.drawing if view.tilts else None
        cut = placed.frame.state.view.workspace
        where = scale, cut.cut, cut.level, cut.flipped
        if self._drawn[0] is not drawing or self._drawn[1] != where:
            self._drawn = drawing, where
            if drawing is not None:
                kept = kept_nodes(drawing, cut)
                positions = np.asarray(scale * drawing.positions[kept], dtype=np.float32)
                self._cloud = positions, colours_of(drawing.tilts[kept], most_of(drawing))
        is_shown = drawing is not None and len(self._cloud[0]) > 0
        yield self._points, "visible", is_shown
        if drawing is not None and is_shown:
            yield self._points, "points", self._cloud[0]
            yield self._points, "colors", self._cloud[1]
            yield self._points, "point_size", POINT_SHARE * scale * drawing.step
        solid, ranged = self._solid, self._ranges.drawing
        is_drawn = ranged is not None and not ranged.solid.is_empty and view.over != "none"
        if ranged is not None and self._ranged != (ranged, scale):
            self._ranged = ranged, scale
            vertices = np.asarray(scale * ranged.solid.vertices, dtype=np.float32)
            self._mesh = vertices, np.asarray(ranged.solid.faces, dtype=np.uint32)
        yield solid, "visible", is_drawn
        if ranged is not None and is_drawn:
            yield solid, "color", COLOURS[ranged.request.over]
            yield solid, "vertices", self._mesh[0]
            yield solid, "faces", self._mesh[1]

    def corners(self, placed: Placed) -> FloatArray:
        """Return the corners of the boxes about the nodes and about the solid of the range."""
        tilts, ranged = self._tilts.drawing, self._ranges.drawing
        drawn = [tilts.positions] if tilts is not None else []
        drawn += [ranged.solid.vertices] if ranged is not None else []
        ends = [np.array([p.min(axis=0), p.max(axis=0)]) for p in drawn if len(p)]
        if not ends:
            return NO_POINTS
        return placed.scale * np.concatenate([corners_of(box) for box in ends])


def kept_nodes(drawing: TiltsDrawing, view: WorkspaceView) -> BoolArray:
    """Return which nodes the cut of the workspace keeps, shape (n,)."""
    if view.cut is None or not len(drawing.positions):
        return np.ones(len(drawing.positions), dtype=np.bool_)
    along = drawing.positions[:, AXES.index(view.cut)]
    level = level_within(float(along.min()), float(along.max()), view.level)
    return np.asarray(along >= level if keeps_above(view.cut, view.flipped) else along <= level)
