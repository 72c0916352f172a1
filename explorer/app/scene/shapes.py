"""Primitive meshes and colours, and nodes of many copies that move in one message.

viser is slow with many nodes and fast with one instanced node, so all rods are one node, and all
balls, and all boxes.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Iterator
from typing import Any, Literal, TypeAlias

import numpy as np
import viser
from numpy.typing import NDArray
from scipy.spatial import ConvexHull

from explorer.mechanism.rgb import NEUTRAL, Rgb, linear
from explorer.numerics.arrays import FloatArray, IntArray
from explorer.page.widgets.assigning import Update

# Colours of the scene, besides those of `explorer.singularity.colours`.
GHOST: Rgb = NEUTRAL
SWEPT: Rgb = (92, 60, 156)
# Colours of the live design and of the pinned ones: distinct for every common colour-vision
# deficiency, from the scale of proximity, and from light and dark pages.
COMPARED: tuple[Rgb, ...] = ((0, 158, 115), (120, 70, 200), (225, 110, 190), (170, 150, 20))

Mesh: TypeAlias = tuple[FloatArray, IntArray]

# Number of points on a circle.
SECTIONS = 28
# Number of points around the tube of a ring.
TUBE_SECTIONS = 12
# Turns a shape by half a turn about x.
HALF_TURN = np.array([1.0, -1.0, -1.0])
# Ends of the four sides of a quadrilateral.
SIDES = np.array([[0, 1], [1, 2], [2, 3], [3, 0]])
NO_MESH: Mesh = (np.zeros((3, 3)), np.array([[0, 1, 2]]))
"""The mesh before the first frame, where each frame has its own."""

TETRAHEDRON_FACES = np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]])
"""The faces of a tetrahedron, as indices of its corners."""


def add_lines(
    scene: viser.SceneApi,
    name: str,
    count: int,
    colour: Rgb | None,
    thickness: float,
) -> viser.LineSegmentsHandle:
    """Add hidden line segments, a number of them, as a node with a name.

    Without a colour each has its own. The thickness is in pixels.
    """
    # One colour for all could not become many: the browser would draw white.
    colours = np.zeros((count, 2, 3), dtype=np.uint8) if colour is None else colour
    return scene.add_line_segments(
        name,
        np.zeros((count, 2, 3)),
        colours,
        thickness=thickness,
        thickness_units="screen",
        visible=False,
    )


def add_translucent(
    scene: viser.SceneApi,
    name: str,
    mesh: Mesh,
    opacity: float,
    *,
    colour: Rgb = (0, 0, 0),
    side: Literal["front", "double"] = "double",
    is_flat: bool = False,
) -> viser.MeshHandle:
    """Add a hidden translucent mesh, of an opacity from 0 to 1, as a node with a name.

    It is flat if each face is shaded by itself; a side of its faces, or both, are drawn.
    """
    return scene.add_mesh_simple(
        name,
        *mesh,
        color=colour,
        opacity=opacity,
        side=side,
        flat_shading=is_flat,
        visible=False,
    )


def draw_mesh(handle: viser.MeshHandle, mesh: tuple[FloatArray, NDArray[Any]]) -> Iterator[Update]:
    """Yield the updates that give a node a mesh."""
    vertices, faces = mesh
    yield handle, "vertices", vertices.astype(np.float32)
    yield handle, "faces", faces.astype(np.uint32)


class Instances:
    """Many copies of one mesh in one node, each with its own place, size and colour."""

    def __init__(
        self,
        scene: viser.SceneApi,
        name: str,
        mesh: Mesh,
        colours: list[Rgb],
        *,
        opacity: float | None = None,
    ) -> None:
        count = len(colours)
        vertices, faces = mesh
        self.handle = scene.add_batched_meshes_simple(
            name,
            vertices,
            faces,
            batched_wxyzs=np.tile([1.0, 0.0, 0.0, 0.0], (count, 1)),
            batched_positions=np.zeros((count, 3)),
            batched_scales=np.ones((count, 3)),
            batched_colors=np.array(colours, dtype=np.uint8),
            opacity=opacity,
            lod="off",
        )

    def place(
        self, positions: FloatArray, wxyzs: FloatArray | None, scales: FloatArray
    ) -> Iterator[Update]:
        """Yield the updates that place the copies (n, 3), (n, 4), (n, 3); upright with None."""
        if wxyzs is None:
            wxyzs = np.tile([1.0, 0.0, 0.0, 0.0], (len(positions), 1))
        yield self.handle, "batched_positions", positions.astype(np.float32)
        yield self.handle, "batched_wxyzs", wxyzs.astype(np.float32)
        yield self.handle, "batched_scales", scales.astype(np.float32)

    def colour(self, colours: list[Rgb]) -> Iterator[Update]:
        """Yield the updates that give each copy its colour."""
        yield self.handle, "batched_colors", np.array(colours, dtype=np.uint8)

    def show(self, visible: bool) -> Iterator[Update]:
        """Yield the updates that show or hide all copies."""
        yield self.handle, "visible", visible


class Rods(Instances):
    """Cylinders between pairs of points."""

    def __init__(
        self, scene: viser.SceneApi, name: str, colours: list[Rgb], *, opacity: float | None = None
    ) -> None:
        super().__init__(scene, name, cylinder(), colours, opacity=opacity)

    def between(self, starts: FloatArray, ends: FloatArray, radii: FloatArray) -> Iterator[Update]:
        """Yield the updates that lay the cylinders from starts (n, 3) to ends (n, 3)."""
        spans = ends - starts
        lengths = np.linalg.norm(spans, axis=1)
        scales = np.stack([radii, radii, np.maximum(lengths, 1e-9)], axis=1)
        yield from self.place(starts, turn_z_to(spans), scales)


class Balls(Instances):
    """Spheres."""

    def __init__(self, scene: viser.SceneApi, name: str, colours: list[Rgb]) -> None:
        super().__init__(scene, name, sphere(), colours)

    def at(self, centres: FloatArray, radii: FloatArray) -> Iterator[Update]:
        """Yield the updates that put the spheres at centres (n, 3)."""
        yield from self.place(centres, None, np.repeat(radii[:, None], 3, axis=1))


class Patch:
    """A translucent quadrilateral with an outline."""

    def __init__(self, scene: viser.SceneApi, name: str, opacity: float) -> None:
        square = np.zeros((4, 3)), np.array([[0, 1, 2], [0, 2, 3]])
        self._plane = add_translucent(scene, f"{name}/plane", square, opacity)
        self._outline = add_lines(scene, f"{name}/hem", len(SIDES), None, 1.5)

    def show(self, visible: bool) -> Iterator[Update]:
        """Yield the updates that show or hide the patch."""
        yield self._plane, "visible", visible
        yield self._outline, "visible", visible

    def span(self, corners: FloatArray, colour: Rgb) -> Iterator[Update]:
        """Yield the updates that span the patch between corners (4, 3)."""
        yield self._plane, "color", colour
        yield self._plane, "vertices", corners.astype(np.float32)
        yield self._outline, "points", corners[SIDES].astype(np.float32)
        yield self._outline, "colors", of_one_colour(colour, len(SIDES))


@functools.lru_cache(maxsize=256)
def linear_colour(colour: Rgb) -> Rgb:
    """Return the linear value of an sRGB colour, for what shall look like a mesh in this colour.

    viser's client takes the colours of copies and of the ends of segments for linear ones.
    """
    red, green, blue = (round(255.0 * linear(channel)) for channel in colour)
    return red, green, blue


@functools.lru_cache(maxsize=256)
def of_one_colour(colour: Rgb, count: int) -> NDArray[np.uint8]:
    """Return vertex colours of `count` segments of one colour, shape (count, 2, 3); read only."""
    colours = np.tile(np.array(linear_colour(colour), dtype=np.uint8), (count, 2, 1))
    colours.flags.writeable = False
    return colours


def dashes(lines: FloatArray, most: int, period: float, drawn: float) -> FloatArray:
    """Return lines, given by their ends (n, 2, 3), cut into dashes, shape (n * most, 2, 3).

    Dashes beyond the end of a line have no length; one dash is the whole line. The period is that
    of a dash and the space after it, longer where the dashes would not do; a share of it is drawn.
    """
    if most == 1:
        return lines
    spans = (lines[:, 1] - lines[:, 0])[:, None, None]
    lengths = np.linalg.norm(spans[:, 0, 0], axis=1)
    # A line begins and ends with a dash.
    periods = np.minimum(np.maximum(np.rint(lengths / period + 1.0 - drawn), 1.0), most) - 1.0
    shares = (np.arange(most)[:, None] + [0.0, drawn]) / (periods + drawn)[:, None, None]
    shares = np.minimum(shares, 1.0)
    return (lines[:, None, :1] + shares[..., None] * spans).reshape(-1, 2, 3)


def turn_z_to(directions: FloatArray) -> FloatArray:
    """Return quaternions (n, 4) that turn the z-axis to directions (n, 3)."""
    lengths = np.linalg.norm(directions, axis=1, keepdims=True)
    unit = np.divide(
        directions, lengths, out=np.tile([0.0, 0.0, 1.0], (len(lengths), 1)), where=lengths > 0.0
    )
    wxyz = np.stack([1.0 + unit[:, 2], -unit[:, 1], unit[:, 0], np.zeros(len(unit))], axis=1)
    wxyz[unit[:, 2] < -1.0 + 1e-12] = (0.0, 1.0, 0.0, 0.0)
    return wxyz / np.linalg.norm(wxyz, axis=1, keepdims=True)


def _revolve(*profile: tuple[float, float]) -> Mesh:
    """Return the surface that a line of points (r, z) sweeps about the z-axis, seen from its right.

    It is smooth along the line; parts that meet at a sharp edge are revolved apart.
    """
    angles = np.linspace(0.0, 2.0 * np.pi, SECTIONS, endpoint=False)
    radii, heights = np.array(profile).T
    sides = [np.outer(turn(angles), radii) for turn in (np.cos, np.sin)]
    vertices = np.stack([*sides, np.tile(heights, (SECTIONS, 1))], axis=-1).reshape(-1, 3)
    count = len(profile)
    section, point = (each.ravel() for each in np.indices((SECTIONS, count - 1)))
    a, b = count * section + point, count * ((section + 1) % SECTIONS) + point
    faces = np.concatenate([np.stack([a, b, b + 1], 1), np.stack([a, b + 1, a + 1], 1)])
    # On the axis one of two faces has no area.
    ends = vertices[faces]
    areas = np.linalg.norm(np.cross(ends[:, 1] - ends[:, 0], ends[:, 2] - ends[:, 0]), axis=1)
    return vertices, faces[areas > 1e-12]


@functools.cache
def cylinder() -> Mesh:
    """Return the cylinder of radius one from z = 0 to z = 1, its rim with sharp edges."""
    bottom, top = _revolve((0.0, 0.0), (1.0, 0.0)), _revolve((1.0, 1.0), (0.0, 1.0))
    return join_meshes(bottom, _revolve((1.0, 0.0), (1.0, 1.0)), top)


@functools.cache
def cone() -> Mesh:
    """Return the cone of radius one from z = 0 to z = 1."""
    return join_meshes(_revolve((0.0, 0.0), (1.0, 0.0)), _revolve((1.0, 0.0), (0.0, 1.0)))


@functools.cache
def sphere() -> Mesh:
    """Return the sphere of radius one."""
    angles = np.linspace(-0.5 * np.pi, 0.5 * np.pi, SECTIONS).tolist()
    return _revolve(*((math.cos(angle), math.sin(angle)) for angle in angles))


@functools.cache
def torus(radius: float, tube: float) -> Mesh:
    """Return the ring about the z-axis with a radius and the radius of its tube."""
    angles = np.linspace(-np.pi, np.pi, TUBE_SECTIONS + 1).tolist()
    return _revolve(*((radius + tube * math.cos(v), tube * math.sin(v)) for v in angles))


def join_meshes(*meshes: Mesh) -> Mesh:
    """Return several meshes as one."""
    starts = np.cumsum([0, *(len(vertices) for vertices, _ in meshes)])
    vertices = np.concatenate([vertices for vertices, _ in meshes])
    faces = [faces + start for (_, faces), start in zip(meshes, starts, strict=False)]
    return vertices, np.concatenate(faces)


@functools.cache
def box() -> Mesh:
    """Return the unit cube about the origin."""
    square = np.array([[-0.5, -0.5], [0.5, -0.5], [0.5, 0.5], [-0.5, 0.5]])
    side = np.column_stack([square, np.full(4, 0.5)])
    sides = [np.roll(turn * side, axis, axis=1) for axis in range(3) for turn in (HALF_TURN, 1.0)]
    return _sharp(np.concatenate([each[[0, 1, 2, 0, 2, 3]].reshape(2, 3, 3) for each in sides]))


def plate(points: FloatArray, radius: float, bottom: float, top: float) -> Mesh:
    """Return the hull of discs of a radius around points (n, 2), from z = bottom to top."""
    return _plate(tuple((x, y) for x, y in points.tolist()), radius, bottom, top)


@functools.lru_cache(maxsize=8)
def _plate(
    points: tuple[tuple[float, float], ...], radius: float, bottom: float, top: float
) -> Mesh:
    angles = np.linspace(0.0, 2.0 * np.pi, 2 * SECTIONS, endpoint=False)
    disc = radius * np.stack([np.cos(angles), np.sin(angles)], axis=1)
    outline = (np.array(points)[:, None, :] + disc).reshape(-1, 2)
    rim = outline[ConvexHull(outline).vertices]
    count = len(rim)
    corners = np.empty((2 * count, 3))
    corners[:, :2] = np.concatenate([rim, rim])
    corners[:count, 2], corners[count:, 2] = bottom, top
    i = np.arange(count)
    j = (i + 1) % count
    wall = np.concatenate([np.stack([i, j, count + j], 1), np.stack([i, count + j, count + i], 1)])
    fan = np.stack([np.zeros(count - 2, int), i[1:-1], i[2:]], axis=1)
    faces = np.concatenate([wall, fan[:, ::-1], count + fan])
    return _sharp(corners[faces])


def _sharp(triangles: FloatArray) -> Mesh:
    """Return triangles (n, 3, 3) as a mesh with corners of their own, so that edges are sharp."""
    return triangles.reshape(-1, 3), np.arange(3 * len(triangles)).reshape(-1, 3)


def add_label(
    scene: viser.SceneApi,
    name: str,
    text: str,
    *,
    colour: Rgb | None = None,
    fades: bool = True,
) -> viser.LabelHandle:
    """Add a hidden label; the parent of its node is the frame of its position.

    Without a colour it has that of the page's
    text; it may be pale where a body hides its point.
    """
    height = label_height((0, 0, 0) if colour is None else colour)
    return scene.add_label(name, text, font_scene_height=height, depth_test=fades, visible=False)


def write_label(handle: viser.LabelHandle, text: str, place: FloatArray) -> Iterator[Update]:
    """Yield the updates that give a label its text and its position (3,)."""
    yield handle, "text", text
    yield handle, "position", tuple(place.tolist())


def label_height(colour: Rgb) -> float:
    """Return the `font_scene_height` by which a script gives a label its colour.

    viser's labels have none, and use this height only if their size is that of things in the scene.
    """
    red, green, blue = colour
    return float(red << 16 | green << 8 | blue)
