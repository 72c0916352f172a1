"""Sets of orientations, and the share of them that a position can have.

A set is a range of yaw, pitch and roll, or a cone of tilts. Orientations that stand for all are
several sets of super-Fibonacci spirals (M. Alexa, "Super-Fibonacci Spirals: Fast, Low-Discrepancy
Sampling of SO(3)", CVPR 2022), each turned by a random rotation of its own. Every turned point is
spread evenly over all rotations, so the mean of the sets is without bias, and the spread of the
sets gives its standard error (randomised quasi-Monte Carlo; A. B. Owen, "Practical Quasi-Monte
Carlo Integration", 2023, chapter 17). It is a few times smaller than that of as many independent
orientations.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial.transform import Rotation

from explorer.errors import InputError
from explorer.mechanism.configuration import one_tool, tool_offset
from explorer.mechanism.design import Design
from explorer.mechanism.pose import checked_rotation, rotation_from_yaw_pitch_roll
from explorer.numerics import arrays
from explorer.numerics.arrays import BoolArray, FloatArray, IntArray
from explorer.numerics.checks import whole
from explorer.numerics.compiled import kernel
from explorer.workspace.limits.quantities import is_valid, valid_rows
from explorer.workspace.limits.valid_poses import Rules

MOST_ORIENTATIONS = 1_000_000
"""Largest number of orientations in a set."""

# Largest number of azimuths or torsions.
MOST_ANGLES = 100_000
GOLDEN_ANGLE = math.pi * (3.0 - math.sqrt(5.0))


def yaw_pitch_roll_range(
    lows: Sequence[float], highs: Sequence[float], counts: Sequence[int]
) -> FloatArray:
    """Return a grid of orientations over yaw (outermost), pitch and roll, shape (n, 3, 3).

    Args:
        lows: Least yaw, pitch and roll, in degrees.
        highs: Largest yaw, pitch and roll, in degrees.
        counts: Numbers of values on the ranges, ends included; a single one is the middle.

    Raises:
        InputError: Not three of each, a reversed range, or no usable number of orientations.
    """
    low, high = arrays.finite_array("lows", lows, (3,)), arrays.finite_array("highs", highs, (3,))
    if low.ndim != 1 or high.ndim != 1 or len(counts) != 3:
        raise InputError("lows, highs and counts are of yaw, pitch and roll: three numbers each")
    axes: list[FloatArray] = []
    for name, start, end, count in zip(("yaw", "pitch", "roll"), low, high, counts, strict=True):
        if start > end:
            raise InputError(f"{name}: the low end {start:g}° exceeds the high end {end:g}°")
        whole(f"the number of values of {name}", count, 1, MOST_ORIENTATIONS)
        first, last = (start, end) if count > 1 else (0.5 * (start + end), 0.0)
        axes.append(np.asarray(np.linspace(first, last, count), dtype=np.float64))
    whole("the number of orientations", math.prod(counts), 1, MOST_ORIENTATIONS)
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
    whole("the number of orientations", count, 1, MOST_ORIENTATIONS)
    share = np.arange(count) / max(1, count - 1)
    # The area of a spherical cap grows with 1 - cos of the tilt.
    tilt = 2.0 * np.arcsin(np.sqrt(share) * math.sin(0.5 * math.radians(half_angle)))
    turn = GOLDEN_ANGLE * np.arange(count)
    axes = np.column_stack([np.cos(turn), np.sin(turn), np.zeros(count)])
    return untilted @ Rotation.from_rotvec(tilt[:, None] * axes).as_matrix()


def one_position(position: ArrayLike) -> FloatArray:
    """Return one position (3,); an `InputError` says if it is not finite, or there are several."""
    p = arrays.position_array("position", position)
    if p.ndim != 1:
        raise InputError(f"give one position, three numbers; got the shape {p.shape}")
    return p


def one_angle(name: str, angle: ArrayLike) -> float:
    """Return one angle; an `InputError` says if it is not finite, or there are several."""
    value = arrays.finite_array(name, angle, ())
    if value.ndim:
        raise InputError(f"give one {name}, a number; got the shape {value.shape}")
    return float(value)


def even_angles(name: str, count: object, fewest: int = 3) -> FloatArray:
    """Return a checked number of angles in degrees at equal distances once around from 0 on."""
    number = whole(f"the number of {name}", count, fewest, MOST_ANGLES)
    return np.asarray(np.arange(number) * (360.0 / number), dtype=np.float64)


CAPABILITY_ORIENTATIONS = 100_000
"""Number of orientations that gives the share at a position to about a thousandth."""

# Largest number of sets of orientations.
SETS = 20
# Turns of the two spirals between neighbours: 1/√2, and 1/ψ with ψ⁴ = ψ + 4.
PHI, PSI = math.sqrt(2.0), 1.533751168755204288118041


@dataclass(frozen=True)
class OrientationShare:
    """The share of all orientations that a position can have.

    Attributes:
        share: Share, 0 to 1.
        standard_error: Standard error of the share; 0 if all sets of orientations agree, as where
            a position can have every orientation or none.
        orientations: Number of orientations that were checked.
    """

    share: float
    standard_error: float
    orientations: int


def orientation_share(
    design: Design,
    position: ArrayLike,
    n: int = CAPABILITY_ORIENTATIONS,
    seed: int = 0,
    tool: ArrayLike | None = None,
) -> OrientationShare:
    """Return the share of all orientations that a position can have, of n that stand for all.

    The same seed of the random rotations gives the same result. Limits, position, tool and errors
    are those of `orientations_within`.
    """
    p, t = one_position(position), one_tool(tool)
    n = whole("the number of orientations", n, 2, MOST_ORIENTATIONS)
    seed = whole("the seed", seed, 0, 2**63)
    sets = min(SETS, n)
    sizes = np.full(sets, n // sets, dtype=np.int64)
    sizes[: n % sets] += 1
    turns = Rotation.random(sets, random_state=np.random.default_rng(seed))
    quaternions = arrays.for_kernel(turns.as_quat(scalar_first=True).reshape(sets, 4))
    counts = np.zeros(sets, dtype=np.int64)
    rules = Rules.of(design).without_clearances()
    share_rows(n, *rules, arrays.for_kernel(p), t, quaternions, sizes, counts)
    share = float(counts.sum()) / n
    weights = sizes / n
    # The sets differ in size by one orientation at the most.
    spread = float(np.sum(weights * (counts / sizes - share) ** 2))
    return OrientationShare(share, math.sqrt(spread / (sets - 1)), n)


def orientation_capability(
    design: Design,
    position: ArrayLike,
    orientations: ArrayLike | int = CAPABILITY_ORIENTATIONS,
    tool: ArrayLike | None = None,
) -> float:
    """Return the share of orientations that a position can have within all limits, 0 to 1.

    Args:
        design: The manipulator.
        position: Position of b4 or the tool in the base frame, in design units, shape (3,).
        orientations: Rotations from platform to base, shape (n, 3, 3), or their number for
            `orientation_share`, which gives the standard error too.
        tool: Point of the platform that has the position, in the platform frame, shape (3,), in
            design units; None for b4.

    Raises:
        InputError: Not a position, not a tool point, not rotations, or no usable count.
    """
    array = np.asarray(orientations)
    if array.ndim == 0:
        return orientation_share(design, position, array.item(), tool=tool).share
    return float(orientations_within(design, position, array, tool).mean())


def orientations_within(
    design: Design, position: ArrayLike, rotations: ArrayLike, tool: ArrayLike | None = None
) -> BoolArray:
    """Return which rotations (n, 3, 3) a position can have within the limits, shape (n,).

    The limits are those of `explorer.workspace.limits.valid_poses.violations`: lengths, guide, gap,
    carriage order, box, margins with the home's sign triple, and swing demands. Position, tool and
    errors are those of `orientation_capability`.
    """
    p, r, t = one_position(position), checked_rotation(rotations), one_tool(tool)
    if r.ndim != 3 or not len(r):
        raise InputError(f"rotations must have the shape (n, 3, 3); got {r.shape}")
    within = np.empty(len(r), dtype=np.bool_)
    rules = Rules.of(design).without_clearances()
    valid_rows(len(r), *rules, p - tool_offset(r, t), arrays.for_kernel(r), within)
    return within


@kernel("void(f8[::1], f8[:,::1], f8[::1], f8[::1], f8[:,::1], i8[::1], i8[::1])")
def share_rows(
    row: FloatArray,
    demands: FloatArray,
    position: FloatArray,
    tool: FloatArray,
    turns: FloatArray,
    sizes: IntArray,
    counts: IntArray,
) -> None:
    """Write how many orientations of each set satisfy all rules.

    Each of m sets of a size is turned by a unit quaternion (w, x, y, z), shape (m, 4). The position
    is that of the tool.
    """
    base, ends, r = np.zeros((4, 3)), np.zeros((4, 3)), np.zeros((3, 3))
    p = np.zeros(3)
    for index in range(turns.shape[0]):
        a, b, c, d = turns[index, 0], turns[index, 1], turns[index, 2], turns[index, 3]
        size = sizes[index]
        count = 0
        for number in range(size):
            s = number + 0.5
            inner, outer = math.sqrt(s / size), math.sqrt(1.0 - s / size)
            first, second = 2.0 * math.pi * s / PHI, 2.0 * math.pi * s / PSI
            e, f = outer * math.cos(second), inner * math.sin(first)
            g, h = inner * math.cos(first), outer * math.sin(second)
            w, x = a * e - b * f - c * g - d * h, a * f + b * e + c * h - d * g
            y, z = a * g - b * h + c * e + d * f, a * h + b * g - c * f + d * e
            r[0, 0], r[0, 1] = 1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - w * z)
            r[0, 2], r[1, 0] = 2.0 * (x * z + w * y), 2.0 * (x * y + w * z)
            r[1, 1], r[1, 2] = 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - w * x)
            r[2, 0], r[2, 1] = 2.0 * (x * z - w * y), 2.0 * (y * z + w * x)
            r[2, 2] = 1.0 - 2.0 * (x * x + y * y)
            for i in range(3):
                arm = r[i, 0] * tool[0] + r[i, 1] * tool[1] + r[i, 2] * tool[2]
                p[i] = position[i] - arm
            if is_valid(row, demands, p, r, base, ends):
                count += 1
        counts[index] = count
