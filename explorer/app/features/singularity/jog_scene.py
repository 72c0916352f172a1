"""The uncoupled motions as arrows and arcs: what each does, and where it becomes singular.

A motion on the base's axes is drawn as the way that b4 goes, one on the platform's axes about
b4 itself. It begins and ends with a disc where its margin vanishes, with a head where it may go on.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import viser

from explorer.app.scene.placing import Placed
from explorer.app.scene.shapes import Instances, Mesh, cylinder, of_one_colour, turned_to
from explorer.app.widgets.assigning import Update
from explorer.app.widgets.colours import SINGULAR, Rgb, proximity_colour
from explorer.numerics.arrays import FloatArray
from explorer.singularity.uncoupled import UNCOUPLED, Travel, UncoupledMotion

POINTS = 49
THICKNESS = 3.0
# Of the reach: the radius of an arc about b4, and of one about an axis that b4 lies on.
ARC = 0.32
# Of the reach: how far a translation is drawn that never becomes singular, or not for long.
FARTHEST = 0.75
HEAD = (0.24, 0.62)
STOP = (0.3, 0.07)


@dataclass(frozen=True)
class Drawn:
    """One motion in scene units.

    Attributes:
        points: Along it, shape (n, 3).
        singular: Whether its first and its last point are singular.
        spoke: From the axis to where the platform is now, shape (2, 3).
    """

    points: FloatArray
    singular: tuple[bool, bool]
    spoke: FloatArray


class JogScene:
    """Draws the motion in use, all six, or none."""

    def __init__(self, scene: viser.SceneApi) -> None:
        self._lines = [
            scene.add_line_segments(
                f"/motion/{index}/line",
                np.zeros((POINTS, 2, 3)),
                # One colour for all could not become many: the browser would draw white.
                np.zeros((POINTS, 2, 3), dtype=np.uint8),
                thickness=THICKNESS,
                thickness_units="screen",
                visible=False,
            )
            for index in range(len(UNCOUPLED))
        ]
        self._labels = [
            scene.add_label(f"/motion/{index}/label", "δ1", font_screen_scale=0.8, visible=False)
            for index in range(len(UNCOUPLED))
        ]
        count = 2 * len(UNCOUPLED)
        self._heads = Instances(scene, "/motion/heads", _cone(), [SINGULAR] * count)
        self._stops = Instances(scene, "/motion/stops", cylinder(), [SINGULAR] * count)
        for part in (self._heads, self._stops):
            part.handle.cast_shadow = False

    def updates(self, placed: Placed) -> Iterator[Update]:
        """Yield what draws the motions of this frame."""
        shown = shown_motions(placed)
        for index in range(len(UNCOUPLED)):
            for handle in (self._lines[index], self._labels[index]):
                yield handle, "visible", index in shown
        for part in (self._heads, self._stops):
            yield from part.shown(bool(shown))
        if not shown:
            return
        count = 2 * len(UNCOUPLED)
        at, towards = np.zeros((count, 3)), np.tile([0.0, 0.0, 1.0], (count, 1))
        is_stop, is_head = np.zeros(count), np.zeros(count)
        colours: list[Rgb] = [SINGULAR] * count
        for index in shown:
            motion = UNCOUPLED[index]
            drawn = drawn_motion(placed, motion, placed.frame.travels[index])
            colour = proximity_colour(placed.frame.verdict.levels[motion.incidence - 1], 1.0)
            segments = np.stack([drawn.points[:-1], drawn.points[1:]], axis=1)
            segments = np.concatenate([segments, drawn.spoke[None]])
            yield self._lines[index], "points", segments.astype(np.float32)
            yield self._lines[index], "colors", of_one_colour(colour, POINTS)
            for side, (end, before) in enumerate(((0, 1), (-1, -2))):
                row = 2 * index + side
                at[row] = drawn.points[end]
                towards[row] = drawn.points[end] - drawn.points[before]
                (is_stop if drawn.singular[side] else is_head)[row] = 1.0
                if not drawn.singular[side]:
                    colours[row] = colour
            yield self._labels[index], "text", f"δ{motion.incidence}: {motion.name}"
            far = drawn.points[-1] if motion.kind == "translation" else drawn.points[POINTS // 4]
            yield self._labels[index], "position", tuple(far.tolist())
        turned = turned_to(towards)
        size = np.array([HEAD[0], HEAD[0], HEAD[1]]), np.array([STOP[0], STOP[0], STOP[1]])
        yield from self._heads.placed(at, turned, np.maximum(is_head[:, None] * size[0], 1e-6))
        yield from self._heads.coloured(colours)
        yield from self._stops.placed(at, turned, np.maximum(is_stop[:, None] * size[1], 1e-6))


def shown_motions(placed: Placed) -> tuple[int, ...]:
    """Return the indices of the motions that are drawn."""
    state = placed.frame.state
    arrows, jog = state.view.singular.arrows, state.jog_in_use
    if arrows == "all six":
        return tuple(range(len(UNCOUPLED)))
    return (jog.motion,) if arrows == "one in use" and jog is not None else ()


def drawn_motion(placed: Placed, motion: UncoupledMotion, travel: Travel) -> Drawn:
    """Return how a motion is drawn in scene units, from as far back as it may go to ahead."""
    point, along = motion.line(placed.frame.state.pose)
    centre, here = placed.scale * point, placed.points["b4"]
    if motion.kind == "translation":
        far = FARTHEST * placed.reach
        low, high = placed.scale * travel.low, placed.scale * travel.high
        ends = max(low, -far), min(high, far)
        points = here + np.linspace(*ends, POINTS)[:, None] * along
        return Drawn(points, (low >= -far, high <= far), np.stack([here, here]))
    # The foot of b4 on the axis, and how the radius turns.
    foot = centre + float((here - centre) @ along) * along
    spoke = here - foot
    if float(np.linalg.norm(spoke)) < 1e-6 * placed.reach:
        across = placed.frame.snapshot.rotation[:, 1 if motion.axis == "x" else 0]
        spoke = ARC * placed.reach * across
        spoke = spoke - float(spoke @ along) * along
    low, high = travel.low, travel.high
    if low == high:
        # Singular here: once round, from here to here.
        low, high = -math.pi, math.pi
    angles = np.linspace(low, high, POINTS)
    points = (
        foot + np.cos(angles)[:, None] * spoke + np.sin(angles)[:, None] * np.cross(along, spoke)
    )
    return Drawn(points, (True, True), np.stack([foot, foot + spoke]))


def _cone() -> Mesh:
    """Return the cone of radius one from z = 0 to z = 1."""
    vertices, faces = cylinder()
    tip = vertices.copy()
    top = tip[:, 2] > 0.5
    tip[top, :2] = 0.0
    return tip, faces
