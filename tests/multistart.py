"""What one would do without a formula: SLSQP from many starts for the nearest singular pose."""

from __future__ import annotations

import warnings

import numpy as np
from scipy.optimize import minimize
from scipy.spatial.transform import Rotation

from explorer import Design
from explorer.arrays import FloatArray


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
    seed: int = 0,
) -> float:
    """Return the least root-mean-square way found to a pose with an incidence.

    Args:
        design: The manipulator, of ordinary size.
        position: b4, shape (3,).
        rotation: Platform to base, shape (3, 3).
        incidence: 1, 2 or 3.
        starts: How many, from the pose itself to any rotation at all.
        seed: Of the starts.
    """
    rng = np.random.default_rng(seed)
    points = platform_points(design)
    size = float(np.sqrt((points**2).sum() / 4.0))

    def pose(x: FloatArray) -> tuple[FloatArray, FloatArray]:
        turn = Rotation.from_rotvec(x[3:]).as_matrix()
        return position + size * x[:3], turn @ rotation

    def square(x: FloatArray) -> float:
        p, r = pose(x)
        way = (p - position) + points @ (r - rotation).T
        return float((way**2).sum()) / (4.0 * size**2)

    def margin(x: FloatArray) -> float:
        p, r = pose(x)
        if incidence == 1:
            return float(r[:, 2] @ p) / size
        if incidence == 2:
            return float(r[1, 0] * p[2] - r[2, 0] * p[1]) / size
        return float(p[2]) / size

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
                constraints={"type": "eq", "fun": margin},
                options={"ftol": 1e-16, "maxiter": 200},
            )
        if abs(margin(np.asarray(found.x))) < 1e-9:
            best = min(best, float(found.fun))
    return size * float(np.sqrt(best))
