"""The nearest singular pose, the ellipsoids, and the largest singularity-free ball."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import viser

from explorer.app.features.feature import Services
from explorer.app.features.mechanism.bodies import platform_plate
from explorer.app.scene.ellipsoid import Ellipsoid
from explorer.app.scene.labels import add_label
from explorer.app.scene.part import ScenePart
from explorer.app.scene.placing import Placed
from explorer.app.scene.shapes import NO_MESH, add_lines, add_translucent, sphere
from explorer.app.widgets.assigning import Update
from explorer.app.widgets.colours import FAR, GHOST, SINGULAR, Rgb, proximity_colour
from explorer.measures.blocks.block import Number
from explorer.measures.blocks.singularity import finite_gain
from explorer.mechanism.pose import Pose
from explorer.numerics.arrays import FloatArray
from explorer.numerics.number_text import format_number
from explorer.singularity.nearest import NearestSingularity

GHOST_OPACITY, BALL_OPACITY = 0.4, 0.14
# Semi-axes of an ellipsoid in scene units: for a gain of one, of speeds and of forces; and the
# shortest and the longest that is drawn, so that a flat one is visible and a long one has an end.
SPEED_UNIT, FORCE_UNIT = 1.0, 4.0
THINNEST, LONGEST = 0.02, 8.0
TOUCH_RADIUS = 0.2
SPEED: Rgb = (24, 128, 118)
FORCE: Rgb = (92, 60, 156)


class PlatformGhost:
    """The platform in another pose than the present one, and its legs.

    Args:
        scene: Where they are added.
        name: Their node.
    """

    def __init__(self, scene: viser.SceneApi, name: str) -> None:
        self._plate = add_translucent(
            scene, f"{name}/platform", NO_MESH, GHOST_OPACITY, colour=SINGULAR
        )
        self._legs = add_lines(scene, f"{name}/legs", 4, GHOST, 1.5)

    def show(self, visible: bool) -> Iterator[Update]:
        """Yield the updates that show or hide the ghost."""
        yield self._plate, "visible", visible
        yield self._legs, "visible", visible

    def draw(self, placed: Placed, pose: Pose) -> Iterator[Update]:
        """Yield the updates that draw the ghost in a pose."""
        vertices, faces = platform_plate(placed)
        yield self._plate, "vertices", vertices.astype(np.float32)
        yield self._plate, "faces", faces.astype(np.uint32)
        yield self._plate, "position", tuple((placed.scale * np.array(pose.position)).tolist())
        yield self._plate, "wxyz", pose.quaternion
        tips = platform_tips(placed, pose)
        bases = np.zeros((4, 3))
        bases[1:3, 0] = tips[1:3, 0]
        bases[3] = placed.points["a3"]
        yield self._legs, "points", np.stack([bases, tips], axis=1).astype(np.float32)


def platform_tips(placed: Placed, pose: Pose) -> FloatArray:
    """Return b1 to b4 in a pose, in scene units, shape (4, 3)."""
    local = np.array(list(placed.platform_points.values()))
    return placed.scale * np.array(pose.position) + local @ pose.rotation.T


class NearestGhost(ScenePart):
    """The platform in the nearest singular pose, its legs, and the displacements of b1 to b4."""

    def __init__(self, services: Services) -> None:
        scene = services.scene
        self._ghost = PlatformGhost(scene, "/nearest")
        self._displacements = add_lines(scene, "/nearest/ways", 4, SINGULAR, 3.0)
        self._label = add_label(scene, "/nearest/label", "δ1 = 0", visible=False)

    def updates(self, placed: Placed) -> Iterator[Update]:
        """Yield the updates that draw the singular pose of this frame."""
        nearest = chosen_ghost(placed)
        yield from self._ghost.show(nearest is not None)
        for handle in (self._displacements, self._label):
            yield handle, "visible", nearest is not None
        if nearest is None:
            return
        yield from self._ghost.draw(placed, nearest.pose)
        tips = platform_tips(placed, nearest.pose)
        here = np.array([placed.points[name] for name in placed.platform_points])
        yield self._displacements, "points", np.stack([here, tips], axis=1).astype(np.float32)
        distance = format_number(nearest.distance, size=placed.frame.state.design.reach)
        yield self._label, "text", f"δ{nearest.incidence} = 0: {distance} away"
        yield self._label, "position", tuple(tips[0].tolist())


def chosen_ghost(placed: Placed) -> NearestSingularity | None:
    """Return the singular pose that the view requests; None if it is the present one."""
    ghost = placed.frame.state.view.singular.ghost
    if ghost == "none":
        return None
    poses = placed.frame.snapshot.nearest
    if ghost == "nearest":
        chosen = min(poses, key=lambda pose: pose.distance)
    else:
        chosen = poses[int(ghost[1]) - 1]
    return chosen if chosen.distance > 0.0 else None


class EllipsoidScene(ScenePart):
    """The ellipsoid of velocities, or of forces, of unit actuators at b4 or at the tool point."""

    def __init__(self, services: Services) -> None:
        self._ellipsoid = Ellipsoid(services.scene, "/ellipsoid")

    def updates(self, placed: Placed) -> Iterator[Update]:
        """Yield the updates that draw the ellipsoid of this frame."""
        kind = placed.frame.state.view.singular.ellipsoid
        yield from self._ellipsoid.show(kind != "none")
        if kind == "none":
            return
        gains = placed.frame.performance.translation
        gain = gains.velocity if kind == "speed" else gains.force
        colour, unit = (SPEED, SPEED_UNIT) if kind == "speed" else (FORCE, FORCE_UNIT)
        words = f"{kind} ≤ {Number(finite_gain(float(gain.max())), digits=3).text} per unit"
        lengths = drawn_axes(gain, unit)
        yield from self._ellipsoid.draw(placed.point, gains.axes, lengths, colour, words)


def drawn_axes(gain: FloatArray, unit: float) -> FloatArray:
    """Return the semi-axes to draw for gains, in scene units, within the drawn lengths."""
    return np.clip(unit * gain, THINNEST, LONGEST)


class BallScene(ScenePart):
    """The largest singularity-free ball of positions, and where it touches the singular plane.

    The positions are those of b4, or of the tool point, whose planes are as far away.
    """

    def __init__(self, services: Services) -> None:
        scene = services.scene
        self._ball = add_translucent(
            scene, "/ball/ball", sphere(), BALL_OPACITY, colour=FAR, side="front"
        )
        self._touch = scene.add_mesh_simple(
            "/ball/touch", *sphere(), color=SINGULAR, scale=TOUCH_RADIUS, visible=False
        )
        self._line = add_lines(scene, "/ball/radius", 1, SINGULAR, 2.5)
        self._label = add_label(scene, "/ball/label", "δ1 = 0", visible=False)

    def updates(self, placed: Placed) -> Iterator[Update]:
        """Yield the updates that draw the ball of this frame."""
        frame = placed.frame
        shown = frame.state.view.singular.ball and not frame.snapshot.is_singular
        for handle in (self._ball, self._touch, self._line, self._label):
            yield handle, "visible", shown
        if not shown:
            return
        ball = frame.free_ball
        centre, touch = placed.point, placed.scale * ball.touches + placed.offset
        colour = proximity_colour(frame.verdict.levels[ball.incidence - 1])
        yield self._ball, "position", tuple(centre.tolist())
        yield self._ball, "scale", placed.scale * ball.radius
        yield self._ball, "color", colour
        yield self._touch, "position", tuple(touch.tolist())
        yield self._line, "points", np.stack([centre, touch])[None].astype(np.float32)
        distance = format_number(ball.radius, size=frame.state.design.reach)
        yield self._label, "text", f"δ{ball.incidence} = 0: {distance} away"
        yield self._label, "position", tuple(touch.tolist())
