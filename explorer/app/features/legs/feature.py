"""Clearances of the legs in the pose and in the last move."""

from __future__ import annotations

import itertools

import numpy as np

from explorer.app.features.feature import Feature, Services, Tab, show
from explorer.app.inputs.controls import Controls
from explorer.app.scene import shapes
from explorer.app.scene.placing import Placed, ScenePart
from explorer.app.state.frame import Frame
from explorer.app.widgets.blocks import render
from explorer.app.widgets.buttons import figure
from explorer.app.widgets.markup import dim
from explorer.legs.clearance import PAIRS, legs_of, pair_name
from explorer.legs.interference import swept_tetrahedra
from explorer.measures.blocks.block import Statement
from explorer.measures.blocks.clearances import move_clearances, pose_clearances
from explorer.measures.blocks.commands import pose_command
from explorer.mechanism.configuration import Configuration
from explorer.mechanism.rgb import OUTLINE
from explorer.page.widgets.assigning import Updates


class ClearancePanel(Controls):
    """The table of clearances, and that of the last move."""

    def __init__(self, services: Services) -> None:
        super().__init__(services)
        copy = services.copy_button(
            "Workspace › Clearance",
            lambda state: pose_command("interference", state.design, state.pose),
        )
        with services.gui.add_folder("Clearance"):
            self.markup(
                lambda frame: render(pose_clearances(frame.snapshot, frame.state.unit), corner=copy)
            )
            self.checkbox(
                "Swept tetrahedra",
                "Draw the tetrahedra that the legs swept in the last move, and compare the paper's "
                "test for interference with the exact one.",
                "view.swept",
            )
            self.markup(lambda frame: move_table(frame) if frame.state.view.swept else "")


def move_table(frame: Frame) -> str:
    """Return the last move by both tests, the paper's and the exact one, as HTML."""
    move = frame.last_move
    if move is None:
        words = "No move yet. Move the platform: a drag without a pause is one move."
        return render([Statement("", words)])
    return render(move_clearances(move, frame.state.design, frame.state.unit))


def clearance_figure(frame: Frame) -> str:
    """Return the clearance of the closest legs in the pose, as HTML."""
    clearances, state = frame.snapshot.clearances, frame.state
    closest = int(clearances.closest)
    clearance = float(clearances.clearance[closest])
    words = state.unit.text(clearance, 3, size=state.design.reach)
    pair = pair_name(PAIRS[closest])
    hint = f"Clearance of the closest legs, {pair}: distance of their axes less their radii."
    if not any(state.design.limits.leg_radii):
        words += f" {dim('axes only')}"
        hint = f"Distance of the axes of the closest legs, {pair}: the design states no radii."
    look = "ex-beyond" if clearance < 0.0 else ""
    return figure("Workspace", "Clearance here", words, hint=hint, look=look)


OPACITY = 0.22
# Vertices 0 and 1 are the base ends at the start and at the end, 2 and 3 the platform ends.
# Legs 1 and 4 sweep triangles, since their base ends do not move; a face drawn twice would be twice
# as opaque.
TRIANGLE = np.array([[0, 2, 3]])
# The leg before the move has thicker lines of its own, which show the direction of the move.
START = np.array([(0, 2)])
EDGES = np.array([edge for edge in itertools.combinations(range(4), 2) if edge != (0, 2)])


class ClearanceScene(ScenePart):
    """The shortest line between the axes of the closest legs, and their clearance."""

    def __init__(self, services: Services) -> None:
        scene = services.scene
        self._line = shapes.add_lines(scene, "/clearance/line", 1, OUTLINE, 4.0)
        self._label = shapes.add_label(scene, "/clearance/label", "0")

    def updates(self, placed: Placed) -> Updates:
        """Yield the updates that draw the closest pair of this frame."""
        state, snapshot = placed.frame.state, placed.frame.snapshot
        is_visible = state.view.clearance and not state.view.is_twin
        yield from show(is_visible, self._line, self._label)
        if is_visible:
            clearances = snapshot.clearances
            pair = int(clearances.closest)
            ends = placed.scale * clearances.points[pair]
            yield self._line, "points", ends[None].astype(np.float32)
            least = float(clearances.clearance[pair])
            clearance = state.unit.text(least, 3, size=state.design.reach)
            words = f"legs {pair_name(PAIRS[pair])}: {clearance}"
            yield from shapes.write_label(self._label, words, ends.mean(axis=0))


class SweptTetrahedra(ScenePart):
    """Tetrahedra that the legs swept in the last move, taken as one step as in the paper.

    Those that overlap another have the colour of a collision.
    """

    def __init__(self, services: Services) -> None:
        scene = services.scene
        self._meshes = [
            shapes.add_translucent(
                scene,
                f"/swept/{leg}",
                (np.zeros((4, 3)), TRIANGLE if leg in (1, 4) else shapes.TETRAHEDRON_FACES),
                OPACITY,
                is_flat=True,
            )
            for leg in (1, 2, 3, 4)
        ]
        self._lines = (
            (EDGES, shapes.add_lines(scene, "/swept/edges", 4 * len(EDGES), None, 1.5)),
            (START, shapes.add_lines(scene, "/swept/starts", 4, None, 4.0)),
        )

    def updates(self, placed: Placed) -> Updates:
        """Yield the updates that draw the tetrahedra of this frame's last move."""
        view = placed.frame.state.view
        move = placed.frame.last_move if view.swept and not view.is_twin else None
        lines = (handle for _, handle in self._lines)
        yield from show(move is not None, *self._meshes, *lines)
        if move is None:
            return
        design = placed.frame.state.design
        ends = (Configuration.at(design, pose) for pose in (move.start, move.end))
        tetrahedra = placed.scale * swept_tetrahedra(*ends)
        colours = [OUTLINE if overlaps else shapes.SWEPT for overlaps in legs_of(move.overlaps)]
        for mesh, corners, colour in zip(self._meshes, tetrahedra, colours, strict=True):
            yield mesh, "vertices", corners.astype(np.float32)
            yield mesh, "color", colour
        for edges, handle in self._lines:
            points = tetrahedra[:, edges].reshape(-1, 2, 3)
            yield handle, "points", points.astype(np.float32)
            ends = np.repeat(np.array(colours, dtype=np.uint8), 2 * len(edges), axis=0)
            yield handle, "colors", ends.reshape(-1, 2, 3)


LEGS = Feature(
    "legs",
    tabs=(Tab("analyse", "Workspace", ClearancePanel),),
    bar=(("middle", lambda _: clearance_figure),),
    verdicts={
        "Legs are clear": "No two legs meet, their radii included.",
        "Legs touch": "It is not certain that two legs stay apart, their radii included.",
        "Legs collide": "Two legs would be in one place, their radii included.",
    },
    scene=(ClearanceScene, SweptTetrahedra),
)
