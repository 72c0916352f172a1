"""Errors of the tool from its 31 sources: the actuators' errors and the geometric dimensions.

The model is linear: the tool moves by J⁻¹ times the errors of the joints, and by −J⁻¹ ∂q/∂g times
the errors of the dimensions g while the actuators hold their values. The sums Σ e_i v_i for errors
e_i within ±b_i fill a zonotope, whose farthest vertex is the exact worst error.

Errors are independent, and each is uniform within ± its bound, as those of the machines that
`explorer.prototype.imperfect` draws. Root-mean-square errors are those of this model.

A strut that leans along the guide by an angle ε has the effect of an error of d1 by −d2 ε, or of d3
by −d4 ε. Play in the joints and the straightness of the guide are no sources.
"""

from __future__ import annotations

import itertools
import math
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from explorer.mechanism.configuration import Configuration
from explorer.mechanism.design import JOINTS, Design
from explorer.mechanism.machine import A1, A3, DIMENSIONS, GUIDE, PLATFORM, STRUTS, TILT
from explorer.motion.inverse_jacobian import twists_of_actuators
from explorer.numerics.arrays import FloatArray, finite_array, for_kernel, lengths_of, rotate
from explorer.numerics.computed_once import computed_once
from explorer.numerics.zonotope import signs_of_longest_sums

UNIFORM = 1.0 / math.sqrt(3.0)
"""Standard deviation of an error that is uniform within ± its bound, over the bound."""

RMS_ERRORS = "independent errors, each uniform within its bounds"
"""The errors behind each root-mean-square error, in words."""

NO_SOURCES = "play in the joints, straightness of the guide"
"""Errors of a machine that are no sources, in words."""

# Signs of the actuators' errors at the corners of their cube, up to a common sign, shape (6, 32),
# and number of poses at whose corners errors are computed at once.
CORNERS = np.array([(1.0, *corner) for corner in itertools.product((1.0, -1.0), repeat=5)]).T
BATCH = 1024


class ToolError(NamedTuple):
    """An error of the tool; infinite in a singular pose.

    Attributes:
        displacement: Displacement of the tool point, shape (...), in design units.
        turn: Turn of the tool, shape (...), in radians.
    """

    displacement: FloatArray
    turn: FloatArray


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
    """Return the tool's error per error of each point and of the guide, shape (..., 6, 23).

    These are the first columns of `error_by_geometry` of `Configuration(design, position, rotation,
    tool)`; the two others are those of the struts.
    """
    by_geometry = error_by_geometry(Configuration(design, position, rotation, tool))
    return by_geometry[..., : STRUTS.start]


def worst_errors(configuration: Configuration, errors: ArrayLike) -> ToolError:
    """Return the largest errors of the tool for actuator errors within ±errors, shape (..., 6).

    They are exact for the linear model: the largest over the 64 corners of the cube of errors.
    With six sources this is faster than `largest_error`. The errors are in design units.

    Raises:
        InputError: An error is negative or not finite, or batch axes do not broadcast.
    """
    e = finite_array("the errors of the six actuators", errors, (6,), signed=False)
    c = configuration.spread(e)
    twists = twists_of_actuators(c)
    regular = np.isfinite(twists[..., :1, 0])
    moved = (np.where(regular[..., None], twists, 0.0) * e[..., None, :]).reshape(-1, 6, 6)
    squares = np.empty((len(moved), 2))
    for start in range(0, len(moved), BATCH):
        x, y, z = np.moveaxis((moved[start : start + BATCH] @ CORNERS).reshape(-1, 2, 3, 32), 2, 0)
        squares[start : start + BATCH] = (x * x + y * y + z * z).max(axis=-1)
    largest = np.where(regular, np.sqrt(squares).reshape(*c.batch, 2), np.inf)
    return ToolError(largest[..., 0], largest[..., 1])


@computed_once
def error_by_geometry(configuration: Configuration) -> FloatArray:
    """Return the tool's error per error of each dimension, −J⁻¹ ∂q/∂g, shape (..., 6, 25).

    Rows are the displacement and the turn of the tool, base axes, while the actuators hold their
    values. Columns have the order of `explorer.mechanism.machine.DIMENSIONS`, points of the base
    and the guide along base axes, b1 to b4 along platform axes; offsets are in design units, tilts
    in radians. All entries are infinite in a singular pose.
    """
    c, twists = configuration, twists_of_actuators(configuration)
    rows, b = c.jacobian[..., :3], c.points
    # Slopes of the joints, whose rows of J are along their legs or the guide.
    slopes = np.zeros((*c.batch, 6, len(DIMENSIONS)))
    slopes[..., 0, A1], slopes[..., 5, A3] = -rows[..., 0, :], -rows[..., 5, :]
    for joint, point in enumerate((0, 1, 1, 2, 2, 3)):
        end = PLATFORM.start + 3 * point
        slopes[..., joint, end : end + 3] = rotate(
            np.swapaxes(c.rotation, -1, -2), rows[..., joint, :]
        )
    for strut, (first, end) in enumerate(((1, b.b2), (3, b.b3))):
        pair = slice(first, first + 2)
        slopes[..., pair, GUIDE] = -rows[..., pair, :]
        slopes[..., pair, TILT] = np.cross(rows[..., pair, :], end[..., None, :])[..., 1:]
        slopes[..., first, STRUTS.start + strut] = -c.leg_lengths[..., 1 + strut]
    singular = np.isinf(twists[..., :1, :1])
    return np.where(singular, np.inf, -np.where(singular, 0.0, twists) @ slopes)


def actuator_errors(design: Design) -> FloatArray:
    """Return the largest errors of a design's actuators, shape (6,), in design units."""
    return np.array(design.actuators.error_mm) / design.unit_mm


SOURCES = (*JOINTS, *DIMENSIONS)
"""The 31 sources of errors, in the order of every array axis of 31."""

IS_TILT = np.array(["tilt" in name for name in SOURCES])
"""Whether each source is a tilt of the guide or a strut, shape (31,)."""

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
    """Return the errors of a design's actuators and its tolerances, shape (31,), as in `UNITS`."""
    return np.array([*design.actuators.error_mm, *design.tolerances.stated])


def source_errors(design: Design) -> FloatArray:
    """Return the largest errors of the sources of a design, (31,), in design units and radians."""
    return from_drawing_values(design, stated_tolerances(design))


def from_drawing_values(design: Design, values: FloatArray) -> FloatArray:
    """Return errors in the units of `UNITS`, shape (31,), in design units and radians."""
    return np.where(IS_TILT, np.radians(values), values / design.unit_mm)


def drawing_values(design: Design, errors: FloatArray) -> FloatArray:
    """Return errors in design units and radians, shape (31,), in the units of `UNITS`."""
    return np.where(IS_TILT, np.degrees(errors), errors * design.unit_mm)


@computed_once
def error_by_source(configuration: Configuration) -> FloatArray:
    """Return the tool's error per error of each source, J⁻¹ and −J⁻¹ ∂q/∂g, shape (..., 6, 31).

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
