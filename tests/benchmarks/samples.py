"""Poses about the optimal design's home."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.spatial.transform import Rotation

from explorer import PRESETS, inverse
from explorer.numerics.arrays import FloatArray

DESIGN = PRESETS["paper-optimal"]
SIZE = max(map(abs, DESIGN.variables))


class Samples(NamedTuple):
    """Poses and their joints."""

    positions: FloatArray
    rotations: FloatArray
    joints: FloatArray


def around_home(count: int) -> Samples:
    """Return poses within a tenth of the design's size, and of a radian, of its home."""
    rng = np.random.default_rng(1)
    home = DESIGN.home_pose
    positions = np.array(home.position) + 0.1 * SIZE * rng.uniform(-1.0, 1.0, (count, 3))
    rotations = Rotation.from_rotvec(rng.uniform(-0.1, 0.1, (count, 3))).as_matrix() @ home.rotation
    return Samples(positions, rotations, inverse(DESIGN, positions, rotations))
