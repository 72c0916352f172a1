"""Whether orientations of a position are connected by tilts and a change of torsion."""

from __future__ import annotations

import math

from numpy.typing import ArrayLike

from explorer.mechanism.design import Design
from explorer.mechanism.pose import checked_rotation
from explorer.mechanism.tilt_torsion import tilt_torsion_of
from explorer.workspace.orientations.inputs import one_position
from explorer.workspace.orientations.tilts import tilt_map
from explorer.workspace.orientations.torsions import torsion_range

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
    is that of torsion 0.

    Args:
        design: The manipulator.
        position: Position of b4 or the tool in the base frame, in design units, shape (3,).
        rotation: Orientation, platform to base, shape (3, 3).
        other: Second orientation, shape (3, 3). If given, the question is whether a tilt from the
            first one to tilt zero, a change of the torsion there and a tilt to the second one
            connect the two.
        tool: Point of the platform that has the position, in the platform frame, shape (3,), in
            design units; None for b4.

    Raises:
        InputError: not a position, not a rotation, or not a tool point.
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
