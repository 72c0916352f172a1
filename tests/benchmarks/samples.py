"""Poses about the optimal design's home, and the numeric search over them."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from benchmarks.numeric_root import LoopEquations, pose_near, turn_by
from benchmarks.timing import best_of
from explorer import PRESETS, home_pose, inverse
from explorer.numerics.arrays import FloatArray

DESIGN = PRESETS["paper-optimal"]
SIZE = max(map(abs, DESIGN.variables))
SEARCHES, ROUNDS = 300, 5


class Samples(NamedTuple):
    """Poses and their joints."""

    positions: FloatArray
    rotations: FloatArray
    joints: FloatArray


def around_home(count: int) -> Samples:
    """Return poses within a tenth of the design's size, and of a radian, of its home."""
    rng = np.random.default_rng(1)
    home = home_pose(DESIGN)
    positions = np.array(home.position) + 0.1 * SIZE * rng.uniform(-1.0, 1.0, (count, 3))
    turns = np.stack([turn_by(v) for v in rng.uniform(-0.1, 0.1, (min(count, 1000), 3))])
    rotations = np.resize(turns, (count, 3, 3)) @ home.rotation
    return Samples(positions, rotations, inverse(DESIGN, positions, rotations))


class Searches(NamedTuple):
    """How the numeric search did, in the fastest of several rounds."""

    converged: int
    seconds: float

    @property
    def seconds_each(self) -> float:
        """Of those that converged."""
        return self.seconds / self.converged

    def __str__(self) -> str:
        return f"{self.converged} of {SEARCHES} converged, 1 mode of 8"


def searches() -> Searches:
    """Search for one mode of each sample, one after the other, from a nearby pose."""
    rng = np.random.default_rng(2)
    equations = LoopEquations(DESIGN)
    questions = [
        (joints, *pose_near(position, rotation, SIZE, rng))
        for position, rotation, joints in zip(*around_home(SEARCHES), strict=True)
    ]

    def search() -> int:
        return sum(equations.finds_pose(*question) for question in questions)

    converged = search()
    return Searches(converged, best_of(ROUNDS, search))
