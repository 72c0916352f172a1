"""The claim that every path between two assembly modes passes through a singular pose."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from explorer.mechanism.design_file import PRESETS
from explorer.mechanism.kinematics import forward, inverse
from explorer.numerics.arrays import FloatArray, IntArray
from explorer.reproduce.claim import Measurement, below
from explorer.reproduce.samples import random_poses
from explorer.singularity.jacobian import inverse_condition, jacobian

OPTIMAL = PRESETS["paper-optimal"]
PATHS, ON_PATH = 500, 400
# Number of the lowest minima of a sampled path that are searched, and of steps of each search.
MINIMA, SECTIONS = 3, 60
# Share of a bracket that the search by the golden section keeps.
GOLDEN_SECTION = 0.5 * (5.0**0.5 - 1.0)
# Inverse condition of J up to which a pose counts as singular.
SINGULAR = 1e-9


def mode_paths() -> Measurement:
    """Search random paths between two modes of one joint vector for their most singular poses.

    The search is by the singular values of J alone; it uses neither margins nor tetrahedra.
    """
    return judge_paths(least_condition_on(random_paths(np.random.default_rng(8), PATHS)))


def judge_paths(least: FloatArray) -> Measurement:
    """Return the measurement of paths, given the least inverse condition on each, shape (n,)."""
    free, worst = int((least > SINGULAR).sum()), float(least.max())
    text = (
        f"Of {len(least):,} random curved paths between two modes of the same joints {free} have "
        f"no singular pose: on each the inverse condition of J falls to {below(worst, SINGULAR)}. "
        "None can: a mode is a triple of signs of δ1, δ2 and δ3, these are continuous along a "
        "path, and by the intermediate value theorem one that changes its sign vanishes on the "
        "way."
    )
    return Measurement(
        text,
        "confirmed" if free == 0 else "not confirmed",
        {"paths": len(least), "without": free, "largest_inverse_condition": worst},
    )


@dataclass(frozen=True)
class Paths:
    """Curved paths between two poses: quadratic curves of b4, and turns with a detour.

    Attributes:
        points: Positions of start, middle and end, shape (n, 3, 3).
        start: Rotations at the start, shape (n, 3, 3).
        turn: Rotation vector from start to end, shape (n, 3).
        detour: Rotation vector that is added in the middle of the way, shape (n, 3).
    """

    points: FloatArray
    start: FloatArray
    turn: FloatArray
    detour: FloatArray

    def poses(self, which: IntArray, shares: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return poses on paths.

        Args:
            which: Numbers of the paths, shape (m,).
            shares: Share of the way on each, 0 to 1, shape (m,).

        Returns:
            Positions, shape (m, 3), and rotations, shape (m, 3, 3).
        """
        s, points = shares[:, None], self.points[which]
        curve = (1 - s) ** 2 * points[:, 0] + 2 * s * (1 - s) * points[:, 1] + s**2 * points[:, 2]
        vectors = s * self.turn[which] + np.sin(np.pi * s) * self.detour[which]
        return curve, np.asarray(Rotation.from_rotvec(vectors).as_matrix()) @ self.start[which]

    def conditions(self, which: IntArray, shares: FloatArray) -> FloatArray:
        """Return the inverse condition of J at poses as in `poses`, shape (m,)."""
        return inverse_condition(jacobian(OPTIMAL, *self.poses(which, shares)), OPTIMAL.reach)


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
    """Return the least inverse condition of J on each path, shape (n,).

    The lowest minima of a sampled path are narrowed down by the golden section.
    """
    count = len(paths.points)
    shares = np.linspace(0.0, 1.0, ON_PATH)
    number, place = np.divmod(np.arange(count * ON_PATH), ON_PATH)
    sampled = paths.conditions(number, shares[place]).reshape(count, ON_PATH)
    inner = sampled[:, 1:-1]
    is_minimum = (inner <= sampled[:, :-2]) & (inner <= sampled[:, 2:])
    lowest = np.argsort(np.where(is_minimum, inner, np.inf), axis=1)[:, :MINIMA] + 1
    which, at = np.repeat(np.arange(count), MINIMA), lowest.ravel()
    low, high = shares[at - 1], shares[at + 1]
    for _ in range(SECTIONS):
        span = GOLDEN_SECTION * (high - low)
        first, second = high - span, low + span
        is_left = paths.conditions(which, first) < paths.conditions(which, second)
        low, high = np.where(is_left, low, first), np.where(is_left, second, high)
    found = paths.conditions(which, 0.5 * (low + high)).reshape(count, MINIMA)
    return np.minimum(found.min(axis=1), sampled.min(axis=1))
