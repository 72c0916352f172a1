"""Sets of orientations, and the share of them that a position can have.

A set is a range of yaw, pitch and roll, a cone of tilts, or an even sample of all rotations on
super-Fibonacci spirals (M. Alexa, "Super-Fibonacci Spirals: Fast, Low-Discrepancy Sampling of
SO(3)", CVPR 2022).
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial.transform import Rotation

from explorer.errors import InputError
from explorer.mechanism.design import Design
from explorer.mechanism.pose import (
    checked_rotation,
    rotation_from_quaternion,
    rotation_from_yaw_pitch_roll,
)
from explorer.numerics.arrays import BoolArray, FloatArray, finite_array, for_kernel
from explorer.workspace.limits.valid_poses import Rules, valid_rows

# Largest number of orientations in a set.
MOST_ORIENTATIONS = 1_000_000
# Turns of the two spirals between neighbours: 1/√2, and 1/ψ with ψ⁴ = ψ + 4.
PHI, PSI = math.sqrt(2.0), 1.533751168755204288118041
GOLDEN_ANGLE = math.pi * (3.0 - math.sqrt(5.0))
# Number of orientations that gives the share at a position to about a thousandth.
CAPABILITY_ORIENTATIONS = 100_000


def yaw_pitch_roll_range(
    lows: Sequence[float], highs: Sequence[float], counts: Sequence[int]
) -> FloatArray:
    """Return the orientations of a grid over ranges of yaw, pitch and roll.

    Args:
        lows: Least yaw, pitch and roll, in degrees.
        highs: Largest yaw, pitch and roll, in degrees.
        counts: Numbers of values on the ranges, ends included; a single one is the middle.

    Returns:
        Rotations from platform to base, shape (n, 3, 3), yaw outermost.

    Raises:
        InputError: not three of each, a reversed range, a count that is not positive, or too
            many orientations.
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
    """Return orientations that tilt a platform in all directions up to a half-angle.

    Each tilt turns the platform's z-axis along the shortest arc, without torsion. The tilted
    axes are spread evenly over the cone, the first at its centre, the last on its rim.

    Args:
        rotation: Rotation from platform to base without tilt, shape (3, 3).
        half_angle: Half-angle of the cone in degrees, 0 to 180.
        count: Number of orientations.

    Returns:
        Rotations from platform to base, shape (count, 3, 3).

    Raises:
        InputError: not a rotation, a half-angle out of its range, or no usable count.
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


def uniform_rotations(count: int) -> FloatArray:
    """Return rotations spread evenly over SO(3), always the same for a count.

    Args:
        count: Number of rotations.

    Returns:
        Rotations, shape (count, 3, 3).

    Raises:
        InputError: a count that is not positive or too large.
    """
    _check_count("the number of orientations", count)
    s = np.arange(count) + 0.5
    inner, outer = np.sqrt(s / count), np.sqrt(1.0 - s / count)
    first, second = 2.0 * math.pi * s / PHI, 2.0 * math.pi * s / PSI
    return rotation_from_quaternion(
        np.column_stack(
            [
                outer * np.cos(second),
                inner * np.sin(first),
                inner * np.cos(first),
                outer * np.sin(second),
            ]
        )
    )


def orientation_capability(
    design: Design, position: ArrayLike, orientations: ArrayLike | int = CAPABILITY_ORIENTATIONS
) -> float:
    """Return the share of orientations that a position can have within all limits, 0 to 1.

    Args:
        design: The manipulator.
        position: Position of b4 in the base frame, in design units, shape (3,).
        orientations: Rotations from platform to base, shape (n, 3, 3), or their number for
            `uniform_rotations`.

    Raises:
        InputError: not a position, not rotations, or no usable count.
    """
    array = np.asarray(orientations)
    rotations = uniform_rotations(int(array)) if array.ndim == 0 else array
    return float(orientations_within(design, position, rotations).mean())


def orientations_within(design: Design, position: ArrayLike, rotations: ArrayLike) -> BoolArray:
    """Return which orientations a position can have within all limits, shape (n,).

    The limits are those of `explorer.workspace.limits.broken.violations`: lengths, guide, gap,
    carriage order, box, margins with the home's sign triple, and swing cones.

    Args:
        design: The manipulator.
        position: Position of b4 in the base frame, in design units, shape (3,).
        rotations: Rotations from platform to base, shape (n, 3, 3).

    Raises:
        InputError: not a position, or not rotations.
    """
    p, r = finite_array("position", position, (3,)), checked_rotation(rotations)
    if p.ndim != 1:
        raise InputError(f"give one position, three numbers; got the shape {p.shape}")
    if r.ndim != 3 or not len(r):
        raise InputError(f"rotations must have the shape (n, 3, 3); got {r.shape}")
    within = np.empty(len(r), dtype=np.bool_)
    rules = Rules.of(design).without_clearances()
    valid_rows(len(r), rules.row, rules.cones, np.full((len(r), 3), p), for_kernel(r), within)
    return within


def _check_count(name: str, count: int) -> None:
    if not 1 <= count <= MOST_ORIENTATIONS:
        raise InputError(f"{name} must lie within 1 to {MOST_ORIENTATIONS:,}; got {count}")
