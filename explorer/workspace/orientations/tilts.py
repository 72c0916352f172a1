"""Tilts and torsions that a position can have: how far the platform turns until a limit stops it.

The angles are those of `explorer.mechanism.tilt_torsion`. At a torsion the platform tilts from
tilt zero in each azimuth, b4 or the tool held in its place, until it meets the first limit. That
tilt is exact but for rounding (`explorer.workspace.orientations.turns`). The limits are those of
`explorer.workspace.limits.table`; collisions of legs are not among them.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from explorer.errors import InputError
from explorer.mechanism.configuration import one_tool
from explorer.mechanism.design import Design
from explorer.mechanism.pose import rotation_array
from explorer.mechanism.tilt_torsion import rotation_from_tilt_torsion, tilt_torsion_of
from explorer.numerics import arrays
from explorer.numerics.arrays import FloatArray
from explorer.workspace.limits.table import by_quantity, demands_of
from explorer.workspace.limits.valid_poses import Rules
from explorer.workspace.orientations.least_tilts import least_tilt_rows, tilt_rows
from explorer.workspace.orientations.share import MOST_ANGLES, even_angles, one_angle, one_position
from explorer.workspace.orientations.turns import NO_LIMIT, turn_rows

AZIMUTHS = 72
"""Number of azimuths of a map of tilts, and of those between which the least tilt of each of many
positions is searched."""

# Number of azimuths between which the least tilt of a single position is searched.
AZIMUTHS_OF_ONE = 360
# Number of rows of a kernel that a single turn is worth.
ROWS_OF_TURN = 20


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
        azimuth: Azimuth in which the tilt ends, −180 to 180; NaN if none ends it.
        limit: Name of the limit that ends the tilt, or that tilt zero violates; None if the
            platform can tilt by 180° in every azimuth.
    """

    torsion: float
    tilt: float
    azimuth: float
    limit: str | None


def tilt_map(
    design: Design,
    position: ArrayLike,
    torsion: float | None = None,
    azimuths: ArrayLike | int = AZIMUTHS,
    tool: ArrayLike | None = None,
) -> TiltMap:
    """Return the greatest tilt of a position in each azimuth, and the limit that ends it.

    The azimuths are in degrees, shape (n,), or their number, at equal distances from 0 on. The
    other arguments and the errors are those of `greatest_tilt`.
    """
    p, sigma = one_position(position), _torsion_of(design, torsion)
    array = np.asarray(azimuths)
    if array.ndim == 0:
        directions = even_angles("azimuths", array.item(), fewest=1)
    else:
        directions = arrays.finite_array("azimuths", array, ())
        if directions.ndim != 1 or not 1 <= len(directions) <= MOST_ANGLES:
            raise InputError(
                f"azimuths must be 1 to {MOST_ANGLES:,} angles; got the shape {directions.shape}"
            )
    count = len(directions)
    tilts, limits = np.empty(count), np.empty(count, dtype=np.int64)
    rules = Rules.of(design).without_clearances()
    at = arrays.for_kernel(p), one_tool(tool), math.radians(sigma), np.radians(directions)
    tilt_rows(ROWS_OF_TURN * count, *rules, *at, tilts, limits)
    return TiltMap(sigma, directions, in_degrees(tilts), names_of(design, limits.tolist()))


def greatest_tilt(
    design: Design, position: ArrayLike, torsion: float | None = None, tool: ArrayLike | None = None
) -> GreatestTilt:
    """Return the greatest tilt of a position in every azimuth.

    It is the least over all azimuths of the tilts of `tilt_map`. The search starts from 360
    azimuths, and from those of the worst orientations for lengths, guide and box, and narrows down
    every minimum among them that can be the least. A dip by the swing of a joint that is narrower
    than the distance of the azimuths, 1°, can be missed.

    Args:
        design: The manipulator.
        position: Position of b4 or the tool in the base frame, in design units, shape (3,).
        torsion: Torsion in degrees; that of the home pose if None.
        tool: Point of the platform that has the position, in the platform frame, shape (3,), in
            design units; None for b4.

    Raises:
        InputError: Not a position, not a tool point, or a torsion that is not finite.
    """
    p, sigma = one_position(position), _torsion_of(design, torsion)
    sigmas = np.array([sigma])
    tilts, towards, limits = _least_tilts(design, p[None], sigmas, AZIMUTHS_OF_ONE, tool)
    tilt = float(tilts[0])
    is_ended = not math.isnan(tilt) and limits[0] != NO_LIMIT
    azimuth = math.remainder(float(towards[0]), 360.0) if is_ended else math.nan
    return GreatestTilt(sigma, tilt, azimuth, names_of(design, limits)[0])


def greatest_tilts(
    design: Design,
    position: ArrayLike,
    torsion: ArrayLike | None = None,
    azimuths: int = AZIMUTHS,
    tool: ArrayLike | None = None,
) -> FloatArray:
    """Return the greatest tilts of positions in every azimuth, in degrees, shape (...).

    A position whose tilt zero violates a limit has NaN. Positions have the shape (..., 3), torsions
    in degrees (...). The search is that of `greatest_tilt`, from fewer azimuths, 3 or more: with
    72, a dip by the swing of a joint that is narrower than 5° can be missed.

    Raises:
        InputError: As there, or positions and torsions that do not broadcast.
    """
    p = arrays.position_array("position", position)
    sigma = arrays.finite_array("torsion", _torsion_of(design) if torsion is None else torsion, ())
    shape = arrays.batch_shape((p, 1), (sigma, 0))
    positions = np.broadcast_to(p, (*shape, 3)).reshape(-1, 3)
    torsions = np.broadcast_to(sigma, shape).reshape(-1)
    return _least_tilts(design, positions, torsions, azimuths, tool)[0].reshape(shape)


def _torsion_of(design: Design, torsion: float | None = None) -> float:
    """Return one torsion in degrees after checking it; that of the home pose if None."""
    if torsion is None:
        return tilt_torsion_of(design.home_pose.rotation).torsion
    return one_angle("torsion", torsion)


def _least_tilts(
    design: Design,
    positions: FloatArray,
    torsions: FloatArray,
    azimuths: int,
    tool: ArrayLike | None,
) -> tuple[FloatArray, FloatArray, list[int]]:
    """Return least tilts and their azimuths in degrees, and the numbers of their limits."""
    n, directions = len(positions), np.radians(even_angles("azimuths", azimuths))
    count = len(directions)
    least, towards, limits = np.empty(n), np.empty(n), np.empty(n, dtype=np.int64)
    rules, angles = Rules.of(design).without_clearances(), np.radians(torsions)
    at = arrays.for_kernel(positions), one_tool(tool), angles, directions, np.empty(count)
    least_tilt_rows(ROWS_OF_TURN * n * count, *rules, *at, least, towards, limits)
    return in_degrees(least), np.degrees(towards), limits.tolist()


def in_degrees(angles: FloatArray) -> FloatArray:
    """Return angles in degrees; NaN for those whose start violates a limit."""
    degrees: FloatArray = np.rad2deg(angles)
    degrees[angles < 0.0] = math.nan
    return degrees


def names_of(design: Design, limits: list[int]) -> tuple[str | None, ...]:
    """Return the names of limits by their numbers, two for each demand; None for no limit."""
    demands = by_quantity(demands_of(design))
    names = [name for demand in demands for name in demand.end_names()]
    return tuple(None if limit == NO_LIMIT else names[limit] for limit in limits)


TORSIONS = 72
"""Number of torsions at which the greatest tilt is measured."""

# Width in degrees of the interval of torsions at which the search for the best one ends.
TORSION_WIDTH = 1e-3


@dataclass(frozen=True)
class TorsionRange:
    """The torsions that lead on from one without a gap, at a tilt; angles in degrees.

    Attributes:
        low: Least torsion, at most 360° below the one that the range starts from; NaN if that one
            violates a limit.
        high: Largest torsion, at most 360° above the one that the range starts from, and above
            the least one; NaN as `low`. If every torsion is possible, both are 180° away.
        low_limit: Name of the limit at the least torsion, or that the start violates; None if
            every torsion is possible.
        high_limit: Name of the limit at the largest torsion, as `low_limit`.
    """

    low: float
    high: float
    low_limit: str | None
    high_limit: str | None


@dataclass(frozen=True)
class TiltByTorsion:
    """The greatest tilt in every azimuth of a position at each of n torsions; angles in degrees.

    Attributes:
        torsions: Torsions at equal distances once around from −180 on, shape (n,).
        tilts: Greatest tilts in every azimuth, shape (n,); NaN where tilt zero violates a limit.
        best: The largest of all; its tilt is NaN if no torsion is possible.
    """

    torsions: FloatArray
    tilts: FloatArray
    best: GreatestTilt


def torsion_range(
    design: Design,
    position: ArrayLike,
    torsion: float | None = None,
    azimuth: float = 0.0,
    tilt: float = 0.0,
    tool: ArrayLike | None = None,
) -> TorsionRange:
    """Return the torsions that a position can have without a gap from one torsion, at a tilt.

    The azimuth and the tilt, in degrees, stay the same. The range starts from the torsion. Other
    arguments and errors are those of `greatest_tilt`.
    """
    p, sigma = one_position(position), _torsion_of(design, torsion)
    r = rotation_from_tilt_torsion([one_angle("azimuth", azimuth), one_angle("tilt", tilt), sigma])
    angles, limits = _end_of_turns(design, p, _turns_about_z(r), tool)
    down, up = in_degrees(angles).tolist()
    names = names_of(design, limits)
    if names[0] is None and names[1] is None:
        return TorsionRange(sigma - 180.0, sigma + 180.0, None, None)
    if names[0] is None or names[1] is None:
        # Half a turn one way ends where the other way ends, beyond that half turn.
        half = r * np.array([-1.0, -1.0, 1.0])
        angles, limits = _end_of_turns(design, p, _turns_about_z(half), tool)
        # Where the half turn ends on a limit, rounding may make the start of the rest invalid.
        more, rest_names = np.maximum(np.degrees(angles), 0.0).tolist(), names_of(design, limits)
        if names[0] is None:
            down = min(180.0 + more[0], 360.0 - up)
            names = rest_names[0] or names[1], names[1]
        else:
            up = min(180.0 + more[1], 360.0 - down)
            names = names[0], rest_names[1] or names[0]
    return TorsionRange(sigma - down, sigma + up, *names)


def tilt_by_torsion(
    design: Design, position: ArrayLike, torsions: int = TORSIONS, tool: ArrayLike | None = None
) -> TiltByTorsion:
    """Return the greatest tilt in every azimuth of a position at a number of torsions once around.

    The best of them is searched between the neighbours of the best one of the row. There are three
    torsions or more. Other arguments and errors are those of `greatest_tilt`.
    """
    p = one_position(position)
    angles = even_angles("torsions", torsions) - 180.0
    tilts = greatest_tilts(design, p, angles, AZIMUTHS_OF_ONE, tool)
    if np.isnan(tilts).all():
        return TiltByTorsion(angles, tilts, greatest_tilt(design, p, float(angles[0]), tool))
    step, middle = 360.0 / len(angles), float(angles[np.nanargmax(tilts)])
    best = greatest_tilt(design, p, middle, tool)
    low, high = middle - step, middle + step
    while high - low > TORSION_WIDTH:
        tried = np.linspace(low, high, 9)
        found = np.nan_to_num(greatest_tilts(design, p, tried, AZIMUTHS_OF_ONE, tool), nan=-1.0)
        top = int(found.argmax())
        if found[top] > best.tilt:
            best = greatest_tilt(design, p, float(tried[top]), tool)
        low, high = float(tried[max(top - 1, 0)]), float(tried[min(top + 1, 8)])
    return TiltByTorsion(angles, tilts, best)


def _end_of_turns(
    design: Design, position: FloatArray, turns: FloatArray, tool: ArrayLike | None
) -> tuple[FloatArray, list[int]]:
    """Return the angles (n,) in radians at which turns (n, 3, 3, 3) end, and their limits."""
    count = len(turns)
    angles, limits = np.empty(count), np.empty(count, dtype=np.int64)
    rules, p = Rules.of(design).without_clearances(), arrays.for_kernel(position)
    turn_rows(count, *rules, p, one_tool(tool), turns, angles, limits)
    return angles, limits.tolist()


def _turns_about_z(rotation: FloatArray) -> FloatArray:
    """Return the turns down and up from a rotation about the platform's z-axis, (2, 3, 3, 3)."""
    # For a decreasing torsion the platform's x-axis turns towards its negative y-axis.
    sine = 2.0 * np.column_stack([rotation[:, 1], -rotation[:, 0], np.zeros(3)])
    end = rotation * np.array([-1.0, -1.0, 1.0])
    return np.stack([np.stack([rotation, side * sine, end], axis=-1) for side in (-1.0, 1.0)])


# Error of an angle that is computed in two ways, in degrees.
ANGLE_TOLERANCE = 1e-7


def is_connected(
    design: Design, position: ArrayLike, rotation: ArrayLike, tool: ArrayLike | None = None
) -> bool:
    """Return whether an orientation is connected to tilt zero by a tilt without a gap.

    The tilt keeps azimuth and torsion. At tilt 180°, where many torsions give one orientation, it
    is that of torsion 0. Position, tool and errors are those of `greatest_tilt`; the orientation is
    a rotation (3, 3).
    """
    azimuth, tilt, torsion = tilt_torsion_of(rotation_array(rotation))
    reached = tilt_map(design, one_position(position), torsion, [azimuth], tool).tilts[0]
    return bool(reached >= tilt - ANGLE_TOLERANCE)
