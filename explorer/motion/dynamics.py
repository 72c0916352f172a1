"""Inverse dynamics: forces of the actuators in a motion, with all bodies."""

from __future__ import annotations

from numpy.typing import ArrayLike

from explorer.errors import InputError
from explorer.mechanism.configuration import Configuration
from explorer.mechanism.design import Design
from explorer.motion.inverse_jacobian import forces_of
from explorer.motion.masses import DENSITY, bar_masses, moving_bodies
from explorer.motion.weights import AT_REST, MovingBodies, carry
from explorer.numerics.arrays import FloatArray


def forces_in_motion(
    configuration: Configuration,
    bodies: MovingBodies,
    twist: ArrayLike = AT_REST,
    acceleration: ArrayLike = AT_REST,
) -> FloatArray:
    """Return the forces of the actuators, (..., 6), in N; arguments and errors as in `carry`."""
    return forces_of(configuration, carry(configuration, bodies, twist, acceleration).wrench)


def inverse_dynamics(
    design: Design,
    position: ArrayLike,
    rotation: ArrayLike,
    twist: ArrayLike,
    acceleration: ArrayLike,
    legs: bool = True,
) -> FloatArray:
    """Return the forces of the actuators in a motion, shape (..., 6), in newtons.

    They hold the weights and accelerate the masses; f > 0 pushes its joint's value up. All six are
    infinite in a singular pose. `carry` with `moving_bodies` has the same for `reactions`, which
    also tells the bending of the struts and what the guide bears.

    The arguments are those of `joint_accelerations`: the twist of b4 and the platform (v; ω) in
    design units and radians per second, and its rate (v̇; ω̇) per s², base axes, (..., 6) each. Legs
    and platform have the masses of the exported simulation; without legs only the payload of the
    design has a mass, which has to include platform and tool.

    Raises:
        InputError: A number is not finite, the rotation is not one, batch axes do not broadcast, or
            nothing on the platform has a mass.
    """
    bodies = MovingBodies().with_payload(design)
    if legs:
        bodies = moving_bodies(design, bar_masses(design, DENSITY))
    elif not design.payload.mass_kg:
        raise InputError(
            "the platform has no mass, so that a motion needs no force: give the payload of "
            "the design a mass, or let the bodies of the prototype count"
        )
    return forces_in_motion(Configuration(design, position, rotation), bodies, twist, acceleration)
