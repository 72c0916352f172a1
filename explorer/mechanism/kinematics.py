"""Inverse and forward kinematics in closed form, over any batch, in the order of `JOINTS`.

The inverse kinematics is that of `explorer.mechanism.points`. The forward kinematics finds the
folds of `explorer.mechanism.folds` by the three trilaterations, each the cosine of one fold, and
has eight assembly modes.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from explorer.errors import InputError
from explorer.mechanism.configuration import Configuration
from explorer.mechanism.design import JOINTS, LENGTHS, Design
from explorer.mechanism.trilateration import solve_rows
from explorer.numerics.arrays import (
    FARTHEST,
    BoolArray,
    FloatArray,
    finite_array,
    for_kernel,
)


class ForwardKinematics(NamedTuple):
    """The eight assembly modes; mode k has the sign triple of the bits of k.

    Bit 2 of k is set if δ1 is positive, bit 1 if δ2 is, bit 0 if δ3 is.

    Attributes:
        position: b4 in the base frame, shape (..., 8, 3), in design units.
        rotation: Platform to base, shape (..., 8, 3, 3).
        feasible: Whether the joints close, shape (...), in all eight modes or in none. If they
            do not, the poses are finite but have other joints.
    """

    position: FloatArray
    rotation: FloatArray
    feasible: BoolArray


def inverse(design: Design, position: ArrayLike, rotation: ArrayLike) -> FloatArray:
    """Return the joints of `Configuration(design, position, rotation)`, shape (..., 6)."""
    return Configuration(design, position, rotation).joints


def forward(design: Design, joints: ArrayLike) -> ForwardKinematics:
    """Return all eight assembly modes of the joints.

    Args:
        design: The manipulator.
        joints: (l1, d1, d2, d3, d4, l4), shape (..., 6), in design units.

    Raises:
        InputError: The joints are not usable, see `checked_joints`.
    """
    return ForwardKinematics(*_solve(design, joints)[:3])


def discriminants(design: Design, joints: ArrayLike) -> FloatArray:
    """Return δ1², δ2², δ3² of the joints, shape (..., 3), in squared design units.

    The joints close if none is negative (to rounding); a negative one shows which trilateration
    fails, and by how much.

    Args:
        design: The manipulator.
        joints: (l1, d1, d2, d3, d4, l4), shape (..., 6), in design units.

    Raises:
        InputError: The joints are not usable, see `checked_joints`.
    """
    return _solve(design, joints)[3]


def checked_joints(joints: ArrayLike) -> FloatArray:
    """Return joints (..., 6) as float64 after checking them.

    Raises:
        InputError: The joints are not six finite numbers, a length is negative, or a joint is
            beyond `FARTHEST`.
    """
    array = finite_array(f"joints ({', '.join(JOINTS)})", joints, (6,), FARTHEST)
    for index, name in enumerate(JOINTS):
        if name in LENGTHS and (array[..., index] < 0.0).any():
            raise InputError(
                f"{name} is a length and must not be negative; "
                f"got {float(array[..., index].min()):g}"
            )
    return array


def _solve(
    design: Design, joints: ArrayLike
) -> tuple[FloatArray, FloatArray, BoolArray, FloatArray]:
    q = checked_joints(joints)
    batch = q.shape[:-1]
    rows = for_kernel(q.reshape(-1, 6))
    count = len(rows)
    position = np.empty((count, 8, 3))
    rotation = np.empty((count, 8, 3, 3))
    feasible = np.empty(count, dtype=np.bool_)
    squares = np.empty((count, 3))
    solve_rows(count, np.array(design.variables), rows, position, rotation, feasible, squares)
    return (
        position.reshape(*batch, 8, 3),
        rotation.reshape(*batch, 8, 3, 3),
        feasible.reshape(batch),
        squares.reshape(*batch, 3),
    )
