"""Base and platform as bodies, and the grid they stand on."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import viser

from explorer.app.features.mechanism.legs import PLATE_TOP
from explorer.app.scene.placing import Placed
from explorer.app.scene.shapes import Mesh, plate
from explorer.app.widgets.assigning import Update
from explorer.app.widgets.colours import BASE_BODY, PLATFORM_BODY, Rgb

PLATE_THICKNESS = 0.22
PLATFORM_THICKNESS = 0.2
PLATFORM_OPACITY = 0.82
GRID_BELOW = 0.01
# Of the grid, cells and sections, by whether the page is dark.
GRID: dict[bool, tuple[Rgb, Rgb]] = {
    False: ((226, 230, 236), (203, 209, 218)),
    True: ((38, 41, 46), (56, 61, 69)),
}


class Bodies:
    """The base plate, the platform plate and the grid."""

    def __init__(self, scene: viser.SceneApi) -> None:
        self._scene = scene
        # The frame that carries all that is rigid with the platform.
        self._frame = scene.add_frame("/platform", show_axes=False)
        empty = np.zeros((3, 3)), np.array([[0, 1, 2]])
        self._base = scene.add_mesh_simple("/base/body", *empty, color=BASE_BODY)
        self._platform = scene.add_mesh_simple(
            "/platform/body", *empty, color=PLATFORM_BODY, opacity=PLATFORM_OPACITY, side="double"
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
        """Yield what draws the bodies of this frame."""
        state = placed.frame.state
        yield self._frame, "position", tuple(placed.points["b4"].tolist())
        yield self._frame, "wxyz", state.pose.quaternion
        for body in (self._base, self._platform):
            yield body, "visible", state.view.bodies and placed.parts is None
        # Within what is translucent the browser would leave a translucent body out.
        singular = state.view.singular
        within = state.view.workspace.solid or singular.ball or singular.ellipsoid != "none"
        yield self._platform, "opacity", None if within else PLATFORM_OPACITY
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


def _lowest(placed: Placed) -> float:
    """Return the height at which the base stands."""
    if placed.parts is None:
        return PLATE_TOP - PLATE_THICKNESS
    vertices, _ = placed.parts.meshes[0]
    return placed.scale * float(vertices[:, 2].min())


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
