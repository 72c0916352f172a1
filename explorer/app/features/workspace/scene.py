"""The solid and the hull of the workspace, the singular planes, and the broken limit."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import viser

from explorer.app.features.feature import Services
from explorer.app.features.workspace.feed import WorkspaceFeed
from explorer.app.features.workspace.orientation import workspace_rotation
from explorer.app.features.workspace.tasks import WorkspaceDrawing
from explorer.app.scene.bands import COLLIDING, PLAIN, Shell
from explorer.app.scene.creases import Drawn
from explorer.app.scene.part import NO_POINTS, ScenePart
from explorer.app.scene.placing import Placed
from explorer.app.scene.shapes import NO_MESH, Patch, add_lines, add_translucent
from explorer.app.widgets.assigning import Update
from explorer.app.widgets.colours import OUTLINE, Rgb, proximity_colour
from explorer.measures.size import corners_of
from explorer.numerics.arrays import FloatArray
from explorer.numerics.number_text import format_number
from explorer.singularity.colours import band_colours
from explorer.workspace.limits.constraints import (
    BallOrCylinder,
    Cone,
    HalfSpace,
    Never,
    constraints,
)

SOLID_OPACITY = 0.42
# Opacity where legs collide, so that this is visible through the rest.
COLLIDING_OPACITY = 0.8
CUT_OPACITY = 0.96
PLANE_OPACITY = 0.12
HULL_COLOUR: Rgb = (90, 100, 116)
HULL_OPACITY = 0.3
# Corners of a square about its centre, in order.
CORNERS = ((-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0))


class WorkspaceScene(ScenePart):
    """The newest drawing, the singular planes, and the limit that the position p breaks most."""

    def __init__(self, services: Services) -> None:
        scene = services.scene
        self._feed = services.get(WorkspaceFeed)
        # Collisions are added first and so drawn first: surfaces before them let them through.
        self._colours: tuple[Rgb, ...] = (COLLIDING, PLAIN, *band_colours())
        self._shells = [
            add_translucent(
                scene,
                f"/workspace/shell/{index}",
                NO_MESH,
                SOLID_OPACITY,
                colour=colour,
                is_flat=True,
            )
            for index, colour in enumerate(self._colours)
        ]
        self._hull = scene.add_mesh_simple(
            "/workspace/hull",
            *NO_MESH,
            color=HULL_COLOUR,
            wireframe=True,
            opacity=HULL_OPACITY,
            visible=False,
        )
        self._planes = [_SingularPlane(scene, index) for index in range(3)]
        self._broken = add_lines(scene, "/workspace/broken/lines", 1, OUTLINE, 4.0)
        self._broken_label = scene.add_label(
            "/workspace/broken/label", "limit", font_screen_scale=0.9, visible=False
        )
        self._scaled_from: tuple[WorkspaceDrawing, float] | None = None
        self._scaled: dict[Rgb, Drawn] = {}
        self._scaled_hull: Drawn | None = None

    def updates(self, placed: Placed) -> Iterator[Update]:
        """Yield the updates that draw the workspace of a frame."""
        view = placed.frame.state.view.workspace
        drawing = self._feed.drawing
        self._scale(drawing, placed.scale)
        is_cut = drawing is not None and drawing.request.cut is not None
        for colour, handle in zip(self._colours, self._shells, strict=True):
            shell = self._scaled.get(colour)
            yield handle, "visible", view.solid and shell is not None
            if view.solid and shell is not None:
                yield handle, "opacity", _opacity(colour, is_cut=is_cut)
                yield handle, "vertices", shell[0]
                yield handle, "faces", shell[1]
        hull = self._scaled_hull if view.hull else None
        yield self._hull, "visible", hull is not None
        if hull is not None:
            yield self._hull, "vertices", hull[0]
            yield self._hull, "faces", hull[1]
        for plane in self._planes:
            yield from plane.updates(placed)
        yield from self._broken_limit(placed)

    def corners(self, placed: Placed) -> FloatArray:
        """Return the corners of the box about the drawn workspace."""
        drawing = self._feed.drawing
        if drawing is None or drawing.extent is None:
            return NO_POINTS
        return corners_of(placed.scale * np.array(drawing.extent))

    def _scale(self, drawing: WorkspaceDrawing | None, scale: float) -> None:
        """Scale a new drawing to scene units, once, so that updates compare it by identity."""
        if drawing is None:
            self._scaled_from, self._scaled, self._scaled_hull = None, {}, None
        elif self._scaled_from is None or (
            self._scaled_from[0] is not drawing or self._scaled_from[1] != scale
        ):
            self._scaled_from = drawing, scale
            self._scaled = {shell.colour: _scaled(shell, scale) for shell in drawing.shells}
            self._scaled_hull = None if drawing.hull is None else _scaled(drawing.hull, scale)

    def _broken_limit(self, placed: Placed) -> Iterator[Update]:
        """Yield the updates that draw a line from p to the surface of the limit it breaks most."""
        frame = placed.frame
        shown = frame.state.view.workspace.solid and frame.state.unclosed is None
        worst: tuple[float, str, FloatArray] | None = None
        if shown and frame.snapshot.violations:
            p = np.array(frame.state.pose.position)
            for limit in constraints(frame.state.design, workspace_rotation(frame)):
                if isinstance(limit, Never | Cone):
                    continue
                slack = float(limit.slack(p))
                if slack < -frame.state.design.tolerance and (worst is None or slack < worst[0]):
                    worst = slack, limit.name, _nearest(limit, p)
        for handle in (self._broken, self._broken_label):
            yield handle, "visible", worst is not None
        if worst is not None:
            ends = placed.scale * np.array([frame.state.pose.position, worst[2]])
            yield self._broken, "points", ends[None].astype(np.float32)
            yield self._broken_label, "text", f"{worst[1]}: {format_number(-worst[0], 3)} beyond"
            yield self._broken_label, "position", tuple(ends[1].tolist())


class _SingularPlane:
    """One of the three planes of singular positions, which all pass through a1."""

    def __init__(self, scene: viser.SceneApi, index: int) -> None:
        self._index = index
        self._patch = Patch(scene, f"/singular/{index + 1}", opacity=PLANE_OPACITY, visible=False)
        self._label = scene.add_label(
            f"/singular/{index + 1}/label", f"δ{index + 1} = 0", visible=False
        )

    def updates(self, placed: Placed) -> Iterator[Update]:
        """Yield the updates that draw the plane of a frame."""
        state, snapshot = placed.frame.state, placed.frame.snapshot
        normal = self._normal(snapshot.rotation) if state.view.workspace.planes else None
        yield from self._patch.show(normal is not None)
        yield self._label, "visible", normal is not None
        if normal is None:
            return
        colour = proximity_colour(placed.frame.verdict.levels[self._index])
        along = np.cross(normal, [0.0, 1.0, 0.0])
        if np.linalg.norm(along) < 0.1:
            along = np.array([1.0, 0.0, 0.0])
        along /= np.linalg.norm(along)
        across = np.cross(normal, along)
        half = 1.1 * placed.reach
        corners = half * np.array([a * along + b * across for a, b in CORNERS])
        yield from self._patch.span(corners, colour)
        yield self._label, "position", tuple(corners[2].tolist())

    def _normal(self, rotation: FloatArray) -> FloatArray | None:
        """Return the unit normal; None if the lines are parallel and every position is singular."""
        x = rotation[:, 0]
        normal = (-rotation[:, 2], np.array([0.0, -x[2], x[1]]), np.array([0.0, 0.0, 1.0]))[
            self._index
        ]
        length = float(np.linalg.norm(normal))
        return normal / length if length > 1e-9 else None


def _opacity(colour: Rgb, *, is_cut: bool) -> float:
    if is_cut:
        return CUT_OPACITY
    return COLLIDING_OPACITY if colour == COLLIDING else SOLID_OPACITY


def _scaled(shell: Shell, scale: float) -> Drawn:
    vertices = np.asarray(shell.vertices * scale, dtype=np.float32)
    return vertices, np.asarray(shell.faces, dtype=np.uint32)


def _nearest(limit: BallOrCylinder | HalfSpace, p: FloatArray) -> FloatArray:
    """Return the position nearest to p on the surface of a limit."""
    if isinstance(limit, HalfSpace):
        excess = float(limit.normal @ p) - limit.offset
        return p - limit.normal * excess / float(limit.normal @ limit.normal)
    axes = np.array([1.0 if limit.is_ball else 0.0, 1.0, 1.0])
    off = (p - limit.centre) * axes
    distance = float(np.linalg.norm(off))
    outward = off / distance if distance > 0.0 else np.array([0.0, 0.0, 1.0])
    return p + outward * (limit.radius - distance)
