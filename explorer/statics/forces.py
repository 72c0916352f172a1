"""Forces of the six actuators and of the struts under a load on the platform.

A load is a wrench (F; M) that acts on the platform at the tool point, along the axes of the base,
in newtons and newtons times the design unit. A positive actuator force pushes its joint's value
up. The legs are weightless: legs 1 and 4 then carry forces along their axes only; legs 2 and 3 also
carry a force along the guide, which bends their struts. In a singular pose all forces are infinite.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from explorer.errors import InputError
from explorer.mechanism.design import Design
from explorer.mechanism.kinematics import inverse
from explorer.numerics.arrays import FloatArray, IntArray, finite_array
from explorer.statics.equilibrium import Poses, force_rows, twists_of_actuators

GUIDE_ROWS = (1, 3)
"""Indices of d1 and d3, whose forces bend the struts."""
STRUT_ROWS = (2, 4)
"""Indices of d2 and d4, the lengths of the struts of legs 2 and 3."""


class WorstDirection(NamedTuple):
    """The direction in which a force loads an actuator most.

    Attributes:
        direction: Unit vector along the axes of the base, shape (..., 3); NaN in a singular pose.
        actuator: Index of that actuator in `JOINTS`, shape (...).
        share: Its force over its limit for a force of 1 N, shape (...), in 1/N.
    """

    direction: FloatArray
    actuator: IntArray
    share: FloatArray


def actuator_forces(
    design: Design,
    position: ArrayLike,
    rotation: ArrayLike,
    load: ArrayLike,
    tool: ArrayLike | None = None,
) -> FloatArray:
    """Return the actuator forces f = −J⁻ᵀ (F; M) that hold a load, shape (..., 6), in newtons.

    Their order is that of `JOINTS`. All six are infinite in a singular pose.

    Args:
        design: The manipulator.
        position: b4 in the base frame, shape (..., 3), in design units.
        rotation: Platform to base, shape (..., 3, 3).
        load: (F; M) on the platform at the tool point, base axes, shape (..., 6), in N and
            N × unit.
        tool: Tool point in the platform frame, shape (..., 3), in design units; None for b4.

    Raises:
        InputError: A value is not finite, the rotation is not one, or batch axes do not broadcast.
    """
    w = finite_array("load (FX FY FZ MX MY MZ)", load, (6,))
    poses = Poses(design, position, rotation, tool, (w, 1))
    out = np.empty((poses.count, 6))
    force_rows(
        poses.count,
        poses.variables,
        poses.tools,
        poses.positions,
        poses.rotations,
        poses.rows_or_one(w),
        out,
    )
    return out.reshape(*poses.batch, 6)


def strut_bending(
    design: Design,
    position: ArrayLike,
    rotation: ArrayLike,
    load: ArrayLike,
    tool: ArrayLike | None = None,
) -> FloatArray:
    """Return the bending moments of struts 2 and 3 at their carriages, shape (..., 2), N × unit.

    They are |f(d1)| d2 and |f(d3)| d4; the guide takes the same moments. Both are infinite in a
    singular pose.

    Args:
        design: The manipulator.
        position: b4 in the base frame, shape (..., 3), in design units.
        rotation: Platform to base, shape (..., 3, 3).
        load: (F; M) on the platform at the tool point, base axes, shape (..., 6), in N and
            N × unit.
        tool: Tool point in the platform frame, shape (..., 3), in design units; None for b4.

    Raises:
        InputError: A value is not finite, the rotation is not one, or batch axes do not broadcast.
    """
    forces = actuator_forces(design, position, rotation, load, tool)
    return bending_of(forces, inverse(design, position, rotation))


def bending_of(forces: FloatArray, joints: FloatArray) -> FloatArray:
    """Return the bending moments of actuator forces (..., 6) at joints (..., 6), shape (..., 2).

    An infinite force gives an infinite moment, even if its strut has no length.
    """
    along_guide = np.abs(forces[..., GUIDE_ROWS])
    lengths = np.broadcast_to(joints[..., STRUT_ROWS], along_guide.shape)
    out = np.full(along_guide.shape, np.inf)
    np.multiply(along_guide, lengths, out=out, where=np.isfinite(along_guide))
    return out


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

    Args:
        design: The manipulator.
        position: b4 in the base frame, shape (..., 3), in design units.
        rotation: Platform to base, shape (..., 3, 3).
        most: Largest force of each actuator to either side, shape (..., 6), in N, positive; may
            be infinite.
        tool: Tool point in the platform frame, shape (..., 3), in design units; None for b4.

    Raises:
        InputError: A limit is not positive, a value is not finite, the rotation is not one, or
            batch axes do not broadcast.
    """
    shares = worst_direction(design, position, rotation, most, tool).share
    return np.divide(1.0, shares, out=np.full(shares.shape, np.inf), where=shares > 0.0)


def worst_direction(
    design: Design,
    position: ArrayLike,
    rotation: ArrayLike,
    most: ArrayLike,
    tool: ArrayLike | None = None,
) -> WorstDirection:
    """Return the direction in which a force at the tool loads an actuator most.

    The opposite direction is as bad, with a pull for a push. The share is infinite in a singular
    pose, and zero if no actuator has a limit.

    Args:
        design: The manipulator.
        position: b4 in the base frame, shape (..., 3), in design units.
        rotation: Platform to base, shape (..., 3, 3).
        most: Largest force of each actuator to either side, shape (..., 6), in N, positive; may
            be infinite.
        tool: Tool point in the platform frame, shape (..., 3), in design units; None for b4.

    Raises:
        InputError: A limit is not positive, a value is not finite, the rotation is not one, or
            batch axes do not broadcast.
    """
    limits = checked_limits(most)
    twists = twists_of_actuators(design, position, rotation, tool)
    # Row i: the force of actuator i is the product with the load's force.
    rows = -np.swapaxes(twists[..., :3, :], -1, -2)
    sizes = np.sqrt(np.einsum("...ij,...ij->...i", rows, rows))
    sizes, limits = np.broadcast_arrays(sizes, limits)
    # A share is infinite in a singular pose, even without a limit.
    shares = np.full(sizes.shape, np.inf)
    np.divide(sizes, limits, out=shares, where=np.isfinite(sizes))
    actuator = np.argmax(shares, axis=-1)
    row = np.take_along_axis(rows, actuator[..., None, None], axis=-2)[..., 0, :]
    size = np.take_along_axis(sizes, actuator[..., None], axis=-1)
    regular = np.isfinite(size) & (size > 0.0)
    direction = np.full(row.shape, np.nan)
    np.divide(row, size, out=direction, where=regular)
    return WorstDirection(direction, actuator, shares.max(axis=-1))


def checked_limits(most: ArrayLike) -> FloatArray:
    """Return limits of the actuators, shape (..., 6), after checking that all are positive.

    Raises:
        InputError: There are not six numbers, or one is not positive.
    """
    limits = np.asarray(most, dtype=np.float64)
    if limits.shape[-1:] != (6,) or not (limits > 0.0).all():
        raise InputError(
            "the largest forces must be six positive numbers (l1, d1, d2, d3, d4, l4), infinite "
            f"for no limit; got {np.array2string(limits, threshold=12)}".replace("\n", "")
        )
    return limits
