"""The workspaces of the compared designs over one another, each in its colour, to true size.

They are of b4, or of the tool point of each design.
"""

from __future__ import annotations

from functools import lru_cache, partial
from typing import NamedTuple

import numpy as np

from explorer.app.features.compare import work
from explorer.app.features.compare.state import Compared
from explorer.app.features.compare.work import LIVE, NAMES
from explorer.app.features.feature import Services, show
from explorer.app.scene.placing import NO_POINTS, Placed, ScenePart
from explorer.app.scene.shapes import COMPARED, NO_MESH, add_label, add_translucent, write_label
from explorer.app.scene.surfaces import Drawn
from explorer.measures.box import corners_of
from explorer.numerics.arrays import FloatArray
from explorer.page.widgets.assigning import Updates

OPACITY = 0.3
# Each workspace is drawn larger by this share than the one before: designs share limits, and
# of two faces in one plane no renderer knows which is in front.
APART = 3e-4


class _Scaled(NamedTuple):
    """A workspace in scene units without its offset, its corners (8, 3), and its label's place."""

    workspace: Drawn
    corners: FloatArray
    top: FloatArray


# Cached, so that updates compare what is drawn by identity.
@lru_cache(2 * len(NAMES))
def _scale(drawing: work.ComparedDrawing, column: int, scale: float) -> _Scaled | None:
    shell = drawing.shell
    if shell is None:
        return None
    points = scale * shell.vertices
    extent = np.array([points.min(axis=0), points.max(axis=0)])
    middle = extent.mean(axis=0)
    enlarged = middle + (1.0 + column * APART) * (points - middle)
    workspace = enlarged.astype(np.float32), np.asarray(shell.faces, dtype=np.uint32)
    return _Scaled(workspace, corners_of(extent), enlarged[int(enlarged[:, 2].argmax())])


class ComparedScene(ScenePart):
    """The workspace of the design in a column, and its letter."""

    def __init__(self, column: int, services: Services) -> None:
        self._column, self._feed = column, services.get(work.FEEDS[column])
        scene, name, colour = services.scene, f"/compared/{NAMES[column]}", COMPARED[column]
        self._mesh = add_translucent(
            scene, f"{name}/workspace", NO_MESH, OPACITY, colour=colour, is_flat=True
        )
        self._label = add_label(scene, f"{name}/label", NAMES[column], colour=colour)

    def updates(self, placed: Placed) -> Updates:
        """Yield the updates that draw the design in this frame."""
        placement = self._place(placed)
        yield from show(placement is not None, self._mesh, self._label)
        if placement is None:
            return
        scaled, offset = placement
        vertices, faces = scaled.workspace
        yield self._mesh, "position", tuple(offset.tolist())
        yield self._mesh, "vertices", vertices
        yield self._mesh, "faces", faces
        pinned = work.design_in(self._column, placed.frame.state)
        name = f" {pinned.name}" if pinned is not None and self._column != LIVE else ""
        yield from write_label(self._label, NAMES[self._column] + name, scaled.top + offset)

    def corners(self, placed: Placed) -> FloatArray:
        """Return the corners of the box about the workspace, if it is drawn."""
        placement = self._place(placed)
        return NO_POINTS if placement is None else placement[0].corners + placement[1]

    def _place(self, placed: Placed) -> tuple[_Scaled, FloatArray] | None:
        """Return the workspace of the design, and its offset in the scene; None for none."""
        state, drawing = placed.frame.state, work.drawing_in(self._column, self._feed)
        if not Compared.of(state).look.overlay or drawing is None:
            return None
        scale = placed.scale * work.unit_ratio(drawing.request.design, state.design)
        scaled = _scale(drawing, self._column, scale)
        return None if scaled is None else (scaled, scale * drawing.offset(state.view.at))


SCENES = tuple(partial(ComparedScene, column) for column in range(len(NAMES)))
"""The parts of the scene by column: the live design, then the pinned ones."""
