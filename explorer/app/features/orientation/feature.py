"""The orientations of a position and workspaces over orientations: declaration and scene."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import viser

from explorer.app.features.feature import Feature, Services, Tab
from explorer.app.features.orientation.maps import colours_of, most_of
from explorer.app.features.orientation.panel import OrientationPanel
from explorer.app.features.orientation.work import (
    POSITION_FEED,
    RANGE_FEED,
    TILTS_FEED,
    TiltsDrawing,
    orientations_at,
    range_solid,
    tilts_at_nodes,
)
from explorer.app.features.workspace.slice_map import AXES, keeps_above, level_within
from explorer.app.scene.placing import NO_POINTS, Placed, ScenePart
from explorer.app.scene.shapes import NO_MESH, add_translucent
from explorer.app.state.view import WorkspaceView
from explorer.app.widgets.assigning import Update
from explorer.measures.size import corners_of
from explorer.numerics.arrays import BoolArray, FloatArray
from explorer.singularity.colours import Rgb

COLOURS: dict[str, Rgb] = {"inclusive": (96, 140, 196), "total": (30, 150, 135)}
OPACITY = 0.22
# Size of a point over the distance of nodes.
POINT_SHARE = 0.12


class OrientationScene(ScenePart):
    """Points in the colours of their tilts, and the solid of a range."""

    def __init__(self, services: Services) -> None:
        scene = services.scene
        self._tilts, self._ranges = services.get(TILTS_FEED), services.get(RANGE_FEED)
        self._points = scene.add_point_cloud(
            "/orientation/tilts",
            np.zeros((1, 3), dtype=np.float32),
            np.zeros((1, 3), dtype=np.uint8),
            point_size=0.1,
            point_shape="circle",
            visible=False,
        )
        self._solid = add_translucent(scene, "/orientation/range", NO_MESH, OPACITY)

    def updates(self, placed: Placed) -> Iterator[Update]:
        """Yield the updates that draw tilts and range of a frame."""
        view, scale = placed.frame.state.view.orientation, placed.scale
        tilts = self._tilts.drawing if view.tilts else None
        visible = (
            None if tilts is None else nodes_beside_cut(tilts, placed.frame.state.view.workspace)
        )
        has_points = visible is not None and bool(visible.any())
        yield self._points, "visible", has_points
        if tilts is not None and visible is not None and has_points:
            yield self._points, "points", (scale * tilts.positions[visible]).astype(np.float32)
            yield self._points, "colors", colours_of(tilts.tilts[visible], most_of(tilts))
            yield self._points, "point_size", POINT_SHARE * scale * tilts.step
        over = self._ranges.drawing if view.over != "none" else None
        has_solid = over is not None and not over.solid.is_empty
        yield self._solid, "visible", has_solid
        if over is not None and has_solid:
            yield self._solid, "color", COLOURS[over.request.over]
            yield self._solid, "vertices", (scale * over.solid.vertices).astype(np.float32)
            yield self._solid, "faces", over.solid.faces.astype(np.uint32)

    def corners(self, placed: Placed) -> FloatArray:
        """Return the corners of the boxes about the nodes and about the solid of the range."""
        tilts, ranged = self._tilts.drawing, self._ranges.drawing
        drawn = [tilts.positions] if tilts is not None else []
        drawn += [ranged.solid.vertices] if ranged is not None else []
        ends = [np.array([p.min(axis=0), p.max(axis=0)]) for p in drawn if len(p)]
        if not ends:
            return NO_POINTS
        return placed.scale * np.concatenate([corners_of(box) for box in ends])


def nodes_beside_cut(drawing: TiltsDrawing, view: WorkspaceView) -> BoolArray:
    """Return which nodes the cut of the workspace keeps, shape (n,)."""
    if view.cut is None or not len(drawing.positions):
        return np.ones(len(drawing.positions), dtype=np.bool_)
    along = drawing.positions[:, AXES.index(view.cut)]
    level = level_within(float(along.min()), float(along.max()), view.level)
    return np.asarray(along >= level if keeps_above(view.cut, view.flipped) else along <= level)


ORIENTATION = Feature(
    "orientation",
    tabs=(Tab("analyse", "Tilt", OrientationPanel, viser.Icon.COMPASS),),
    scene=(OrientationScene,),
    later_feeds=(POSITION_FEED, TILTS_FEED, RANGE_FEED),
    tasks=(orientations_at, tilts_at_nodes, range_solid),
    lists=("Solid over tilts",),
)
