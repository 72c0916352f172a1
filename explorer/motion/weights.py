"""Weights and inertia of payload, platform and legs, as a load that the actuators hold.

By d'Alembert's principle a body whose centre accelerates by a has the weight m (g − a) and the
moment of its inertia. By virtual work the weight and inertia of a leg act on the actuators like one
force at its end. A leg's motion follows from that of its end: its universal joint turns about one
axis that the base holds and one across that and the leg, so that a leg that swings also spins. The
actuators d1 and d3 hold the part along the guide of legs 2 and 3, their carriages included.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike

from explorer.mechanism.configuration import Configuration
from explorer.mechanism.design import Design
from explorer.mechanism.machine import STANDARD_GRAVITY
from explorer.mechanism.points import ACROSS
from explorer.numerics.arrays import FloatArray, dot, finite_array, lengths_of, rotate

LARGEST_RATE = 1e20
"""Largest entry of a twist or an acceleration, far below what makes forces overflow."""
AT_REST = (0.0,) * 6

# Columns of the rows of the legs, see `MovingBodies`.
TOTAL, ROD, ROD_CENTRE, FIRST_MOMENT, SIDE_X, SIDE_Y, SPIN, CROSS = range(8)
AXIS = slice(8, 11)
# Which legs start at a carriage.
IS_ON_GUIDE = np.array([False, True, True, False])


@dataclass(frozen=True)
class MovingBodies:
    """The masses that move, in kilograms, with lengths in design units; none by default.

    Attributes:
        platform: Of the platform with all that it carries, in its frame, 4 × 4 numbers: its inertia
            about b4 in the first three rows and columns, mass × centre in the last column and row,
            and its mass where they meet.
        legs: Eleven numbers of each leg: its mass, the carriage's included; mass of its rod and
            distance of the rod's centre back from the platform joint; mass of its cylinder times
            the distance of its centre from the base joint; inertia of cylinder and rod about the
            two axes across the leg, of the cylinder about the base joint, of the rod about its
            centre; inertia of both about the leg; inertia of the cross about the axis that the base
            holds; and this axis in the base frame.
    """

    platform: ArrayLike = ((0.0,) * 4,) * 4
    legs: ArrayLike = ((0.0,) * 11,) * 4

    def __post_init__(self) -> None:
        # Plain numbers, so that bodies can be compared.
        for name in ("platform", "legs"):
            rows: list[list[float]] = np.asarray(getattr(self, name), dtype=np.float64).tolist()
            object.__setattr__(self, name, tuple(map(tuple, rows)))

    def with_mass(
        self, mass: float, centre: ArrayLike, inertia: ArrayLike = ((0.0,) * 3,) * 3
    ) -> MovingBodies:
        """Return these bodies with another mass on the platform, with its inertia about its centre.

        The centre (3,) and the inertia (3, 3) are in the frame of the platform.
        """
        off, matrix = np.array(centre), np.array(self.platform)
        matrix[:3, :3] += np.array(inertia) + mass * (off @ off * np.eye(3) - np.outer(off, off))
        matrix[:3, 3] += mass * off
        matrix[3, :3] += mass * off
        matrix[3, 3] += mass
        return replace(self, platform=matrix)

    def with_payload(self, design: Design) -> MovingBodies:
        """Return these bodies with the payload of a design."""
        payload = design.payload
        inertia = np.diag(payload.inertia_kg_mm2) / design.unit_mm**2
        return self.with_mass(payload.mass_kg, payload.centre, inertia)

    @cached_property
    def arrays(self) -> tuple[FloatArray, FloatArray]:
        """The platform's matrix (4, 4) and the legs' rows (4, 11)."""
        return np.array(self.platform), np.array(self.legs)


@dataclass(frozen=True)
class Carried:
    """The load of weights and inertia in some poses or motions.

    Attributes:
        wrench: (F; M) on the platform at the tool point, base axes, that stands for all of them,
            shape (..., 6), in N and N × unit.
        at_joints: Forces at b1 to b4 that stand for the legs, part of it, (..., 4, 3), in N.
        along_guide: Moments by which legs 2 and 3 change those of the forces of d1 and d3 at the
            carriages, shape (..., 2), in N × unit.
        legs: Weights and inertia of the legs, carriages included, shape (..., 4, 3), in N.
    """

    wrench: FloatArray
    at_joints: FloatArray
    along_guide: FloatArray
    legs: FloatArray = field(repr=False)


def payload_wrench(design: Design, rotation: FloatArray) -> FloatArray:
    """Return the weight of the design's payload as a wrench (F; M) at its tool, shape (6,)."""
    payload = design.payload
    weight = payload.mass_kg * STANDARD_GRAVITY * np.array(design.gravity)
    arm = rotation @ np.subtract(payload.centre, design.tool.position)
    return np.concatenate([weight, np.cross(arm, weight)])


def motion_array(name: str, value: ArrayLike) -> FloatArray:
    """Return a twist or an acceleration (..., 6) as float64 after checking it."""
    return finite_array(f"the {name} (X Y Z, then turning)", value, (6,), LARGEST_RATE)


def carry(
    configuration: Configuration,
    bodies: MovingBodies,
    twist: ArrayLike = AT_REST,
    acceleration: ArrayLike = AT_REST,
) -> Carried:
    """Return the load of weights and inertia of bodies at rest or in a motion.

    The twist and the acceleration are those of `explorer.motion.rates.joint_accelerations`, of b4
    whatever the tool of the configuration. Where a leg lies along the first axis of its universal
    joint, its spin is undefined and taken as zero.

    Raises:
        InputError: A number is not finite, or batch axes do not broadcast.
    """
    t, rate = motion_array("twist", twist), motion_array("acceleration", acceleration)
    c, metres = configuration.spread(t, rate), 1e-3 * configuration.design.unit_mm
    g, r = STANDARD_GRAVITY / metres * np.array(c.design.gravity), c.rotation
    (v, turning), (a, turning_rate) = (np.split(each, 2, axis=-1) for each in (t, rate))
    platform, rows = bodies.arrays
    # The platform turns in its own frame, in which its inertia does not change.
    inertia, mass, back = platform[:3, :3], platform[3, 3], np.swapaxes(r, -1, -2)
    own, own_rate = rotate(back, turning), rotate(back, turning_rate)
    torque = own_rate @ inertia + np.cross(own, own @ inertia)
    # Mass × centre from b4, and mass × the acceleration of the centre beyond that of b4.
    first_moment = rotate(r, platform[:3, 3])
    beyond, from_b4 = _swing(turning, turning_rate, first_moment), g - a
    force = mass * from_b4 - beyond
    moment = np.cross(first_moment, from_b4) - rotate(r, torque)
    arms = c.design.platform_points @ back
    v, a, turning, turning_rate = (each[..., None, :] for each in (v, a, turning, turning_rate))
    end_v = v + np.cross(turning, arms)
    at_joints, legs, along_guide = _leg_inertia(
        c, rows, end_v, a + _swing(turning, turning_rate, arms), g
    )
    force = force + at_joints.sum(axis=-2)
    moment = moment + np.cross(arms, at_joints).sum(axis=-2) - np.cross(c.arm, force)
    wrench = np.concatenate(np.broadcast_arrays(force, moment), axis=-1)
    # Masses times units/s² so far.
    parts = wrench, at_joints, along_guide[..., IS_ON_GUIDE], legs
    shapes = (6,), (4, 3), (2,), (4, 3)
    return Carried(
        *(
            np.broadcast_to(metres * each, (*c.batch, *shape))
            for each, shape in zip(parts, shapes, strict=True)
        )
    )


def _swing(turning: FloatArray, turning_rate: FloatArray, arm: FloatArray) -> FloatArray:
    """Return the acceleration of a point of a body at an arm beyond that of the arm's start."""
    return np.cross(turning_rate, arm) + np.cross(turning, np.cross(turning, arm))


def _leg_inertia(
    c: Configuration, rows: FloatArray, v: FloatArray, a: FloatArray, g: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return the load of the legs' weight and inertia, given the motion of their ends, (..., 4, 3).

    Returns:
        The forces at their ends that stand for them, their sums, (..., 4, 3), and the moments by
        which they change those of the forces of their carriages, (..., 4), in N and N × unit.
    """
    total, rod, rod_centre, first_moment, side_x, side_y, spin, cross = rows[:, : AXIS.start].T
    slide, s = np.where(IS_ON_GUIDE, a[..., 0], 0.0), c.leg_directions
    from_rail = slide - float(g[0])
    v, a = (np.where(IS_ON_GUIDE[:, None], each * ACROSS, each) for each in (v, a))
    has_length = c.leg_lengths > 0.0
    length = np.where(has_length, c.leg_lengths, 1.0)
    # The leg's frame (x, y, s): y is the second axis of the universal joint, and the first axis is
    # sine x + cosine s. Along the first axis y is undefined, and the spin is taken as zero.
    y, cosine = np.cross(s, rows[:, AXIS]), dot(s, rows[:, AXIS])
    sine = lengths_of(y)
    is_turned = sine > 0.0
    sine, cosine = np.where(is_turned, sine, 1.0), np.where(is_turned, cosine, 0.0)
    y = np.where(is_turned[..., None], y / sine[..., None], [0.0, 0.0, 1.0])
    x, cotangent = np.cross(y, s), cosine / sine
    # Angular velocity w in this frame, from v = l̇ s + w × l s. The leg turns by φ̇ about the first
    # axis and by w_y about y, so that w_x = φ̇ sine and w_z = φ̇ cosine.
    length_rate = dot(s, v)
    wx, wy = -dot(y, v) / length, dot(x, v) / length
    wz = cotangent * wx
    # Angular acceleration in this frame. With sine' = −w_y cosine and cosine' = w_y sine, φ̈ is
    # (alpha_x + w_y w_z) / sine.
    square = wx * wx + wy * wy
    length_acceleration = dot(s, a) + length * square
    alpha_x = -(dot(y, a) + 2.0 * length_rate * wx) / length + wy * wz
    alpha_y = (dot(x, a) - 2.0 * length_rate * wy) / length - wx * wz
    first_acceleration = (alpha_x + wy * wz) / sine
    alpha_z = cosine * first_acceleration + wx * wy
    # Euler's equations of cylinder and rod about the base joint.
    back = length - rod_centre
    at_base = first_moment + rod * back
    ix, iy, iz = side_x + rod * back * back, side_y + rod * back * back, spin
    # The rod goes farther out, so that the inertia about the base joint grows at this rate.
    growth = 2.0 * rod * back * length_rate
    tx = ix * alpha_x + growth * wx + (iz - iy) * wy * wz + at_base * dot(y, g)
    ty = iy * alpha_y + growth * wy + (ix - iz) * wx * wz - at_base * dot(x, g)
    tz = iz * alpha_z + (iy - ix) * wx * wy
    # Their power is w_x (t_x + cotangent t_z + cross φ̈ / sine) + w_y t_y, and that of a force at
    # the end, which moves by v_x = l w_y and v_y = −l w_x, is the opposite.
    about_first = tx + cotangent * tz + cross * first_acceleration / sine
    along_leg = rod * (length_acceleration - back * square - dot(s, g))
    across = np.asarray(np.where(IS_ON_GUIDE, total * from_rail, ty / length), np.float64)
    frame = np.stack([x, y, s], axis=-2)

    def combine(*shares: FloatArray) -> FloatArray:
        return np.asarray(np.einsum("...k,...ki->...i", np.stack(shares, axis=-1), frame))

    at_end = combine(-across, about_first / length, -along_leg)
    # The sum of mass × acceleration is rod a + swinging · l s̈, with l s̈ = a − l̈ s − 2 l̇ ṡ.
    swinging = ((first_moment - rod * rod_centre) / length)[..., None]
    turn = combine(2.0 * length_rate * wy, -2.0 * length_rate * wx, length_acceleration)
    sums = total[:, None] * g - rod[:, None] * a - swinging * (a - turn)
    sums[..., 0] -= total * slide
    # Along the guide the centre is at first_moment / total from the carriage, the force at l.
    on_carriage = -from_rail * (total * length - at_base)
    at_end, sums = (np.where(has_length[..., None], each, 0.0) for each in (at_end, sums))
    return at_end, sums, np.where(has_length, on_carriage, 0.0)
