"""Checks of what a caller gives: one position, one angle, a whole number, angles once around."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from explorer.errors import InputError
from explorer.numerics.arrays import FloatArray, finite_array

# Largest number of azimuths or torsions.
MOST_ANGLES = 100_000


def one_position(position: ArrayLike) -> FloatArray:
    """Return one position (3,) after checking it.

    Raises:
        InputError: The position is not finite, or there are several.
    """
    p = finite_array("position", position, (3,))
    if p.ndim != 1:
        raise InputError(f"give one position, three numbers; got the shape {p.shape}")
    return p


def one_angle(name: str, angle: ArrayLike) -> float:
    """Return one angle after checking it.

    Raises:
        InputError: The angle is not finite, or there are several.
    """
    value = finite_array(name, angle, ())
    if value.ndim:
        raise InputError(f"give one {name}, a number; got the shape {value.shape}")
    return float(value)


def whole_number(name: str, value: ArrayLike, least: int, most: int | None = None) -> int:
    """Return a whole number within bounds after checking it.

    Args:
        name: Name of the number in messages.
        value: The number; a float without a fraction counts as whole.
        least: Least allowed number.
        most: Largest allowed number; None for no bound.

    Raises:
        InputError: The value is not one whole number, or beyond the bounds.
    """
    array = np.asarray(value)
    try:
        is_whole = array.ndim == 0 and array.dtype.kind in "iuf" and float(array).is_integer()
    except OverflowError:
        is_whole = False
    if not is_whole:
        raise InputError(f"{name} must be a whole number; got {value}")
    number = int(array)
    if number < least and most is None:
        raise InputError(f"{name} must be at least {least}; got {number}")
    if number < least or (most is not None and number > most):
        raise InputError(f"{name} must lie within {least} to {most:,}; got {number}")
    return number


def even_angles(name: str, count: ArrayLike, fewest: int = 3) -> FloatArray:
    """Return angles in degrees at equal distances once around from 0 on, shape (count,).

    Args:
        name: Name of the angles in messages.
        count: Their number.
        fewest: Least allowed number.

    Raises:
        InputError: Not a whole number, or too few or too many angles.
    """
    number = whole_number(f"the number of {name}", count, fewest, MOST_ANGLES)
    return np.asarray(np.arange(number) * (360.0 / number), dtype=np.float64)
