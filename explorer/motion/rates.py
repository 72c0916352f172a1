"""Rates and accelerations of the joints in a motion of the platform, in closed form.

A motion is a twist (v; ω) and an acceleration (v̇; ω̇) of b4 and the platform along the axes of the
base, in design units, radians and seconds. For a leg of length l with the direction s, at whose end
the platform has the velocity v and the acceleration a, l̇ = s·v and l̈ = s·a + |v − l̇ s|² / l. Legs
2 and 3 do so across the guide, and along it d̈ = a_x.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from explorer.mechanism.configuration import Configuration
from explorer.mechanism.design import LENGTH_ROWS, Design
from explorer.mechanism.points import IN_LEGS
from explorer.motion.weights import motion_array
from explorer.numerics.arrays import FloatArray, dot, rotate


def joint_rates(
    design: Design, position: ArrayLike, rotation: ArrayLike, twist: ArrayLike
) -> FloatArray:
    """Return the rates of the joints q̇ = J (v; ω), shape (..., 6), in design units per second.

    The pose is that of a `Configuration`. The twist is the velocity of b4 and the angular velocity
    (v; ω), base axes, shape (..., 6), in design units and radians per second.

    Raises:
        InputError: A number is not finite, the rotation is not one, or batch axes do not broadcast.
    """
    t = motion_array("twist", twist)
    return rotate(Configuration(design, position, rotation).spread(t).jacobian, t)


def joint_accelerations(
    design: Design,
    position: ArrayLike,
    rotation: ArrayLike,
    twist: ArrayLike,
    acceleration: ArrayLike,
) -> FloatArray:
    """Return the accelerations of the joints J (v̇; ω̇) + J̇ (v; ω), (..., 6), in units/s².

    The acceleration of b4 and the angular acceleration (v̇; ω̇) have the shape (..., 6), in design
    units and radians per s²; the other arguments and the errors are those of `joint_rates`. That of
    a joint of length zero, which has no direction, is zero.
    """
    t, rate = motion_array("twist", twist), motion_array("acceleration", acceleration)
    c = Configuration(design, position, rotation).spread(t, rate)
    arms = c.joint_arms
    turning, turning_rate = t[..., None, 3:], rate[..., None, 3:]
    swing = np.cross(turning, arms)
    velocity = t[..., None, :3] + swing
    of_ends = rate[..., None, :3] + np.cross(turning_rate, arms) + np.cross(turning, swing)
    found = np.array(of_ends[..., 0])
    velocity, of_ends = velocity[..., LENGTH_ROWS, :] * IN_LEGS, of_ends[..., LENGTH_ROWS, :]
    across = velocity - dot(c.leg_directions, velocity)[..., None] * c.leg_directions
    squares, lengths = dot(across, across), c.leg_lengths
    centripetal = np.divide(squares, lengths, out=np.zeros(squares.shape), where=lengths > 0.0)
    found[..., LENGTH_ROWS] = dot(c.leg_directions, of_ends) + centripetal
    return found
