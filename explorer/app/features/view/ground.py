"""The lights, and the ground under the mechanism: its grid with a scale, and the shadow on it.

viser's own lighting, an environment map and shadow maps, takes a software renderer four times as
long, and three.js may keep drawing a mesh of another shape than it has while shadow maps come
and go. The shadow is the outline of each body as the sun projects it on the ground, in closed form.
"""

from __future__ import annotations

import numpy as np

from explorer.app.features.feature import Services
from explorer.app.features.mechanism import bodies
from explorer.app.scene.placing import Placed, ScenePart
from explorer.app.scene.shapes import add_label
from explorer.app.widgets.assigning import Updates
from explorer.numerics.arrays import FloatArray
from explorer.reproduce.six_legs import TWIN
from explorer.singularity.colours import Rgb

TO_SUN = np.array([-0.22, 0.3, 1.0])
"""Direction from the scene to the sun, so that shadows fall towards the isometric camera."""

# Colours of the light from above and from below, and the intensities of both lights.
SKY: Rgb = (255, 255, 255)
FROM_BELOW: Rgb = (112, 120, 150)
SKY_INTENSITY, SUN_INTENSITY = 2.0, 3.0
# The shadow lies below the lines of the grid, and both below the base plate.
GRID_BELOW, SHADOW_BELOW = 0.01, 0.03
# Colours of the grid's cells and sections, by whether the page is dark.
GRID: dict[bool, tuple[Rgb, Rgb]] = {
    False: ((226, 230, 236), (203, 209, 218)),
    True: ((38, 41, 46), (56, 61, 69)),
}
SHADOW: dict[bool, Rgb] = {False: (188, 192, 200), True: (4, 4, 5)}
# Directions on the ground, in each of which an outline has a corner.
CORNERS = 32
ANGLES = np.linspace(0.0, 2.0 * np.pi, CORNERS, endpoint=False)
OUTWARD = np.stack([np.cos(ANGLES), np.sin(ANGLES)], axis=1)
# Both plates, and as many legs as the twin has.
OUTLINES = 2 + len(TWIN)
# Rows that project a direction along the sun's rays on the ground.
PROJECTION = np.column_stack([np.eye(2), -TO_SUN[:2] / TO_SUN[2]])


class Ground(ScenePart):
    """The lights, the grid with the size of its squares, and the shadow.

    `labels.js` writes the size in a corner of the scene, or draws a bar of such a length where that
    is the same at every depth.
    """

    def __init__(self, services: Services) -> None:
        scene = services.scene
        scene.configure_environment_map(hdri=None)
        scene.configure_default_lights(enabled=False, cast_shadow=False)
        # Lights shine from where they are towards the origin.
        scene.add_light_hemisphere(
            "/lights/sky",
            sky_color=SKY,
            ground_color=FROM_BELOW,
            intensity=SKY_INTENSITY,
            position=(0.0, 0.0, 1.0),
        )
        scene.add_light_directional(
            "/lights/sun", intensity=SUN_INTENSITY, cast_shadow=False, position=tuple(TO_SUN)
        )
        self._scale = add_label(scene, "/ground/scale", "")
        self._grid = scene.add_grid(
            "/grid",
            width=60.0,
            height=60.0,
            cell_color=GRID[False][0],
            section_color=GRID[False][1],
            fade_distance=46.0,
            fade_from="origin",
            shadow_opacity=0.0,
        )
        fans = np.stack(
            [np.zeros(CORNERS - 2, int), np.arange(1, CORNERS - 1), np.arange(2, CORNERS)], axis=1
        )
        faces = (CORNERS * np.arange(OUTLINES)[:, None, None] + fans).reshape(-1, 3)
        self._shadow = scene.add_mesh_simple(
            "/shadow",
            np.zeros((OUTLINES * CORNERS, 3)),
            faces,
            # Flat and of one tone, so that the cheapest material does.
            material="toon3",
        )

    def updates(self, placed: Placed) -> Updates:
        """Yield the updates that draw the ground of this frame."""
        view, lowest = placed.frame.state.view, ground_of(placed)
        for handle in (self._grid, self._scale):
            yield handle, "visible", view.grid
        # Of the sides of the squares, in millimetres.
        yield self._scale, "text", f"{placed.square_mm:.6g}"
        cell, section = GRID[placed.dark]
        yield self._grid, "cell_color", cell
        yield self._grid, "section_color", section
        yield self._grid, "cell_size", placed.square
        yield self._grid, "section_size", 5.0 * placed.square
        yield self._grid, "position", (0.0, 0.0, lowest - GRID_BELOW)
        outlines = shadow_outlines(placed, lowest)
        # Without the grid nothing says that there is a ground.
        yield self._shadow, "visible", view.grid and bool(outlines)
        vertices = np.zeros((OUTLINES, CORNERS, 3))
        if outlines:
            vertices[: len(outlines), :, :2] = outlines
        yield self._shadow, "vertices", vertices.reshape(-1, 3).astype(np.float32)
        yield self._shadow, "color", SHADOW[placed.dark]
        yield self._shadow, "position", (0.0, 0.0, lowest - SHADOW_BELOW)


def ground_of(placed: Placed) -> float:
    """Return the height at which the base stands, in scene units."""
    if placed.floor is None:
        return bodies.PLATE_TOP - bodies.PLATE_THICKNESS
    return placed.scale * placed.floor


def shadow_outlines(placed: Placed, ground: float) -> list[FloatArray]:
    """Return the shadows of the drawn bodies and legs on a height, convex polygons (CORNERS, 2)."""
    view, p, size = placed.frame.state.view, placed.points, placed.thickness
    outlines: list[FloatArray] = []
    if view.bodies and placed.is_schematic:
        feet = np.array([p[name] * [1.0, 1.0, 0.0] for name in ("a1", "a2", "a3")])
        depths = (0.0, bodies.PLATE_THICKNESS)
        discs = np.concatenate([feet + [0.0, 0.0, bodies.PLATE_TOP - t] for t in depths])
        outlines.append(_outline(discs, bodies.BASE_RADIUS * np.eye(3)[:, :2], ground))
        rotation = placed.frame.snapshot.rotation
        local = np.array(list(placed.platform_points.values()))
        centres = local + [0.0, 0.0, bodies.PLATFORM_SHIFT * size * placed.facing]
        axes = bodies.PLATFORM_RADIUS * size * rotation[:, :2]
        outlines.append(_outline(p["b4"] + centres @ rotation.T, axes, ground))
    if view.legs and (placed.is_schematic or view.is_twin):
        twin = [(p[base], p[tip]) for base, tip in TWIN]
        legs = twin if view.is_twin else list(zip(*placed.struts, strict=True))
        radius = 0.5 * (bodies.TUBE_RADIUS + bodies.ROD_RADIUS) * size * np.eye(3)[:, :2]
        outlines += [_outline(np.stack(leg), radius, ground) for leg in legs]
    return outlines


def _outline(centres: FloatArray, axes: FloatArray, ground: float) -> FloatArray:
    """Return the shadow of n equal discs with two radii as `axes` (3, 2), shape (CORNERS, 2)."""
    flat = (centres - [0.0, 0.0, ground]) @ PROJECTION.T
    # Farthest point of an ellipse in each direction, seen from its centre.
    ellipse = PROJECTION @ axes
    reach = OUTWARD @ ellipse
    lengths = np.linalg.norm(reach, axis=1, keepdims=True)
    rim = (reach / np.maximum(lengths, 1e-9)) @ ellipse.T
    return flat[np.argmax(flat @ OUTWARD.T, axis=0)] + rim
