"""Derivatives of J⁻¹ at the tool, and of what follows from it, by design, yaw and position.

A row of J is (n; a × n) with n the direction of a joint's rate and a the arm from the tool to the
joint's point on the platform. Both have elementary derivatives, and ∂(J⁻¹) = −J⁻¹ (∂J) J⁻¹. The
load is the payload's weight and its force of any direction; the legs count as weightless.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from explorer.mechanism.configuration import Configuration
from explorer.mechanism.design import VARIABLES, Design
from explorer.numerics.arrays import FloatArray, IntArray, dot
from explorer.statics.accuracy import actuator_errors, largest_error
from explorer.statics.compliance import largest_deflection, stiffness_of
from explorer.statics.forces import GUIDE_ROWS, STRUT_ROWS, twists_of_actuators
from explorer.statics.weights import payload_wrench

PARAMETERS = (*VARIABLES, "yaw", "x", "y", "z")
"""The parameters: the design variables, the yaw of the platform in radians, and b4's position."""

# Divisor in place of a length of zero.
LEAST_LENGTH = 1e-300
RADIAL = np.array([0.0, 1.0, 1.0])
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
    """Return J⁻¹ at the design's tool at regular positions, with its derivatives.

    Args:
        design: The manipulator.
        positions: b4 in the base frame, shape (n, 3), in design units.
        rotation: Platform to base, shape (3, 3).

    Raises:
        InputError: A position is not finite.
    """
    tool = np.array(design.tool.position)
    twists = twists_of_actuators(Configuration(design, positions, rotation, tool))
    # Joints' points on the platform and the tool, from b4 along the axes of the base.
    u, v = rotation[:, 0], rotation[:, 1]
    b1, b2, b3 = rotation[:, :2] @ np.array(design.b1), design.b2 * u, design.b3 * u
    still, to_tool = np.zeros(3), rotation @ tool
    offsets = np.array([b1, b2, b2, b3, b3, still])
    arms = offsets - to_tool
    arms_by = _arms_by(u, v, (b1, b2, b3)) - _turned(to_tool)
    from_base = positions[:, None, :] + offsets
    from_base[:, 5, :2] -= design.a3
    from_base_by = _from_base_by(u, v, (b1, b2, b3))
    directions, directions_by = _directions(from_base, from_base_by)
    rows_by = np.concatenate(
        [
            directions_by,
            np.cross(arms_by, directions[:, None]) + np.cross(arms, directions_by),
        ],
        axis=-1,
    )
    by = -(twists[:, None] @ rows_by @ twists[:, None])
    radial = from_base[:, (2, 4)] * RADIAL
    lengths = np.sqrt(dot(radial, radial))
    lengths_by = np.einsum("nki,nqki->nqk", directions[:, (2, 4)], from_base_by[None, :, (2, 4)])
    return TwistSlopes(twists, by, lengths, lengths_by)


def _turned(vector: FloatArray) -> FloatArray:
    """Return the derivatives of a vector fixed to the platform by `PARAMETERS`, (10, 1, 3)."""
    by = np.zeros((len(PARAMETERS), 1, 3))
    by[PARAMETERS.index("yaw"), 0] = np.cross(VERTICAL, vector)
    return by


def _arms_by(
    u: FloatArray, v: FloatArray, points: tuple[FloatArray, FloatArray, FloatArray]
) -> FloatArray:
    """Return the derivatives of the offsets of the six joints from b4, shape (10, 6, 3)."""
    b1, b2, b3 = points
    by = np.zeros((len(PARAMETERS), 6, 3))
    by[PARAMETERS.index("b1x"), 0] = u
    by[PARAMETERS.index("b1y"), 0] = v
    by[PARAMETERS.index("b2"), 1:3] = u
    by[PARAMETERS.index("b3"), 3:5] = u
    for joint, point in enumerate((b1, b2, b2, b3, b3)):
        by[PARAMETERS.index("yaw"), joint] = np.cross(VERTICAL, point)
    return by


def _from_base_by(
    u: FloatArray, v: FloatArray, points: tuple[FloatArray, FloatArray, FloatArray]
) -> FloatArray:
    """Return the derivatives of the vectors to the joints' points, shape (10, 6, 3)."""
    by = _arms_by(u, v, points)
    by[PARAMETERS.index("a3x"), 5, 0] = -1.0
    by[PARAMETERS.index("a3y"), 5, 1] = -1.0
    for axis, name in enumerate("xyz"):
        by[PARAMETERS.index(name), :, axis] = 1.0
    return by


def _directions(from_base: FloatArray, by: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the directions of the joints' rates, (n, 6, 3), and derivatives, (n, 10, 6, 3)."""
    across = np.ones((6, 3))
    across[[2, 4]] = RADIAL
    vectors = from_base * across
    lengths = np.maximum(np.sqrt(dot(vectors, vectors)), LEAST_LENGTH)[..., None]
    directions = vectors / lengths
    moved = (by * across)[None]
    along = np.einsum("nki,nqki->nqk", directions, moved)[..., None]
    directions_by = (moved - along * directions[:, None]) / lengths[:, None]
    directions[:, [1, 3]] = (1.0, 0.0, 0.0)
    directions_by[:, :, [1, 3]] = 0.0
    return directions, directions_by


ACTUATOR_OF = np.array([*range(6), *GUIDE_ROWS, *STRUT_ROWS])
"""Loaded parts, in the order of `explorer.statics.reactions.part_limits`, by the actuator whose
force loads them."""

BENDING = slice(6, 8)
"""The parts that are the bending of struts."""

DISPLACEMENT, TURN = slice(0, 3), slice(3, 6)
"""Rows of twists."""


def share_slopes(
    design: Design,
    rotation: FloatArray,
    slopes: TwistSlopes,
    parts: tuple[IntArray, IntArray],
    limits: FloatArray,
) -> tuple[FloatArray, FloatArray]:
    """Return shares of limits, shape (k,), and their derivatives by `PARAMETERS`, shape (k, 10).

    Args:
        design: The manipulator, with its tool and its payload.
        rotation: Platform to base, shape (3, 3).
        slopes: J⁻¹ at n positions, with its derivatives.
        parts: Index of the position, and of the part, of each share, shape (k,) each.
        limits: Limits of the parts, shape (2, 10), as in `explorer.statics.reactions.part_limits`.
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
    is_up = (force + spread) / highs >= (spread - force) / lows
    sign = np.where(is_up, 1.0, -1.0)
    limit = np.asarray(np.where(is_up, highs, lows), dtype=np.float64)
    value = sign * force + spread
    value_by = sign[:, None] * force_by + spread_by
    bends = (part >= BENDING.start) & (part < BENDING.stop)
    strut = np.where(bends, part - BENDING.start, 0)
    lever = np.where(bends, slopes.struts[row, strut], 1.0)
    lever_by = np.where(bends[:, None], slopes.struts_by[row, :, strut], 0.0)
    value_by = value_by * lever[:, None] + value[:, None] * lever_by
    return value * lever / limit, np.asarray(value_by / limit[:, None])


def error_slopes(
    design: Design, slopes: TwistSlopes, rows: slice = DISPLACEMENT
) -> tuple[FloatArray, FloatArray]:
    """Return the worst errors of the tool, shape (n,), and derivatives by `PARAMETERS`, (n, 10).

    Args:
        design: The manipulator, with the errors of its actuators.
        slopes: J⁻¹ at n positions, with its derivatives.
        rows: Rows of twists, `DISPLACEMENT` or `TURN`.
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

    Args:
        design: The manipulator, with its payload and its stiffness.
        rotation: Platform to base, shape (3, 3).
        slopes: J⁻¹ at n positions, with its derivatives.
    """
    weight, turned = _weight_and_turn(design, rotation)
    return _moved_by(design, slopes, weight, turned, design.payload.force_n)


def compliance_slopes(design: Design, slopes: TwistSlopes) -> tuple[FloatArray, FloatArray]:
    """Return the largest displacements of the tool per force, (n,), and derivatives, (n, 10).

    Args:
        design: The manipulator, with its stiffness.
        slopes: J⁻¹ at n positions, with its derivatives.
    """
    return _moved_by(design, slopes, np.zeros(6), np.zeros(6), 1.0)


def _moved_by(
    design: Design, slopes: TwistSlopes, wrench: FloatArray, turned: FloatArray, force: float
) -> tuple[FloatArray, FloatArray]:
    """Return the largest displacements and derivatives under a wrench and a force.

    The force has the worst direction, so that its change by a parameter does not count. The
    wrench changes by `turned` with the yaw.
    """
    stiffness, bending = stiffness_of(design)
    soft = np.tile(1.0 / stiffness, (len(slopes.twists), 1))
    soft[:, GUIDE_ROWS] += slopes.struts**3 / (3.0 * bending)
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
