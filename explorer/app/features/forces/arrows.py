"""Arrows of forces: shafts and heads, many in two nodes."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import viser

from explorer.app.scene.shapes import Instances, Rods, cone, linear_colour, turned_to
from explorer.app.widgets.assigning import Update
from explorer.app.widgets.colours import Rgb
from explorer.numerics.arrays import FloatArray

# Radii of shaft and head over a length, and length of the head, in scene units.
SHAFT, HEAD, HEAD_LENGTH = 0.08, 0.21, 0.55
# Share of a short arrow that its head takes.
MOST_HEAD = 0.6
# Size of what is not drawn, since a copy of no size has no normals.
NOTHING = 1e-6


class ForceArrows:
    """Arrows between points.

    Args:
        scene: Where they are added.
        name: Their node.
        count: Number of arrows.
        colour: Colour before the first frame.
    """

    def __init__(self, scene: viser.SceneApi, name: str, count: int, colour: Rgb) -> None:
        self._shafts = Rods(scene, f"{name}/shafts", [colour] * count)
        self._heads = Instances(scene, f"{name}/heads", cone(), [colour] * count)

    def show(self, visible: bool) -> Iterator[Update]:
        """Yield the updates that show or hide the arrows."""
        yield from self._shafts.show(visible)
        yield from self._heads.show(visible)

    def draw(
        self, tails: FloatArray, vectors: FloatArray, colours: list[Rgb], size: float
    ) -> Iterator[Update]:
        """Yield the updates that draw arrows from tails (n, 3) along vectors (n, 3).

        Args:
            tails: Where they begin, in scene units.
            vectors: Their directions and lengths, in scene units.
            colours: Their colours.
            size: Scale of their thickness.
        """
        lengths = np.linalg.norm(vectors, axis=1, keepdims=True)
        units = vectors / np.maximum(lengths, 1e-12)
        heads = np.minimum(HEAD_LENGTH * size, MOST_HEAD * lengths)
        necks = tails + units * (lengths - heads)
        drawn = lengths[:, 0] > NOTHING
        yield from self._shafts.between(tails, necks, np.where(drawn, SHAFT * size, NOTHING))
        linear = [linear_colour(each) for each in colours]
        yield from self._shafts.colour(linear)
        radii = np.minimum(HEAD * size, heads * HEAD / HEAD_LENGTH)
        scales = np.maximum(np.concatenate([radii, radii, heads], axis=1), NOTHING)
        yield from self._heads.place(necks, turned_to(vectors), scales)
        yield from self._heads.colour(linear)
