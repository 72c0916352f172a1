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
from explorer.mechanism.design import JOINTS, LENGTHS, TOLERANCE, Design
from explorer.mechanism.pose import (
    checked_rotation,
    rotation_from_quaternion,
    rotation_from_yaw_pitch_roll,
)
from explorer.numerics.arrays import BoolArray, FloatArray, finite_array, for_kernel
from explorer.numerics.compiled import kernel
from explorer.workspace.limits.constraints import demanded_order, home_signs
from explorer.workspace.limits.joint_cones import joint_cones

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
    middle = checked_rotation(rotation)
    if not 0.0 <= half_angle <= 180.0:
        raise InputError(f"the half-angle of tilts must lie within 0° to 180°; got {half_angle:g}°")
    _check_count("the number of orientations", count)
    share = np.arange(count) / max(1, count - 1)
    # The area of a spherical cap grows with 1 - cos of the tilt.
    tilt = 2.0 * np.arcsin(np.sqrt(share) * math.sin(0.5 * math.radians(half_angle)))
    turn = GOLDEN_ANGLE * np.arange(count)
    about = np.column_stack([np.cos(turn), np.sin(turn), np.zeros(count)])
    return middle @ Rotation.from_rotvec(tilt[:, None] * about).as_matrix()


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
    given = np.asarray(orientations)
    rotations = uniform_rotations(int(given)) if given.ndim == 0 else given
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
        raise InputError("an orientation capability is that of one position")
    if r.ndim != 3 or not len(r):
        raise InputError(f"rotations must have the shape (n, 3, 3); got {r.shape}")
    within = np.zeros(len(r), dtype=np.bool_)
    limits, slack = design.limits, design.tolerance
    if limits.box is not None:
        lows, highs = np.array(limits.box)
        if (p < lows - slack).any() or (p > highs + slack).any():
            return within
    ranges = np.tile([-math.inf, math.inf], (7, 1))
    for name in LENGTHS:
        ranges[JOINTS.index(name)] = design.length_range(name)
    if limits.guide is not None:
        ranges[[JOINTS.index("d1"), JOINTS.index("d3")]] = limits.guide
    ranges[6, 0] = limits.gap
    demands = np.full((3, 2), -math.inf)
    if limits.margin is not None:
        demands = np.array([(sign, limits.margin) for sign in home_signs(design)], dtype=np.float64)
    cones = np.array(
        [
            # A leg of length zero at home has no direction, so no pose keeps its cone.
            (cone.leg, cone.in_platform, *cone.axis, cone.half_angle + TOLERANCE)
            if cone.axis is not None
            else (cone.leg, cone.in_platform, 0.0, 0.0, 0.0, -1.0)
            for cone in joint_cones(design)
        ],
        dtype=np.float64,
    ).reshape(-1, 6)
    keep_limits(
        len(r),
        np.array(design.variables),
        for_kernel(p),
        for_kernel(r),
        ranges + [-slack, slack],
        demands - [0.0, slack],
        float(demanded_order(design)),
        cones,
        within,
    )
    return within


@kernel("void(f8[::1], f8[::1], f8[:,:,::1], f8[:,::1], f8[:,::1], f8, f8[:,::1], b1[::1])")
def keep_limits(
    variables: FloatArray,
    p: FloatArray,
    rotations: FloatArray,
    ranges: FloatArray,
    demands: FloatArray,
    order: float,
    cones: FloatArray,
    within: BoolArray,
) -> None:
    """Write whether a position keeps all limits in each orientation.

    Args:
        variables: Design variables X = (a3x, a3y, b1x, b1y, b2, b3).
        p: Position of b4 in the base frame, shape (3,).
        rotations: Rotations from platform to base, shape (n, 3, 3).
        ranges: (lowest, highest) value of each joint and of the gap, shape (7, 2).
        demands: (sign, least value) of each margin times that sign, shape (3, 2); minus
            infinity twice for no demand.
        order: Demanded sign of d3 − d1, 0 for either.
        cones: (leg, whether in platform axes, axis, half-angle), shape (k, 6).
        within: Written: whether all limits are kept, shape (n,).
    """
    legs = np.zeros((4, 3))
    legs[3, 0], legs[3, 1], legs[3, 2] = p[0] - variables[0], p[1] - variables[1], p[2]
    l4 = math.hypot(math.hypot(legs[3, 0], legs[3, 1]), legs[3, 2])
    for i in range(rotations.shape[0]):
        r = rotations[i]
        within[i] = False
        for axis in range(3):
            legs[0, axis] = p[axis] + variables[2] * r[axis, 0] + variables[3] * r[axis, 1]
            if axis > 0:
                legs[1, axis] = p[axis] + variables[4] * r[axis, 0]
                legs[2, axis] = p[axis] + variables[5] * r[axis, 0]
        d1, d3 = p[0] + variables[4] * r[0, 0], p[0] + variables[5] * r[0, 0]
        l1 = math.hypot(math.hypot(legs[0, 0], legs[0, 1]), legs[0, 2])
        d2 = math.hypot(legs[1, 1], legs[1, 2])
        d4 = math.hypot(legs[2, 1], legs[2, 2])
        gap = order * (d3 - d1) if order != 0.0 else abs(d3 - d1)
        if not (
            ranges[0, 0] <= l1 <= ranges[0, 1]
            and ranges[1, 0] <= d1 <= ranges[1, 1]
            and ranges[2, 0] <= d2 <= ranges[2, 1]
            and ranges[3, 0] <= d3 <= ranges[3, 1]
            and ranges[4, 0] <= d4 <= ranges[4, 1]
            and ranges[5, 0] <= l4 <= ranges[5, 1]
            and ranges[6, 0] <= gap
        ):
            continue
        if demands[0, 0] > -2.0:
            delta1 = -(r[0, 2] * p[0] + r[1, 2] * p[1] + r[2, 2] * p[2])
            delta2 = r[1, 0] * p[2] - r[2, 0] * p[1]
            if (
                demands[0, 0] * delta1 < demands[0, 1]
                or demands[1, 0] * delta2 < demands[1, 1]
                or demands[2, 0] * p[2] < demands[2, 1]
            ):
                continue
        kept = True
        for k in range(cones.shape[0]):
            leg = legs[int(cones[k, 0]) - 1]
            x, y, z = cones[k, 2], cones[k, 3], cones[k, 4]
            if cones[k, 1] > 0.0:
                x, y, z = (
                    r[0, 0] * x + r[0, 1] * y + r[0, 2] * z,
                    r[1, 0] * x + r[1, 1] * y + r[1, 2] * z,
                    r[2, 0] * x + r[2, 1] * y + r[2, 2] * z,
                )
            across = math.sqrt(
                (leg[1] * z - leg[2] * y) ** 2
                + (leg[2] * x - leg[0] * z) ** 2
                + (leg[0] * y - leg[1] * x) ** 2
            )
            if math.atan2(across, leg[0] * x + leg[1] * y + leg[2] * z) > cones[k, 5]:
                kept = False
                break
        within[i] = kept


def _check_count(name: str, count: int) -> None:
    if not 1 <= count <= MOST_ORIENTATIONS:
        raise InputError(f"{name} must lie within 1 to {MOST_ORIENTATIONS:,}; got {count}")
