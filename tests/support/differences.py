"""One check of every Jacobian, by central differences along twists."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.testing import assert_allclose
from scipy.spatial.transform import Rotation

from explorer.numerics.arrays import FloatArray


def moved(position: FloatArray, rotation: FloatArray, twist: FloatArray) -> tuple[FloatArray, ...]:
    """Return the pose moved by a twist (velocity of b4, angular velocity) for unit time."""
    turn = Rotation.from_rotvec(twist[3:]).as_matrix()
    return position + twist[:3], turn @ rotation


def assert_is_jacobian(
    function: Callable[[FloatArray, FloatArray], FloatArray],
    jacobian: FloatArray,
    position: FloatArray,
    rotation: FloatArray,
    length: float,
    tolerance: float,
) -> None:
    """Check the Jacobian of a function of the pose, column by column.

    Args:
        function: Function of position and rotation to lengths, shape (n,).
        jacobian: Its Jacobian by the twist (v; ω), shape (n, 6).
        position: Position of the pose, shape (3,).
        rotation: Rotation of the pose, shape (3, 3).
        length: Length of which steps are a share, and that divides the columns of ω.
        tolerance: Tolerance of the homogeneous Jacobian.
    """
    step = 1e-5
    columns: list[FloatArray] = []
    for axis in range(6):
        twist = np.zeros(6)
        twist[axis] = step * (length if axis < 3 else 1.0)
        ahead = function(*moved(position, rotation, twist))
        behind = function(*moved(position, rotation, -twist))
        columns.append((ahead - behind) / (2.0 * step * length))
    homogeneous = jacobian / np.array([1.0, 1.0, 1.0, length, length, length])
    assert_allclose(homogeneous, np.column_stack(columns), rtol=0, atol=tolerance)
