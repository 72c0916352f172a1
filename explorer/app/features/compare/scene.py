"""The workspaces of the compared designs over one another, each in its colour, to true size.

They are of b4, or of the tool point of each design.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import viser
from numpy.typing import NDArray

from explorer.app.features.compare.drawing import ComparedDrawing
from explorer.app.features.compare.feed import COLUMNS, LIVE, CompareFeed, unit_ratio
from explorer.app.features.feature import Services
from explorer.app.scene.creases import Drawn
from explorer.app.scene.labels import add_label
from explorer.app.scene.part import NO_POINTS, ScenePart
from explorer.app.scene.placing import Placed
from explorer.app.scene.shapes import NO_MESH, add_lines, add_translucent
from explorer.app.state.compared import SLOTS
from explorer.app.widgets.assigning import Update
from explorer.app.widgets.colours import COMPARED
from explorer.measures.size import corners_of
from explorer.mechanism.design import Design
from explorer.numerics.arrays import FloatArray

OPACITY = 0.3
# Each workspace is drawn larger by this share than the one before: designs share limits, and
# of two faces in one plane no renderer knows which is in front.
APART = 3e-4
NAMES = ("live", *SLOTS)


class ComparedScene(ScenePart):
    """The workspaces and outlines of all columns."""

    def __init__(self, services: Services) -> None:
        scene = services.scene
        self._feed = services.get(CompareFeed)
        self._columns = [_Column(scene, column) for column in range(COLUMNS)]

    def updates(self, placed: Placed) -> Iterator[Update]:
        """Yield the updates that draw the workspaces of this frame."""
        for index, column in enumerate(self._columns):
            yield from column.updates(placed, self._feed.drawing(index))

    def corners(self, placed: Placed) -> FloatArray:
        """Return the corners of the boxes about the workspaces that are drawn."""
        extents = self._feed.extents(placed.frame.state)
        boxes = [corners_of(placed.scale * extent) for extent in extents]
        return np.concatenate(boxes) if boxes else NO_POINTS


class _Column:
    """The workspace of one design, its letter, and its outline."""

    def __init__(self, scene: viser.SceneApi, column: int) -> None:
        self._column = column
        name, colour = f"/compared/{NAMES[column]}", COMPARED[column]
        self._mesh = add_translucent(
            scene, f"{name}/workspace", NO_MESH, OPACITY, colour=colour, is_flat=True
        )
        self._lines = add_lines(scene, f"{name}/outline", 1, colour, 2.5)
        self._label = add_label(scene, f"{name}/label", NAMES[column], colour=colour, visible=False)
        self._drawn: tuple[ComparedDrawing, float] | None = None
        self._workspace: Drawn | None = None
        self._outline: NDArray[np.float32] = np.zeros((1, 2, 3), dtype=np.float32)
        self._top: FloatArray = np.zeros(3)

    def updates(self, placed: Placed, drawing: ComparedDrawing | None) -> Iterator[Update]:
        """Yield the updates that draw the design in this frame."""
        state = placed.frame.state
        compared, column = state.compared, self._column
        design = state.design if column == LIVE else compared.pinned[column - 1]
        look = compared.look
        offset = np.zeros(3)
        if drawing is not None and design is not None:
            scale = placed.scale * unit_ratio(design, state.design)
            self._scale(drawing, scale)
            offset = scale * drawing.offset(state.view.at)
        # Nothing is overlaid where there is nothing to compare.
        shown = look.overlay and drawing is not None and self._workspace is not None
        yield self._mesh, "visible", shown
        yield self._label, "visible", shown
        if shown and self._workspace is not None:
            yield self._mesh, "position", tuple(offset.tolist())
            yield self._mesh, "vertices", self._workspace[0]
            yield self._mesh, "faces", self._workspace[1]
            yield (
                self._label,
                "text",
                NAMES[column] if column == LIVE else _title(column, design),
            )
            yield self._label, "position", tuple((self._top + offset).tolist())
        # The live design has no outline, since its mechanism is drawn.
        outlined = look.outlines and column != LIVE and drawing is not None
        yield self._lines, "visible", outlined
        if outlined:
            yield self._lines, "points", self._outline

    def _scale(self, drawing: ComparedDrawing, scale: float) -> None:
        """Scale a new drawing to scene units, once, so that updates compare it by identity."""
        if self._drawn is not None and self._drawn[0] is drawing and self._drawn[1] == scale:
            return
        self._drawn = drawing, scale
        self._outline = _scaled(drawing.outline, scale)
        self._workspace = None
        if drawing.shell is not None:
            vertices = _scaled(_enlarged(drawing.shell.vertices, self._column * APART), scale)
            self._workspace = vertices, np.asarray(drawing.shell.faces, dtype=np.uint32)
            self._top = vertices[int(vertices[:, 2].argmax())].astype(np.float64)


def _title(column: int, design: Design | None) -> str:
    name = "" if design is None else f" {design.name}"
    return f"{NAMES[column]}{name}"


def _enlarged(points: FloatArray, share: float) -> FloatArray:
    """Return points (n, 3) enlarged by a share about the middle of their box."""
    middle = 0.5 * (points.min(axis=0) + points.max(axis=0))
    return middle + (1.0 + share) * (points - middle)


def _scaled(points: FloatArray, scale: float) -> NDArray[np.float32]:
    return np.asarray(points * scale, dtype=np.float32)
