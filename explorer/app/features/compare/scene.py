"""The workspaces of the compared designs over one another, each in its colour, to true size.

They are of b4, or of the tool point of each design.
"""

from __future__ import annotations

from collections.abc import Iterator
from functools import lru_cache
from typing import NamedTuple

import numpy as np
import viser
from numpy.typing import NDArray

from explorer.app.features.compare import work
from explorer.app.features.feature import Services
from explorer.app.scene.placing import NO_POINTS, Placed, ScenePart
from explorer.app.scene.shapes import COMPARED, NO_MESH, add_label, add_lines, add_translucent
from explorer.app.scene.surfaces import Drawn
from explorer.app.state.compared import SLOTS
from explorer.app.widgets.assigning import Update
from explorer.measures.box import corners_of
from explorer.numerics.arrays import FloatArray

OPACITY = 0.3
# Each workspace is drawn larger by this share than the one before: designs share limits, and
# of two faces in one plane no renderer knows which is in front.
APART = 3e-4
NAMES = ("live", *SLOTS)


class ComparedScene(ScenePart):
    """The workspaces and outlines of all columns."""

    def __init__(self, services: Services) -> None:
        self._columns = [
            _Column(services.scene, column, services.get(feed))
            for column, feed in enumerate(work.FEEDS)
        ]

    def updates(self, placed: Placed) -> Iterator[Update]:
        """Yield the updates that draw the workspaces of this frame."""
        for column in self._columns:
            yield from column.updates(placed)

    def corners(self, placed: Placed) -> FloatArray:
        """Return the corners of the boxes about the workspaces that are drawn."""
        placements = [column.place(placed) for column in self._columns]
        boxes = [
            corners_of(each[0].extent + each[1])
            for each in placements
            if each is not None and each[0].extent is not None
        ]
        return np.concatenate(boxes) if boxes and _overlays(placed) else NO_POINTS


def _overlays(placed: Placed) -> bool:
    return placed.frame.state.compared.look.overlay


class _Scaled(NamedTuple):
    """A drawing in scene units, without its offset.

    `workspace` and its `extent`, lows and highs, shape (2, 3), are None if it is not drawn; `top`
    is the place of its label.
    """

    outline: NDArray[np.float32]
    workspace: Drawn | None
    extent: FloatArray | None
    top: FloatArray


# Cached, so that updates compare what is drawn by identity.
@lru_cache(2 * len(NAMES))
def _scale(drawing: work.ComparedDrawing, column: int, scale: float) -> _Scaled:
    lines = np.asarray(scale * drawing.outline, dtype=np.float32)
    if drawing.shell is None:
        return _Scaled(lines, None, None, np.zeros(3))
    points = scale * drawing.shell.vertices
    extent = np.array([points.min(axis=0), points.max(axis=0)])
    middle = extent.mean(axis=0)
    enlarged = middle + (1.0 + column * APART) * (points - middle)
    workspace = enlarged.astype(np.float32), np.asarray(drawing.shell.faces, dtype=np.uint32)
    return _Scaled(lines, workspace, extent, enlarged[int(enlarged[:, 2].argmax())])


class _Column:
    """The workspace of one design, its letter, and its outline."""

    def __init__(self, scene: viser.SceneApi, column: int, feed: work.CompareFeed) -> None:
        self._column, self._feed = column, feed
        name, colour = f"/compared/{NAMES[column]}", COMPARED[column]
        self._mesh = add_translucent(
            scene, f"{name}/workspace", NO_MESH, OPACITY, colour=colour, is_flat=True
        )
        self._lines = add_lines(scene, f"{name}/outline", 1, colour, 2.5)
        self._label = add_label(scene, f"{name}/label", NAMES[column], colour=colour, visible=False)

    def place(self, placed: Placed) -> tuple[_Scaled, FloatArray] | None:
        """Return the drawing of the design, and its offset in the scene; None without one."""
        state, drawing = placed.frame.state, work.drawing_in(self._column, self._feed)
        if drawing is None:
            return None
        scale = placed.scale * work.unit_ratio(drawing.request.design, state.design)
        return _scale(drawing, self._column, scale), scale * drawing.offset(state.view.at)

    def updates(self, placed: Placed) -> Iterator[Update]:
        """Yield the updates that draw the design in this frame."""
        compared, column, placement = placed.frame.state.compared, self._column, self.place(placed)
        workspace = placement[0].workspace if placement and _overlays(placed) else None
        for handle in (self._mesh, self._label):
            yield handle, "visible", workspace is not None
        # The live design has no outline, since its mechanism is drawn.
        outlined = compared.look.outlines and column != work.LIVE and placement is not None
        yield self._lines, "visible", outlined
        if placement is None:
            return
        scaled, offset = placement
        if workspace is not None:
            yield self._mesh, "position", tuple(offset.tolist())
            yield self._mesh, "vertices", workspace[0]
            yield self._mesh, "faces", workspace[1]
            design = None if column == work.LIVE else compared.pinned[column - 1]
            title = f"{NAMES[column]} {design.name}" if design else NAMES[column]
            yield self._label, "text", title
            yield self._label, "position", tuple((scaled.top + offset).tolist())
        if outlined:
            yield self._lines, "points", scaled.outline
