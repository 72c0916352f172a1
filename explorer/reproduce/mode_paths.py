"""The claim that every path between two assembly modes passes through a singular pose."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from explorer.mechanism.design_file import PRESETS
from explorer.mechanism.kinematics import forward, inverse
from explorer.mechanism.margins import margins
from explorer.numerics.arrays import FloatArray, IntArray
from explorer.reproduce.claim import Measured
from explorer.reproduce.samples import random_poses
from explorer.singularity.jacobian import inverse_condition, jacobian

OPTIMAL = PRESETS["paper-optimal"]
PATHS, ON_PATH = 2000, 400
HALVINGS = 60
# Inverse condition of J up to which a pose counts as singular.
SINGULAR = 1e-12


def paths() -> Measured:
    """Follow random paths between two modes of one joint vector, and find their singular poses.

    Whether a pose is singular is judged by the singular values of J, which know nothing of the
    margins that name the modes.
    """
    least = least_condition_on(random_paths(np.random.default_rng(8), PATHS))
    free, worst = int((least > SINGULAR).sum()), float(least.max())
    text = (
        f"Of {PATHS:,} random curved paths between two modes of the same joints {free} have no "
        f"singular pose: the inverse condition of J falls to at most {worst:.1e} on each. None "
        "can: a mode is a triple of signs of δ1, δ2 and δ3, these are continuous along a path, and "
        "by the intermediate value theorem one that changes its sign vanishes on the way."
    )
    return Measured(
        text,
        "confirmed" if free == 0 else "not confirmed",
        {"paths": PATHS, "without": free, "largest_inverse_condition": worst},
    )


@dataclass(frozen=True)
class Paths:
    """Curved paths between two poses: quadratic curves of b4, and turns that swing out.

    Attributes:
        points: Positions of start, middle and end, shape (n, 3, 3).
        start: Rotations at the start, shape (n, 3, 3).
        turn: Rotation vector from start to end, shape (n, 3).
        swing: Rotation vector that is added in the middle, shape (n, 3).
    """

    points: FloatArray
    start: FloatArray
    turn: FloatArray
    swing: FloatArray

    def margins(self, which: IntArray, shares: FloatArray) -> FloatArray:
        """Return margins (m, 3) on the paths with these numbers (m,) at shares of them (m,)."""
        return margins(*self.poses(which, shares))

    def poses(self, which: IntArray, shares: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return positions (m, 3) and rotations (m, 3, 3), as `margins` those of them."""
        s, points = shares[:, None], self.points[which]
        curve = (1 - s) ** 2 * points[:, 0] + 2 * s * (1 - s) * points[:, 1] + s**2 * points[:, 2]
        vectors = s * self.turn[which] + np.sin(np.pi * s) * self.swing[which]
        return curve, np.asarray(Rotation.from_rotvec(vectors).as_matrix()) @ self.start[which]


def random_paths(random: np.random.Generator, count: int) -> Paths:
    """Return paths between two modes of the joints of random poses."""
    reach = OPTIMAL.reach
    position, rotation = random_poses(random, count, reach)
    p, r, _ = forward(OPTIMAL, inverse(OPTIMAL, position, rotation))
    first, last = random.permuted(np.tile(np.arange(8), (count, 1)), axis=1)[:, :2].T
    rows = np.arange(count)
    middle = random.uniform(-reach, reach, (count, 3))
    points = np.stack([p[rows, first], middle, p[rows, last]], axis=1)
    start, end = r[rows, first], r[rows, last]
    turn = Rotation.from_matrix(end @ np.swapaxes(start, 1, 2)).as_rotvec()
    return Paths(points, start, turn, random.normal(size=(count, 3)))


def least_condition_on(paths: Paths) -> FloatArray:
    """Return the least inverse condition of J where a margin changes its sign, shape (n,).

    It is infinite on a path on which none does.
    """
    count = len(paths.points)
    shares = np.linspace(0.0, 1.0, ON_PATH)
    of, at = np.divmod(np.arange(count * ON_PATH), ON_PATH)
    signs = np.sign(paths.margins(of, shares[at])).reshape(count, ON_PATH, 3)
    which, steps, index = np.nonzero(signs[:, 1:] != signs[:, :-1])
    low, high, before = shares[steps], shares[steps + 1], signs[which, steps, index]
    rows = np.arange(len(which))
    for _ in range(HALVINGS):
        middle = 0.5 * (low + high)
        is_before = np.sign(paths.margins(which, middle)[rows, index]) == before
        low, high = np.where(is_before, middle, low), np.where(is_before, high, middle)
    least = np.full(count, np.inf)
    j = jacobian(OPTIMAL, *paths.poses(which, low))
    np.minimum.at(least, which, inverse_condition(j, OPTIMAL.reach))
    return least
