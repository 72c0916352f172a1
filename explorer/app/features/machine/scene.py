"""The tool and the payload on the platform; nothing of a design that has neither."""

from __future__ import annotations

import math

import numpy as np

from explorer.app.features.feature import Services, show
from explorer.app.scene import shapes
from explorer.app.scene.placing import NO_POINTS, Placed, ScenePart, around
from explorer.mechanism.rgb import Rgb
from explorer.numerics.arrays import FloatArray
from explorer.numerics.number_text import format_number
from explorer.page.widgets.assigning import Updates

# Length and radius of the axes of the tool, in scene units, and thickness of its line in pixels.
AXIS_LENGTH, AXIS_RADIUS, THICKNESS = 0.9, 0.035, 2.5
# Colours of the axes x, y and z, those of the corner of the scene, and of the payload: brass.
AXIS_COLOURS: tuple[Rgb, ...] = ((255, 32, 96), (32, 176, 96), (32, 128, 255))
BRASS: Rgb = (190, 154, 92)
# Radius of the ball of one kilogram in scene units, and those of the smallest and the largest ball.
KILOGRAM_RADIUS, LEAST_RADIUS, LARGEST_RADIUS = 0.4, 0.12, 0.9
BALL_OPACITY = 0.6


class ToolScene(ScenePart):
    """A line from b4 to the tool point, and the axes of the tool there."""

    def __init__(self, services: Services) -> None:
        scene = services.scene
        self._line = shapes.add_lines(scene, "/platform/tool-line", 1, shapes.GHOST, THICKNESS)
        # The frame's own axes are too dark for a dark page.
        self._frame = scene.add_frame("/platform/tool", show_axes=False, visible=False)
        self._axes = shapes.Rods(
            scene, "/platform/tool/axes", list(map(shapes.linear_colour, AXIS_COLOURS))
        )
        self._label = shapes.add_label(scene, "/platform/tool-label", "tool")

    def updates(self, placed: Placed) -> Updates:
        """Yield the updates that draw the tool of this frame."""
        visible, tool = _has_tool(placed), placed.frame.state.design.tool
        yield self._line, "visible", visible and any(tool.position)
        yield from show(visible, self._frame, self._label, self._axes)
        if not visible:
            return
        tip = placed.scale * np.array(tool.position)
        yield self._line, "points", np.stack([np.zeros(3), tip])[None].astype(np.float32)
        yield self._frame, "position", tuple(tip.tolist())
        yield self._frame, "wxyz", tool.quaternion
        yield from self._axes.between(
            np.zeros((3, 3)), AXIS_LENGTH * np.eye(3), np.full(3, AXIS_RADIUS)
        )
        yield self._label, "position", tuple(tip.tolist())

    def corners(self, placed: Placed) -> FloatArray:
        """Return the corners of a cube about the tool point."""
        if not _has_tool(placed):
            return NO_POINTS
        return around(placed.on_platform(placed.frame.state.design.tool.position)[None])


class PayloadScene(ScenePart):
    """A ball at the centre of the payload, whose volume is in proportion to the mass."""

    def __init__(self, services: Services) -> None:
        scene = services.scene
        self._ball = shapes.add_translucent(
            scene, "/platform/payload", shapes.sphere(), BALL_OPACITY, colour=BRASS, side="front"
        )
        self._label = shapes.add_label(scene, "/platform/payload-label", "1 kg", fades=False)

    def updates(self, placed: Placed) -> Updates:
        """Yield the updates that draw the payload of this frame."""
        visible, payload = _has_payload(placed), placed.frame.state.design.payload
        yield from show(visible, self._ball, self._label)
        if not visible:
            return
        centre = placed.scale * np.array(payload.centre)
        yield self._ball, "position", tuple(centre.tolist())
        yield self._ball, "scale", ball_radius(payload.mass_kg)
        words = f"{format_number(payload.mass_kg)} kg"
        yield from shapes.write_label(self._label, words, centre)

    def corners(self, placed: Placed) -> FloatArray:
        """Return the ends of the ball along the axes of the base."""
        if not _has_payload(placed):
            return NO_POINTS
        payload = placed.frame.state.design.payload
        ends = ball_radius(payload.mass_kg) * np.concatenate([np.eye(3), -np.eye(3)])
        return placed.on_platform(payload.centre) + ends


def ball_radius(mass: float) -> float:
    """Return the radius of the ball of a mass in kilograms, in scene units."""
    return min(max(KILOGRAM_RADIUS * math.cbrt(mass), LEAST_RADIUS), LARGEST_RADIUS)


def _has_tool(placed: Placed) -> bool:
    """Whether the design has a tool, and it is drawn."""
    tool = placed.frame.state.design.tool
    return _is_visible(placed) and any((*tool.position, *tool.quaternion[1:]))


def _has_payload(placed: Placed) -> bool:
    """Whether the design has a payload with a mass, and it is drawn."""
    return _is_visible(placed) and placed.frame.state.design.payload.mass_kg > 0.0


def _is_visible(placed: Placed) -> bool:
    # Apart, the platform is not where its points are.
    return placed.frame.state.view.machine and not placed.is_apart
