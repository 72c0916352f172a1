"""The plates of base and platform, and the grid under them."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from explorer.app.features.feature import Services
from explorer.app.features.mechanism.legs import PLATE_TOP
from explorer.app.scene.part import ScenePart, around
from explorer.app.scene.placing import Placed
from explorer.app.scene.shapes import NO_MESH, Mesh, plate
from explorer.app.widgets.assigning import Update
from explorer.app.widgets.colours import BASE_BODY, PLATFORM_BODY, Rgb
from explorer.numerics.arrays import FloatArray

# Sizes in scene units.
PLATE_THICKNESS = 0.22
PLATFORM_THICKNESS = 0.2
PLATFORM_OPACITY = 0.82
GRID_BELOW = 0.01
# Colours of the grid's cells and sections, by whether the page is dark.
GRID: dict[bool, tuple[Rgb, Rgb]] = {
    False: ((226, 230, 236), (203, 209, 218)),
    True: ((38, 41, 46), (56, 61, 69)),
}


class Bodies(ScenePart):
    """The base plate, the platform plate and the grid."""

    def __init__(self, services: Services) -> None:
        scene = services.scene
        # Whatever is rigid with the platform has this frame as its parent.
        self._frame = scene.add_frame("/platform", show_axes=False)
        self._base = scene.add_mesh_simple("/base/body", *NO_MESH, color=BASE_BODY)
        self._platform = scene.add_mesh_simple(
            "/platform/body", *NO_MESH, color=PLATFORM_BODY, opacity=PLATFORM_OPACITY, side="double"
        )
        self._grid = scene.add_grid(
            "/grid",
            width=60.0,
            height=60.0,
            cell_size=1.0,
            section_size=5.0,
            cell_color=GRID[False][0],
            section_color=GRID[False][1],
            fade_distance=46.0,
            fade_from="origin",
            shadow_opacity=0.1,
        )

    def updates(self, placed: Placed) -> Iterator[Update]:
        """Yield the updates that draw the bodies of this frame."""
        state = placed.frame.state
        yield self._frame, "position", tuple(placed.points["b4"].tolist())
        yield self._frame, "wxyz", state.pose.quaternion
        for body in (self._base, self._platform):
            yield body, "visible", state.view.bodies and placed.is_schematic
        # The browser does not draw a translucent body inside another one.
        singular = state.view.singular
        is_inside = state.view.workspace.solid or singular.ball or singular.ellipsoid != "none"
        yield self._platform, "opacity", None if is_inside else PLATFORM_OPACITY
        yield self._grid, "visible", state.view.grid
        cell, section = GRID[placed.dark]
        yield self._grid, "cell_color", cell
        yield self._grid, "section_color", section
        yield self._grid, "position", (0.0, 0.0, _lowest(placed) - GRID_BELOW)
        for handle, (vertices, faces) in (
            (self._base, _base_plate(placed)),
            (self._platform, platform_plate(placed)),
        ):
            yield handle, "vertices", vertices.astype(np.float32)
            yield handle, "faces", faces.astype(np.uint32)

    def corners(self, placed: Placed) -> FloatArray:
        """Return the corners of cubes about the joints."""
        return around(np.array(list(placed.points.values())))


def _lowest(placed: Placed) -> float:
    """Return the height at which the base stands, in scene units."""
    if placed.floor is None:
        return PLATE_TOP - PLATE_THICKNESS
    return placed.scale * placed.floor


def _base_plate(placed: Placed) -> Mesh:
    points = np.array([placed.points[name][:2] for name in ("a1", "a2", "a3")])
    return plate(points, 0.75, PLATE_TOP - PLATE_THICKNESS, PLATE_TOP)


def platform_plate(placed: Placed) -> Mesh:
    """Return the platform's plate in the platform frame, on the side away from the legs."""
    size = placed.thickness
    points = np.array([p[:2] for p in placed.platform_points.values()])
    near = 0.26 * size * placed.facing
    far = near + PLATFORM_THICKNESS * size * placed.facing
    return plate(points, 0.42 * size, min(near, far), max(near, far))
