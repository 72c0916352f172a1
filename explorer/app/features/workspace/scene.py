"""The solid and the hull of the workspace, the singular planes, and the broken limit."""

from __future__ import annotations

from collections.abc import Iterator
from functools import lru_cache

import numpy as np
import viser
from numpy.typing import NDArray

from explorer.app.features.feature import Services
from explorer.app.features.workspace.feeds import (
    WORKSPACE_FEED,
    surface_of,
    workspace_position,
    workspace_rotation,
)
from explorer.app.features.workspace.tasks import (
    WorkspaceDrawing,
    WorkspaceRequest,
    WorkspaceSurface,
)
from explorer.app.scene.bands import AT_LIMIT, COLLIDING, PLAIN, Shell
from explorer.app.scene.creases import Drawn
from explorer.app.scene.placing import NO_POINTS, Placed, ScenePart
from explorer.app.scene.shapes import NO_MESH, Patch, add_label, add_lines, add_translucent
from explorer.app.widgets.assigning import Update
from explorer.measures.size import corners_of
from explorer.numerics.arrays import FloatArray
from explorer.numerics.number_text import format_number
from explorer.singularity.colours import OUTLINE, Rgb, band_colours, proximity_colour
from explorer.workspace.limits.constraints import (
    BallOrCylinder,
    Cone,
    HalfSpace,
    Never,
    constraints,
)
from explorer.workspace.position_bands import SHARE_COLOURS, STEP_COLOURS

# Each ray passes at least two faces: the mechanism stays readable within the solid.
PLAIN_OPACITY = 0.125
# Opacity of bands of colour, of which only the faces towards the camera are drawn.
BAND_OPACITY = 0.4
# Opacity where legs collide, so that this is visible through the rest.
COLLIDING_OPACITY = 0.6
# Opacity where a part takes its limit, which can be most of the surface.
AT_LIMIT_OPACITY = 0.3
# Colour of the edges on a light page and on a dark one, and their thickness in pixels.
EDGE_COLOURS: tuple[Rgb, Rgb] = (58, 86, 126), (138, 164, 200)
EDGE_THICKNESS = 1.3
PLANE_OPACITY = 0.12
HULL_COLOUR: Rgb = (90, 100, 116)
HULL_OPACITY = 0.3
# Corners of a square about its centre, in order.
CORNERS = ((-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0))


class WorkspaceScene(ScenePart):
    """The newest drawing, the singular planes, and the limit that the position p breaks most."""

    def __init__(self, services: Services) -> None:
        scene = services.scene
        self._feed = services.get(WORKSPACE_FEED)
        # Collisions are added first and so drawn first: surfaces before them let them through.
        colours = (COLLIDING, AT_LIMIT, PLAIN, *band_colours(), *SHARE_COLOURS, *STEP_COLOURS)
        self._colours: tuple[Rgb, ...] = tuple(dict.fromkeys(colours))
        self._shells = [
            add_translucent(scene, f"/workspace/shell/{i}", NO_MESH, PLAIN_OPACITY, colour=colour)
            for i, colour in enumerate(self._colours)
        ]
        self._edges = add_lines(scene, "/workspace/edges", 1, EDGE_COLOURS[0], EDGE_THICKNESS)
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
        self._broken_label = add_label(scene, "/workspace/broken/label", "limit", visible=False)

    def updates(self, placed: Placed) -> Iterator[Update]:
        """Yield the updates that draw the workspace of a frame."""
        view = placed.frame.state.view.workspace
        drawing, surface = self._feed.drawing, surface_of(self._feed)
        shells: dict[Rgb, Drawn] = {}
        edges = hull = None
        if surface is not None:
            shells, edges = _scale_surface(surface, placed.scale)
            # The workspace of the tool point is that of b4, moved.
            place = _place(placed, surface.request)
            for handle in (*self._shells, self._edges):
                yield handle, "position", place
        if drawing is not None:
            hull = _scale_hull(drawing, placed.scale)
            yield self._hull, "position", _place(placed, drawing.request)
        is_cut = surface is not None and surface.request.cut is not None
        for colour, handle in zip(self._colours, self._shells, strict=True):
            shell = shells.get(colour) if view.solid else None
            yield handle, "visible", shell is not None
            if shell is not None:
                yield handle, "opacity", _opacity(colour, is_cut=is_cut)
                yield handle, "side", _side(colour, is_cut=is_cut)
                yield handle, "vertices", shell[0]
                yield handle, "faces", shell[1]
        yield self._edges, "visible", view.solid and edges is not None
        if view.solid and edges is not None:
            yield self._edges, "colors", np.array(EDGE_COLOURS[placed.dark], dtype=np.uint8)
            yield self._edges, "points", edges
        yield self._hull, "visible", view.hull and hull is not None
        if view.hull and hull is not None:
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
        offset = placed.frame.state.offset(drawing.request.rotation)
        return corners_of(placed.scale * (np.array(drawing.extent) + offset))

    def _broken_limit(self, placed: Placed) -> Iterator[Update]:
        """Yield the updates that draw a line from p to the surface of the limit it breaks most.

        Both are moved as the workspace is.
        """
        frame = placed.frame
        shown = frame.state.view.workspace.solid and frame.state.unclosed is None
        worst: tuple[float, str, FloatArray] | None = None
        if shown and frame.snapshot.violations:
            p = np.array(workspace_position(frame))
            for limit in constraints(frame.state.design, workspace_rotation(frame)):
                if isinstance(limit, Never | Cone):
                    continue
                slack = float(limit.slack(p))
                if slack < -frame.state.design.tolerance and (worst is None or slack < worst[0]):
                    worst = slack, limit.name, _nearest(limit, p)
        for handle in (self._broken, self._broken_label):
            yield handle, "visible", worst is not None
        if worst is not None:
            offset = frame.state.offset(workspace_rotation(frame))
            ends = placed.scale * (np.array([workspace_position(frame), worst[2]]) + offset)
            yield self._broken, "points", ends[None].astype(np.float32)
            yield self._broken_label, "text", f"{worst[1]}: {format_number(-worst[0], 3)} beyond"
            yield self._broken_label, "position", tuple(ends[1].tolist())


class _SingularPlane:
    """One of up to three planes of singular positions; those of b4 all pass through a1."""

    def __init__(self, scene: viser.SceneApi, index: int) -> None:
        self._index = index
        self._patch = Patch(scene, f"/singular/{index + 1}", opacity=PLANE_OPACITY, visible=False)
        self._label = add_label(
            scene, f"/singular/{index + 1}/label", f"δ{index + 1} = 0", visible=False
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
        corners = half * np.array([a * along + b * across for a, b in CORNERS]) + placed.offset
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


def _opacity(colour: Rgb, *, is_cut: bool) -> float | None:
    if is_cut:
        return None
    opacities = {PLAIN: PLAIN_OPACITY, COLLIDING: COLLIDING_OPACITY, AT_LIMIT: AT_LIMIT_OPACITY}
    return opacities.get(colour, BAND_OPACITY)


def _side(colour: Rgb, *, is_cut: bool) -> str:
    """Return which sides of faces are drawn: of translucent bands only those in front."""
    return "double" if is_cut or colour in (PLAIN, COLLIDING, AT_LIMIT) else "front"


def _place(placed: Placed, request: WorkspaceRequest) -> tuple[float, ...]:
    offset = placed.frame.state.offset(request.rotation)
    return tuple((placed.scale * offset).tolist())


# Both are cached, so that updates compare what is drawn by identity.
@lru_cache(2)
def _scale_surface(
    surface: WorkspaceSurface, scale: float
) -> tuple[dict[Rgb, Drawn], NDArray[np.float32] | None]:
    """Return the shells of a surface in scene units, by colour, and its edges; None for none."""
    shells = {shell.colour: _scale_shell(shell, scale) for shell in surface.shells}
    edges = np.asarray(scale * surface.edges, dtype=np.float32)
    return shells, edges if len(edges) else None


@lru_cache(2)
def _scale_hull(drawing: WorkspaceDrawing, scale: float) -> Drawn | None:
    return None if drawing.hull is None else _scale_shell(drawing.hull, scale)


def _scale_shell(shell: Shell, scale: float) -> Drawn:
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
