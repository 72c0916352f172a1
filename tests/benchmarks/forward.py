"""The forward kinematics and the folds, beside a root of the loop equations and plain NumPy.

`scipy.optimize.root` finds the pose nearest to where it starts; seven other modes stay
unknown. The equations are written here anew, from the drawing of the mechanism.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from scipy.optimize import root
from scipy.spatial.transform import Rotation

from benchmarks.samples import DESIGN, SIZE, around_home
from benchmarks.table import Row, per_second, seconds, times
from benchmarks.timing import best_of
from explorer import Design, forward, to_folds
from explorer.numerics.arrays import FloatArray
from explorer.numerics.compiled import warm

COUNT, CALLS, ROUNDS = 100_000, 500, 100
SEARCHES, SEARCH_ROUNDS = 300, 5
# Where the search starts: this far off, as a share of the size and in radians.
OFF_BY = 0.02
# Residuals below this share of the size count as closed.
CLOSED = 1e-9
SHORT = {"COUNT": 1_000, "CALLS": 20, "ROUNDS": 1, "SEARCHES": 5, "SEARCH_ROUNDS": 1}


class LoopEquations:
    """The loop equations of one design, as a function of a displacement from a start."""

    def __init__(self, design: Design) -> None:
        self._a3 = np.array([*design.a3, 0.0])
        self._b1 = np.array([*design.b1, 0.0])
        self._b2, self._b3 = design.b2, design.b3
        self._size = max(map(abs, design.variables))

    def finds_pose(self, joints: FloatArray, position: FloatArray, rotation: FloatArray) -> bool:
        """Return whether a search from a position (3,) and a rotation (3, 3) closes the loops."""

        def residual(pose: FloatArray) -> FloatArray:
            return (
                self._lengths(pose[:3], Rotation.from_rotvec(pose[3:]).as_matrix() @ rotation)
                - joints
            )

        found = root(residual, np.concatenate([position, np.zeros(3)]))
        return bool(found.success) and float(np.abs(found.fun).max()) <= CLOSED * self._size

    def _lengths(self, p: FloatArray, r: FloatArray) -> FloatArray:
        x = r[:, 0]
        tip1, tip2, tip3 = p + r @ self._b1, p + self._b2 * x, p + self._b3 * x
        return np.array(
            [
                math.hypot(*tip1),
                tip2[0],
                math.hypot(tip2[1], tip2[2]),
                tip3[0],
                math.hypot(tip3[1], tip3[2]),
                math.hypot(*(p - self._a3)),
            ]
        )


def run() -> Iterator[Row]:
    """Yield the rows."""
    positions, rotations, joints = around_home(COUNT)
    rows = [tuple(row) for row in joints[:CALLS].tolist()]
    warm()
    fold = best_of(ROUNDS, lambda: to_folds(positions, rotations)) / COUNT
    plain = best_of(ROUNDS, lambda: fold_in_numpy(positions, rotations)) / COUNT
    yield Row(
        f"folds of a pose, batch of {COUNT:,}, one core",
        seconds(fold),
        "60 ns",
        f"the same in NumPy, without a check: {seconds(plain)}; {times(plain / fold)}",
    )
    rate = COUNT / best_of(ROUNDS, lambda: forward(DESIGN, joints))
    once = best_of(ROUNDS, lambda: [forward(DESIGN, row) for row in rows]) / CALLS
    search = searches()
    yield Row(
        f"forward kinematics, batch of {COUNT:,}, all 8 modes, one core",
        per_second(rate),
        "5 million/s",
        f"scipy.optimize.root: {per_second(1.0 / search.seconds_each)} ({search}); "
        f"{times(rate * search.seconds_each)}",
    )
    yield Row(
        "one forward call, all 8 modes",
        seconds(once),
        "50 µs",
        f"scipy.optimize.root: {seconds(search.seconds_each)}, 1 mode; "
        f"{times(search.seconds_each / once)}",
    )


def fold_in_numpy(position: FloatArray, rotation: FloatArray) -> FloatArray:
    """Return the fold coordinates (n, 6) of poses off the walls, column by column."""
    x, y, z = position.T
    h, r = np.hypot(y, z), np.hypot(np.hypot(x, y), z)
    cos3, sin3, cos_b, sin_b = (column[:, None] for column in (y / h, z / h, x / r, h / r))
    level = cos3 * rotation[:, 1] + sin3 * rotation[:, 2]
    up = cos3 * rotation[:, 2] - sin3 * rotation[:, 1]
    along = cos_b[:, 0] * rotation[:, 0, 0] + sin_b[:, 0] * level[:, 0]
    across = cos_b * level - sin_b * rotation[:, 0]
    sine = np.hypot(across[:, 0], up[:, 0])
    cos2, sin2 = across[:, 0] / sine, -up[:, 0] / sine
    phi1 = np.arctan2(-sin2 * across[:, 1] - cos2 * up[:, 1], sin2 * across[:, 2] + cos2 * up[:, 2])
    phi2, phi3 = np.arctan2(sin2, cos2), np.arctan2(z, y)
    return np.stack([r, np.arctan2(h, x), np.arctan2(sine, along), phi1, phi2, phi3], axis=-1)


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
    positions, rotations, joints = around_home(SEARCHES)
    turns = Rotation.from_rotvec(OFF_BY * rng.uniform(-1.0, 1.0, (SEARCHES, 3))).as_matrix()
    starts = positions + OFF_BY * SIZE * rng.uniform(-1.0, 1.0, (SEARCHES, 3)), turns @ rotations

    def search() -> int:
        return sum(map(equations.finds_pose, joints, *starts))

    converged = search()
    return Searches(converged, best_of(SEARCH_ROUNDS, search))
