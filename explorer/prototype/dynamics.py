"""Inverse dynamics: forces of the actuators in a motion or along a path, with all bodies."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from numpy.typing import ArrayLike

from explorer.errors import InputError
from explorer.legs.moves import StraightMoves
from explorer.mechanism.configuration import Configuration
from explorer.mechanism.design import Design
from explorer.mechanism.pose import Pose, Triple
from explorer.numerics.arrays import FloatArray
from explorer.paths.drives import Drives, check_limits
from explorer.paths.time_law import TimeLaw, law_at_speed, law_of_shortest_time
from explorer.prototype.weights import DENSITY, bar_masses, moving_bodies
from explorer.statics.forces import forces_of
from explorer.statics.weights import MovingBodies, carry


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

    Args:
        design: The manipulator, with its payload and its direction of gravity.
        position: b4 in the base frame, shape (..., 3), in design units.
        rotation: Platform to base, shape (..., 3, 3).
        twist: Velocity of b4 and angular velocity (v; ω), base axes, shape (..., 6), in design
            units and radians per second.
        acceleration: Their rates (v̇; ω̇), shape (..., 6), in design units and radians per s².
        legs: Whether the bodies of the prototype have masses, as in the exported simulation; else
            the payload of the design, which then stands for platform and tool too, counts alone.

    Raises:
        InputError: A number is not finite, the rotation is not one, batch axes do not broadcast, or
            nothing on the platform has a mass.
    """
    bodies = MovingBodies().with_payload(design)
    if legs:
        bodies = moving_bodies(design, bar_masses(design, DENSITY))
    elif not design.payload.mass_kg:
        raise InputError(
            "the platform has no mass, so that no motion asks a force for it: give the payload of "
            "the design a mass, or let the bodies of the prototype count"
        )
    c = Configuration(design, position, rotation)
    return forces_of(c, carry(c, bodies, twist, acceleration).wrench)


class TimedPath(NamedTuple):
    """A path of straight moves with rest at every corner, and what moves along it.

    Attributes:
        poses: Corners of the path, two or more.
        law: Its time law, or its duration in seconds with the least acceleration of the fastest
            actuator; None for the shortest time within the limits of the actuators, which needs
            the extra `timing`.
        tool: Point that moves straight in the platform frame, in design units; None for b4.
        density: Density of legs and platform in kg/m³, as bars with the legs' radii.
    """

    poses: Sequence[Pose]
    law: TimeLaw | float | None = None
    tool: Triple | None = None
    density: float = DENSITY


def drives_along(design: Design, path: TimedPath) -> Drives:
    """Return what a path within the limits of a design asks of its actuators.

    Raises:
        InputError: The path leaves the limits or has no length, the platform has no mass, or
            nothing limits the time.
        MissingExtraError: toppra is not installed.
        NoAnswerError: The path is singular, or a weight exceeds the largest force at rest.
    """
    moves, law = StraightMoves.along(path.poses, path.tool), path.law
    check_limits(design, moves)
    bodies = moving_bodies(design, bar_masses(design, path.density))
    if law is None:
        law = law_of_shortest_time(design, moves, bodies)
    elif not isinstance(law, TimeLaw):
        law = law_at_speed(design, moves).lasting(law)
    return Drives.along(design, moves, law, bodies)
