"""The gaps between the two flags, and the least turns by which the three incidences come about.

A gap is the shortest segment from an element of the base flag to one of the platform flag: from a1
to the platform plane (δ1), between the lines a1a2 and b2b3 (δ2), and from the base plane to b4
(δ3). The mechanism is singular where one of them closes, or where the two lines are parallel.

A least turn is one about b4 or about a1, the points of the two flags, and about any axis through
them. Each incidence is then the meeting of a line and a plane of which the turn moves one and
leaves the other, so that the least turn is the angle between the two, and its sine is the margin
over a length: δ1 and δ3 over |a1 b4|, δ2 over the distance of b4 from the guide (a turn about b4)
or of a1 from the line b2b3 (a turn about a1). Uncoupled rotations are no shorter.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from explorer.mechanism.margins import ROUNDING, margins
from explorer.mechanism.pose import checked_rotation
from explorer.numerics.arrays import FloatArray, dot, position_array


@dataclass(frozen=True)
class FlagGaps:
    """The three gaps of a pose, in the order δ1, δ2, δ3, in design units.

    Attributes:
        base: Ends on a1, the line a1a2 and the base plane, in the base frame, shape (3, 3).
        platform: Ends on the platform plane, the line b2b3 and b4, in the base frame, shape (3, 3).
        lengths: Lengths: |δ1|, the distance of the lines and |δ3|. That of the lines is |δ2| over
            the sine between them.
        are_parallel: Whether the lines are parallel. Of their common perpendiculars, the second
            gap is then the one through b4.
    """

    base: FloatArray
    platform: FloatArray
    lengths: tuple[float, float, float]
    are_parallel: bool


def flag_gaps(position: FloatArray, rotation: FloatArray) -> FlagGaps:
    """Return the gaps of a pose."""
    x, y, z = position.tolist()
    height = float(rotation[:, 2] @ position)
    along, uy, uz = rotation[:, 0].tolist()
    sine = math.hypot(uy, uz)
    are_parallel = sine <= ROUNDING
    if are_parallel:
        on_line = (x, y, z)
        on_guide, distance = (x, 0.0, 0.0), math.hypot(y, z)
    else:
        ny, nz = -uz / sine, uy / sine
        apart = ny * y + nz * z
        # Way from b4 along b2b3 to the point closest to the guide.
        way = -(y * uy + z * uz) / sine / sine
        on_guide = (x + way * along, 0.0, 0.0)
        on_line = (on_guide[0], apart * ny, apart * nz)
        distance = abs(apart)
    base = np.array([(0.0, 0.0, 0.0), on_guide, (x, y, 0.0)])
    platform = np.array([height * rotation[:, 2], on_line, (x, y, z)])
    return FlagGaps(base, platform, (abs(height), distance, abs(z)), are_parallel)


def least_turns(position: ArrayLike, rotation: ArrayLike) -> FloatArray:
    """Return the least turns to δ1 = 0, δ2 = 0 and δ3 = 0, shape (..., 3), in radians.

    They are from 0, for a pose that has the incidence, to a quarter turn. Arguments and errors are
    those of `explorer.mechanism.margins.margins`.
    """
    p, r = position_array("position", position), checked_rotation(rotation)
    line = r[..., :, 0]
    from_line = np.cross(line, p)
    distance = np.sqrt(dot(p, p))
    arm = np.maximum(np.hypot(p[..., 1], p[..., 2]), np.sqrt(dot(from_line, from_line)))
    sizes = np.abs(margins(p, r))
    arms = np.stack(np.broadcast_arrays(distance, arm, distance), axis=-1)
    sines = np.divide(sizes, arms, out=np.zeros(sizes.shape), where=arms > 0.0)
    return np.arcsin(np.minimum(sines, 1.0))
