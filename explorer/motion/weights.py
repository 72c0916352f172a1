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
from explorer.motion.inverse_jacobian import A3X, A3Y
from explorer.numerics.arrays import FloatArray, finite_array
from explorer.numerics.compiled import helper, kernel
from explorer.numerics.vectors import Vector, along, column, cross3, dot3, norm3, times, vector

LARGEST_RATE = 1e20
"""Largest entry of a twist or an acceleration, far below what makes forces overflow."""
AT_REST = (0.0,) * 6

# Columns of the rows of the legs, see `MovingBodies`.
TOTAL, ROD, ROD_CENTRE, FIRST_MOMENT, SIDE_X, SIDE_Y, SPIN, CROSS = range(8)
AXIS_X, AXIS_Y, AXIS_Z = range(8, 11)
# First columns of the rows of `inertia_rows` after the wrench, and their number.
AT_JOINTS, ALONG_GUIDE, OF_LEGS, COLUMNS = 6, 18, 20, 32


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


@helper
def combine(shares: Vector, x: Vector, y: Vector, z: Vector) -> Vector:
    """Return the sum of three vectors with shares."""
    return along(along(along((0.0, 0.0, 0.0), shares[0], x), shares[1], y), shares[2], z)


@helper
def acceleration_of(a: Vector, turning: Vector, turning_rate: Vector, arm: Vector) -> Vector:
    """Return the acceleration of a point of a body at an arm from one with the acceleration a."""
    swing = cross3(turning, arm)
    return along(along(a, 1.0, cross3(turning_rate, arm)), 1.0, cross3(turning, swing))


@helper
def leg_inertia(
    leg: Vector, v: Vector, a: Vector, g: Vector, on_guide: bool, row: FloatArray
) -> tuple[Vector, Vector, float]:
    """Return the load of a leg's weight and inertia, given its vector and the motion of its end.

    Returns:
        The force at its end that stands for them, their sum, and the moment by which they change
        that of the force of its carriage, in N and N × unit.
    """
    slide, first = 0.0, (row[AXIS_X], row[AXIS_Y], row[AXIS_Z])
    if on_guide:
        slide = a[0]
        leg, v, a = (0.0, leg[1], leg[2]), (0.0, v[1], v[2]), (0.0, a[1], a[2])
    length = norm3(leg)
    if length == 0.0:
        return (0.0, 0.0, 0.0), (0.0, 0.0, 0.0), 0.0
    rod, total = row[ROD], row[TOTAL]
    s = along((0.0, 0.0, 0.0), 1.0 / length, leg)
    # The leg's frame (x, y, s): y is the second axis of the universal joint, and the first axis is
    # sine x + cosine s. Along the first axis y is undefined, and the spin is taken as zero.
    y, cosine = cross3(s, first), dot3(s, first)
    sine = norm3(y)
    if sine > 0.0:
        y = along((0.0, 0.0, 0.0), 1.0 / sine, y)
    else:
        y, cosine, sine = (0.0, 0.0, 1.0), 0.0, 1.0
    x, cotangent = cross3(y, s), cosine / sine
    # Angular velocity w in this frame, from v = l̇ s + w × l s. The leg turns by φ̇ about the first
    # axis and by w_y about y, so that w_x = φ̇ sine and w_z = φ̇ cosine.
    length_rate = dot3(s, v)
    wx, wy = -dot3(y, v) / length, dot3(x, v) / length
    wz = cotangent * wx
    # Angular acceleration in this frame. With sine' = −w_y cosine and cosine' = w_y sine, φ̈ is
    # (alpha_x + w_y w_z) / sine.
    square = wx * wx + wy * wy
    length_acceleration = dot3(s, a) + length * square
    alpha_x = -(dot3(y, a) + 2.0 * length_rate * wx) / length + wy * wz
    alpha_y = (dot3(x, a) - 2.0 * length_rate * wy) / length - wx * wz
    first_acceleration = (alpha_x + wy * wz) / sine
    alpha_z = cosine * first_acceleration + wx * wy
    # Euler's equations of cylinder and rod about the base joint.
    back = length - row[ROD_CENTRE]
    first_moment = row[FIRST_MOMENT] + rod * back
    ix = row[SIDE_X] + rod * back * back
    iy, iz = row[SIDE_Y] + rod * back * back, row[SPIN]
    # The rod goes farther out, so that the inertia about the base joint grows at this rate.
    growth = 2.0 * rod * back * length_rate
    tx = ix * alpha_x + growth * wx + (iz - iy) * wy * wz + first_moment * dot3(y, g)
    ty = iy * alpha_y + growth * wy + (ix - iz) * wx * wz - first_moment * dot3(x, g)
    tz = iz * alpha_z + (iy - ix) * wx * wy
    # Their power is w_x (t_x + cotangent t_z + cross φ̈ / sine) + w_y t_y, and that of a force at
    # the end, which moves by v_x = l w_y and v_y = −l w_x, is the opposite.
    about_first = tx + cotangent * tz + row[CROSS] * first_acceleration / sine
    along_leg = rod * (length_acceleration - back * square - dot3(s, g))
    across = total * (slide - g[0]) if on_guide else ty / length
    at_end = combine((-across, about_first / length, -along_leg), x, y, s)
    # The sum of mass × acceleration is rod a + swinging · l s̈, with l s̈ = a − l̈ s − 2 l̇ ṡ.
    swinging = (row[FIRST_MOMENT] - rod * row[ROD_CENTRE]) / length
    turn = (2.0 * length_rate * wy, -2.0 * length_rate * wx, length_acceleration)
    total_force = combine((total, -rod, -swinging), g, a, along(a, -1.0, combine(turn, x, y, s)))
    total_force = (total_force[0] - total * slide, total_force[1], total_force[2])
    # Along the guide the centre is at first_moment / total from the carriage, the force at l.
    return at_end, total_force, (g[0] - slide) * (total * length - first_moment)


@kernel(
    "void(f8[::1], f8[:,::1], f8[::1], f8[:,::1], f8[:,::1], f8[:,::1], f8[:,:,::1], f8[:,::1], "
    "f8[:,::1], f8[:,::1])"
)
def inertia_rows(
    variables: FloatArray,
    points: FloatArray,
    gravity: FloatArray,
    platform: FloatArray,
    legs: FloatArray,
    position: FloatArray,
    rotation: FloatArray,
    twists: FloatArray,
    accelerations: FloatArray,
    out: FloatArray,
) -> None:
    """Write the load of weights and inertia in n motions, shape (n, 32).

    A row has the four arrays of `Carried` in turn, the wrench about b4.
    """
    g = (gravity[0], gravity[1], gravity[2])
    mass = platform[3, 3]
    for k in range(position.shape[0]):
        r, p = rotation[k], vector(position, k)
        t, rate = twists[k % twists.shape[0]], accelerations[k % accelerations.shape[0]]
        v, turning = (t[0], t[1], t[2]), (t[3], t[4], t[5])
        a, turning_rate = (rate[0], rate[1], rate[2]), (rate[3], rate[4], rate[5])
        x, y, z = column(r, 0), column(r, 1), column(r, 2)
        # The platform turns in its own frame, in which its inertia does not change.
        own = (dot3(x, turning), dot3(y, turning), dot3(z, turning))
        own_rate = (dot3(x, turning_rate), dot3(y, turning_rate), dot3(z, turning_rate))
        i, j, h = column(platform, 0), column(platform, 1), column(platform, 2)
        torque = along(combine(own_rate, i, j, h), 1.0, cross3(own, combine(own, i, j, h)))
        # Mass × centre from b4, and mass × the acceleration of the centre beyond that of b4.
        first_moment = combine(column(platform, 3), x, y, z)
        beyond = acceleration_of((0.0, 0.0, 0.0), turning, turning_rate, first_moment)
        from_b4 = along(g, -1.0, a)
        force = along((-beyond[0], -beyond[1], -beyond[2]), mass, from_b4)
        moment = along(cross3(first_moment, from_b4), -1.0, combine(torque, x, y, z))
        for leg in range(4):
            arm, on_guide = times(r, points[leg]), 0 < leg < 3
            end = along(p, 1.0, arm)
            if leg == 3:
                end = (end[0] - variables[A3X], end[1] - variables[A3Y], end[2])
            end_v = along(v, 1.0, cross3(turning, arm))
            end_a = acceleration_of(a, turning, turning_rate, arm)
            at_end, total, on_carriage = leg_inertia(end, end_v, end_a, g, on_guide, legs[leg])
            force, moment = along(force, 1.0, at_end), along(moment, 1.0, cross3(arm, at_end))
            if on_guide:
                out[k, ALONG_GUIDE + leg - 1] = on_carriage
            for axis in range(3):
                out[k, AT_JOINTS + 3 * leg + axis] = at_end[axis]
                out[k, OF_LEGS + 3 * leg + axis] = total[axis]
        for axis in range(3):
            out[k, axis], out[k, 3 + axis] = force[axis], moment[axis]


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
    out = np.empty((len(c.positions), COLUMNS))
    inertia_rows(
        len(out),
        c.variables,
        c.design.platform_points,
        STANDARD_GRAVITY / metres * np.array(c.design.gravity),
        *bodies.arrays,
        c.positions,
        c.rotations,
        c.rows_or_one(t),
        c.rows_or_one(rate),
        out,
    )
    # Masses times units/s² so far.
    parts = np.split(metres * out.reshape(*c.batch, COLUMNS), (AT_JOINTS, ALONG_GUIDE, OF_LEGS), -1)
    wrench, at_joints, along_guide, legs = parts
    if c.tool.any():
        wrench[..., 3:] -= np.cross(c.arm, wrench[..., :3])
    at_joints, legs = (each.reshape(*c.batch, 4, 3) for each in (at_joints, legs))
    return Carried(wrench, at_joints, along_guide, legs)
