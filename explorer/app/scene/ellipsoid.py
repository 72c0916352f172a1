"""A translucent ellipsoid with its axes and a label at the end of the longest."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import viser

from explorer.app.scene.shapes import add_label, add_lines, add_translucent, sphere, write_label
from explorer.mechanism.pose import quaternion_from_rotation
from explorer.mechanism.rgb import Rgb
from explorer.numerics.arrays import FloatArray
from explorer.page.widgets.assigning import Update
from explorer.singularity.colours import FAR

OPACITY = 0.3


class EllipsoidNode:
    """An ellipsoid in a scene, at the node of a name."""

    def __init__(self, scene: viser.SceneApi, name: str) -> None:
        self._body = add_translucent(scene, f"{name}/body", sphere(), OPACITY, side="front")
        self._axes = add_lines(scene, f"{name}/axes", 3, FAR, 2.0)
        self._label = add_label(scene, f"{name}/label", "1")

    def show(self, visible: bool) -> Iterator[Update]:
        """Yield the updates that show or hide it."""
        for handle in (self._body, self._axes, self._label):
            yield handle, "visible", visible

    def draw(
        self, centre: FloatArray, axes: FloatArray, lengths: FloatArray, colour: Rgb, words: str
    ) -> Iterator[Update]:
        """Yield the updates that draw it about a centre (3,) in scene units, with a label's text.

        The columns of the axes, a rotation (3, 3), are the directions of the semi-axes, whose
        lengths (3,) are in scene units.
        """
        yield self._body, "position", tuple(centre.tolist())
        yield self._body, "wxyz", tuple(quaternion_from_rotation(axes).tolist())
        yield self._body, "scale", tuple(lengths.tolist())
        yield self._body, "color", colour
        semi_axes = (axes * lengths).T
        ends = np.stack([centre - semi_axes, centre + semi_axes], axis=1)
        yield self._axes, "points", ends.astype(np.float32)
        longest = semi_axes[int(lengths.argmax())]
        upward = longest if longest[2] >= 0.0 else -longest
        yield from write_label(self._label, words, centre + upward)
