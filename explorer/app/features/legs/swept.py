"""The tetrahedra that the legs swept in the last move, taken as one step as in the paper."""

from __future__ import annotations

import itertools
from collections.abc import Iterator

import numpy as np
import viser

from explorer.app.features.feature import Services
from explorer.app.scene.part import ScenePart
from explorer.app.scene.placing import Placed
from explorer.app.scene.shapes import TETRAHEDRON_FACES, add_lines, add_translucent
from explorer.app.widgets.assigning import Update
from explorer.app.widgets.colours import OUTLINE, SWEPT, Rgb
from explorer.legs.clearance import legs_of
from explorer.legs.interference import swept_tetrahedra
from explorer.numerics.arrays import FloatArray

# Vertices 0 and 1 are the base ends at the start and at the end, 2 and 3 the platform ends.
# Legs 1 and 4 sweep triangles, since their base ends do not move; a face drawn twice would be twice
# as opaque.
TRIANGLE = np.array([[0, 2, 3]])
# The leg before the move has thicker lines of its own, which show the direction of the move.
START = (0, 2)
EDGES = tuple(edge for edge in itertools.combinations(range(4), 2) if edge != START)
OPACITY = 0.22


class SweptTetrahedra(ScenePart):
    """Four translucent tetrahedra; those that overlap another have the colour of a collision."""

    def __init__(self, services: Services) -> None:
        scene = services.scene
        self._meshes = [
            add_translucent(
                scene,
                f"/swept/{leg}",
                (np.zeros((4, 3)), TRIANGLE if leg in (1, 4) else TETRAHEDRON_FACES),
                OPACITY,
                is_flat=True,
            )
            for leg in (1, 2, 3, 4)
        ]
        self._edges = _Lines(scene, "/swept/edges", EDGES, 1.5)
        self._starts = _Lines(scene, "/swept/starts", (START,), 4.0)

    def updates(self, placed: Placed) -> Iterator[Update]:
        """Yield the updates that draw the tetrahedra of this frame's last move."""
        view = placed.frame.state.view
        move = placed.frame.last_move if view.swept and not view.is_twin else None
        for handle in (*self._meshes, self._edges.handle, self._starts.handle):
            yield handle, "visible", move is not None
        if move is None:
            return
        start, end = move.start, move.end
        tetrahedra = placed.scale * swept_tetrahedra(
            placed.frame.state.design,
            np.array(start.position),
            start.rotation,
            np.array(end.position),
            end.rotation,
        )
        colours = [OUTLINE if overlaps else SWEPT for overlaps in legs_of(move.overlaps)]
        for mesh, corners, colour in zip(self._meshes, tetrahedra, colours, strict=True):
            yield mesh, "vertices", corners.astype(np.float32)
            yield mesh, "color", colour
        yield from self._edges.along(tetrahedra, colours)
        yield from self._starts.along(tetrahedra, colours)


class _Lines:
    """The same edges of each of four tetrahedra, each in its own colour."""

    def __init__(
        self,
        scene: viser.SceneApi,
        name: str,
        edges: tuple[tuple[int, int], ...],
        thickness: float,
    ) -> None:
        self._edges = np.array(edges)
        self.handle = add_lines(scene, name, 4 * len(edges), None, thickness)

    def along(self, tetrahedra: FloatArray, colours: list[Rgb]) -> Iterator[Update]:
        """Yield the updates that draw the edges of tetrahedra (4, 4, 3)."""
        points = tetrahedra[:, self._edges].reshape(-1, 2, 3)
        yield self.handle, "points", points.astype(np.float32)
        end_colours = np.repeat(np.array(colours, dtype=np.uint8), 2 * len(self._edges), axis=0)
        yield self.handle, "colors", end_colours.reshape(-1, 2, 3)
