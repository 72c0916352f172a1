"""The nearest singular pose by SLSQP from many starts, without the formulas of the package."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from typing import Any

import numpy as np
from scipy.optimize import minimize
from scipy.spatial.transform import Rotation

from explorer import Design
from explorer.numerics.arrays import FloatArray


def searched_distance(
    design: Design, position: FloatArray, rotation: FloatArray, incidence: int, starts: int
) -> float:
    """Return the least root-mean-square displacement to a pose with an incidence, 1, 2 or 3."""

    def margin(p: FloatArray, r: FloatArray) -> list[float]:
        values = (r[:, 2] @ p, r[1, 0] * p[2] - r[2, 0] * p[1], p[2])
        return [float(values[incidence - 1])]

    return searched_least(design, position, rotation, margin, starts)


def searched_least(
    design: Design,
    position: FloatArray,
    rotation: FloatArray,
    condition: Callable[[FloatArray, FloatArray], list[float]],
    starts: int,
    seed: int = 0,
) -> float:
    """Return the least root-mean-square displacement to a pose that satisfies conditions.

    Args:
        design: The manipulator, of ordinary size.
        position: b4, shape (3,).
        rotation: Platform to base, shape (3, 3).
        condition: Function of position and rotation to independent values that must vanish.
        starts: Number of starts, from the pose itself to arbitrary rotations.
        seed: Seed of the starts.
    """
    rng = np.random.default_rng(seed)
    points = design.platform_points
    size = float(np.sqrt((points**2).sum() / 4.0))

    def pose(x: FloatArray) -> tuple[FloatArray, FloatArray]:
        turn = Rotation.from_rotvec(x[3:]).as_matrix()
        return position / size + x[:3], turn @ rotation

    def square(x: FloatArray) -> float:
        p, r = pose(x)
        way = (p - position / size) + points @ (r - rotation).T / size
        return float((way**2).sum()) / 4.0

    def off(x: FloatArray) -> FloatArray:
        return np.array(condition(*pose(x)))

    # SciPy's stubs allow only conditions of one number.
    vanishing: Any = {"type": "eq", "fun": off}
    best = np.inf
    for index in range(starts):
        start = np.zeros(6)
        # The first start is the pose itself; the others are farther and farther away.
        start[3:] = rng.normal(size=3) * 2.0 * index / starts
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            found = minimize(
                square,
                start,
                method="SLSQP",
                constraints=vanishing,
                options={"ftol": 1e-16, "maxiter": 200},
            )
        if np.abs(off(np.asarray(found.x))).max() < 1e-9:
            best = min(best, float(found.fun))
    return size * float(np.sqrt(best))
