"""The least turn of the platform that leads to each of the three incidences.

The platform turns about b4 or about a1, the points of the two flags, and about any axis through
them. Each incidence is then the meeting of a line and a plane of which the turn moves one and
leaves the other, so that the least turn is the angle between the two, and its sine is the margin
over a length: δ1 and δ3 over |a1 b4|, δ2 over the distance of b4 from the guide (a turn about b4)
or of a1 from the line b2b3 (a turn about a1). The uncoupled rotations of
`explorer.singularity.uncoupled` turn about some of these axes, so that none of them is shorter.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from explorer.mechanism.margins import margins
from explorer.mechanism.pose import checked_rotation
from explorer.numerics.arrays import FloatArray, dot, position_array


def least_turns(position: ArrayLike, rotation: ArrayLike) -> FloatArray:
    """Return the least turns to δ1 = 0, δ2 = 0 and δ3 = 0, shape (..., 3), in radians.

    They are from 0, for a pose that has the incidence, to a quarter turn.

    Args:
        position: b4 in the base frame, shape (..., 3), in design units.
        rotation: Platform to base, shape (..., 3, 3).

    Raises:
        InputError: The position is not finite, or the rotation is not one.
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
