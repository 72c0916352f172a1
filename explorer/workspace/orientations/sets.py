"""Sets of orientations: a range of yaw, pitch and roll, or a cone of tilts; checks of angles."""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial.transform import Rotation

from explorer.errors import InputError
from explorer.mechanism.pose import checked_rotation, rotation_from_yaw_pitch_roll
from explorer.numerics.arrays import FloatArray, finite_array, position_array

MOST_ORIENTATIONS = 1_000_000
"""Largest number of orientations in a set."""

GOLDEN_ANGLE = math.pi * (3.0 - math.sqrt(5.0))


def yaw_pitch_roll_range(
    lows: Sequence[float], highs: Sequence[float], counts: Sequence[int]
) -> FloatArray:
    """Return the orientations of a grid over ranges of yaw, pitch and roll, (n, 3, 3).

    The yaw is outermost.

    Args:
        lows: Least yaw, pitch and roll, in degrees.
        highs: Largest yaw, pitch and roll, in degrees.
        counts: Numbers of values on the ranges, ends included; a single one is the middle.

    Raises:
        InputError: Not three of each, a reversed range, or no usable number of orientations.
    """
    low, high = finite_array("lows", lows, (3,)), finite_array("highs", highs, (3,))
    if low.ndim != 1 or high.ndim != 1 or len(counts) != 3:
        raise InputError("lows, highs and counts are of yaw, pitch and roll: three numbers each")
    axes: list[FloatArray] = []
    for name, start, end, count in zip(("yaw", "pitch", "roll"), low, high, counts, strict=True):
        if start > end:
            raise InputError(f"{name}: the low end {start:g}° exceeds the high end {end:g}°")
        _check_count(f"the number of values of {name}", count)
        first, last = (start, end) if count > 1 else (0.5 * (start + end), 0.0)
        axes.append(np.asarray(np.linspace(first, last, count), dtype=np.float64))
    _check_count("the number of orientations", math.prod(counts))
    return rotation_from_yaw_pitch_roll(np.array(list(itertools.product(*axes))))


def cone_of_directions(rotation: ArrayLike, half_angle: float, count: int) -> FloatArray:
    """Return orientations that tilt a platform in all directions up to a half-angle, (count, 3, 3).

    Each tilt turns the platform's z-axis along the shortest arc, without torsion. The tilted
    axes are spread evenly over the cone, the first at its centre, the last on its rim.

    Args:
        rotation: Rotation from platform to base without tilt, shape (3, 3).
        half_angle: Half-angle of the cone in degrees, 0 to 180.
        count: Number of orientations.

    Raises:
        InputError: Not a rotation, a half-angle out of its range, or no usable count.
    """
    untilted = checked_rotation(rotation)
    if not 0.0 <= half_angle <= 180.0:
        raise InputError(f"the half-angle of tilts must lie within 0° to 180°; got {half_angle:g}°")
    _check_count("the number of orientations", count)
    share = np.arange(count) / max(1, count - 1)
    # The area of a spherical cap grows with 1 - cos of the tilt.
    tilt = 2.0 * np.arcsin(np.sqrt(share) * math.sin(0.5 * math.radians(half_angle)))
    turn = GOLDEN_ANGLE * np.arange(count)
    axes = np.column_stack([np.cos(turn), np.sin(turn), np.zeros(count)])
    return untilted @ Rotation.from_rotvec(tilt[:, None] * axes).as_matrix()


def _check_count(name: str, count: int) -> None:
    whole_number(name, count, 1, MOST_ORIENTATIONS)


# Largest number of azimuths or torsions.
MOST_ANGLES = 100_000


def one_position(position: ArrayLike) -> FloatArray:
    """Return one position (3,); an `InputError` says if it is not finite, or there are several."""
    p = position_array("position", position)
    if p.ndim != 1:
        raise InputError(f"give one position, three numbers; got the shape {p.shape}")
    return p


def one_angle(name: str, angle: ArrayLike) -> float:
    """Return one angle; an `InputError` says if it is not finite, or there are several."""
    value = finite_array(name, angle, ())
    if value.ndim:
        raise InputError(f"give one {name}, a number; got the shape {value.shape}")
    return float(value)


def whole_number(name: str, value: ArrayLike, least: int, most: int | None = None) -> int:
    """Return a whole number from `least` to `most`, or raise an `InputError`; 3.0 is whole."""
    array = np.asarray(value)
    if not (array.ndim == 0 and array.dtype.kind in "iuf" and float(array).is_integer()):
        raise InputError(f"{name} must be a whole number; got {value}")
    number = int(array)
    if number < least and most is None:
        raise InputError(f"{name} must be at least {least}; got {number}")
    if number < least or (most is not None and number > most):
        raise InputError(f"{name} must lie within {least} to {most:,}; got {number}")
    return number


def even_angles(name: str, count: ArrayLike, fewest: int = 3) -> FloatArray:
    """Return a checked number of angles in degrees at equal distances once around from 0 on."""
    number = whole_number(f"the number of {name}", count, fewest, MOST_ANGLES)
    return np.asarray(np.arange(number) * (360.0 / number), dtype=np.float64)
