"""Smooth motions of the platform, and derivatives by time from central differences."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterator
from typing import NamedTuple

import numpy as np
from scipy.spatial.transform import Rotation
from statics_cases import random_poses

from explorer import Design
from explorer.numerics.arrays import FloatArray

# Steps of time of which each is half of the one before, for Richardson's extrapolation.
STEP, HALVINGS = 0.04, 3


class Motion(NamedTuple):
    """Poses with a twist and an acceleration each, (..., 6), as `inverse_dynamics` takes them."""

    position: FloatArray
    rotation: FloatArray
    twist: FloatArray
    acceleration: FloatArray

    def each(self) -> Iterator[Motion]:
        """Yield the motions of a batch."""
        yield from (Motion(*row) for row in zip(*self, strict=True))

    def pose_at(self, time: float) -> tuple[FloatArray, FloatArray]:
        """Return the pose of a smooth motion that is this one at time zero."""
        way = time * self.twist + 0.5 * time**2 * self.acceleration
        turn = Rotation.from_rotvec(way[3:]).as_matrix()
        return self.position + way[:3], turn @ self.rotation


def random_motions(design: Design, count: int, seed: int, rate: float) -> Motion:
    """Return regular poses that move by about the reach and a radian at a rate, in 1/s."""
    rng = np.random.default_rng(seed)
    sizes = np.repeat([design.reach, 1.0], 3)
    twists, accelerations = rng.uniform(-1.0, 1.0, (2, count, 6)) * sizes
    return Motion(*random_poses(design, count, seed), rate * twists, rate**2 * accelerations)


def derivatives(
    function: Callable[[float], FloatArray], step: float = STEP
) -> tuple[FloatArray, FloatArray]:
    """Return the first and the second derivative of a function at zero, to the eighth order."""
    here = function(0.0)
    first: list[FloatArray] = []
    second: list[FloatArray] = []
    for halving in range(HALVINGS + 1):
        h = step / 2**halving
        ahead, behind = function(h), function(-h)
        first.append((ahead - behind) / (2.0 * h))
        second.append((ahead - 2.0 * here + behind) / h**2)
    return _extrapolate(first), _extrapolate(second)


def _extrapolate(values: list[FloatArray]) -> FloatArray:
    for order in range(1, len(values)):
        factor = 4.0**order
        values = [(factor * b - a) / (factor - 1.0) for a, b in itertools.pairwise(values)]
    return np.asarray(values[0])
