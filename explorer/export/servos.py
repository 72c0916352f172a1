"""Servos of the simulation: stiffness, damping, rotors, strokes, and forces that hold the weights.

Every servo is a spring with critical damping on a rotor, whose frequency stays at or below
`FREQUENCY` whatever the pose, so that time steps of up to 4 ms are stable with every integrator of
MuJoCo. The rotor has at least the inertia that its joint moves at home, and is the heavier, the
stiffer the servo. That has no effect at rest; in a motion, the servo accelerates its rotor too.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from explorer.errors import NoAnswerError
from explorer.mechanism.configuration import Configuration
from explorer.mechanism.design import JOINTS, STRUT_ROWS, Design
from explorer.motion.dynamics import forces_in_motion
from explorer.motion.inverse_jacobian import twists_of_actuators
from explorer.motion.masses import Mass, moving_bodies
from explorer.numerics.arrays import FloatArray
from explorer.numerics.number_text import format_number
from explorer.statics.compliance import softness_with_struts
from explorer.workspace.limits.table import joint_ranges

FREQUENCY = 200.0
"""Largest natural frequency of a servo and its rotor, in rad/s."""

# Stiffness of what a design leaves rigid, over that of its stiffest spring.
RIGID = 10.0


class Servos(NamedTuple):
    """The six servos in the order of `JOINTS`: N/m, N s/m, kg and N, each of shape (6,).

    The weights are forces that hold all bodies at home; the forces at the commanded joint values
    are the same, or zeros for servos that give way as the design does.
    """

    stiffness: FloatArray
    damping: FloatArray
    rotors: FloatArray
    weights: FloatArray
    forces: FloatArray

    def droop(self, design: Design) -> FloatArray:
        """Return displacement, in design units, and turn of the tool by the weights at home."""
        home = design.home_pose
        lag = (self.weights - self.forces) / (1e-3 * design.unit_mm * self.stiffness)
        twists = twists_of_actuators(Configuration.at(design, home, design.tool.position))
        return twists @ -lag


def droop_text(displacement: ArrayLike, turn: ArrayLike) -> str:
    """Return the droop in words, given the vectors (3,) in millimetres and in degrees."""
    moved, turned = (format_number(float(np.linalg.norm(v)), 3) for v in (displacement, turn))
    return f"at home the weights move the tool by {moved} mm and {turned}°"


class Strokes(NamedTuple):
    """Ranges of actuated joints and the least gap of carriages, in metres; home exceeds no end."""

    ranges: Mapping[str, tuple[float, float]]
    gap: float
    exceeded: bool


def strokes_of(design: Design, joints: FloatArray) -> Strokes:
    """Return the ranges of the actuated joints of a design, given their values at home (6,)."""
    metres, least_gap = 1e-3 * design.unit_mm, design.limits.gap
    at_home: dict[str, float] = dict(zip(JOINTS, joints.tolist(), strict=True))
    gap = min(least_gap, abs(at_home["d1"] - at_home["d3"]))
    exceeded = gap < least_gap
    ranges: dict[str, tuple[float, float]] = {}
    for name, stated in joint_ranges(design).items():
        low, high = min(stated[0], at_home[name]), max(stated[1], at_home[name])
        exceeded |= (low, high) != stated
        # MuJoCo refuses a range of zero width.
        if high > low:
            ranges[name] = low * metres, high * metres
    return Strokes(ranges, gap * metres, exceeded)


def servo_stiffness(design: Design) -> FloatArray | None:
    """Return the stiffness of the servos at home, shape (6,), in N/m; None if all is rigid.

    Those of d1 and d3 are in series with struts 2 and 3, cantilevers of the lengths that d2 and d4
    have at home. An actuator that the design leaves rigid is ten times as stiff as the stiffest of
    the others.
    """
    joints = Configuration.at(design, design.home_pose).joints
    softness = softness_with_struts(design, joints[STRUT_ROWS])
    gives = softness > 0.0
    if not gives.any():
        return None
    softness[~gives] = softness[gives].min() / RIGID
    return 1e3 / (softness * design.unit_mm)


def servos_of(design: Design, masses: Mapping[str, Mass], *, elastic: bool) -> Servos:
    """Return the servos of a design, given the masses of bodies as of `SimulationModel`.

    Elastic servos have the stiffness that the design states. Others, and those of a design that
    states none, have the frequency `FREQUENCY` with the inertia that they move, and hold the
    weights at home.

    Raises:
        NoAnswerError: The home pose is singular.
    """
    home, metres = Configuration.at(design, design.home_pose), 1e-3 * design.unit_mm
    twists = twists_of_actuators(home).T
    if not np.isfinite(twists).all():
        message = "the home pose is singular, so that no servos hold it; choose another home"
        raise NoAnswerError(message)
    # At rest, and with an acceleration of each actuator.
    bodies, accelerations = moving_bodies(design, masses), np.vstack([np.zeros(6), twists])
    held = forces_in_motion(home, bodies, acceleration=accelerations)
    weights, inertia = held[0], np.diag(held[1:] - held[0]) / metres
    stiffness = servo_stiffness(design) if elastic else None
    forces = weights if stiffness is None else np.zeros(6)
    if stiffness is None:
        stiffness = FREQUENCY**2 * inertia
    rotors = np.maximum(inertia, stiffness / FREQUENCY**2)
    return Servos(stiffness, 2.0 * np.sqrt(stiffness * rotors), rotors, weights, forces)
