"""Random designs, poses and folds with fixed seeds, on which claims are tried."""

from __future__ import annotations

import numpy as np
from scipy.spatial.transform import Rotation

from explorer.mechanism.design import Design
from explorer.mechanism.folds import from_folds, to_folds
from explorer.numerics.arrays import BoolArray, FloatArray

# Columns of the folds.
R, BETA, EPSILON, PHI1, PHI2, PHI3 = range(6)


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


def random_folds(random: np.random.Generator, free: BoolArray) -> FloatArray:
    """Return folds (n, 6), far from flat where they are free and zero elsewhere."""
    folds = random.uniform(0.3, 2.8, free.shape)
    folds[:, PHI1:] *= random.choice((-1.0, 1.0), (len(folds), 3))
    return np.where(free, folds, 0.0)


def flatten(
    positions: FloatArray, rotations: FloatArray, column: int
) -> tuple[FloatArray, FloatArray]:
    """Return poses with one fold flat, at 0 in one half of them and at π in the other."""
    folds = to_folds(positions, rotations)
    folds[:, column] = np.where(np.arange(len(folds)) % 2, np.pi, 0.0)
    return from_folds(folds)
