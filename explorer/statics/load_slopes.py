"""Shares of limits, errors and deflections with their derivatives by design, yaw and position.

They follow from those of J⁻¹, see `explorer.statics.slopes`. The load is the payload's weight and
its force of any direction; the legs count as weightless.
"""

from __future__ import annotations

import numpy as np

from explorer.mechanism.design import Design
from explorer.numerics.arrays import FloatArray, IntArray
from explorer.statics.accuracy import actuator_errors
from explorer.statics.compliance import largest_deflection, stiffness_of
from explorer.statics.equilibrium import GUIDE_ROWS, STRUT_ROWS
from explorer.statics.slopes import PARAMETERS, TwistSlopes
from explorer.statics.weights import payload_wrench

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
    along = twist[:, :3] / np.maximum(speed, 1e-300)[:, None]
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
    signed = actuator_errors(design) * _corners()
    moved = np.einsum("kji,ci->kcj", slopes.twists[:, rows], signed)
    length = np.linalg.norm(moved, axis=2)
    corner, row = length.argmax(axis=1), np.arange(len(length))
    largest = length[row, corner]
    along = moved[row, corner] / np.maximum(largest, 1e-300)[:, None]
    by = np.einsum("kj,kqji,ki->kq", along, slopes.by[:, :, rows], signed[corner])
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
    along = np.einsum("kij,kj->ki", moved[:, :3], load) / np.maximum(largest, 1e-300)[:, None]
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
    turned[3:] = np.cross(np.cross([0.0, 0.0, 1.0], arm), wrench[:3])
    return wrench, turned


def _corners() -> FloatArray:
    """Return the signs of the corners of the cube of errors, up to a common one, (32, 6)."""
    bits = np.arange(32)[:, None] >> np.arange(6) & 1
    return np.asarray(1.0 - 2.0 * bits, dtype=np.float64)
