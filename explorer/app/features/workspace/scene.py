"""The solid and the hull of the workspace, the singular planes, and the broken limit."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
import viser
from numpy.typing import NDArray

from explorer.app.features.feature import Services, show
from explorer.app.features.workspace import feeds, work
from explorer.app.scene import shapes
from explorer.app.scene.placing import NO_POINTS, Placed, ScenePart
from explorer.app.scene.surfaces import AT_LIMIT, COLLIDING, PLAIN, Drawn, Shell
from explorer.app.state.frame import Frame
from explorer.measures.box import corners_of
from explorer.measures.position_bands import STEP_COLOURS, UTILISATION_COLOURS
from explorer.mechanism.rgb import OUTLINE, Rgb
from explorer.numerics.arrays import FloatArray
from explorer.page.widgets.assigning import Updates
from explorer.singularity.colours import band_colours, proximity_colour
from explorer.singularity.ellipsoids import planes_of_singularity
from explorer.workspace.faces.surfaces import Surfaces
from explorer.workspace.limits import constraints as limits
from explorer.workspace.workspace import Workspace

# Each ray passes at least two faces: the mechanism stays readable within the solid.
PLAIN_OPACITY = 0.125
# Opacity of bands of colour, of which only the faces towards the camera are drawn.
BAND_OPACITY = 0.4
# Opacity where legs collide, so that this is visible through the rest.
COLLIDING_OPACITY = 0.6
# Opacity where a part takes its limit, which can be most of the surface.
AT_LIMIT_OPACITY = 0.3
# Colour of the edges, seen on light pages and on dark ones, and their thickness in pixels.
EDGE_COLOUR: Rgb = (84, 116, 164)
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
        self._feed = services.get(feeds.WORKSPACE_FEED)
        # Collisions are added first and so drawn first: surfaces before them let them through.
        colours = (COLLIDING, AT_LIMIT, PLAIN, *band_colours(), *UTILISATION_COLOURS, *STEP_COLOURS)
        self._colours: tuple[Rgb, ...] = tuple(dict.fromkeys(colours))
        self._shells = [
            shapes.add_translucent(
                scene, f"/workspace/shell/{i}", shapes.NO_MESH, PLAIN_OPACITY, colour=colour
            )
            for i, colour in enumerate(self._colours)
        ]
        self._edges = shapes.add_lines(scene, "/workspace/edges", 1, EDGE_COLOUR, EDGE_THICKNESS)
        self._hull = scene.add_mesh_simple(
            "/workspace/hull",
            *shapes.NO_MESH,
            color=HULL_COLOUR,
            wireframe=True,
            opacity=HULL_OPACITY,
            visible=False,
        )
        self._planes = [_SingularPlane(scene, index) for index in range(3)]
        self._broken = shapes.add_lines(scene, "/workspace/broken/lines", 1, OUTLINE, 4.0)
        self._broken_label = shapes.add_label(scene, "/workspace/broken/label", "limit")

    def updates(self, placed: Placed) -> Updates:
        """Yield the updates that draw the workspace of a frame."""
        view = placed.frame.state.view.workspace
        drawing, surface = self._feed.drawing, feeds.surface_of(self._feed)
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
                opacity, side = _look(colour, is_cut=is_cut)
                yield handle, "opacity", opacity
                yield handle, "side", side
                yield handle, "vertices", shell[0]
                yield handle, "faces", shell[1]
        yield self._edges, "visible", view.solid and edges is not None
        if view.solid and edges is not None:
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

    def _broken_limit(self, placed: Placed) -> Updates:
        """Yield the updates that draw a line from p to the surface of the limit it breaks most."""
        broken = _most_broken(placed.frame)
        yield from show(broken is not None, self._broken, self._broken_label)
        if broken is not None:
            name, slack, ends = broken
            yield self._broken, "points", (placed.scale * ends)[None].astype(np.float32)
            words = f"{name}: {placed.frame.state.unit.text(-slack, 3)} beyond"
            yield from shapes.write_label(self._broken_label, words, placed.scale * ends[1])


def _most_broken(frame: Frame) -> tuple[str, float, FloatArray] | None:
    """Return the limit that p breaks most, its slack, and p and its nearest point of the surface.

    Both are moved as the workspace is, in design units. None if no limit is broken, or drawn.
    """
    state = frame.state
    if not state.view.workspace.solid or state.unclosed or not frame.snapshot.violations:
        return None
    rotation = feeds.workspace_pose(frame).rotation
    p = np.array(feeds.workspace_position(frame))
    broken = [
        (float(limit.slack(p)), limit)
        for limit in Workspace(state.design, rotation).limits
        if isinstance(limit, limits.BallOrCylinder | limits.HalfSpace)
    ]
    slack, limit = min(broken, key=lambda pair: pair[0])
    if slack >= -state.design.tolerance:
        return None
    (distance,), (inward,) = Surfaces([limit]).distances(p[None], np.zeros(1, dtype=np.int64))
    return limit.name, slack, np.array([p, p - distance * inward]) + state.offset(rotation)


class _SingularPlane:
    """One of up to three planes of singular positions; those of b4 all pass through a1."""

    def __init__(self, scene: viser.SceneApi, index: int) -> None:
        self._index = index
        self._patch = shapes.Patch(scene, f"/singular/{index + 1}", PLANE_OPACITY)
        self._label = shapes.add_label(scene, f"/singular/{index + 1}/label", f"δ{index + 1} = 0")

    def updates(self, placed: Placed) -> Updates:
        """Yield the updates that draw the plane of a frame."""
        state, snapshot = placed.frame.state, placed.frame.snapshot
        normal, length = NO_POINTS, 0.0
        if state.view.workspace.planes:
            normal = planes_of_singularity(snapshot.rotation)[self._index]
            length = float(np.linalg.norm(normal))
        # If the lines are parallel every position is singular.
        is_drawn = length > 1e-9
        yield from show(is_drawn, self._patch, self._label)
        if not is_drawn:
            return
        along = np.cross(normal / length, [0.0, 1.0, 0.0])
        if np.linalg.norm(along) < 0.1:
            along = np.array([1.0, 0.0, 0.0])
        along /= np.linalg.norm(along)
        across = np.cross(normal / length, along)
        corners = np.array([a * along + b * across for a, b in CORNERS])
        corners = 1.1 * placed.reach * corners + placed.offset
        colour = proximity_colour(placed.frame.verdict.levels[self._index])
        yield from self._patch.span(corners, colour)
        yield self._label, "position", tuple(corners[2].tolist())


def _look(colour: Rgb, *, is_cut: bool) -> tuple[float | None, str]:
    """Return the opacity and the visible sides of faces: of translucent bands those in front."""
    if is_cut:
        return None, "double"
    opacities = {PLAIN: PLAIN_OPACITY, COLLIDING: COLLIDING_OPACITY, AT_LIMIT: AT_LIMIT_OPACITY}
    return opacities.get(colour, BAND_OPACITY), "double" if colour in opacities else "front"


def _place(placed: Placed, request: work.WorkspaceRequest) -> tuple[float, ...]:
    offset = placed.frame.state.offset(request.rotation)
    return tuple((placed.scale * offset).tolist())


# Both are cached, so that updates compare what is drawn by identity.
@lru_cache(2)
def _scale_surface(
    surface: work.WorkspaceSurface, scale: float
) -> tuple[dict[Rgb, Drawn], NDArray[np.float32] | None]:
    """Return the shells of a surface in scene units, by colour, and its edges; None for none."""
    shells = {shell.colour: _scale_shell(shell, scale) for shell in surface.shells}
    edges = np.asarray(scale * surface.edges, dtype=np.float32)
    return shells, edges if len(edges) else None


@lru_cache(2)
def _scale_hull(drawing: work.WorkspaceDrawing, scale: float) -> Drawn | None:
    return None if drawing.hull is None else _scale_shell(drawing.hull, scale)


def _scale_shell(shell: Shell, scale: float) -> Drawn:
    vertices = np.asarray(shell.vertices * scale, dtype=np.float32)
    return vertices, np.asarray(shell.faces, dtype=np.uint32)
