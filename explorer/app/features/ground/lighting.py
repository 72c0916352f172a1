"""The lights of the scene: a sky over a ground, and a sun.

viser's own lighting, an environment map and shadow maps, takes a software renderer four times as
long, and three.js may keep drawing a mesh of another shape than it has while shadow maps come
and go.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from explorer.app.features.feature import Services
from explorer.app.scene.part import ScenePart
from explorer.app.scene.placing import Placed
from explorer.app.widgets.assigning import Update
from explorer.app.widgets.colours import Rgb

TO_SUN = np.array([-0.22, 0.3, 1.0])
"""Direction from the scene to the sun, so that shadows fall towards the isometric camera."""

SKY: Rgb = (255, 255, 255)
GROUND: Rgb = (112, 120, 150)
SKY_INTENSITY, SUN_INTENSITY = 2.0, 3.0


class Lighting(ScenePart):
    """The lights, which never change."""

    def __init__(self, services: Services) -> None:
        scene = services.scene
        scene.configure_environment_map(hdri=None)
        scene.configure_default_lights(enabled=False, cast_shadow=False)
        # Lights shine from where they are towards the origin.
        scene.add_light_hemisphere(
            "/lights/sky",
            sky_color=SKY,
            ground_color=GROUND,
            intensity=SKY_INTENSITY,
            position=(0.0, 0.0, 1.0),
        )
        scene.add_light_directional(
            "/lights/sun", intensity=SUN_INTENSITY, cast_shadow=False, position=tuple(TO_SUN)
        )

    def updates(self, placed: Placed) -> Iterator[Update]:  # noqa: ARG002 - nothing changes
        """Yield nothing."""
        yield from ()
