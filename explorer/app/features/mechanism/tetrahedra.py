"""The three tetrahedra of the trilaterations: a pose is singular where one of them is flat.

The edges of each have the colour of its margin and dashes of their own. Faces show which of the
incidences is near: they are filled for that one alone, in the colour of its danger.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from explorer.app.features.feature import Services
from explorer.app.features.mechanism.approach import (
    Approach,
    HoveredMargin,
    approaches,
    is_shown,
)
from explorer.app.scene.labels import add_label
from explorer.app.scene.part import ScenePart
from explorer.app.scene.placing import Placed
from explorer.app.scene.shapes import (
    TETRAHEDRON_FACES,
    add_lines,
    add_translucent,
    dashes,
    of_one_colour,
)
from explorer.app.widgets.assigning import Update
from explorer.app.widgets.colours import MARGIN_COLOURS, OUTLINE, proximity_colour
from explorer.mechanism.margins import TETRAHEDRA
from explorer.numerics.arrays import FloatArray

EDGES = np.array(list(itertools.combinations(range(4), 2)))
OPACITY = 0.26


@dataclass(frozen=True)
class Stroke:
    """How the edges of a tetrahedron are drawn.

    Attributes:
        most: Most dashes of an edge.
        period: Length of a dash with the space after it, in scene units.
        drawn: Share of the dash in it.
        thickness: Thickness in pixels.
    """

    most: int
    period: float
    drawn: float
    thickness: float


# Solid, dashed and dotted, as the lines of the margins in charts; what has gaps is thicker.
STROKES = (Stroke(1, 1.0, 1.0, 1.8), Stroke(16, 0.9, 0.64, 2.4), Stroke(30, 0.5, 0.36, 3.0))
# Share by which a tetrahedron is drawn smaller about its centroid, so that edges that two of them
# share lie beside each other.
INSET = 0.04
# Pixels by which the edges of the filled tetrahedron are thicker, and thickness of one that fails.
FILLED_EDGE, FAILING_EDGE = 1.0, 5.0


class Tetrahedra(ScenePart):
    """The edges of three tetrahedra with their names, and the faces of the nearest one.

    One that the present lengths cannot close has thick edges in the colour of an alarm.
    """

    def __init__(self, services: Services) -> None:
        scene, self._hovered = services.scene, services.get(HoveredMargin)
        flat = np.zeros((4, 3)), TETRAHEDRON_FACES
        self._faces = add_translucent(scene, "/tetrahedra/faces", flat, OPACITY, is_flat=True)
        self._edges = [
            add_lines(
                scene, f"/tetrahedra/{index}/edges", len(EDGES) * each.most, None, each.thickness
            )
            for index, each in enumerate(STROKES, start=1)
        ]
        self._names = [
            add_label(scene, f"/tetrahedra/{index}/name", f"δ{index}", colour=colour, visible=False)
            for index, colour in enumerate(MARGIN_COLOURS, start=1)
        ]

    def updates(self, placed: Placed) -> Iterator[Update]:
        """Yield the updates that draw the tetrahedra of this frame."""
        state = placed.frame.state
        failing = state.unclosed.failing if state.unclosed else ()
        each = approaches(placed, self._hovered.row)
        is_filled = False
        for index, approach in enumerate(each):
            corners = np.array([placed.points[name] for name in TETRAHEDRA[index]])
            centre = corners.mean(axis=0)
            shown, fails = is_shown(placed, index, approach), index in failing
            inner = corners + INSET * (centre - corners)
            yield from self._draw_edges(index, inner, approach, shown=shown, fails=fails)
            is_named = shown and not approach.has_label and state.view.labels
            yield self._names[index], "visible", is_named
            yield self._names[index], "position", tuple(centre.tolist())
            if shown and approach.is_filled:
                is_filled = True
                yield self._faces, "vertices", inner.astype(np.float32)
                yield self._faces, "color", proximity_colour(approach.level)
                yield self._faces, "opacity", OPACITY * approach.presence
        yield self._faces, "visible", is_filled

    def _draw_edges(
        self, index: int, corners: FloatArray, approach: Approach, *, shown: bool, fails: bool
    ) -> Iterator[Update]:
        edges, stroke = self._edges[index], STROKES[index]
        segments = dashes(corners[EDGES], stroke.most, stroke.period, stroke.drawn)
        yield edges, "visible", shown or fails
        yield edges, "points", segments.astype(np.float32)
        colour = OUTLINE if fails else MARGIN_COLOURS[index]
        yield edges, "colors", of_one_colour(colour, len(segments))
        thickness = stroke.thickness + FILLED_EDGE * approach.presence * approach.is_filled
        yield edges, "thickness", FAILING_EDGE if fails else thickness
