"""The tilts that a position can have: how far the platform tilts before a limit stops it.

The angles are those of `explorer.mechanism.tilt_torsion`. At a torsion the platform tilts from
tilt zero in each azimuth, b4 or the tool held in its place, until it meets the first limit. That
tilt is exact but for rounding (`explorer.workspace.orientations.turns`). The limits are those of
`explorer.workspace.limits.valid_poses.violations`; collisions of legs are not among them.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from explorer.errors import InputError
from explorer.mechanism.configuration import one_tool
from explorer.mechanism.design import Design
from explorer.mechanism.tilt_torsion import tilt_torsion_of
from explorer.numerics.arrays import FloatArray, finite_array, for_kernel, position_array
from explorer.workspace.limits.valid_poses import Rules
from explorer.workspace.orientations.least_tilts import least_tilt_rows
from explorer.workspace.orientations.sets import MOST_ANGLES, even_angles, one_angle, one_position
from explorer.workspace.orientations.turns import NO_LIMIT, limit_names, tilt_rows

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
    p, sigma = one_position(position), checked_torsion(design, torsion)
    array = np.asarray(azimuths)
    if array.ndim == 0:
        directions = even_angles("azimuths", array, fewest=1)
    else:
        directions = finite_array("azimuths", array, ())
        if directions.ndim != 1 or not 1 <= len(directions) <= MOST_ANGLES:
            raise InputError(
                f"azimuths must be 1 to {MOST_ANGLES:,} angles; got the shape {directions.shape}"
            )
    count = len(directions)
    tilts, limits = np.empty(count), np.empty(count, dtype=np.int64)
    rules = Rules.of(design).without_clearances()
    tilt_rows(
        ROWS_OF_TURN * count,
        rules.row,
        rules.demands,
        for_kernel(p),
        one_tool(tool),
        math.radians(sigma),
        np.radians(directions),
        tilts,
        limits,
    )
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
    p, sigma = one_position(position), checked_torsion(design, torsion)
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

    A position whose tilt zero violates a limit has NaN. The search is that of `greatest_tilt`, from
    fewer azimuths: with 72, a dip by the swing of a joint that is narrower than 5° can be missed.

    Args:
        design: The manipulator.
        position: Positions of b4 or the tool in the base frame, in design units, shape (..., 3).
        torsion: Torsions in degrees, shape (...); that of the home pose if None.
        azimuths: Number of azimuths from which the least tilt is searched, 3 or more.
        tool: As in `greatest_tilt`.

    Raises:
        InputError: As there, or positions and torsions that do not broadcast.
    """
    p = position_array("position", position)
    sigma = np.asarray(checked_torsion(design, None))
    if torsion is not None:
        sigma = finite_array("torsion", torsion, ())
    try:
        shape = np.broadcast_shapes(p.shape[:-1], sigma.shape)
    except ValueError:
        raise InputError(
            f"positions of the shape {p.shape[:-1]} do not go with torsions of the shape "
            f"{sigma.shape}"
        ) from None
    positions = np.broadcast_to(p, (*shape, 3)).reshape(-1, 3)
    torsions = np.broadcast_to(sigma, shape).reshape(-1)
    return _least_tilts(design, positions, torsions, azimuths, tool)[0].reshape(shape)


def checked_torsion(design: Design, torsion: float | None) -> float:
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
    rules = Rules.of(design).without_clearances()
    least_tilt_rows(
        ROWS_OF_TURN * n * count,
        rules.row,
        rules.demands,
        for_kernel(positions),
        one_tool(tool),
        np.radians(torsions),
        directions,
        np.empty(count),
        least,
        towards,
        limits,
    )
    return in_degrees(least), np.degrees(towards), limits.tolist()


def in_degrees(angles: FloatArray) -> FloatArray:
    """Return angles in degrees; NaN for those whose start violates a limit."""
    degrees: FloatArray = np.rad2deg(angles)
    degrees[angles < 0.0] = math.nan
    return degrees


def names_of(design: Design, limits: list[int]) -> tuple[str | None, ...]:
    """Return the names of limits by their numbers, as in `limit_names`; None for no limit."""
    names = limit_names(design)
    return tuple(None if limit == NO_LIMIT else names[limit] for limit in limits)
