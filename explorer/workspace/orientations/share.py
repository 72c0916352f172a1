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

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial.transform import Rotation

from explorer.errors import InputError
from explorer.mechanism.configuration import one_tool, tool_offset
from explorer.mechanism.design import Design
from explorer.mechanism.pose import rotation_array, rotation_from_yaw_pitch_roll
from explorer.numerics import arrays
from explorer.numerics.arrays import BoolArray, FloatArray, IntArray
from explorer.numerics.checks import whole
from explorer.numerics.number_text import format_apart
from explorer.workspace.limits.quantities import valid_rows
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
            first, last = format_apart((start, end))
            raise InputError(f"{name}: the low end {first}° exceeds the high end {last}°")
        whole(f"the number of values of {name}", count, 1, MOST_ORIENTATIONS)
        first, last = (start, end) if count > 1 else (0.5 * (start + end), 0.0)
        axes.append(np.asarray(np.linspace(first, last, count), dtype=np.float64))
    whole("the number of orientations", math.prod(counts), 1, MOST_ORIENTATIONS)
    grid = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1)
    return rotation_from_yaw_pitch_roll(grid.reshape(-1, 3))


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
    untilted = rotation_array(rotation)
    if not 0.0 <= half_angle <= 180.0:
        most, got = format_apart((180.0, half_angle))
        raise InputError(f"the half-angle of tilts must lie within 0° to {most}°; got {got}°")
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
    return share_of(lambda rotations: _are_within(design, p, rotations, t), n, seed)


def share_of(
    are_within: Callable[[FloatArray], BoolArray], n: int = CAPABILITY_ORIENTATIONS, seed: int = 0
) -> OrientationShare:
    """Return the share of orientations that are within limits, as `orientation_share` does.

    The function tells which rotations (n, 3, 3) are, shape (n,).
    """
    n = whole("the number of orientations", n, 2, MOST_ORIENTATIONS)
    rotations, sizes = _even_sets(n, whole("the seed", seed, 0, 2**63))
    within = are_within(rotations)
    shares = np.add.reduceat(within.astype(np.int64), np.cumsum(sizes) - sizes) / sizes
    share = float(within.mean())
    # The sets differ in size by one orientation at the most.
    spread = float(np.average((shares - share) ** 2, weights=sizes))
    return OrientationShare(share, math.sqrt(spread / (len(sizes) - 1)), n)


@lru_cache(1)
def _even_sets(n: int, seed: int) -> tuple[FloatArray, IntArray]:
    """Return the rotations of sets that each stand for all, (n, 3, 3), and the sets' sizes."""
    sizes = [len(part) for part in np.array_split(np.empty(n), min(SETS, n))]
    turns = Rotation.random(len(sizes), random_state=np.random.default_rng(seed))
    sets: list[FloatArray] = []
    for turn, size in zip(turns, sizes, strict=True):
        s = np.arange(size) + 0.5
        inner, outer = np.sqrt(s / size), np.sqrt(1.0 - s / size)
        first, second = 2.0 * math.pi * s / PHI, 2.0 * math.pi * s / PSI
        w, x = outer * np.cos(second), inner * np.sin(first)
        y, z = inner * np.cos(first), outer * np.sin(second)
        spiral = Rotation.from_quat(np.column_stack([w, x, y, z]), scalar_first=True)
        sets.append((turn * spiral).as_matrix())
    return np.concatenate(sets), np.array(sizes, dtype=np.int64)


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

    The limits are those of `explorer.workspace.limits.table`: lengths, guide, gap, carriage order,
    box, margins with the home's sign triple, and swing demands, without the clearances of legs.
    Position, tool and errors are those of `orientation_capability`.
    """
    p, r, t = one_position(position), rotation_array(rotations), one_tool(tool)
    if r.ndim != 3 or not len(r):
        raise InputError(f"rotations must have the shape (n, 3, 3); got {r.shape}")
    return _are_within(design, p, r, t)


def _are_within(
    design: Design, position: FloatArray, rotations: FloatArray, tool: FloatArray
) -> BoolArray:
    within = np.empty(len(rotations), dtype=np.bool_)
    at = position - tool_offset(rotations, tool), arrays.for_kernel(rotations)
    valid_rows(len(within), *Rules.of(design).without_clearances(), *at, within)
    return within
