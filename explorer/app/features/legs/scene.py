"""The closest pair of legs, the legs as capsules, and the tetrahedra that they swept."""

from __future__ import annotations

import itertools

import numpy as np

from explorer.app.features.feature import Services
from explorer.app.scene.placing import Placed, ScenePart
from explorer.app.scene.shapes import (
    SWEPT,
    TETRAHEDRON_FACES,
    TUBE,
    Balls,
    Rods,
    add_label,
    add_lines,
    add_translucent,
)
from explorer.app.widgets.assigning import Updates
from explorer.legs.clearance import PAIRS, leg_axes, legs_of, pair_name
from explorer.legs.interference import swept_tetrahedra
from explorer.mechanism.configuration import Configuration
from explorer.numerics.number_text import format_number
from explorer.singularity.colours import OUTLINE

OPACITY = 0.22
# Vertices 0 and 1 are the base ends at the start and at the end, 2 and 3 the platform ends.
# Legs 1 and 4 sweep triangles, since their base ends do not move; a face drawn twice would be twice
# as opaque.
TRIANGLE = np.array([[0, 2, 3]])
# The leg before the move has thicker lines of its own, which show the direction of the move.
START = np.array([(0, 2)])
EDGES = np.array([edge for edge in itertools.combinations(range(4), 2) if edge != (0, 2)])


class ClearanceScene(ScenePart):
    """The shortest line between the axes of the closest legs, and a capsule for each leg."""

    def __init__(self, services: Services) -> None:
        scene = services.scene
        self._line = add_lines(scene, "/clearance/line", 1, OUTLINE, 4.0)
        self._label = add_label(scene, "/clearance/label", "0", visible=False)
        self._rods = Rods(scene, "/clearance/rods", [TUBE] * 4, opacity=OPACITY)
        self._ends = Balls(scene, "/clearance/ends", [TUBE] * 8, opacity=OPACITY)

    def updates(self, placed: Placed) -> Updates:
        """Yield the updates that draw the closest pair and the capsules of this frame."""
        state, snapshot = placed.frame.state, placed.frame.snapshot
        radii = placed.scale * np.array(state.design.limits.leg_radii)
        has_radii = state.view.legs and not state.view.is_twin and bool(radii.any())
        for part in (self._rods, self._ends):
            yield from part.show(has_radii)
        if has_radii:
            axes = placed.scale * leg_axes(snapshot)
            yield from self._rods.between(axes[:, 0], axes[:, 1], radii)
            yield from self._ends.at(axes.reshape(-1, 3), np.repeat(radii, 2))
        is_visible = state.view.clearance and not state.view.is_twin
        yield self._line, "visible", is_visible
        yield self._label, "visible", is_visible
        if is_visible:
            clearances = snapshot.clearances
            pair = int(clearances.closest)
            ends = placed.scale * clearances.points[pair]
            yield self._line, "points", ends[None].astype(np.float32)
            yield self._label, "position", tuple(ends.mean(axis=0).tolist())
            clearance = format_number(float(clearances.clearance[pair]), 3, size=state.design.reach)
            yield self._label, "text", f"legs {pair_name(PAIRS[pair])}: {clearance}"


class SweptTetrahedra(ScenePart):
    """Tetrahedra that the legs swept in the last move, taken as one step as in the paper.

    Those that overlap another have the colour of a collision.
    """

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
        self._lines = (
            (EDGES, add_lines(scene, "/swept/edges", 4 * len(EDGES), None, 1.5)),
            (START, add_lines(scene, "/swept/starts", 4, None, 4.0)),
        )

    def updates(self, placed: Placed) -> Updates:
        """Yield the updates that draw the tetrahedra of this frame's last move."""
        view = placed.frame.state.view
        move = placed.frame.last_move if view.swept and not view.is_twin else None
        for handle in (*self._meshes, *(handle for _, handle in self._lines)):
            yield handle, "visible", move is not None
        if move is None:
            return
        design = placed.frame.state.design
        ends = (Configuration.at(design, pose) for pose in (move.start, move.end))
        tetrahedra = placed.scale * swept_tetrahedra(*ends)
        colours = [OUTLINE if overlaps else SWEPT for overlaps in legs_of(move.overlaps)]
        for mesh, corners, colour in zip(self._meshes, tetrahedra, colours, strict=True):
            yield mesh, "vertices", corners.astype(np.float32)
            yield mesh, "color", colour
        for edges, handle in self._lines:
            points = tetrahedra[:, edges].reshape(-1, 2, 3)
            yield handle, "points", points.astype(np.float32)
            ends = np.repeat(np.array(colours, dtype=np.uint8), 2 * len(edges), axis=0)
            yield handle, "colors", ends.reshape(-1, 2, 3)
