"""The torsions that a position can have, the greatest tilt at each of them, and connections."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from explorer.mechanism.configuration import one_tool
from explorer.mechanism.design import Design
from explorer.mechanism.pose import checked_rotation
from explorer.mechanism.tilt_torsion import rotation_from_tilt_torsion, tilt_torsion_of
from explorer.numerics.arrays import FloatArray, for_kernel
from explorer.workspace.limits.valid_poses import Rules
from explorer.workspace.orientations.sets import even_angles, one_angle, one_position
from explorer.workspace.orientations.tilts import (
    AZIMUTHS_OF_ONE,
    GreatestTilt,
    checked_torsion,
    greatest_tilt,
    greatest_tilts,
    in_degrees,
    names_of,
    tilt_map,
)
from explorer.workspace.orientations.turns import turn_rows

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
    p, sigma = one_position(position), checked_torsion(design, torsion)
    r = rotation_from_tilt_torsion([one_angle("azimuth", azimuth), one_angle("tilt", tilt), sigma])
    # For a decreasing torsion the platform's x-axis turns towards its negative y-axis.
    turns = np.stack([_turn_about_z(r, -1.0), _turn_about_z(r, 1.0)])
    angles, limits = _end_of_turns(design, p, turns, tool)
    down, up = in_degrees(angles).tolist()
    names = names_of(design, limits)
    if names[0] is None and names[1] is None:
        return TorsionRange(sigma - 180.0, sigma + 180.0, None, None)
    if names[0] is None or names[1] is None:
        # Half a turn one way ends where the other way ends, beyond that half turn.
        half = _turned_half(r)
        rest = np.stack([_turn_about_z(half, -1.0), _turn_about_z(half, 1.0)])
        angles, limits = _end_of_turns(design, p, rest, tool)
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
    angles, limits = np.empty(len(turns)), np.empty(len(turns), dtype=np.int64)
    rules = Rules.of(design).without_clearances()
    given = for_kernel(position), one_tool(tool), turns
    turn_rows(len(turns), rules.row, rules.demands, *given, angles, limits)
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


# Error of an angle that is computed in two ways, in degrees.
ANGLE_TOLERANCE = 1e-7


def is_connected(
    design: Design,
    position: ArrayLike,
    rotation: ArrayLike,
    other: ArrayLike | None = None,
    tool: ArrayLike | None = None,
) -> bool:
    """Return whether an orientation is connected to tilt zero by a tilt without a gap.

    The tilt keeps azimuth and torsion. At tilt 180°, where many torsions give one orientation, it
    is that of torsion 0. With a second orientation the question is whether a tilt from the first
    one to tilt zero, a change of the torsion there and a tilt to the second one connect the two.
    Position, tool and errors are those of `greatest_tilt`; orientations are rotations (3, 3).
    """
    p = one_position(position)
    ends = [
        tilt_torsion_of(checked_rotation(each)) for each in (rotation, other) if each is not None
    ]
    for azimuth, tilt, torsion in ends:
        reached = tilt_map(design, p, torsion, [azimuth], tool).tilts[0]
        if not reached >= tilt - ANGLE_TOLERANCE:
            return False
    if other is None:
        return True
    span = torsion_range(design, p, ends[0].torsion, tool=tool)
    if math.isnan(span.low):
        return False
    turn = (ends[1].torsion - span.low + ANGLE_TOLERANCE) % 360.0 - ANGLE_TOLERANCE
    return turn <= span.high - span.low + ANGLE_TOLERANCE
