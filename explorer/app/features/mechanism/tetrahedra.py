"""The three tetrahedra of the trilaterations: a pose is singular where one of them is flat."""

from __future__ import annotations

import itertools
from collections.abc import Iterator

import numpy as np

from explorer.app.features.feature import Services
from explorer.app.scene.part import ScenePart
from explorer.app.scene.placing import Placed
from explorer.app.scene.shapes import TETRAHEDRON_FACES, add_lines, add_translucent, of_one_colour
from explorer.app.widgets.assigning import Update
from explorer.app.widgets.colours import MARGIN_COLOURS, OUTLINE, proximity_colour
from explorer.mechanism.margins import TETRAHEDRA

EDGES = np.array(list(itertools.combinations(range(4), 2)))
OPACITY = 0.1


class Tetrahedra(ScenePart):
    """Three translucent tetrahedra: faces in the colour of danger, edges in that of the margin.

    One that the present lengths cannot close has thick edges in the colour of an alarm.
    """

    def __init__(self, services: Services) -> None:
        scene, flat = services.scene, (np.zeros((4, 3)), TETRAHEDRON_FACES)
        self._meshes = [
            add_translucent(scene, f"/tetrahedra/{index}/faces", flat, OPACITY, is_flat=True)
            for index in (1, 2, 3)
        ]
        self._edges = [
            add_lines(scene, f"/tetrahedra/{index}/edges", len(EDGES), None, 1.5)
            for index in (1, 2, 3)
        ]

    def updates(self, placed: Placed) -> Iterator[Update]:
        """Yield the updates that draw the tetrahedra of this frame."""
        state = placed.frame.state
        failing = state.unclosed.failing if state.unclosed else ()
        for index, names in enumerate(TETRAHEDRA):
            level = placed.frame.verdict.levels[index]
            fails = index in failing
            colour = OUTLINE if fails else proximity_colour(level)
            edge_colour = OUTLINE if fails else MARGIN_COLOURS[index]
            corners = np.array([placed.points[name] for name in names])
            mesh, edges = self._meshes[index], self._edges[index]
            shown = state.view.tetrahedra[index]
            yield mesh, "visible", shown
            yield edges, "visible", shown or fails
            yield mesh, "vertices", corners.astype(np.float32)
            yield mesh, "color", colour
            yield edges, "points", corners[EDGES].astype(np.float32)
            yield edges, "colors", of_one_colour(edge_colour, len(EDGES))
            yield edges, "thickness", 5.0 if fails else 2.0
