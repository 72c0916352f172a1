"""What the legs swept in the last move: the paper's four tetrahedra of one step."""

from __future__ import annotations

import itertools
from collections.abc import Iterator

import numpy as np
import viser

from explorer.app.scene.placing import Placed
from explorer.app.widgets.assigning import Update
from explorer.app.widgets.colours import OUTLINE, SWEPT, Rgb
from explorer.legs.clearance import PAIRS
from explorer.legs.interference import swept_tetrahedra
from explorer.legs.moves import MoveClearance
from explorer.numerics.arrays import FloatArray

# Vertices 0 and 1 are the base ends at the start and at the end, 2 and 3 the platform ends.
SOLID = np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]])
# The base ends of legs 1 and 4 do not move: one face twice would be twice as opaque.
TRIANGLE = np.array([[0, 2, 3]])
# The leg where it was is drawn by itself, so that the eye sees which way it went.
START = (0, 2)
EDGES = tuple(edge for edge in itertools.combinations(range(4), 2) if edge != START)
OPACITY = 0.22


class SweptTetrahedra:
    """Each translucent, and those that overlap another in the colour of a collision."""

    def __init__(self, scene: viser.SceneApi) -> None:
        self._meshes = [
            scene.add_mesh_simple(
                f"/swept/{leg}",
                np.zeros((4, 3)),
                TRIANGLE if leg in (1, 4) else SOLID,
                color=SWEPT,
                opacity=OPACITY,
                side="double",
                flat_shading=True,
                cast_shadow=False,
                receive_shadow=False,
                visible=False,
            )
            for leg in (1, 2, 3, 4)
        ]
        self._edges = _Lines(scene, "/swept/edges", EDGES, thickness=1.5)
        self._starts = _Lines(scene, "/swept/starts", (START,), thickness=4.0)

    def updates(self, placed: Placed) -> Iterator[Update]:
        """Yield what draws the tetrahedra of this frame's last move."""
        view = placed.frame.state.view
        move = placed.frame.last_move if view.swept and not view.twin else None
        for handle in (*self._meshes, self._edges.handle, self._starts.handle):
            yield handle, "visible", move is not None
        if move is None:
            return
        start, end = move.start, move.end
        bodies = placed.scale * swept_tetrahedra(
            placed.frame.state.design,
            np.array(start.position),
            start.rotation,
            np.array(end.position),
            end.rotation,
        )
        colours = [OUTLINE if overlaps else SWEPT for overlaps in overlapping_legs(move)]
        for mesh, body, colour in zip(self._meshes, bodies, colours, strict=True):
            yield mesh, "vertices", body.astype(np.float32)
            yield mesh, "color", colour
        yield from self._edges.along(bodies, colours)
        yield from self._starts.along(bodies, colours)


class _Lines:
    """The same edges of each of four tetrahedra, each in its own colour."""

    def __init__(
        self,
        scene: viser.SceneApi,
        name: str,
        edges: tuple[tuple[int, int], ...],
        *,
        thickness: float,
    ) -> None:
        self._edges = np.array(edges)
        self.handle = scene.add_line_segments(
            name,
            np.zeros((4 * len(edges), 2, 3)),
            # One colour for all could not become many: the browser would draw white.
            np.zeros((4 * len(edges), 2, 3), dtype=np.uint8),
            thickness=thickness,
            thickness_units="screen",
            visible=False,
        )

    def along(self, bodies: FloatArray, colours: list[Rgb]) -> Iterator[Update]:
        """Yield what draws the edges of bodies (4, 4, 3)."""
        points = bodies[:, self._edges].reshape(-1, 2, 3)
        yield self.handle, "points", points.astype(np.float32)
        many = np.repeat(np.array(colours, dtype=np.uint8), 2 * len(self._edges), axis=0)
        yield self.handle, "colors", many.reshape(-1, 2, 3)


def overlapping_legs(move: MoveClearance) -> list[bool]:
    """Return which of the four legs sweep a tetrahedron that overlaps another's."""
    pairs = [pair for pair, overlaps in zip(PAIRS, move.overlaps, strict=True) if overlaps]
    return [any(leg in pair for pair in pairs) for leg in (1, 2, 3, 4)]
