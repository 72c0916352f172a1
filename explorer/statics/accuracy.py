"""Errors of the tool from the actuators' errors and from the geometric dimensions.

The model is linear: the tool moves by J⁻¹ times the errors of the joints, and by −J⁻¹ ∂q/∂g times
the errors of the dimensions g while the actuators hold their values.

Errors are independent, and each is uniform within ± its bound, as those of the machines that
`explorer.export.imperfect` draws. Root-mean-square errors are those of this model.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from explorer.errors import InputError
from explorer.mechanism.configuration import Configuration, computed_once
from explorer.mechanism.design import Design
from explorer.mechanism.machine import DIMENSIONS
from explorer.numerics.arrays import FloatArray
from explorer.numerics.compiled import helper, kernel
from explorer.statics.equilibrium import A3X, A3Y, B1X, B1Y, B2, B3, twists_of_actuators

# First columns of the dimensions, in the order of `DIMENSIONS`.
A1_COLUMN, A3_COLUMN, GUIDE_COLUMN, TILT_COLUMN, B_COLUMN = 0, 3, 6, 9, 11

UNIFORM = 1.0 / math.sqrt(3.0)
"""Standard deviation of an error that is uniform within ± its bound, over the bound."""

RMS_ERRORS = "independent errors, each uniform within its bounds"
"""The errors behind each root-mean-square error, in words."""

# Corners of the cube of the actuators' errors, up to a common sign.
CORNERS = 32


class ToolError(NamedTuple):
    """An error of the tool; infinite in a singular pose.

    Attributes:
        displacement: Displacement of the tool point, shape (...), in design units.
        turn: Turn of the tool, shape (...), in radians.
    """

    displacement: FloatArray
    turn: FloatArray


class ToolErrors(NamedTuple):
    """Errors of the tool for errors of the actuators within their bounds.

    Attributes:
        worst: Largest displacement and turn over the 64 corners of the cube of errors, exact for
            the linear model.
        rms: Root-mean-square errors for independent errors that are uniform within the bounds.
        by_actuator: Errors that each actuator alone causes, with axes of six in the order of
            `JOINTS`.
    """

    worst: ToolError
    rms: ToolError
    by_actuator: ToolError


@helper
def largest_at_corners(twists: FloatArray, row: int, errors: FloatArray) -> float:
    """Return the largest |Σ ± e_i v_i| over all signs, with v_i three rows of J⁻¹ from `row`."""
    x, y, z = 0.0, 0.0, 0.0
    for i in range(6):
        x += errors[i] * twists[row, i]
        y += errors[i] * twists[row + 1, i]
        z += errors[i] * twists[row + 2, i]
    largest = x * x + y * y + z * z
    signs = 0
    for corner in range(1, CORNERS):
        # Gray code: one sign changes from a corner to the next.
        i = 0
        while corner >> i & 1 == 0:
            i += 1
        twice = 2.0 * errors[i] if signs >> i & 1 else -2.0 * errors[i]
        signs ^= 1 << i
        x += twice * twists[row, i]
        y += twice * twists[row + 1, i]
        z += twice * twists[row + 2, i]
        largest = max(largest, x * x + y * y + z * z)
    return math.sqrt(largest)


@kernel("void(f8[:,:,::1], f8[:,::1], f8[:,:,::1])")
def error_rows(twists: FloatArray, errors: FloatArray, out: FloatArray) -> None:
    """Write the errors of n poses, shape (n, 2, 8): displacement and turn.

    The eight columns are the worst, the root mean square, and those of each actuator alone.
    """
    for k in range(twists.shape[0]):
        e = errors[k % errors.shape[0]]
        if math.isinf(twists[k, 0, 0]):
            for i in range(8):
                out[k, 0, i] = math.inf
                out[k, 1, i] = math.inf
            continue
        for half in range(2):
            row = 3 * half
            total = 0.0
            for i in range(6):
                x, y, z = twists[k, row, i], twists[k, row + 1, i], twists[k, row + 2, i]
                square = e[i] * e[i] * (x * x + y * y + z * z)
                out[k, half, 2 + i] = math.sqrt(square)
                total += square
            out[k, half, 0] = largest_at_corners(twists[k], row, e)
            out[k, half, 1] = math.sqrt(total)


@kernel("void(f8[::1], f8[:,::1], f8[:,:,::1], f8[:,:,::1], f8[:,:,::1])")
def geometry_rows(
    x: FloatArray,
    position: FloatArray,
    rotation: FloatArray,
    twists: FloatArray,
    out: FloatArray,
) -> None:
    """Write −J⁻¹ ∂q/∂g of n poses, shape (n, 6, 23), infinite in singular ones."""
    dq = np.zeros((6, 23))
    for k in range(position.shape[0]):
        if math.isinf(twists[k, 0, 0]):
            for row in range(6):
                for i in range(23):
                    out[k, row, i] = math.inf
            continue
        p, r = position[k], rotation[k]
        # Legs 1 and 4: from a1 to b1 and from a3 to b4.
        for leg in range(2):
            joint = 5 * leg
            base = A3_COLUMN if leg == 1 else A1_COLUMN
            end = B_COLUMN + 9 * leg
            if leg == 0:
                cx = p[0] + x[B1X] * r[0, 0] + x[B1Y] * r[0, 1]
                cy = p[1] + x[B1X] * r[1, 0] + x[B1Y] * r[1, 1]
                cz = p[2] + x[B1X] * r[2, 0] + x[B1Y] * r[2, 1]
            else:
                cx, cy, cz = p[0] - x[A3X], p[1] - x[A3Y], p[2]
            length = math.sqrt(cx * cx + cy * cy + cz * cz)
            cx, cy, cz = cx / length, cy / length, cz / length
            dq[joint, base], dq[joint, base + 1], dq[joint, base + 2] = -cx, -cy, -cz
            for i in range(3):
                dq[joint, end + i] = cx * r[0, i] + cy * r[1, i] + cz * r[2, i]
        # Legs 2 and 3: the place along the guide, and the distance from it.
        for leg in range(2):
            joint, end = 1 + 2 * leg, B_COLUMN + 3 + 3 * leg
            b = x[B3] if leg == 1 else x[B2]
            d, cy, cz = p[0] + b * r[0, 0], p[1] + b * r[1, 0], p[2] + b * r[2, 0]
            radius = math.sqrt(cy * cy + cz * cz)
            uy, uz = cy / radius, cz / radius
            dq[joint, GUIDE_COLUMN] = -1.0
            dq[joint, TILT_COLUMN], dq[joint, TILT_COLUMN + 1] = -cz, cy
            dq[joint + 1, GUIDE_COLUMN + 1], dq[joint + 1, GUIDE_COLUMN + 2] = -uy, -uz
            dq[joint + 1, TILT_COLUMN], dq[joint + 1, TILT_COLUMN + 1] = d * uz, -d * uy
            for i in range(3):
                dq[joint, end + i] = r[0, i]
                dq[joint + 1, end + i] = uy * r[1, i] + uz * r[2, i]
        for row in range(6):
            for i in range(23):
                out[k, row, i] = 0.0
            for joint in range(6):
                share = -twists[k, row, joint]
                for i in range(23):
                    out[k, row, i] += share * dq[joint, i]


def worst_error(
    design: Design,
    position: ArrayLike,
    rotation: ArrayLike,
    errors: ArrayLike,
    tool: ArrayLike | None = None,
) -> ToolError:
    """Return the `worst` of `tool_errors` of `Configuration(design, position, rotation, tool)`."""
    return tool_errors(Configuration(design, position, rotation, tool), errors).worst


def pose_error_by_geometry(
    design: Design, position: ArrayLike, rotation: ArrayLike, tool: ArrayLike | None = None
) -> FloatArray:
    """Return `error_by_geometry` of `Configuration(design, position, rotation, tool)`."""
    return error_by_geometry(Configuration(design, position, rotation, tool))


def tool_errors(configuration: Configuration, errors: ArrayLike) -> ToolErrors:
    """Return the errors of the tool for actuator errors within ±errors.

    Args:
        configuration: Design and poses, with the tool point.
        errors: Bounds of the errors, shape (..., 6), in design units, not negative.

    Raises:
        InputError: An error is negative or not finite, or batch axes do not broadcast.
    """
    e = np.asarray(errors, dtype=np.float64)
    if e.shape[-1:] != (6,) or not (np.isfinite(e) & (e >= 0.0)).all():
        text = np.array2string(e, threshold=12).replace("\n", "")
        raise InputError(
            f"the errors of the actuators must be six finite numbers, none negative; got {text}"
        )
    c = configuration.spread(e)
    out = np.empty((len(c.positions), 2, 8))
    twists = twists_of_actuators(c).reshape(-1, 6, 6)
    error_rows(len(out), twists, c.rows_or_one(e), out)
    halves = out.reshape(*c.batch, 2, 8)
    # The root mean squares of the rows are those of errors as standard deviations.
    return ToolErrors(
        ToolError(halves[..., 0, 0], halves[..., 1, 0]),
        ToolError(UNIFORM * halves[..., 0, 1], UNIFORM * halves[..., 1, 1]),
        ToolError(halves[..., 0, 2:], halves[..., 1, 2:]),
    )


@computed_once
def error_by_geometry(configuration: Configuration) -> FloatArray:
    """Return the tool's error per error of each dimension, −J⁻¹ ∂q/∂g, shape (..., 6, 23).

    Rows are the displacement and the turn of the tool, base axes, while the actuators hold their
    values. Columns have the order of `explorer.mechanism.machine.DIMENSIONS`: a1, a3 and the
    guide's offset along base axes, the guide's tilt about y and z through a1, and b1 to b4 along
    platform axes. Offsets are in design units, tilts in radians. All entries are infinite in a
    singular pose.
    """
    c = configuration
    out = np.empty((len(c.positions), 6, len(DIMENSIONS)))
    twists = twists_of_actuators(c).reshape(-1, 6, 6)
    geometry_rows(len(out), c.variables, c.positions, c.rotations, twists, out)
    return out.reshape(*c.batch, 6, len(DIMENSIONS))


def actuator_errors(design: Design) -> FloatArray:
    """Return the largest errors of a design's actuators, shape (6,), in design units."""
    return np.array(design.actuators.error_mm) / design.unit_mm
