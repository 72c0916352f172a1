"""Derivatives of J⁻¹ at the tool, and of what follows from it, by design, yaw and position.

A row of J is (n; a × n) with n the direction of a joint's rate and a the arm from the tool to the
joint's point on the platform. Both have elementary derivatives, and ∂(J⁻¹) = −J⁻¹ (∂J) J⁻¹. The
load is the payload's weight and its force of any direction; the legs count as weightless.
"""

from __future__ import annotations

from typing import NamedTuple

import msgspec
import numpy as np

from explorer.mechanism.configuration import Configuration
from explorer.mechanism.design import GUIDE_ROWS, STRUT_ROWS, VARIABLES, Design
from explorer.mechanism.machine import Payload, Tool
from explorer.motion.inverse_jacobian import twists_of_actuators
from explorer.motion.weights import payload_wrench
from explorer.numerics.arrays import BoolArray, FloatArray, IntArray
from explorer.statics.accuracy import actuator_errors, largest_error
from explorer.statics.compliance import largest_deflection, softness_with_struts, stiffness_of
from explorer.statics.reactions import part_limits

PARAMETERS = (*VARIABLES, "yaw", "x", "y", "z")
"""The parameters: the design variables, the yaw of the platform in radians, and b4's position."""

# Divisor in place of a length of zero.
LEAST_LENGTH = 1e-300
VERTICAL = np.array([0.0, 0.0, 1.0])


class TwistSlopes(NamedTuple):
    """J⁻¹ at the tool and the lengths of the struts, with their derivatives by `PARAMETERS`.

    Attributes:
        twists: J⁻¹, shape (n, 6, 6).
        by: Derivatives of J⁻¹, shape (n, 10, 6, 6).
        struts: Lengths d2 and d4, shape (n, 2), in design units.
        struts_by: Their derivatives, shape (n, 10, 2).
    """

    twists: FloatArray
    by: FloatArray
    struts: FloatArray
    struts_by: FloatArray


def twist_slopes(design: Design, positions: FloatArray, rotation: FloatArray) -> TwistSlopes:
    """Return J⁻¹ at the design's tool at regular positions (n, 3), with its derivatives."""
    c = Configuration(design, positions, rotation, design.tool.position)
    twists, directions = twists_of_actuators(c), c.jacobian[..., :3]
    # Joints' points on the platform, from b4 and from the tool, along the axes of the base.
    offsets = design.platform_points[[0, 1, 1, 2, 2, 3]] @ rotation.T
    arms = offsets - c.arm
    arms_by = np.zeros((len(PARAMETERS), 6, 3))
    for name, joints, axis in (
        ("b1x", [0], 0),
        ("b1y", [0], 1),
        ("b2", [1, 2], 0),
        ("b3", [3, 4], 0),
    ):
        arms_by[PARAMETERS.index(name), joints] = rotation[:, axis]
    points_by, yaw = arms_by.copy(), PARAMETERS.index("yaw")
    arms_by[yaw], points_by[yaw] = np.cross(VERTICAL, arms), np.cross(VERTICAL, offsets)
    for axis, name in enumerate("xyz"):
        points_by[PARAMETERS.index(name), :, axis] = 1.0
    points_by[PARAMETERS.index("a3x"), 5, 0] = points_by[PARAMETERS.index("a3y"), 5, 1] = -1.0
    # Struts and their lengths are perpendicular to the guide.
    points_by[:, STRUT_ROWS, 0] = 0.0
    lengths_by = np.einsum("nki,qki->nqk", directions, points_by)
    lengths = np.maximum(np.abs(c.joints), LEAST_LENGTH)[:, None, :, None]
    directions_by = (points_by - lengths_by[..., None] * directions[:, None]) / lengths
    directions_by[:, :, GUIDE_ROWS] = 0.0
    moments_by = np.cross(arms_by, directions[:, None]) + np.cross(arms, directions_by)
    rows_by = np.concatenate([directions_by, np.asarray(moments_by, dtype=np.float64)], axis=-1)
    by = -(twists[:, None] @ rows_by @ twists[:, None])
    return TwistSlopes(twists, by, c.joints[:, STRUT_ROWS], lengths_by[..., STRUT_ROWS])


ACTUATOR_OF = np.array([*range(6), *GUIDE_ROWS, *STRUT_ROWS])
"""Loaded parts, in the order of `explorer.statics.reactions.part_limits`, by the actuator whose
force loads them."""

BENDING = slice(6, 8)
"""The parts that are the bending of struts."""

DISPLACEMENT, TURN = slice(0, 3), slice(3, 6)
"""Rows of twists."""


def utilisation_slopes(
    design: Design,
    rotation: FloatArray,
    slopes: TwistSlopes,
    parts: tuple[IntArray, IntArray],
    limits: FloatArray,
    is_up: BoolArray | None = None,
) -> tuple[FloatArray, FloatArray]:
    """Return utilisations, shape (k,), and their derivatives by `PARAMETERS`, shape (k, 10).

    The parts are the index of the position and that of the part for each, shape (k,) each; the
    limits (2, 10) are those of `explorer.statics.reactions.part_limits`. Whether the limit of
    the largest value is meant, shape (k,), follows from the larger share if it is None.
    """
    row, part = parts
    joint = ACTUATOR_OF[part]
    wrench, turned = _weight_and_turn(design, rotation)
    twist, by = slopes.twists[row, :, joint], slopes.by[row, :, :, joint]
    force, force_by = -twist @ wrench, -by @ wrench
    force_by[:, PARAMETERS.index("yaw")] -= twist @ turned
    speed = np.linalg.norm(twist[:, :3], axis=1)
    along = twist[:, :3] / np.maximum(speed, LEAST_LENGTH)[:, None]
    spread = design.payload.force_n * speed
    spread_by = design.payload.force_n * np.einsum("ki,kqi->kq", along, by[..., :3])
    highs, lows = limits[0, part], limits[1, part]
    up = (force + spread) / highs >= (spread - force) / lows if is_up is None else is_up
    sign = np.where(up, 1.0, -1.0)
    limit = np.asarray(np.where(up, highs, lows), dtype=np.float64)
    value = sign * force + spread
    value_by = sign[:, None] * force_by + spread_by
    bends = (part >= BENDING.start) & (part < BENDING.stop)
    strut = np.where(bends, part - BENDING.start, 0)
    lever = np.where(bends, slopes.struts[row, strut], 1.0)
    lever_by = np.where(bends[:, None], slopes.struts_by[row, :, strut], 0.0)
    value_by = value_by * lever[:, None] + value[:, None] * lever_by
    return value * lever / limit, np.asarray(value_by / limit[:, None])


def acceleration_slopes(
    design: Design, positions: FloatArray, rotation: FloatArray, parts: tuple[IntArray, IntArray]
) -> tuple[FloatArray, FloatArray]:
    """Return largest accelerations, shape (k,), in m/s², and derivatives by `PARAMETERS`, (k, 10).

    They are those of `explorer.statics.reactions.largest_accelerations` at regular positions
    (n, 3); the parts are those of `utilisation_slopes`. Derivatives of an infinite one are zero.
    """
    own, limits = design.payload, part_limits(design)
    # An acceleration of 1 m/s² does what a force of any direction at the payload's centre does.
    unit = msgspec.structs.replace(design, tool=Tool(own.centre), payload=Payload(force_n=1.0))
    held, moved = (twist_slopes(each, positions, rotation) for each in (design, unit))
    row, part = parts
    force = -held.twists[row, :, ACTUATOR_OF[part]] @ payload_wrench(design, rotation)
    is_up = limits[0, part] - force <= limits[1, part] + force
    share, share_by = utilisation_slopes(design, rotation, held, parts, limits, is_up)
    by_one, slope = utilisation_slopes(unit, rotation, moved, parts, limits, is_up)
    loads, by_one, slope = by_one > 0.0, own.mass_kg * by_one, own.mass_kg * slope
    out = np.where(share <= 1.0, np.inf, -np.inf), np.zeros(slope.shape)
    value = np.divide(1.0 - share, by_one, out=out[0], where=loads)
    change = -share_by - np.where(loads, value, 0.0)[:, None] * slope
    return value, np.divide(change, by_one[:, None], out=out[1], where=loads[:, None])


def error_slopes(
    design: Design, slopes: TwistSlopes, rows: slice = DISPLACEMENT
) -> tuple[FloatArray, FloatArray]:
    """Return the worst errors of the tool, shape (n,), and derivatives by `PARAMETERS`, (n, 10).

    The rows of twists are `DISPLACEMENT` or `TURN`.
    """
    half, errors = rows.start // 3, actuator_errors(design)
    found = largest_error(slopes.twists, errors)
    largest = found.turn if half else found.displacement
    signed = found.signs[:, half] * errors
    along = found.vectors[:, half] / np.maximum(largest, LEAST_LENGTH)[:, None]
    by = np.einsum("kj,kqji,ki->kq", along, slopes.by[:, :, rows], signed)
    return largest, np.asarray(by)


def deflection_slopes(
    design: Design, rotation: FloatArray, slopes: TwistSlopes
) -> tuple[FloatArray, FloatArray]:
    """Return the largest displacements of the tool under the load, (n,), and derivatives, (n, 10).

    The arguments are those of `utilisation_slopes`.
    """
    weight, turned = _weight_and_turn(design, rotation)
    return _moved_by(design, slopes, weight, turned, design.payload.force_n)


def compliance_slopes(design: Design, slopes: TwistSlopes) -> tuple[FloatArray, FloatArray]:
    """Return the largest displacements of the tool per force, (n,), and derivatives, (n, 10)."""
    return _moved_by(design, slopes, np.zeros(6), np.zeros(6), 1.0)


def _moved_by(
    design: Design, slopes: TwistSlopes, wrench: FloatArray, turned: FloatArray, force: float
) -> tuple[FloatArray, FloatArray]:
    """Return the largest displacements and derivatives under a wrench and a force.

    The force has the worst direction, so that its change by a parameter does not count. The
    wrench changes by `turned` with the yaw.
    """
    soft, bending = softness_with_struts(design, slopes.struts), stiffness_of(design)[1]
    soft_by = np.zeros((*slopes.by.shape[:2], 6))
    soft_by[:, :, GUIDE_ROWS] = slopes.struts[:, None] ** 2 * slopes.struts_by / bending
    twists = slopes.twists
    moved = (twists * soft[:, None]) @ np.swapaxes(twists, 1, 2)
    largest, worst = largest_deflection(moved, wrench, force)
    load = np.tile(wrench, (len(twists), 1))
    load[:, :3] += worst
    along = np.einsum("kij,kj->ki", moved[:, :3], load) / np.maximum(largest, LEAST_LENGTH)[:, None]
    # Both ends of C = J⁻¹ diag(c) J⁻ᵀ change, and c itself.
    left = np.einsum("kj,kji->ki", along, twists[:, :3])
    right = np.einsum("kj,kji->ki", load, twists)
    left_by = np.einsum("kj,kqji->kqi", along, slopes.by[:, :, :3])
    right_by = np.einsum("kj,kqji->kqi", load, slopes.by)
    right_by[:, PARAMETERS.index("yaw")] += turned @ twists
    by = (
        np.einsum("kqi,ki->kq", left_by, soft * right)
        + np.einsum("kqi,ki->kq", soft_by, left * right)
        + np.einsum("kqi,ki->kq", right_by, soft * left)
    )
    return largest, np.asarray(by)


def _weight_and_turn(design: Design, rotation: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the wrench of the payload's weight and its derivative by the yaw, shape (6,) each."""
    wrench = payload_wrench(design, rotation)
    # A turn about z turns the arm of the weight with the platform, not the weight.
    arm = rotation @ (np.array(design.payload.centre) - design.tool.position)
    turned = np.zeros(6)
    turned[3:] = np.cross(np.cross(VERTICAL, arm), wrench[:3])
    return wrench, turned
