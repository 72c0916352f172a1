"""What one would do without a formula: SLSQP from many starts for the nearest singular pose."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from typing import Any

import numpy as np
from scipy.optimize import minimize
from scipy.spatial.transform import Rotation

from explorer import Design
from explorer.numerics.arrays import FloatArray


def platform_points(design: Design) -> FloatArray:
    """Return b1 to b4 in the platform frame, shape (4, 3)."""
    return np.array(
        [[*design.b1, 0.0], [design.b2, 0.0, 0.0], [design.b3, 0.0, 0.0], [0.0, 0.0, 0.0]]
    )


def searched_distance(
    design: Design,
    position: FloatArray,
    rotation: FloatArray,
    incidence: int,
    starts: int,
) -> float:
    """Return the least root-mean-square way found to a pose with an incidence.

    Args:
        design: The manipulator, of ordinary size.
        position: b4, shape (3,).
        rotation: Platform to base, shape (3, 3).
        incidence: 1, 2 or 3.
        starts: How many, from the pose itself to any rotation at all.
    """

    def margin(p: FloatArray, r: FloatArray) -> list[float]:
        if incidence == 1:
            return [float(r[:, 2] @ p)]
        if incidence == 2:
            return [float(r[1, 0] * p[2] - r[2, 0] * p[1])]
        return [float(p[2])]

    return searched_least(design, position, rotation, margin, starts)


def searched_least(
    design: Design,
    position: FloatArray,
    rotation: FloatArray,
    condition: Callable[[FloatArray, FloatArray], list[float]],
    starts: int,
    seed: int = 0,
) -> float:
    """Return the least root-mean-square way found to a pose that meets conditions.

    Args:
        design: The manipulator, of ordinary size.
        position: b4, shape (3,).
        rotation: Platform to base, shape (3, 3).
        condition: What vanishes there, independent of each other, of position and rotation.
        starts: How many, from the pose itself to any rotation at all.
        seed: Of the starts.
    """
    rng = np.random.default_rng(seed)
    points = platform_points(design)
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

    # The stubs know only conditions of one number.
    vanishing: Any = {"type": "eq", "fun": off}
    best = np.inf
    for index in range(starts):
        start = np.zeros(6)
        # From the pose itself first, then from farther and farther off.
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
