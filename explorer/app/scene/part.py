"""Parts of the scene: each is made once, then only assigned to, frame by frame."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterator

import numpy as np

from explorer.app.scene.placing import Placed
from explorer.app.widgets.assigning import Update
from explorer.measures.size import corners_of
from explorer.numerics.arrays import FloatArray

# Half the edge of a cube about a joint, in scene units.
HALF_JOINT = 0.8
NO_POINTS: FloatArray = np.empty((0, 3))


class ScenePart(ABC):
    """A part of the scene."""

    @abstractmethod
    def updates(self, placed: Placed) -> Iterator[Update]:
        """Yield the updates that draw the part in this frame."""

    def corners(self, placed: Placed) -> FloatArray:  # noqa: ARG002 - most parts are within others
        """Return the points that a picture of the whole mechanism must show, shape (n, 3)."""
        return NO_POINTS


def around(points: FloatArray) -> FloatArray:
    """Return the corners of cubes about points (n, 3) of the mechanism, shape (8 n, 3)."""
    half = corners_of(np.array([[-HALF_JOINT] * 3, [HALF_JOINT] * 3]))
    return (points[:, None] + half).reshape(-1, 3)
