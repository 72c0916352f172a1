"""Servos of the simulation that give way as actuators and struts do: stiffness, damping, step.

The inertia that the servos feel is that of all bodies in the home pose, per joint rate. The fastest
motion is the largest eigenvalue of stiffness over inertia.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
from scipy.spatial.transform import Rotation

from explorer.errors import NoAnswerError
from explorer.mechanism.design import Design
from explorer.mechanism.home import home_pose
from explorer.mechanism.kinematics import inverse
from explorer.numerics.arrays import FloatArray
from explorer.prototype.chains import BODIES, Chains
from explorer.prototype.mass import Mass
from explorer.statics.compliance import stiffness_of
from explorer.statics.equilibrium import twists_of_actuators

# Stiffness of what a design leaves rigid, over that of its stiffest spring.
RIGID = 10.0
# Angle of the fastest motion in a time step, in radians; models oscillate from about 0.6.
FASTEST = 0.2
# Share of the reach that the platform moves by for its velocities.
STEP = 1e-5


class Servos(NamedTuple):
    """The six servos, in the order of `JOINTS`.

    Attributes:
        stiffness: Stiffness, shape (6,), in N/m.
        damping: Damping, shape (6,), in N s/m, critical for each servo alone.
        timestep: Largest time step of the simulation, in seconds.
    """

    stiffness: FloatArray
    damping: FloatArray
    timestep: float


def servo_stiffness(design: Design) -> FloatArray | None:
    """Return the stiffness of the servos at home, shape (6,), in N/m; None if all is rigid.

    Those of d1 and d3 are in series with struts 2 and 3, cantilevers of the lengths that d2 and d4
    have at home. An actuator that the design leaves rigid is ten times as stiff as the stiffest of
    the others.
    """
    stiffness, bending = stiffness_of(design)
    home = home_pose(design)
    softness = 1.0 / stiffness
    lengths = inverse(design, home.position, home.rotation)[[2, 4]]
    softness[[1, 3]] += lengths**3 / (3.0 * bending)
    gives = softness > 0.0
    if not gives.any():
        return None
    softness[~gives] = softness[gives].min() / RIGID
    return 1e3 / (softness * design.unit_mm)


def spring_servos(design: Design, masses: Mapping[str, Mass]) -> Servos | None:
    """Return the servos of a design with its stiffness; None if all of it is rigid.

    Args:
        design: The manipulator.
        masses: Masses of the bodies in their own frames, in metres and kilograms.

    Raises:
        NoAnswerError: The home pose is singular.
    """
    stiffness = servo_stiffness(design)
    if stiffness is None:
        return None
    inertia = joint_inertia(design, masses)
    scale = np.sqrt(stiffness)
    fastest = 1.0 / math.sqrt(np.linalg.eigvalsh(inertia / np.outer(scale, scale))[0])
    return Servos(stiffness, 2.0 * np.sqrt(stiffness * np.diag(inertia)), FASTEST / fastest)


def joint_inertia(design: Design, masses: Mapping[str, Mass]) -> FloatArray:
    """Return the inertia of all bodies at home per joint rates, shape (6, 6), in kg.

    The kinetic energy is half of rates @ inertia @ rates, with rates in metres per second.

    Args:
        design: The manipulator.
        masses: Masses of the bodies in their own frames, in metres and kilograms.

    Raises:
        NoAnswerError: The home pose is singular.
    """
    home, metres = home_pose(design), 1e-3 * design.unit_mm
    twists = twists_of_actuators(design, home.position, home.rotation).T
    if not np.isfinite(twists).all():
        raise NoAnswerError(
            "the home pose is singular, so that no servos hold it; choose another home"
        )
    sizes = np.abs(twists * np.repeat([1.0 / design.reach, 1.0], 3)).max(axis=1)
    steps = STEP / sizes[:, None]
    chains = Chains.of(design)
    ahead, behind = (
        chains.places_at(
            np.array(home.position) + sign * steps * twists[:, :3],
            Rotation.from_rotvec(sign * steps * twists[:, 3:]).as_matrix() @ home.rotation,
        )
        for sign in (1.0, -1.0)
    )
    here = chains.places_at(home.position, home.rotation)
    inertia = np.zeros((6, 6))
    for name, mass in masses.items():
        index = BODIES.index(name)
        moved = (ahead.origin - behind.origin)[:, index] / (2.0 * steps)
        turn = ahead.rotation[:, index] @ np.swapaxes(behind.rotation[:, index], -1, -2)
        spin = Rotation.from_matrix(turn).as_rotvec() / (2.0 * steps * metres)
        axes = here.rotation[index]
        moved += np.cross(spin, axes @ mass.centre)
        turned = spin @ axes
        inertia += mass.mass * moved @ moved.T + turned @ mass.inertia @ turned.T
    return inertia
