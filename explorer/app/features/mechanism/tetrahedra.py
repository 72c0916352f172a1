"""The three trilateration tetrahedra: singular is where one of them is flat."""

from __future__ import annotations

import itertools
from collections.abc import Iterator

import numpy as np
import viser

from explorer.app.scene.placing import Placed
from explorer.app.scene.shapes import of_one_colour
from explorer.app.widgets.assigning import Update
from explorer.app.widgets.colours import OUTLINE, proximity_colour
from explorer.mechanism.margins import TETRAHEDRA

FACES = np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]])
EDGES = np.array(list(itertools.combinations(range(4), 2)))
OPACITY = 0.1


class Tetrahedra:
    """Each translucent in the colour of its incidence; one that cannot close is outlined."""

    def __init__(self, scene: viser.SceneApi) -> None:
        self._meshes = [
            scene.add_mesh_simple(
                f"/tetrahedra/{index}/faces",
                np.zeros((4, 3)),
                FACES,
                opacity=OPACITY,
                side="double",
                flat_shading=True,
                cast_shadow=False,
                receive_shadow=False,
            )
            for index in (1, 2, 3)
        ]
        self._edges = [
            scene.add_line_segments(
                f"/tetrahedra/{index}/edges",
                np.zeros((6, 2, 3)),
                # One colour for all could not become many: the browser would draw white.
                np.zeros((6, 2, 3), dtype=np.uint8),
                thickness=1.5,
                thickness_units="screen",
            )
            for index in (1, 2, 3)
        ]

    def updates(self, placed: Placed) -> Iterator[Update]:
        """Yield what draws the tetrahedra of this frame."""
        state = placed.frame.state
        failing = state.unclosed.failing if state.unclosed else ()
        for index, names in enumerate(TETRAHEDRA):
            level = placed.frame.verdict.levels[index]
            fails = index in failing
            colour = OUTLINE if fails else proximity_colour(level, 1.0)
            corners = np.array([placed.points[name] for name in names])
            mesh, edges = self._meshes[index], self._edges[index]
            shown = state.view.tetrahedra[index]
            yield mesh, "visible", shown
            yield edges, "visible", shown or fails
            yield mesh, "vertices", corners.astype(np.float32)
            yield mesh, "color", colour
            yield edges, "points", corners[EDGES].astype(np.float32)
            yield edges, "colors", of_one_colour(colour, len(EDGES))
            yield edges, "thickness", 5.0 if fails else 1.5
