"""The uncoupled motions as arrows and arcs between their singular poses.

A motion has the colour of the margin that it changes. It is drawn as the path of the point whose
position is shown, b4 or the tool point; a rotation about an axis through it, which leaves it in
place, as an arc about it. An end has a disc if the margin is zero there, an arrowhead if the motion
goes on.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from explorer.app.features.feature import Services
from explorer.app.scene.labels import add_label
from explorer.app.scene.part import ScenePart
from explorer.app.scene.placing import Placed
from explorer.app.scene.shapes import (
    Instances,
    add_lines,
    cone,
    cylinder,
    of_one_colour,
    turned_to,
)
from explorer.app.widgets.assigning import Update
from explorer.app.widgets.colours import MARGIN_COLOURS, SINGULAR, Rgb
from explorer.numerics.arrays import FloatArray
from explorer.singularity.uncoupled import UNCOUPLED, Travel, UncoupledMotion

# Number of points along a motion, and thickness of its line in pixels.
POINTS = 49
THICKNESS = 3.0
# Radius of an arc about an axis through the point, as a share of the reach.
ARC = 0.32
# Longest part of a translation that is drawn either way, as a share of the reach.
FARTHEST = 0.75
# Radius and length of an arrowhead and of a disc, in scene units.
HEAD = (0.24, 0.62)
STOP = (0.3, 0.07)


@dataclass(frozen=True)
class MotionLine:
    """The line of one motion, in scene units.

    Attributes:
        points: Points along the motion, shape (n, 3).
        singular: Whether its first and its last point are singular.
        spoke: Ends of a line from the axis to the present point, shape (2, 3).
    """

    points: FloatArray
    singular: tuple[bool, bool]
    spoke: FloatArray


class JogScene(ScenePart):
    """The motion in use, all six, or none."""

    def __init__(self, services: Services) -> None:
        scene = services.scene
        self._lines = [
            add_lines(scene, f"/motion/{index}/line", POINTS, None, THICKNESS)
            for index in range(len(UNCOUPLED))
        ]
        self._labels = [
            add_label(scene, f"/motion/{index}/label", "δ1", visible=False)
            for index in range(len(UNCOUPLED))
        ]
        count = 2 * len(UNCOUPLED)
        self._heads = Instances(scene, "/motion/heads", cone(), [SINGULAR] * count)
        self._stops = Instances(scene, "/motion/stops", cylinder(), [SINGULAR] * count)

    def updates(self, placed: Placed) -> Iterator[Update]:
        """Yield the updates that draw the motions of this frame."""
        shown = shown_motions(placed)
        for index in range(len(UNCOUPLED)):
            for handle in (self._lines[index], self._labels[index]):
                yield handle, "visible", index in shown
        for part in (self._heads, self._stops):
            yield from part.show(bool(shown))
        if not shown:
            return
        count = 2 * len(UNCOUPLED)
        positions, directions = np.zeros((count, 3)), np.tile([0.0, 0.0, 1.0], (count, 1))
        is_stop, is_head = np.zeros(count), np.zeros(count)
        colours: list[Rgb] = [SINGULAR] * count
        for index in shown:
            motion = UNCOUPLED[index]
            line = motion_line(placed, motion, placed.frame.travels[index])
            colour = MARGIN_COLOURS[motion.incidence - 1]
            segments = np.stack([line.points[:-1], line.points[1:]], axis=1)
            segments = np.concatenate([segments, line.spoke[None]])
            yield self._lines[index], "points", segments.astype(np.float32)
            yield self._lines[index], "colors", of_one_colour(colour, POINTS)
            for side, (end, before) in enumerate(((0, 1), (-1, -2))):
                row = 2 * index + side
                positions[row] = line.points[end]
                directions[row] = line.points[end] - line.points[before]
                (is_stop if line.singular[side] else is_head)[row] = 1.0
                if not line.singular[side]:
                    colours[row] = colour
            yield self._labels[index], "text", f"δ{motion.incidence}: {motion.name}"
            label_at = line.points[-1 if motion.kind == "translation" else POINTS // 4]
            yield self._labels[index], "position", tuple(label_at.tolist())
        wxyzs = turned_to(directions)
        head, stop = np.array([HEAD[0], HEAD[0], HEAD[1]]), np.array([STOP[0], STOP[0], STOP[1]])
        yield from self._heads.place(positions, wxyzs, np.maximum(is_head[:, None] * head, 1e-6))
        yield from self._heads.colour(colours)
        yield from self._stops.place(positions, wxyzs, np.maximum(is_stop[:, None] * stop, 1e-6))


def shown_motions(placed: Placed) -> tuple[int, ...]:
    """Return the indices of the motions that are drawn."""
    state = placed.frame.state
    arrows, jog = state.view.singular.arrows, state.jog_in_use
    if arrows == "all six":
        return tuple(range(len(UNCOUPLED)))
    return (jog.motion,) if arrows == "one in use" and jog is not None else ()


def motion_line(placed: Placed, motion: UncoupledMotion, travel: Travel) -> MotionLine:
    """Return the line of a motion, from the backward end of its travel to the forward end."""
    point, along = motion.line(placed.frame.state.pose)
    centre, here = placed.scale * point, placed.point
    if motion.kind == "translation":
        far = FARTHEST * placed.reach
        low, high = placed.scale * travel.low, placed.scale * travel.high
        ends = max(low, -far), min(high, far)
        points = here + np.linspace(*ends, POINTS)[:, None] * along
        return MotionLine(points, (low >= -far, high <= far), np.stack([here, here]))
    # Foot of the perpendicular from the point that moves to the axis.
    foot = centre + float((here - centre) @ along) * along
    spoke = here - foot
    if float(np.linalg.norm(spoke)) < 1e-6 * placed.reach:
        across = placed.frame.snapshot.rotation[:, 1 if motion.axis == "x" else 0]
        spoke = ARC * placed.reach * across
        spoke = spoke - float(spoke @ along) * along
    low, high = travel.low, travel.high
    if low == high:
        # The pose is singular: the arc is a whole turn.
        low, high = -math.pi, math.pi
    angles = np.linspace(low, high, POINTS)
    points = (
        foot + np.cos(angles)[:, None] * spoke + np.sin(angles)[:, None] * np.cross(along, spoke)
    )
    return MotionLine(points, (True, True), np.stack([foot, foot + spoke]))
