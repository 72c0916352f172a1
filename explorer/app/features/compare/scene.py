"""The workspaces of the compared designs over one another, each in its colour, to true size.

They are of b4, or of the tool point of each design.
"""

from __future__ import annotations

from collections.abc import Iterator
from functools import lru_cache, partial
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from explorer.app.features.compare import work
from explorer.app.features.compare.work import LIVE, NAMES, Compared
from explorer.app.features.feature import Services
from explorer.app.scene.placing import NO_POINTS, Placed, ScenePart
from explorer.app.scene.shapes import COMPARED, NO_MESH, add_label, add_lines, add_translucent
from explorer.app.scene.surfaces import Drawn
from explorer.measures.box import corners_of
from explorer.numerics.arrays import FloatArray
from explorer.page.widgets.assigning import Update

OPACITY = 0.3
# Each workspace is drawn larger by this share than the one before: designs share limits, and
# of two faces in one plane no renderer knows which is in front.
APART = 3e-4


class _Scaled(NamedTuple):
    """A drawing in scene units, without its offset.

    `workspace` is None, and has no `corners` (8, 3), if it is not drawn; `top` is the place of its
    label.
    """

    outline: NDArray[np.float32]
    workspace: Drawn | None
    corners: FloatArray
    top: FloatArray


# Cached, so that updates compare what is drawn by identity.
@lru_cache(2 * len(NAMES))
def _scale(drawing: work.ComparedDrawing, column: int, scale: float) -> _Scaled:
    lines = np.asarray(scale * drawing.outline, dtype=np.float32)
    if drawing.shell is None:
        return _Scaled(lines, None, NO_POINTS, np.zeros(3))
    points = scale * drawing.shell.vertices
    extent = np.array([points.min(axis=0), points.max(axis=0)])
    middle = extent.mean(axis=0)
    enlarged = middle + (1.0 + column * APART) * (points - middle)
    workspace = enlarged.astype(np.float32), np.asarray(drawing.shell.faces, dtype=np.uint32)
    return _Scaled(lines, workspace, corners_of(extent), enlarged[int(enlarged[:, 2].argmax())])


class ComparedScene(ScenePart):
    """The workspace of the design in a column, its letter, and its outline."""

    def __init__(self, column: int, services: Services) -> None:
        self._column, self._feed = column, services.get(work.FEEDS[column])
        scene, name, colour = services.scene, f"/compared/{NAMES[column]}", COMPARED[column]
        self._mesh = add_translucent(
            scene, f"{name}/workspace", NO_MESH, OPACITY, colour=colour, is_flat=True
        )
        self._lines = add_lines(scene, f"{name}/outline", 1, colour, 2.5)
        self._label = add_label(scene, f"{name}/label", NAMES[column], colour=colour)

    def updates(self, placed: Placed) -> Iterator[Update]:
        """Yield the updates that draw the design in this frame."""
        compared, placement = Compared.of(placed.frame.state), self._place(placed)
        workspace = placement[0].workspace if placement and compared.look.overlay else None
        for handle in (self._mesh, self._label):
            yield handle, "visible", workspace is not None
        # The live design has no outline, since its mechanism is drawn.
        outlined = compared.look.outlines and self._column != LIVE and placement is not None
        yield self._lines, "visible", outlined
        if placement is None:
            return
        scaled, offset = placement
        if workspace is not None:
            yield self._mesh, "position", tuple(offset.tolist())
            yield self._mesh, "vertices", workspace[0]
            yield self._mesh, "faces", workspace[1]
            pinned = work.design_in(self._column, placed.frame.state)
            name = f" {pinned.name}" if pinned is not None and self._column != LIVE else ""
            yield self._label, "text", NAMES[self._column] + name
            yield self._label, "position", tuple((scaled.top + offset).tolist())
        if outlined:
            yield self._lines, "points", scaled.outline

    def corners(self, placed: Placed) -> FloatArray:
        """Return the corners of the box about the workspace, if it is drawn."""
        placement = self._place(placed)
        if placement is None or not Compared.of(placed.frame.state).look.overlay:
            return NO_POINTS
        return placement[0].corners + placement[1]

    def _place(self, placed: Placed) -> tuple[_Scaled, FloatArray] | None:
        """Return the drawing of the design, and its offset in the scene; None without one."""
        state, drawing = placed.frame.state, work.drawing_in(self._column, self._feed)
        if drawing is None:
            return None
        scale = placed.scale * work.unit_ratio(drawing.request.design, state.design)
        return _scale(drawing, self._column, scale), scale * drawing.offset(state.view.at)


SCENES = tuple(partial(ComparedScene, column) for column in range(len(NAMES)))
"""The parts of the scene by column: the live design, then the pinned ones."""
