"""The tilts that a position can have: how far the platform tilts before a limit stops it.

The angles are those of `explorer.mechanism.tilt_torsion`. At a torsion the platform tilts from
tilt zero in each azimuth, b4 held in its place, until it meets the first limit. That tilt is exact
but for rounding (`explorer.workspace.orientations.turns`). The limits are those of
`explorer.workspace.limits.broken.violations`; collisions of legs are not among them.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from explorer.errors import InputError
from explorer.mechanism.design import Design
from explorer.mechanism.home import home_pose
from explorer.mechanism.pose import checked_rotation
from explorer.mechanism.tilt_torsion import rotation_from_tilt_torsion, tilt_torsion_of
from explorer.numerics.arrays import FloatArray, finite_array, for_kernel
from explorer.workspace.limits.valid_poses import Rules
from explorer.workspace.orientations.least_tilts import least_tilt_rows
from explorer.workspace.orientations.turns import NO_LIMIT, limit_names, tilt_rows, turn_rows

AZIMUTHS = 72
"""Number of azimuths of a map of tilts, and of those between which the least tilt is searched."""

FEWEST_AZIMUTHS, MOST_AZIMUTHS = 3, 100_000
# Number of rows of a kernel that a single turn is worth.
ROWS_OF_TURN = 20
# Error of an angle that is computed in two ways, in degrees.
ANGLE_TOLERANCE = 1e-7


@dataclass(frozen=True)
class TiltMap:
    """The greatest tilt of a position in each of n azimuths, at one torsion; angles in degrees.

    Attributes:
        torsion: Torsion.
        azimuths: Azimuths, shape (n,).
        tilts: Greatest tilts without a gap from tilt zero, 0 to 180, shape (n,); NaN if tilt zero
            itself violates a limit.
        limits: Name of the limit that ends each tilt, such as "d2 maximum", or that tilt zero
            violates; None where the platform can tilt by 180°.
    """

    torsion: float
    azimuths: FloatArray
    tilts: FloatArray
    limits: tuple[str | None, ...]


@dataclass(frozen=True)
class GreatestTilt:
    """The greatest tilt that a position can have in every azimuth; angles in degrees.

    Attributes:
        torsion: Torsion.
        tilt: Least of the greatest tilts over all azimuths; NaN if tilt zero violates a limit.
        azimuth: Azimuth in which the tilt ends, 0 to 360; NaN if none ends it.
        limit: Name of the limit that ends the tilt, or that tilt zero violates; None if the
            platform can tilt by 180° in every azimuth.
    """

    torsion: float
    tilt: float
    azimuth: float
    limit: str | None


@dataclass(frozen=True)
class TorsionRange:
    """The torsions that lead on from one without a gap, at a tilt; angles in degrees.

    Attributes:
        low: Least torsion; NaN if the torsion that the range starts from violates a limit.
        high: Largest torsion, at most 360° above the least one; NaN as `low`.
        low_limit: Name of the limit at the least torsion, or that the start violates; None if
            every torsion is possible.
        high_limit: Name of the limit at the largest torsion, as `low_limit`.
    """

    low: float
    high: float
    low_limit: str | None
    high_limit: str | None


def tilt_map(
    design: Design,
    position: ArrayLike,
    torsion: float | None = None,
    azimuths: ArrayLike | int = AZIMUTHS,
) -> TiltMap:
    """Return the greatest tilt of a position in each azimuth, and the limit that ends it.

    Args:
        design: The manipulator.
        position: Position of b4 in the base frame, in design units, shape (3,).
        torsion: Torsion in degrees; that of the home pose if None.
        azimuths: Azimuths in degrees, shape (n,), or their number, at equal distances from 0 on.

    Raises:
        InputError: not a position, angles that are not finite, or no usable number of azimuths.
    """
    p, sigma = _one_position(position), checked_torsion(design, torsion)
    array = np.asarray(azimuths)
    if array.ndim == 0:
        directions = _even_azimuths(int(array), fewest=1)
    else:
        directions = finite_array("azimuths", array, ())
        if directions.ndim != 1 or not 1 <= len(directions) <= MOST_AZIMUTHS:
            raise InputError(
                f"azimuths must be 1 to {MOST_AZIMUTHS:,} angles; got the shape {directions.shape}"
            )
    count = len(directions)
    tilts, limits = np.empty((1, count)), np.empty((1, count), dtype=np.int64)
    rules = Rules.of(design).without_clearances()
    tilt_rows(
        ROWS_OF_TURN * count,
        rules.row,
        rules.cones,
        for_kernel(p[None]),
        math.radians(sigma),
        np.radians(directions),
        tilts,
        limits,
    )
    return TiltMap(sigma, directions, _degrees(tilts[0]), _names(design, limits[0].tolist()))


def greatest_tilt(
    design: Design, position: ArrayLike, torsion: float | None = None
) -> GreatestTilt:
    """Return the greatest tilt of a position in every azimuth.

    It is the least over all azimuths of the tilts of `tilt_map`. The search starts from
    `AZIMUTHS` azimuths and narrows down every minimum among them that can be the least.

    Args:
        design: The manipulator.
        position: Position of b4 in the base frame, in design units, shape (3,).
        torsion: Torsion in degrees; that of the home pose if None.

    Raises:
        InputError: not a position, or a torsion that is not finite.
    """
    p, sigma = _one_position(position), checked_torsion(design, torsion)
    tilts, towards, limits = _least_tilts(design, p[None], sigma, AZIMUTHS)
    tilt = float(tilts[0])
    is_ended = not math.isnan(tilt) and limits[0] != NO_LIMIT
    azimuth = float(towards[0]) % 360.0 if is_ended else math.nan
    return GreatestTilt(sigma, tilt, azimuth, _names(design, limits)[0])


def greatest_tilts(
    design: Design,
    position: ArrayLike,
    torsion: float | None = None,
    azimuths: int = AZIMUTHS,
) -> FloatArray:
    """Return the greatest tilts of positions in every azimuth, in degrees, shape (...).

    A position whose tilt zero violates a limit has NaN.

    Args:
        design: The manipulator.
        position: Positions of b4 in the base frame, in design units, shape (..., 3).
        torsion: Torsion in degrees; that of the home pose if None.
        azimuths: Number of azimuths from which the least tilt is searched, 3 or more.

    Raises:
        InputError: not positions, a torsion that is not finite, or no usable number of azimuths.
    """
    p, sigma = finite_array("position", position, (3,)), checked_torsion(design, torsion)
    return _least_tilts(design, p.reshape(-1, 3), sigma, azimuths)[0].reshape(p.shape[:-1])


def torsion_range(
    design: Design,
    position: ArrayLike,
    torsion: float | None = None,
    azimuth: float = 0.0,
    tilt: float = 0.0,
) -> TorsionRange:
    """Return the torsions that a position can have without a gap from one torsion, at a tilt.

    Args:
        design: The manipulator.
        position: Position of b4 in the base frame, in design units, shape (3,).
        torsion: Torsion in degrees that the range starts from; that of the home pose if None.
        azimuth: Azimuth in degrees, which stays the same.
        tilt: Tilt in degrees, which stays the same.

    Raises:
        InputError: not a position, or angles that are not finite.
    """
    p, sigma = _one_position(position), checked_torsion(design, torsion)
    r = rotation_from_tilt_torsion([azimuth, tilt, sigma])
    # Downwards the platform's y-axis turns towards the negative x-axis.
    turns = np.stack([_turn_about_z(r, -1.0), _turn_about_z(r, 1.0)])
    angles, limits = _end_of_turns(design, p, turns)
    down, up = _degrees(angles).tolist()
    names = _names(design, limits)
    if names[0] is None and names[1] is None:
        return TorsionRange(sigma - 180.0, sigma + 180.0, None, None)
    if names[0] is None or names[1] is None:
        # Half a turn one way ends where the other way ends, beyond that half turn.
        rest = np.stack([_turn_about_z(_turned_half(r), -1.0), _turn_about_z(_turned_half(r), 1.0)])
        angles, limits = _end_of_turns(design, p, rest)
        more, rest_names = _degrees(angles).tolist(), _names(design, limits)
        if names[0] is None:
            down, names = 180.0 + more[0], (rest_names[0], names[1])
        else:
            up, names = 180.0 + more[1], (names[0], rest_names[1])
    return TorsionRange(sigma - down, sigma + up, *names)


def is_connected(
    design: Design, position: ArrayLike, rotation: ArrayLike, other: ArrayLike | None = None
) -> bool:
    """Return whether an orientation is connected to tilt zero by a tilt without a gap.

    The tilt keeps azimuth and torsion. At tilt 180°, where many torsions give one orientation, it
    is that of torsion 0.

    Args:
        design: The manipulator.
        position: Position of b4 in the base frame, in design units, shape (3,).
        rotation: Orientation, platform to base, shape (3, 3).
        other: Second orientation, shape (3, 3). If given, the question is whether a tilt from the
            first one to tilt zero, a change of the torsion there and a tilt to the second one
            connect the two.

    Raises:
        InputError: not a position, or not a rotation.
    """
    p = _one_position(position)
    ends = [
        tilt_torsion_of(checked_rotation(each)) for each in (rotation, other) if each is not None
    ]
    for azimuth, tilt, torsion in ends:
        reached = tilt_map(design, p, torsion, [azimuth]).tilts[0]
        if not reached >= tilt - ANGLE_TOLERANCE:
            return False
    if other is None:
        return True
    span = torsion_range(design, p, ends[0].torsion)
    turn = (ends[1].torsion - span.low) % 360.0
    return span.high - span.low >= min(turn, 360.0 - ANGLE_TOLERANCE) - ANGLE_TOLERANCE


def checked_torsion(design: Design, torsion: float | None) -> float:
    """Return a torsion in degrees after checking it; that of the home pose if None.

    Raises:
        InputError: The torsion is not finite.
    """
    if torsion is None:
        return tilt_torsion_of(home_pose(design).rotation).torsion
    return float(finite_array("torsion", torsion, ()))


def _one_position(position: ArrayLike) -> FloatArray:
    p = finite_array("position", position, (3,))
    if p.ndim != 1:
        raise InputError(f"give one position, three numbers; got the shape {p.shape}")
    return p


def _even_azimuths(count: int, fewest: int) -> FloatArray:
    if not fewest <= count <= MOST_AZIMUTHS:
        raise InputError(
            f"the number of azimuths must lie within {fewest} to {MOST_AZIMUTHS:,}; got {count}"
        )
    return np.asarray(np.arange(count) * (360.0 / count), dtype=np.float64)


def _least_tilts(
    design: Design, positions: FloatArray, torsion: float, azimuths: int
) -> tuple[FloatArray, FloatArray, list[int]]:
    """Return least tilts and their azimuths in degrees, and the numbers of their limits."""
    n, directions = len(positions), np.radians(_even_azimuths(azimuths, FEWEST_AZIMUTHS))
    least, towards, limits = np.empty(n), np.empty(n), np.empty(n, dtype=np.int64)
    rules = Rules.of(design).without_clearances()
    least_tilt_rows(
        ROWS_OF_TURN * n * azimuths,
        rules.row,
        rules.cones,
        for_kernel(positions),
        math.radians(torsion),
        directions,
        np.empty(azimuths),
        least,
        towards,
        limits,
    )
    return _degrees(least), np.degrees(towards), limits.tolist()


def _end_of_turns(
    design: Design, position: FloatArray, turns: FloatArray
) -> tuple[FloatArray, list[int]]:
    """Return the angles (n,) in radians at which turns (n, 3, 3, 3) end, and their limits."""
    angles, limits = np.empty(len(turns)), np.empty(len(turns), dtype=np.int64)
    rules = Rules.of(design).without_clearances()
    positions = np.full((len(turns), 3), position)
    turn_rows(len(turns), rules.row, rules.cones, positions, turns, angles, limits)
    return angles, limits.tolist()


def _turn_about_z(rotation: FloatArray, sign: float) -> FloatArray:
    """Return the turn from a rotation about the platform's z-axis, shape (3, 3, 3)."""
    x, y, z = rotation.T
    still = np.column_stack([0.0 * x, 0.0 * y, z])
    cosine = np.column_stack([x, y, 0.0 * z])
    sine = sign * np.column_stack([y, -x, 0.0 * z])
    return np.stack([still + cosine, 2.0 * sine, still - cosine], axis=-1)


def _turned_half(rotation: FloatArray) -> FloatArray:
    return rotation * np.array([-1.0, -1.0, 1.0])


def _degrees(angles: FloatArray) -> FloatArray:
    """Return angles in degrees; NaN for those whose start violates a limit."""
    degrees: FloatArray = np.rad2deg(angles)
    degrees[angles < 0.0] = math.nan
    return degrees


def _names(design: Design, limits: list[int]) -> tuple[str | None, ...]:
    names = limit_names(design)
    return tuple(None if limit == NO_LIMIT else names[limit] for limit in limits)
