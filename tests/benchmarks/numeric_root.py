"""What a user would take for the forward kinematics: a root of the loop equations.

`scipy.optimize.root` finds the pose nearest to where it starts; seven other modes stay
unknown. The equations are written here anew, from the drawing of the mechanism.
"""

from __future__ import annotations

import math

import numpy as np
from scipy.optimize import root

from explorer import Design
from explorer.numerics.arrays import FloatArray

# Where the search starts: this far off, as a share of the size and in radians.
OFF_BY = 0.02
# Residuals below this share of the size count as closed.
CLOSED = 1e-9


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
            return self._lengths(pose[:3], turn_by(pose[3:]) @ rotation) - joints

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


def turn_by(vector: FloatArray) -> FloatArray:
    """Return the rotation (3, 3) about a vector by its length, after Rodrigues."""
    angle = math.hypot(*vector)
    x, y, z = vector.tolist()
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    if angle < 1e-8:
        return np.eye(3) + cross
    first, second = math.sin(angle) / angle, (1.0 - math.cos(angle)) / angle**2
    return np.eye(3) + first * cross + second * (cross @ cross)


def pose_near(
    position: FloatArray, rotation: FloatArray, size: float, rng: np.random.Generator
) -> tuple[FloatArray, FloatArray]:
    """Return a pose somewhat off the given one, for a search to start from."""
    return (
        position + OFF_BY * size * rng.uniform(-1.0, 1.0, 3),
        turn_by(OFF_BY * rng.uniform(-1.0, 1.0, 3)) @ rotation,
    )
