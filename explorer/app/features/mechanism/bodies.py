"""The plates of base and platform."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from explorer.app.features.feature import Services
from explorer.app.features.mechanism.legs import PLATE_TOP
from explorer.app.scene.part import ScenePart, around
from explorer.app.scene.placing import Placed
from explorer.app.scene.shapes import NO_MESH, Mesh, plate
from explorer.app.widgets.assigning import Update
from explorer.app.widgets.colours import BASE_BODY, PLATFORM_BODY
from explorer.numerics.arrays import FloatArray

# Sizes in scene units.
PLATE_THICKNESS, BASE_RADIUS = 0.22, 0.75
PLATFORM_THICKNESS, PLATFORM_RADIUS = 0.2, 0.42
# Distance of the platform's plate from the plane of its joints.
PLATFORM_SHIFT = 0.26
PLATFORM_OPACITY = 0.82


class Bodies(ScenePart):
    """The base plate and the platform plate."""

    def __init__(self, services: Services) -> None:
        scene = services.scene
        # Whatever is rigid with the platform has this frame as its parent.
        self._frame = scene.add_frame("/platform", show_axes=False)
        self._base = scene.add_mesh_simple("/base/body", *NO_MESH, color=BASE_BODY)
        self._platform = scene.add_mesh_simple(
            "/platform/body", *NO_MESH, color=PLATFORM_BODY, opacity=PLATFORM_OPACITY, side="double"
        )

    def updates(self, placed: Placed) -> Iterator[Update]:
        """Yield the updates that draw the bodies of this frame."""
        state = placed.frame.state
        yield self._frame, "position", tuple(placed.points["b4"].tolist())
        yield self._frame, "wxyz", state.pose.quaternion
        for body in (self._base, self._platform):
            yield body, "visible", state.view.bodies and placed.is_schematic
        # The browser does not draw a translucent body inside another one.
        view = state.view
        is_inside = (
            view.workspace.solid
            or view.singular.ball
            or view.singular.ellipsoid != "none"
            or view.precision.ellipsoid
        )
        yield self._platform, "opacity", None if is_inside else PLATFORM_OPACITY
        for handle, (vertices, faces) in (
            (self._base, _base_plate(placed)),
            (self._platform, platform_plate(placed)),
        ):
            yield handle, "vertices", vertices.astype(np.float32)
            yield handle, "faces", faces.astype(np.uint32)

    def corners(self, placed: Placed) -> FloatArray:
        """Return the corners of cubes about the joints."""
        return around(np.array(list(placed.points.values())))


def _base_plate(placed: Placed) -> Mesh:
    points = np.array([placed.points[name][:2] for name in ("a1", "a2", "a3")])
    return plate(points, BASE_RADIUS, PLATE_TOP - PLATE_THICKNESS, PLATE_TOP)


def platform_plate(placed: Placed) -> Mesh:
    """Return the platform's plate in the platform frame, on the side away from the legs."""
    size = placed.thickness
    points = np.array([p[:2] for p in placed.platform_points.values()])
    near = PLATFORM_SHIFT * size * placed.facing
    far = near + PLATFORM_THICKNESS * size * placed.facing
    return plate(points, PLATFORM_RADIUS * size, min(near, far), max(near, far))
