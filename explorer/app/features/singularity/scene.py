"""The nearest singular pose, the ellipsoids, the singularity-free ball, and the free motions."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import viser

from explorer.app.features.feature import Services, show
from explorer.app.features.mechanism import bodies
from explorer.app.scene import shapes
from explorer.app.scene.ellipsoid import EllipsoidNode
from explorer.app.scene.placing import Placed, ScenePart
from explorer.app.state.frame import Frame
from explorer.app.state.state import State
from explorer.app.widgets.buttons import press_button
from explorer.measures.blocks.block import Number
from explorer.measures.blocks.singularity import finite_gain
from explorer.mechanism.folds import FOLD_LINES
from explorer.mechanism.pose import Pose
from explorer.mechanism.rgb import Rgb
from explorer.page.session.clock import Timer, now
from explorer.page.widgets.assigning import Updates
from explorer.singularity.colours import FAR, SINGULAR, proximity_colour
from explorer.singularity.freedoms import FreeTurn
from explorer.singularity.nearest import NearestSingularity

GHOST_OPACITY, BALL_OPACITY = 0.4, 0.14
# Semi-axes of an ellipsoid in scene units: for a gain of one, of speeds and of forces; and the
# shortest and the longest that is drawn, so that a flat one is visible and a long one has an end.
SPEED_UNIT, FORCE_UNIT = 1.0, 4.0
THINNEST, LONGEST = 0.02, 8.0
TOUCH_RADIUS = 0.2
SPEED: Rgb = (24, 128, 118)
FORCE: Rgb = (92, 60, 156)
SHOW = "singular.show"
SHOW_HINT = "Swing a ghost of the platform about this line, by up to 5 % of the reach."
# Seconds of a swing to and fro, number of swings, and seconds between two frames.
PERIOD, PERIODS, FRAME_SECONDS = 1.8, 2, 0.04
# Way of the fastest of b1 to b4 from its place, over the reach, and the largest angle.
AMPLITUDE, LARGEST_ANGLE = 0.05, math.radians(30.0)
# Length of the axis beyond the points of the mechanism, over the reach.
OVERHANG = 0.15


class PlatformGhost:
    """The platform in another pose than the present one, and its legs, below a node."""

    def __init__(self, scene: viser.SceneApi, name: str) -> None:
        self._plate = shapes.add_translucent(
            scene, f"{name}/platform", shapes.NO_MESH, GHOST_OPACITY, colour=SINGULAR
        )
        self._legs = shapes.add_lines(scene, f"{name}/legs", 4, shapes.GHOST, 1.5)

    def show(self, visible: bool) -> Updates:
        """Yield the updates that show or hide the ghost."""
        yield from show(visible, self._plate, self._legs)

    def draw(self, placed: Placed, pose: Pose) -> Updates:
        """Yield the updates that draw the ghost in a pose."""
        yield from shapes.draw_mesh(self._plate, bodies.platform_plate(placed))
        yield self._plate, "position", tuple((placed.scale * np.array(pose.position)).tolist())
        yield self._plate, "wxyz", pose.quaternion
        joints = bodies.platform_joints(placed, np.array([pose.position]), pose.rotation[None])
        yield self._legs, "points", bodies.leg_lines(placed, joints).astype(np.float32)


class NearestGhost(ScenePart):
    """The platform in the nearest singular pose, its legs, and the displacements of b1 to b4."""

    def __init__(self, services: Services) -> None:
        scene = services.scene
        self._ghost = PlatformGhost(scene, "/nearest")
        self._displacements = shapes.add_lines(scene, "/nearest/ways", 4, SINGULAR, 3.0)
        self._label = shapes.add_label(scene, "/nearest/label", "δ1 = 0")

    def updates(self, placed: Placed) -> Updates:
        """Yield the updates that draw the singular pose of this frame."""
        nearest = chosen_ghost(placed)
        yield from show(nearest is not None, self._ghost, self._displacements, self._label)
        if nearest is None:
            return
        pose = nearest.pose
        yield from self._ghost.draw(placed, pose)
        (tips,) = bodies.platform_joints(placed, np.array([pose.position]), pose.rotation[None])
        here = np.array([placed.points[name] for name in placed.platform_points])
        yield self._displacements, "points", np.stack([here, tips], axis=1).astype(np.float32)
        state = placed.frame.state
        motion = state.unit.text(nearest.distance, size=state.design.reach)
        words = f"δ{nearest.incidence} = 0: {motion} of motion"
        yield from shapes.write_label(self._label, words, tips[0])


def chosen_ghost(placed: Placed) -> NearestSingularity | None:
    """Return the singular pose that the view requests; None if it is the present one."""
    ghost = placed.frame.state.view.singular.ghost
    if ghost == "none":
        return None
    poses = placed.frame.snapshot.nearest
    is_any = ghost == "nearest"
    chosen = min(poses, key=lambda pose: pose.distance) if is_any else poses[int(ghost[1]) - 1]
    return chosen if chosen.distance > 0.0 else None


class EllipsoidScene(ScenePart):
    """The ellipsoid of velocities, or of forces, of unit actuators at b4 or at the tool point."""

    def __init__(self, services: Services) -> None:
        self._ellipsoid = EllipsoidNode(services.scene, "/ellipsoid")

    def updates(self, placed: Placed) -> Updates:
        """Yield the updates that draw the ellipsoid of this frame."""
        kind = placed.frame.state.view.singular.ellipsoid
        yield from self._ellipsoid.show(kind != "none")
        if kind == "none":
            return
        gains = placed.frame.performance.translation
        gain, colour, unit = gains.gain, SPEED, SPEED_UNIT
        if kind == "force":
            gain, colour, unit = gains.force, FORCE, FORCE_UNIT
        words = f"{kind} ≤ {Number(finite_gain(float(gain.max())), digits=3).text} per unit"
        lengths = np.clip(unit * gain, THINNEST, LONGEST)
        yield from self._ellipsoid.draw(placed.point, gains.axes, lengths, colour, words)


class BallScene(ScenePart):
    """The largest singularity-free ball of positions, and where it touches the singular plane.

    The positions are those of b4, or of the tool point, whose planes are as far away.
    """

    def __init__(self, services: Services) -> None:
        scene = services.scene
        self._ball = shapes.add_translucent(
            scene, "/ball/ball", shapes.sphere(), BALL_OPACITY, colour=FAR, side="front"
        )
        self._touch = scene.add_mesh_simple(
            "/ball/touch", *shapes.sphere(), color=SINGULAR, scale=TOUCH_RADIUS, visible=False
        )
        self._line = shapes.add_lines(scene, "/ball/radius", 1, SINGULAR, 2.5)
        self._label = shapes.add_label(scene, "/ball/label", "δ1 = 0")

    def updates(self, placed: Placed) -> Updates:
        """Yield the updates that draw the ball of this frame."""
        frame = placed.frame
        is_visible = frame.state.view.singular.ball and not frame.snapshot.is_singular
        yield from show(is_visible, self._ball, self._touch, self._line, self._label)
        if not is_visible:
            return
        ball = frame.free_ball
        centre, touch = placed.point, placed.scale * ball.touches + placed.offset
        colour = proximity_colour(frame.verdict.levels[ball.incidence - 1])
        yield self._ball, "position", tuple(centre.tolist())
        yield self._ball, "scale", placed.scale * ball.radius
        yield self._ball, "color", colour
        yield self._touch, "position", tuple(touch.tolist())
        yield self._line, "points", np.stack([centre, touch])[None].astype(np.float32)
        distance = frame.state.unit.text(ball.radius, size=frame.state.design.reach)
        words = f"δ{ball.incidence} = 0: {distance} away"
        yield from shapes.write_label(self._label, words, touch)


@dataclass(frozen=True)
class _Swing:
    """A turn of the platform in a frame that is free, since a time of the clock."""

    frame: Frame
    turn: FreeTurn
    start: float

    @property
    def is_over(self) -> bool:
        return now() - self.start >= PERIODS * PERIOD

    def is_of(self, state: State) -> bool:
        """Whether a state has its design and pose."""
        own = self.frame.state
        return state.pose == own.pose and state.design == own.design

    @property
    def angle(self) -> float:
        points = self.frame.snapshot.points
        arms = np.array([points.b1, points.b2, points.b3, points.b4]) - self.turn.point
        longest = float(np.linalg.norm(np.cross(arms, self.turn.direction), axis=1).max())
        way = AMPLITUDE * self.frame.state.design.reach
        largest = way / longest if way < LARGEST_ANGLE * longest else LARGEST_ANGLE
        return largest * math.sin(2.0 * math.pi * (now() - self.start) / PERIOD)


class FreeMotion(ScenePart):
    """A ghost of the platform that swings about the line of a motion, in a singular pose.

    Locked actuators allow the motion. The swing is no part of the state, and ends once the platform
    or the design is another one.
    """

    def __init__(self, services: Services) -> None:
        scene, self._session = services.scene, services.session
        self._ghost = PlatformGhost(scene, "/freedom")
        self._axis = shapes.add_lines(scene, "/freedom/axis", 1, SINGULAR, 3.0)
        self._label = shapes.add_label(scene, "/freedom/label", "")
        self._frame: Frame | None = None
        self._swing: _Swing | None = None
        services.buttons.on(SHOW, self._begin, values={"1", "2", "3"})
        for incidence, line in enumerate(FOLD_LINES, 1):
            services.buttons.offer(
                f"Singularity › Show the turn about the {line}",
                f"{SHOW_HINT} It is one that locked actuators allow where δ{incidence} = 0.",
                SHOW,
                str(incidence),
                lambda incidence=incidence: self._swing_of(incidence) is not None,
            )
        services.at_end(lambda: setattr(self, "_swing", None))

    def updates(self, placed: Placed) -> Updates:
        """Yield the updates that draw the motion at this time."""
        self._frame, swing = placed.frame, self._swing
        if swing is not None and (swing.is_over or not swing.is_of(placed.frame.state)):
            swing = self._swing = None
        yield from show(swing is not None, self._ghost, self._axis, self._label)
        if swing is None:
            return
        yield from self._ghost.draw(placed, swing.turn.move(swing.frame.state.pose, swing.angle))
        # The line goes beyond all points beside it.
        foot, direction = placed.scale * swing.turn.point, swing.turn.direction
        along = (np.array(list(placed.points.values())) - foot) @ direction
        overhang = OVERHANG * placed.reach
        ends = [float(along.min()) - overhang, float(along.max()) + overhang]
        axis = foot + np.outer(ends, direction)
        yield self._axis, "points", axis[None].astype(np.float32)
        words = f"turns about {swing.turn.line_name}"
        yield from shapes.write_label(self._label, words, axis[1])

    def _swing_of(self, incidence: int) -> _Swing | None:
        """Return a swing that begins now in the last frame; None if the turn is not free there."""
        frame = self._frame
        if frame is None or not frame.snapshot.is_singular:
            return None
        turns = frame.snapshot.freedoms.turns
        turn = next((turn for turn in turns if turn.incidence == incidence), None)
        return None if turn is None else _Swing(frame, turn, now())

    def _begin(self, value: str, _: viser.ClientHandle) -> None:
        swing = self._swing_of(int(value))
        if swing is not None:
            self._swing = swing
            self._draw_on(swing)

    def _draw_on(self, swing: _Swing) -> None:
        """Draw a swing again and again until it is over, or another one has begun."""
        self._session.redraw()
        if swing is self._swing and not swing.is_over:
            Timer(FRAME_SECONDS, self._draw_on, swing)


def show_button(incidence: int) -> str:
    """Return the button that shows the turn of an incidence, as HTML."""
    label = f"Show the motion: turn about the {FOLD_LINES[incidence - 1]}"
    return press_button(
        SHOW, incidence, "Show the motion", hint=SHOW_HINT, label=label, class_name="ex-link"
    )
