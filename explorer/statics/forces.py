"""Forces of actuators, bending of struts, and the direction in which a force loads most.

Loads, signs and singular poses are those of `explorer.motion.inverse_jacobian`. Legs 1 and 4 are
two-force members; legs 2 and 3 also carry a force along the guide, which bends their struts.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from explorer.mechanism.configuration import Configuration
from explorer.mechanism.design import GUIDE_ROWS, STRUT_ROWS, Design
from explorer.motion.inverse_jacobian import forces_of, twists_of_actuators
from explorer.numerics.arrays import FloatArray, IntArray, positive_array


class WorstDirection(NamedTuple):
    """The direction in which a force loads an actuator most.

    Attributes:
        direction: Unit vector along the axes of the base, shape (..., 3); NaN in a singular pose.
        actuator: Index of that actuator in `JOINTS`, shape (...).
        utilisation: That of its limit by a force of 1 N, shape (...), in 1/N.
    """

    direction: FloatArray
    actuator: IntArray
    utilisation: FloatArray


def actuator_forces(
    design: Design,
    position: ArrayLike,
    rotation: ArrayLike,
    load: ArrayLike,
    tool: ArrayLike | None = None,
) -> FloatArray:
    """Return `forces_of` of `Configuration(design, position, rotation, tool)` under a load."""
    return forces_of(Configuration(design, position, rotation, tool), load)


def strut_bending(
    design: Design,
    position: ArrayLike,
    rotation: ArrayLike,
    load: ArrayLike,
    tool: ArrayLike | None = None,
) -> FloatArray:
    """Return the bending moments of struts 2 and 3 at their carriages, shape (..., 2), N × unit.

    They are |f(d1)| d2 and |f(d3)| d4; the guide takes the same moments. Both are infinite in a
    singular pose. The arguments are those of `Configuration` and the load of `forces_of`.
    """
    c = Configuration(design, position, rotation, tool)
    along = np.abs(forces_of(c, load)[..., GUIDE_ROWS])
    # An infinite force gives an infinite moment, even if its strut has no length.
    with np.errstate(invalid="ignore"):
        moments = along * c.joints[..., STRUT_ROWS]
    return np.where(np.isinf(along), np.inf, moments)


def largest_force(
    design: Design,
    position: ArrayLike,
    rotation: ArrayLike,
    most: ArrayLike,
    tool: ArrayLike | None = None,
) -> FloatArray:
    """Return the largest force that the actuators hold in every direction, shape (...), in N.

    It acts at the tool point, without a moment. It is the least over the actuators of the limit
    over the length of the actuator's row of J⁻ᵀ, its first three entries; 0 in a singular pose.
    The arguments are those of `Configuration` and of `worst_direction`.
    """
    used = worst_direction(Configuration(design, position, rotation, tool), most).utilisation
    return np.divide(1.0, used, out=np.full(used.shape, np.inf), where=used > 0.0)


def worst_direction(configuration: Configuration, most: ArrayLike) -> WorstDirection:
    """Return the direction in which a force at the tool loads an actuator most.

    The limits of the actuators to either side, shape (..., 6), in N, may be infinite. The opposite
    direction is as bad, with a pull for a push. The utilisation is infinite in a singular pose, and
    zero if no actuator has a limit.

    Raises:
        InputError: A limit is not positive, or batch axes do not broadcast.
    """
    limits = positive_array("the largest forces", most, 6)
    twists = twists_of_actuators(configuration)
    # Row i: the force of actuator i is the product with the load's force.
    rows = -np.swapaxes(twists[..., :3, :], -1, -2)
    sizes = np.sqrt(np.einsum("...ij,...ij->...i", rows, rows))
    sizes, limits = np.broadcast_arrays(sizes, limits)
    # It is infinite in a singular pose, even without a limit.
    utilisations = np.full(sizes.shape, np.inf)
    np.divide(sizes, limits, out=utilisations, where=np.isfinite(sizes))
    actuator = np.argmax(utilisations, axis=-1)
    row = np.take_along_axis(rows, actuator[..., None, None], axis=-2)[..., 0, :]
    size = np.take_along_axis(sizes, actuator[..., None], axis=-1)
    regular = np.isfinite(size) & (size > 0.0)
    direction = np.full(row.shape, np.nan)
    np.divide(row, size, out=direction, where=regular)
    return WorstDirection(direction, actuator, utilisations.max(axis=-1))
