"""What belongs to singularity about the pose: nearest pose, ellipsoid, and ball without any."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import viser

from explorer.app.scene.bodies import platform_plate
from explorer.app.scene.placing import Placed
from explorer.app.scene.shapes import sphere
from explorer.app.widgets.assigning import Update
from explorer.app.widgets.colours import FAR, GHOST, SINGULAR, Rgb, proximity_colour
from explorer.mechanism.pose import quaternion_from_rotation
from explorer.numerics.arrays import FloatArray, IntArray
from explorer.numerics.number_text import format_number
from explorer.singularity.nearest import NearestSingularity
from explorer.singularity.strata import GENERIC

GHOST_OPACITY, ELLIPSOID_OPACITY, BALL_OPACITY = 0.4, 0.3, 0.14
# Scene units for a gain of one, of speeds and of forces, and the longest axis that is drawn.
SPEED_UNIT, FORCE_UNIT, LONGEST = 1.0, 4.0, 8.0
# The thinnest, so that a flat one is still seen.
THINNEST = 0.02
TOUCH_RADIUS = 0.2
SPEED: Rgb = (24, 128, 118)
FORCE: Rgb = (92, 60, 156)


class NearestGhost:
    """The platform in the nearest singular pose, its legs, and the ways of b1 to b4 to it."""

    def __init__(self, scene: viser.SceneApi) -> None:
        self._plate = scene.add_mesh_simple(
            "/nearest/platform",
            np.zeros((3, 3)),
            np.array([[0, 1, 2]]),
            color=SINGULAR,
            opacity=GHOST_OPACITY,
            side="double",
            cast_shadow=False,
            receive_shadow=False,
            visible=False,
        )
        self._legs, self._ways = (
            scene.add_line_segments(
                f"/nearest/{name}",
                np.zeros((4, 2, 3)),
                colour,
                thickness=thickness,
                thickness_units="screen",
                visible=False,
            )
            for name, colour, thickness in (("legs", GHOST, 1.5), ("ways", SINGULAR, 3.0))
        )
        self._label = scene.add_label(
            "/nearest/label", "δ1 = 0", font_screen_scale=0.9, visible=False
        )

    def updates(self, placed: Placed) -> Iterator[Update]:
        """Yield what draws it in this frame."""
        nearest = chosen_ghost(placed)
        for handle in (self._plate, self._legs, self._ways, self._label):
            yield handle, "visible", nearest is not None
        if nearest is None:
            return
        position = placed.scale * np.array(nearest.pose.position)
        vertices, faces = platform_plate(placed)
        yield self._plate, "vertices", vertices.astype(np.float32)
        yield self._plate, "faces", faces.astype(np.uint32)
        yield self._plate, "position", tuple(position.tolist())
        yield self._plate, "wxyz", nearest.pose.quaternion
        local = np.array(list(placed.platform_points.values()))
        tips = position + local @ nearest.pose.rotation.T
        here = np.array([placed.points[name] for name in placed.platform_points])
        bases = np.zeros((4, 3))
        bases[1:3, 0] = tips[1:3, 0]
        bases[3] = placed.points["a3"]
        yield self._legs, "points", np.stack([bases, tips], axis=1).astype(np.float32)
        yield self._ways, "points", np.stack([here, tips], axis=1).astype(np.float32)
        away = format_number(nearest.distance, size=placed.frame.state.design.reach)
        yield self._label, "text", f"δ{nearest.incidence} = 0: {away} away"
        yield self._label, "position", tuple(tips[0].tolist())


def chosen_ghost(placed: Placed) -> NearestSingularity | None:
    """Return the nearest singular pose that is to be drawn; None if it is the present one."""
    ghost = placed.frame.state.view.singular.ghost
    if ghost == "none":
        return None
    found = placed.frame.snapshot.nearest
    if ghost == "nearest":
        chosen = min(found, key=lambda each: each.distance)
    else:
        chosen = found[int(ghost[1]) - 1]
    return chosen if chosen.distance > 0.0 else None


class EllipsoidScene:
    """At b4 the velocities, or the forces, of a unit of the actuators."""

    def __init__(self, scene: viser.SceneApi) -> None:
        vertices, faces = sphere()
        self._bodies = {
            "speed": _translucent(scene, "/ellipsoid/speed", vertices, faces, SPEED),
            "force": _translucent(scene, "/ellipsoid/force", vertices, faces, FORCE),
        }
        self._axes = scene.add_line_segments(
            "/ellipsoid/axes",
            np.zeros((3, 2, 3)),
            FAR,
            thickness=2.0,
            thickness_units="screen",
            visible=False,
        )
        self._label = scene.add_label(
            "/ellipsoid/label", "1", font_screen_scale=0.85, visible=False
        )

    def updates(self, placed: Placed) -> Iterator[Update]:
        """Yield what draws the ellipsoid of this frame."""
        kind = placed.frame.state.view.singular.ellipsoid
        for name, body in self._bodies.items():
            yield body, "visible", name == kind
        for handle in (self._axes, self._label):
            yield handle, "visible", kind != "none"
        if kind == "none":
            return
        found = placed.frame.performance.translation
        gain = found.velocity if kind == "speed" else found.force
        halves = drawn_axes(gain, SPEED_UNIT if kind == "speed" else FORCE_UNIT)
        centre = placed.points["b4"]
        body = self._bodies[kind]
        yield body, "position", tuple(centre.tolist())
        yield body, "wxyz", tuple(quaternion_from_rotation(found.axes).tolist())
        yield body, "scale", tuple(halves.tolist())
        ways = (found.axes * halves).T
        yield (
            self._axes,
            "points",
            np.stack([centre - ways, centre + ways], axis=1).astype(np.float32),
        )
        longest = int(gain.argmax())
        value = "∞" if np.isinf(gain[longest]) else format_number(float(gain[longest]), 3)
        yield self._label, "text", f"{kind} ≤ {value} per unit"
        way = ways[longest] * (1.0 if ways[longest, 2] >= 0.0 else -1.0)
        yield self._label, "position", tuple((centre + way).tolist())


def drawn_axes(gain: FloatArray, unit: float) -> FloatArray:
    """Return the semi-axes to draw, in scene units: in proportion, but none beyond a length."""
    return np.clip(unit * gain, THINNEST, LONGEST)


class BallScene:
    """The largest ball of positions without a singular one, and where it touches the plane."""

    def __init__(self, scene: viser.SceneApi) -> None:
        vertices, faces = sphere()
        self._ball = _translucent(scene, "/ball/ball", vertices, faces, FAR, BALL_OPACITY)
        self._touch = scene.add_mesh_simple(
            "/ball/touch", vertices, faces, color=SINGULAR, scale=TOUCH_RADIUS, visible=False
        )
        self._line = scene.add_line_segments(
            "/ball/radius",
            np.zeros((1, 2, 3)),
            SINGULAR,
            thickness=2.5,
            thickness_units="screen",
            visible=False,
        )
        self._label = scene.add_label("/ball/label", "δ1 = 0", font_screen_scale=0.9, visible=False)

    def updates(self, placed: Placed) -> Iterator[Update]:
        """Yield what draws the ball of this frame."""
        asked = placed.frame.state.view.singular.ball
        shown = asked and placed.frame.snapshot.stratum == GENERIC
        for handle in (self._ball, self._touch, self._line, self._label):
            yield handle, "visible", shown
        if not shown:
            return
        ball = placed.frame.free_ball
        centre, touch = placed.points["b4"], placed.scale * ball.touches
        colour = proximity_colour(placed.frame.verdict.levels[ball.incidence - 1], 1.0)
        yield self._ball, "position", tuple(centre.tolist())
        yield self._ball, "scale", placed.scale * ball.radius
        yield self._ball, "color", colour
        yield self._touch, "position", tuple(touch.tolist())
        yield self._line, "points", np.stack([centre, touch])[None].astype(np.float32)
        away = format_number(ball.radius, size=placed.frame.state.design.reach)
        yield self._label, "text", f"δ{ball.incidence} = 0: {away} away"
        yield self._label, "position", tuple(touch.tolist())


def _translucent(
    scene: viser.SceneApi,
    name: str,
    vertices: FloatArray,
    faces: IntArray,
    colour: Rgb,
    opacity: float = ELLIPSOID_OPACITY,
) -> viser.MeshHandle:
    return scene.add_mesh_simple(
        name,
        vertices,
        faces,
        color=colour,
        opacity=opacity,
        cast_shadow=False,
        receive_shadow=False,
        visible=False,
    )
