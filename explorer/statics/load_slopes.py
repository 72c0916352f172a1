"""Shares of limits and errors of the tool with their derivatives by design, yaw and position.

They follow from those of J⁻¹, see `explorer.statics.slopes`. The load is the payload's weight and
its force of any direction; the legs count as weightless.
"""

from __future__ import annotations

import numpy as np

from explorer.mechanism.design import Design
from explorer.numerics.arrays import FloatArray, IntArray
from explorer.statics.accuracy import actuator_errors
from explorer.statics.forces import GUIDE_ROWS, STRUT_ROWS
from explorer.statics.slopes import PARAMETERS, TwistSlopes
from explorer.statics.weights import payload_wrench

ACTUATOR_OF = np.array([*range(6), *GUIDE_ROWS, *STRUT_ROWS])
"""Loaded parts, in the order of `explorer.statics.reactions.part_limits`, by the actuator whose
force loads them."""

BENDING = slice(6, 8)
"""The parts that are the bending of struts."""


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
    wrench = payload_wrench(design, rotation)
    # A turn about z turns the arm of the weight with the platform, not the weight.
    arm = rotation @ (np.array(design.payload.centre) - design.tool.position)
    turned = np.zeros(6)
    turned[3:] = np.cross(np.cross([0.0, 0.0, 1.0], arm), wrench[:3])
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


def error_slopes(design: Design, slopes: TwistSlopes) -> tuple[FloatArray, FloatArray]:
    """Return the worst displacements of the tool, (n,), and derivatives by `PARAMETERS`, (n, 10).

    Args:
        design: The manipulator, with the errors of its actuators.
        slopes: J⁻¹ at n positions, with its derivatives.
    """
    signed = actuator_errors(design) * _corners()
    moved = np.einsum("kji,ci->kcj", slopes.twists[:, :3], signed)
    length = np.linalg.norm(moved, axis=2)
    corner, row = length.argmax(axis=1), np.arange(len(length))
    largest = length[row, corner]
    along = moved[row, corner] / np.maximum(largest, 1e-300)[:, None]
    by = np.einsum("kj,kqji,ki->kq", along, slopes.by[:, :, :3], signed[corner])
    return largest, np.asarray(by)


def _corners() -> FloatArray:
    """Return the signs of the corners of the cube of errors, up to a common one, (32, 6)."""
    bits = np.arange(32)[:, None] >> np.arange(6) & 1
    return np.asarray(1.0 - 2.0 * bits, dtype=np.float64)
