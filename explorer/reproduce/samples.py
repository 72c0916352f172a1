"""Random designs and poses with fixed seeds, on which claims are tried."""

from __future__ import annotations

import numpy as np
from scipy.spatial.transform import Rotation

from explorer.mechanism.design import Design
from explorer.numerics.arrays import FloatArray


def random_design(random: np.random.Generator) -> Design:
    """Return a design that is far from degenerate."""
    a3 = random.uniform(6.0, 14.0, 2) * random.choice((-1.0, 1.0), 2)
    b1 = random.uniform(2.0, 5.0, 2) * random.choice((-1.0, 1.0), 2)
    b2, gap = float(random.uniform(-2.0, 2.0)), float(random.uniform(1.5, 4.0))
    return Design(
        a3=(float(a3[0]), float(a3[1])), b1=(float(b1[0]), float(b1[1])), b2=b2, b3=b2 + gap
    )


def random_poses(
    random: np.random.Generator, count: int, size: float
) -> tuple[FloatArray, FloatArray]:
    """Return positions (count, 3) within a cube of half the edge `size`, and any rotations."""
    rotations = Rotation.random(count, rng=random).as_matrix()
    return random.uniform(-size, size, (count, 3)), np.asarray(rotations, dtype=np.float64)
