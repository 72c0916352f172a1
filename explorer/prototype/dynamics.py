"""Inverse dynamics: forces of the actuators in a motion or along a path, with all bodies."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from explorer.errors import InputError
from explorer.legs.moves import StraightMoves
from explorer.mechanism.configuration import Configuration
from explorer.mechanism.design import Design
from explorer.mechanism.pose import Pose, Triple
from explorer.numerics.arrays import FloatArray
from explorer.paths.drives import Drives, check_limits
from explorer.paths.time_law import TimeLaw, law_at_speed, law_of_shortest_time
from explorer.prototype.chains import LEGS, ON_GUIDE, Chains
from explorer.prototype.weights import DENSITY, Mass, bar_masses, with_payload
from explorer.statics.forces import forces_of
from explorer.statics.motion import (
    AXIS_X,
    CROSS,
    MOMENT,
    ROD,
    ROD_CENTRE,
    SIDE_X,
    SIDE_Y,
    SPIN,
    TOTAL,
    MovingBodies,
    carry_motion,
)


def inverse_dynamics(
    design: Design,
    position: ArrayLike,
    rotation: ArrayLike,
    twist: ArrayLike,
    acceleration: ArrayLike,
    legs: bool = True,
    *,
    masses: Mapping[str, Mass] | None = None,
) -> FloatArray:
    """Return the forces of the actuators in a motion, shape (..., 6), in newtons.

    They hold the weights and accelerate the masses; f > 0 pushes its joint's value up. All six are
    infinite in a singular pose. `carry_motion` with `moving_bodies` has the same for `reactions`,
    which also tells the bending of the struts and what the guide bears.

    Args:
        design: The manipulator, with its payload and its direction of gravity.
        position: b4 in the base frame, shape (..., 3), in design units.
        rotation: Platform to base, shape (..., 3, 3).
        twist: Velocity of b4 and angular velocity (v; ω), base axes, shape (..., 6), in design
            units and radians per second.
        acceleration: Their rates (v̇; ω̇), shape (..., 6), in design units and radians per s².
        legs: Whether the legs have their masses; else those of platform and payload count alone.
        masses: Masses of the bodies, see `moving_bodies`; of bars as in the exported simulation if
            None.

    Raises:
        InputError: A number is not finite, the rotation is not one, or batch axes do not broadcast.
    """
    c = Configuration(design, position, rotation)
    bodies = _bars(design) if masses is None else moving_bodies(design, masses)
    if not legs:
        bodies = bodies.without_legs()
    return forces_of(c, carry_motion(c, twist, acceleration, bodies).wrench)


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


@lru_cache(16)
def _bars(design: Design) -> MovingBodies:
    return moving_bodies(design, bar_masses(design, DENSITY))


def moving_bodies(design: Design, masses: Mapping[str, Mass]) -> MovingBodies:
    """Return the masses that a motion moves, those of bodies and the design's payload.

    The masses of the bodies are in their own frames, in metres and kilograms, such as
    `bar_masses` or `explorer.prototype.assembly.Prototype.masses`. Cylinders and rods have their
    centres on their axes, and principal axes along those of their frames; the centre of a cross is
    at its joint.

    Raises:
        InputError: Neither the platform nor the payload has a mass.
    """
    if not masses["platform"].mass + design.payload.mass_kg > 0.0:
        raise InputError(
            "the platform has no mass, so that no motion asks a force for it: give it a density, "
            "or the design a payload"
        )
    metres = 1e-3 * design.unit_mm
    platform = with_payload(design, masses)["platform"]
    off = platform.centre
    carried = np.empty((4, 4))
    carried[:3, :3] = platform.inertia + platform.mass * (
        off @ off * np.eye(3) - np.outer(off, off)
    )
    carried[:3, :3] /= metres
    carried[:3, 3] = carried[3, :3] = platform.mass * off
    carried[3, 3] = metres * platform.mass
    axes = Chains.of(design).mounts[:, :, 0]
    rows = np.zeros((4, 11))
    for leg, row, axis in zip(LEGS, rows, axes, strict=True):
        cylinder, rod = masses[f"cylinder {leg}"], masses[f"rod {leg}"]
        first = masses[f"{'carriage' if leg in ON_GUIDE else 'cross'} {leg}"]
        height, of_both = float(cylinder.centre[2]), np.diag(cylinder.inertia + rod.inertia)
        row[TOTAL] = metres * (cylinder.mass + rod.mass)
        if leg in ON_GUIDE:
            row[TOTAL] += metres * first.mass
        else:
            row[CROSS] = first.inertia[0, 0] / metres
        row[ROD], row[ROD_CENTRE] = metres * rod.mass, -rod.centre[2] / metres
        row[MOMENT] = cylinder.mass * height
        row[SIDE_X : SPIN + 1] = of_both / metres
        row[SIDE_X : SIDE_Y + 1] += cylinder.mass * height**2 / metres
        row[AXIS_X:] = axis
    return MovingBodies(carried, rows)
