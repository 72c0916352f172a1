"""Errors of the tool from its 29 sources: the actuators' errors and the geometric dimensions.

The model is linear: the tool moves by J⁻¹ times the errors of the joints, and by −J⁻¹ ∂q/∂g times
the errors of the dimensions g while the actuators hold their values. The sums Σ e_i v_i for errors
e_i within ±b_i fill a zonotope, whose farthest vertex is the exact worst error.

Errors are independent, and each is uniform within ± its bound, as those of the machines that
`explorer.prototype.imperfect` draws. Root-mean-square errors are those of this model.

No source is the squareness of struts 2 and 3 to the guide: an angle ε between a strut and the plane
across the guide has the effect of an error of d1 by d2 ε, or of d3 by d4 ε. Play in the joints and
the straightness of the guide are left out, too.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from explorer.mechanism.configuration import Configuration
from explorer.mechanism.design import JOINTS, Design
from explorer.mechanism.machine import DIMENSIONS
from explorer.motion.inverse_jacobian import A3X, A3Y, B1X, B1Y, B2, B3, twists_of_actuators
from explorer.numerics.arrays import FloatArray, finite_array, for_kernel, lengths_of
from explorer.numerics.compiled import helper, kernel
from explorer.numerics.computed_once import computed_once
from explorer.numerics.zonotope import signs_of_longest_sums

# First columns of the dimensions, in the order of `DIMENSIONS`.
A1_COLUMN, A3_COLUMN, GUIDE_COLUMN, TILT_COLUMN, B_COLUMN = 0, 3, 6, 9, 11

UNIFORM = 1.0 / math.sqrt(3.0)
"""Standard deviation of an error that is uniform within ± its bound, over the bound."""

RMS_ERRORS = "independent errors, each uniform within its bounds"
"""The errors behind each root-mean-square error, in words."""

NO_SOURCES = (
    "squareness of struts 2 and 3 to the guide, play in the joints, straightness of the guide"
)
"""Errors of a machine that are no sources, in words."""

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


@kernel("void(f8[:,:,::1], f8[:,::1], f8[:,::1])")
def worst_rows(twists: FloatArray, errors: FloatArray, out: FloatArray) -> None:
    """Write the largest displacements and turns of n poses, shape (n, 2)."""
    for k in range(twists.shape[0]):
        for half in range(2):
            out[k, half] = math.inf
            if not math.isinf(twists[k, 0, 0]):
                out[k, half] = largest_at_corners(twists[k], 3 * half, errors[k % len(errors)])


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
    """Return `worst_errors` of `Configuration(design, position, rotation, tool)`."""
    return worst_errors(Configuration(design, position, rotation, tool), errors)


def pose_error_by_geometry(
    design: Design, position: ArrayLike, rotation: ArrayLike, tool: ArrayLike | None = None
) -> FloatArray:
    """Return `error_by_geometry` of `Configuration(design, position, rotation, tool)`."""
    return error_by_geometry(Configuration(design, position, rotation, tool))


def worst_errors(configuration: Configuration, errors: ArrayLike) -> ToolError:
    """Return the largest errors of the tool for actuator errors within ±errors, shape (..., 6).

    They are exact for the linear model: the largest over the 64 corners of the cube of errors.
    With six sources this is faster than `largest_error`. The errors are in design units.

    Raises:
        InputError: An error is negative or not finite, or batch axes do not broadcast.
    """
    e = finite_array("the errors of the six actuators", errors, (6,), signed=False)
    c = configuration.spread(e)
    out = np.empty((len(c.positions), 2))
    worst_rows(len(out), twists_of_actuators(c).reshape(-1, 6, 6), c.rows_or_one(e), out)
    halves = out.reshape(*c.batch, 2)
    return ToolError(halves[..., 0], halves[..., 1])


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


SOURCES = (*JOINTS, *DIMENSIONS)
"""The 29 sources of errors, in the order of every array axis of 29."""

IS_TILT = np.array(["tilt" in name for name in SOURCES])
"""Whether each source is a tilt of the guide, shape (29,)."""

UNITS = tuple("degrees" if is_tilt else "mm" for is_tilt in IS_TILT.tolist())
"""Units of the errors of the sources on a drawing."""


class LargestError(NamedTuple):
    """The largest errors of the tool for errors of the sources within their bounds.

    Displacement and turn are the largest each for itself; both are infinite in a singular pose.

    Attributes:
        displacement: Largest displacement of the tool point, shape (...), in design units.
        turn: Largest turn of the tool, shape (...), in radians.
        vectors: That displacement and that turn, base axes, shape (..., 2, 3); NaN if infinite.
        signs: Signs of the sources' errors that cause them, shape (..., 2, n); 0 for a source
            that moves nothing.
    """

    displacement: FloatArray
    turn: FloatArray
    vectors: FloatArray
    signs: FloatArray


def stated_tolerances(design: Design) -> FloatArray:
    """Return the errors of a design's actuators and its tolerances, shape (29,), as in `UNITS`."""
    return np.array([*design.actuators.error_mm, *design.tolerances.stated])


def source_errors(design: Design) -> FloatArray:
    """Return the largest errors of the sources of a design, shape (29,), in the order of `SOURCES`.

    Lengths are in design units, tilts of the guide in radians.
    """
    stated = stated_tolerances(design)
    return np.where(IS_TILT, np.radians(stated), stated / design.unit_mm)


def drawing_values(design: Design, errors: FloatArray) -> FloatArray:
    """Return errors in design units and radians, shape (29,), in the units of `UNITS`."""
    return np.where(IS_TILT, np.degrees(errors), errors * design.unit_mm)


@computed_once
def error_by_source(configuration: Configuration) -> FloatArray:
    """Return the tool's error per error of each source, J⁻¹ and −J⁻¹ ∂q/∂g, shape (..., 6, 29).

    Rows are the displacement and the turn of the tool, base axes; columns have the order of
    `SOURCES`. All entries are infinite in a singular pose.
    """
    by_joint, by_geometry = twists_of_actuators(configuration), error_by_geometry(configuration)
    return np.concatenate([by_joint, by_geometry], axis=-1)


def largest_error(by_source: FloatArray, bounds: ArrayLike) -> LargestError:
    """Return the largest errors for errors of the sources within ±bounds, shape (..., n).

    They are exact for the linear model: the largest over all combinations of signs. `by_source` has
    the errors of the tool per error of each source, shape (..., 6, n). Some of the sources alone
    are a slice of both arguments.

    Raises:
        InputError: A bound is negative or not finite.
    """
    halves = _halves(by_source, bounds)
    signs = signs_of_longest_sums(halves)
    vectors = np.einsum("...ij,...j->...i", halves, signs)
    finite = np.isfinite(vectors).all(axis=-1)
    size = np.where(finite, lengths_of(vectors), np.inf)
    vectors = np.where(finite[..., None], vectors, np.nan)
    return LargestError(size[..., 0], size[..., 1], vectors, signs)


def errors_alone(by_source: FloatArray, bounds: ArrayLike) -> ToolError:
    """Return the largest errors of the tool by each source alone, each of shape (..., n).

    The arguments and errors are those of `largest_error`.
    """
    halves = _halves(by_source, bounds)
    sizes = np.sqrt(np.einsum("...ij,...ij->...j", halves, halves))
    # A source without an error moves nothing, also in a singular pose.
    sizes = np.where(np.asarray(bounds)[..., None, :] > 0.0, sizes, 0.0)
    return ToolError(sizes[..., 0, :], sizes[..., 1, :])


def rms_of_sources(by_source: FloatArray, bounds: ArrayLike) -> ToolError:
    """Return the root-mean-square errors of the tool for errors that are uniform within ±bounds.

    The errors of the sources are independent. The arguments and errors are those of
    `largest_error`.
    """
    halves = _halves(by_source, bounds)
    size = UNIFORM * np.sqrt(np.einsum("...ij,...ij->...", halves, halves))
    size = np.where(np.isfinite(size), size, np.inf)
    return ToolError(size[..., 0], size[..., 1])


def _halves(by_source: FloatArray, bounds: ArrayLike) -> FloatArray:
    """Return displacements and turns by sources at their bounds, shape (..., 2, 3, n)."""
    limits = finite_array("the bounds of errors", bounds, (), signed=False)
    # Zero times infinity is no number, where a source has no error in a singular pose.
    with np.errstate(invalid="ignore"):
        moved = for_kernel(by_source * limits[..., None, :])
    return moved.reshape(*moved.shape[:-2], 2, 3, moved.shape[-1])
