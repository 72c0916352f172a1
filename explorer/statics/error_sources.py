"""Errors of the tool from all 29 sources: the errors of the actuators and of the dimensions.

The model is linear, see `explorer.statics.accuracy`: the tool moves by Σ e_i v_i for errors e_i
within ±b_i. All such sums fill a zonotope, whose farthest vertex is the exact worst error.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from explorer.errors import InputError
from explorer.mechanism.configuration import Configuration, computed_once
from explorer.mechanism.design import JOINTS, Design
from explorer.mechanism.machine import DIMENSIONS
from explorer.numerics.arrays import FloatArray, for_kernel, lengths_of
from explorer.numerics.compiled import helper, kernel
from explorer.numerics.vectors import Vector, along, cross3, dot3, vector
from explorer.statics.accuracy import (
    UNIFORM,
    ToolError,
    actuator_errors,
    error_by_geometry,
)
from explorer.statics.equilibrium import twists_of_actuators

SOURCES = (*JOINTS, *DIMENSIONS)
"""The 29 sources of errors, in the order of every array axis of 29."""

IS_TILT = np.array(["tilt" in name for name in SOURCES])
"""Whether each source is a tilt of the guide, shape (29,)."""

UNITS = tuple("degrees" if is_tilt else "mm" for is_tilt in IS_TILT.tolist())
"""Units of the errors of the sources on a drawing."""

# Sine of the angle up to which vectors count as parallel or in one plane. In the farthest sum S
# each vector w has w · S ≥ |w|², so that the wrong sign of one within this angle of the plane
# across S changes |S| by less than this share squared, which is rounding.
FLAT = 1e-8


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


@helper
def toward(total: Vector, side: float, w: Vector) -> Vector:
    """Return the total plus w where `side` is positive, and minus w elsewhere."""
    return along(total, 1.0 if side > 0.0 else -1.0, w)


@helper
def merge_parallel(columns: FloatArray, scale: float, w: FloatArray, u: FloatArray) -> int:
    """Write vectors of which no two are parallel, and unit vectors along them; return their number.

    Args:
        columns: Vectors to merge, shape (3, m).
        scale: Size that vectors are divided by.
        w: Result, shape (m, 3): sums of parallel vectors that point to one side.
        u: Result, shape (m, 3).
    """
    count = 0
    for k in range(columns.shape[1]):
        v = (columns[0, k] / scale, columns[1, k] / scale, columns[2, k] / scale)
        length = math.sqrt(dot3(v, v))
        if length == 0.0:
            continue
        unit = (v[0] / length, v[1] / length, v[2] / length)
        i = 0
        while i < count:
            across = cross3(unit, vector(u, i))
            if dot3(across, across) <= FLAT * FLAT:
                break
            i += 1
        if i == count:
            count += 1
            u[i, 0], u[i, 1], u[i, 2] = unit
            w[i, 0], w[i, 1], w[i, 2] = v
        else:
            w[i, 0], w[i, 1], w[i, 2] = toward(vector(w, i), dot3(unit, vector(u, i)), v)
    return count


@helper
def longest_sum(w: FloatArray, u: FloatArray, count: int) -> Vector:
    """Return the longest sum Σ ± w_i of vectors of which no two are parallel.

    It is a vertex of the zonotope, which is the farthest one in a cone of directions. An edge n of
    that cone is perpendicular to two vectors i and j. Vectors out of the plane of i and j have
    the sign of their product with n; those in it have that with the normal of i in the plane, and i
    has both. The vectors of a plane span a polygon with i along one of its edges; every corner of
    it ends an edge of another vector too, so that pairs with i < j suffice.
    """
    longest, most = vector(w, 0), 0.0
    for i in range(count):
        for j in range(i + 1, count):
            normal = cross3(vector(u, i), vector(u, j))
            flat = FLAT * math.sqrt(dot3(normal, normal))
            inner = cross3(normal, vector(u, i))
            out, within = (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)
            for k in range(count):
                if k != i:
                    side = dot3(normal, vector(u, k))
                    if abs(side) > flat:
                        out = toward(out, side, vector(w, k))
                    else:
                        within = toward(within, dot3(inner, vector(u, k)), vector(w, k))
            for corner in range(4):
                total = toward(out, 0.5 - (corner & 1), within)
                total = toward(total, 1.0 - (corner & 2), vector(w, i))
                square = dot3(total, total)
                if square > most:
                    longest, most = total, square
    return longest


@kernel("void(f8[:,:,::1], f8[:,::1])")
def farthest_rows(vectors: FloatArray, signs: FloatArray) -> None:
    """Write the signs of the longest sum Σ ± w_i for each of n sets of vectors.

    Args:
        vectors: Columns w_i, shape (n, 3, m).
        signs: Result, shape (n, m): 1 or -1; 0 for a zero vector, and for all vectors of a set of
            which one is not finite.
    """
    m = vectors.shape[2]
    w, u = np.zeros((m, 3)), np.zeros((m, 3))
    for n in range(vectors.shape[0]):
        scale, finite = 0.0, True
        for k in range(m):
            signs[n, k] = 0.0
            for axis in range(3):
                size = abs(vectors[n, axis, k])
                scale, finite = max(scale, size), finite and math.isfinite(size)
        if scale == 0.0 or not finite:
            continue
        total = longest_sum(w, u, merge_parallel(vectors[n], scale, w, u))
        # Every vector of the longest sum points to its side.
        for k in range(m):
            v = (vectors[n, 0, k] / scale, vectors[n, 1, k] / scale, vectors[n, 2, k] / scale)
            side = dot3(total, v)
            if side != 0.0:
                signs[n, k] = 1.0 if side > 0.0 else -1.0


def source_errors(design: Design) -> FloatArray:
    """Return the largest errors of the sources of a design, shape (29,).

    They have the order of `SOURCES`: the errors of the actuators, then the tolerances of the
    dimensions. Lengths are in design units, tilts of the guide in radians.
    """
    return np.concatenate([actuator_errors(design), design.tolerances.values(design.unit_mm)])


def drawing_values(design: Design, errors: FloatArray) -> FloatArray:
    """Return errors of the sources, shape (29,), in the units of `UNITS`.

    Args:
        design: The manipulator.
        errors: Errors in design units and radians, shape (29,).
    """
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
    """Return the largest errors for errors of the sources within ±bounds.

    They are exact for the linear model: the largest over all combinations of signs. Some of the
    sources alone are a slice of both arguments.

    Args:
        by_source: Errors of the tool per error of each source, shape (..., 6, n).
        bounds: Bounds of the sources' errors, shape (..., n), not negative.

    Raises:
        InputError: A bound is negative or not finite.
    """
    limits = _checked(bounds)
    # A product that overflows, and zero times infinity, make the error infinite.
    with np.errstate(over="ignore", invalid="ignore"):
        moved = for_kernel(by_source * limits[..., None, :])
        halves = moved.reshape(*moved.shape[:-2], 2, 3, moved.shape[-1])
        signs = np.empty((*halves.shape[:-2], halves.shape[-1]))
        count = math.prod(signs.shape[:-1])
        farthest_rows(
            count, halves.reshape(count, *halves.shape[-2:]), signs.reshape(count, signs.shape[-1])
        )
        vectors = np.einsum("...ij,...j->...i", halves, signs)
        size = lengths_of(vectors)
    finite = np.isfinite(size)
    size = np.where(finite, size, np.inf)
    vectors = np.where(finite[..., None], vectors, np.nan)
    return LargestError(size[..., 0], size[..., 1], vectors, signs)


def errors_alone(by_source: FloatArray, bounds: ArrayLike) -> ToolError:
    """Return the largest errors of the tool by each source alone, each of shape (..., n).

    Args:
        by_source: Errors of the tool per error of each source, shape (..., 6, n).
        bounds: Bounds of the sources' errors, shape (..., n), not negative.

    Raises:
        InputError: A bound is negative or not finite.
    """
    limits = _checked(bounds)[..., None, :]
    # A source without an error moves nothing, also in a singular pose.
    with np.errstate(over="ignore", invalid="ignore"):
        moved = np.where(limits > 0.0, by_source * limits, 0.0)
        halves = moved.reshape(*moved.shape[:-2], 2, 3, moved.shape[-1])
        sizes = np.sqrt(np.einsum("...ij,...ij->...j", halves, halves))
    return ToolError(sizes[..., 0, :], sizes[..., 1, :])


def rms_of_sources(by_source: FloatArray, bounds: ArrayLike) -> ToolError:
    """Return the root-mean-square errors of the tool for errors that are uniform within ±bounds.

    The errors of the sources are independent.

    Args:
        by_source: Errors of the tool per error of each source, shape (..., 6, n).
        bounds: Bounds of the sources' errors, shape (..., n), not negative.

    Raises:
        InputError: A bound is negative or not finite.
    """
    limits = UNIFORM * _checked(bounds)
    with np.errstate(over="ignore", invalid="ignore"):
        moved = by_source * limits[..., None, :]
        halves = moved.reshape(*moved.shape[:-2], 2, -1)
        size = np.sqrt(np.einsum("...i,...i->...", halves, halves))
    size = np.where(np.isfinite(size), size, np.inf)
    return ToolError(size[..., 0], size[..., 1])


def _checked(bounds: ArrayLike) -> FloatArray:
    limits = np.asarray(bounds, dtype=np.float64)
    if not (np.isfinite(limits) & (limits >= 0.0)).all():
        text = np.array2string(limits, threshold=12).replace("\n", "")
        raise InputError(f"the bounds of errors must be finite numbers, none negative; got {text}")
    return limits
