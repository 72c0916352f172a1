"""Compliance of the tool: how far a load moves it, and what gives way.

C = J⁻¹ diag(c) J⁻ᵀ with c = 1 / k for each actuator. The struts of legs 2 and 3 are cantilevers on
their carriages: they add d2³ / 3EI to c(d1) and d4³ / 3EI to c(d3). All else is rigid, see `RIGID`;
what rods and joints give along a leg can be part of its actuator's stiffness. The model is linear
about the unloaded pose and has no preload terms, which matter only if forces approach stiffness ×
length.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from explorer.mechanism.configuration import Configuration
from explorer.mechanism.design import GUIDE_ROWS, LENGTH_ROWS, STRUT_ROWS, Design
from explorer.mechanism.machine import or_infinite
from explorer.motion.inverse_jacobian import B2, B3, load_array, twists_of_actuators
from explorer.numerics.arrays import FloatArray, finite_array, lengths_of, positive_array
from explorer.numerics.compiled import helper, kernel

RIGID = "joints, carriages, guide, platform and base"
"""The definition of rigid, in words."""

# Number of halvings, of the logarithm where it can be, that find the worst force to rounding.
HALVINGS = 70


class PrincipalCompliances(NamedTuple):
    """The principal values and directions of a compliance, from the softest to the stiffest.

    Attributes:
        displacement: Displacement per force, shape (..., 3), in design units per newton.
        force_directions: Unit vectors, base axes, as rows, shape (..., 3, 3).
        turn: Turn per moment, shape (..., 3), in radians per (N × unit).
        moment_directions: Unit vectors, base axes, as rows, shape (..., 3, 3).
    """

    displacement: FloatArray
    force_directions: FloatArray
    turn: FloatArray
    moment_directions: FloatArray


class ComplianceShares(NamedTuple):
    """Parts of the work that a load does on what gives way, each from 0 to 1, shape (...).

    They are that of the actuators d1 and d3, which hold the carriages (guide), of the bending of
    struts 2 and 3, and of the actuators l1, d2, d4 and l4.
    """

    guide: FloatArray
    struts: FloatArray
    actuators: FloatArray


@helper
def strut_length(x: FloatArray, which: int, p: FloatArray, r: FloatArray) -> float:
    """Return d2 or d4, given the column of b2 or b3 in the design variables."""
    y, z = p[1] + x[which] * r[1, 0], p[2] + x[which] * r[2, 0]
    return math.sqrt(y * y + z * z)


@kernel("void(f8[::1], f8[:,::1], f8[:,:,::1], f8[:,:,::1], f8[:,::1], f8[:,::1], f8[:,:,::1])")
def compliance_rows(
    x: FloatArray,
    position: FloatArray,
    rotation: FloatArray,
    twists: FloatArray,
    softness: FloatArray,
    bending: FloatArray,
    out: FloatArray,
) -> None:
    """Write the compliance of n poses, infinite in singular ones.

    Twists are J⁻¹; softness is 1 / k, shape (n or 1, 6), and bending 1 / 3EI of both struts, shape
    (n or 1, 2).
    """
    c = np.zeros(6)
    for k in range(position.shape[0]):
        for i in range(6):
            c[i] = softness[k % softness.shape[0], i]
        b = bending[k % bending.shape[0]]
        c[1] += b[0] * strut_length(x, B2, position[k], rotation[k]) ** 3
        c[3] += b[1] * strut_length(x, B3, position[k], rotation[k]) ** 3
        singular = math.isinf(twists[k, 0, 0])
        for i in range(6):
            for j in range(i + 1):
                total = 0.0
                for q in range(6):
                    total += twists[k, i, q] * c[q] * twists[k, j, q] if not singular else math.inf
                out[k, i, j] = total
                out[k, j, i] = total


def compliance(
    design: Design,
    position: ArrayLike,
    rotation: ArrayLike,
    stiffness: ArrayLike,
    bending_stiffness: ArrayLike | None = None,
    tool: ArrayLike | None = None,
) -> FloatArray:
    """Return `compliance_of` of `Configuration(design, position, rotation, tool)`."""
    configuration = Configuration(design, position, rotation, tool)
    return compliance_of(configuration, stiffness, bending_stiffness)


def compliance_of(
    configuration: Configuration, stiffness: ArrayLike, bending_stiffness: ArrayLike | None = None
) -> FloatArray:
    """Return the compliance C at the tool, shape (..., 6, 6): (displacement; turn) = C (F; M).

    Axes are those of the base. The blocks are in units/N, 1/N and rad/(N × unit). All entries are
    infinite in a singular pose. The stiffness of the actuators, shape (..., 6), is in N/unit, and
    EI of struts 2 and 3, shape (..., 2), in N × unit²; they are infinite, or None, where rigid.

    Raises:
        InputError: A stiffness is not positive, or batch axes do not broadcast.
    """
    soft, bending = _softness(stiffness, bending_stiffness)
    c = configuration.spread(soft, bending)
    out = np.empty((len(c.positions), 6, 6))
    compliance_rows(
        len(out),
        c.variables,
        c.positions,
        c.rotations,
        twists_of_actuators(c).reshape(-1, 6, 6),
        c.rows_or_one(soft),
        c.rows_or_one(bending),
        out,
    )
    return out.reshape(*c.batch, 6, 6)


def stiffness_of(design: Design) -> tuple[FloatArray, FloatArray]:
    """Return the stiffness of a design's actuators and the bending stiffness of its struts.

    Shapes are (6,) in N/unit and (2,) in N × unit²; infinite where the design states none.
    """
    stiffness = design.unit_mm * or_infinite(design.actuators.stiffness_n_mm)
    return stiffness, np.full(2, design.struts.bending_stiffness / design.unit_mm**2)


def softness_with_struts(design: Design, struts: FloatArray) -> FloatArray:
    """Return the softness of a design's actuators, in units/N, shape (..., 6).

    That of the guide's contains the bending of struts of lengths d2 and d4, shape (..., 2).
    """
    stiffness, bending = stiffness_of(design)
    softness = np.zeros((*struts.shape[:-1], 6)) + 1.0 / stiffness
    softness[..., GUIDE_ROWS] += struts**3 / (3.0 * bending)
    return softness


def is_elastic(design: Design) -> bool:
    """Return whether a design states the stiffness of its actuators or the tubes of its struts."""
    return design.actuators.stiffness_n_mm is not None or design.struts.outer_mm is not None


def deflection(compliance: FloatArray, load: ArrayLike) -> FloatArray:
    """Return the displacement and the turn (v; ω) of the tool under a load, shape (..., 6).

    They are in design units and radians along the axes of the base, infinite in a singular pose.
    The compliance, (..., 6, 6), and the load (F; M), (..., 6), in N and N × unit, are at the tool.

    Raises:
        InputError: The load is not finite.
    """
    w = load_array(load)
    regular = np.isfinite(compliance[..., 0, 0])
    finite = np.where(regular[..., None, None], compliance, 0.0)
    moved = np.einsum("...ij,...j->...i", finite, w)
    return np.where(regular[..., None], moved, np.inf)


def largest_deflection(
    compliance: FloatArray, load: ArrayLike, force: ArrayLike
) -> tuple[FloatArray, FloatArray]:
    """Return the largest displacement of the tool under a load and a force of any direction.

    The force, of a size in N of shape (...), adds to the load at the tool. The tool moves on an
    ellipsoid, whose farthest point from zero is the root of one equation, as in a trust region. The
    results are that displacement, shape (...), and the force that causes it, base axes, shape
    (..., 3); both are infinite in a singular pose.

    Raises:
        InputError: The load or the force is not finite, or the force is negative.
    """
    moved = deflection(compliance, load)[..., :3]
    most = finite_array("the force of any direction", force, (), signed=False)
    regular = np.isfinite(compliance[..., 0, 0]) & np.isfinite(moved).all(axis=-1)
    block = np.where(regular[..., None, None], compliance[..., :3, :3], 0.0)
    soft, axes = np.linalg.eigh(block)
    along = np.einsum("...ji,...j->...i", axes, np.where(regular[..., None], moved, 0.0))
    soft = np.where(regular[..., None], np.maximum(soft, 0.0), 0.0)
    direction = _farthest_direction(soft, along, most)
    farthest = lengths_of(soft * (most[..., None] * direction) + along)
    pushed = most[..., None] * np.einsum("...ij,...j->...i", axes, direction)
    return np.where(regular, farthest, np.inf), np.where(regular[..., None], pushed, np.inf)


def _farthest_direction(soft: FloatArray, along: FloatArray, most: FloatArray) -> FloatArray:
    """Return the unit u for which Σ (s_i F u_i + g_i)² is largest, shape (..., 3).

    The s_i ascend to s = 1 and the largest of |g_i| and F is 1, after both are divided by a size
    each. For the largest sum s_i (s_i F u_i + g_i) = (F s² + n) u_i with n ≥ 0, so that
    u_i = s_i g_i / (F (s² − s_i²) + n). The length of u falls with n, which bounds n on both
    sides: all s_i² count as s², or only the last part of u does.
    """
    softest = np.where(soft[..., -1:] > 0.0, soft[..., -1:], 1.0)
    s = soft / softest
    size = np.maximum(np.abs(along).max(axis=-1, keepdims=True), softest * most[..., None])
    size = np.where(size > 0.0, size, 1.0)
    g, force = along / size, softest * most[..., None] / size
    pull = s * g
    gaps = force * (1.0 - s**2)
    low: FloatArray = np.abs(pull[..., -1])
    high: FloatArray = np.linalg.norm(pull, axis=-1)
    for _ in range(HALVINGS):
        middle: FloatArray = np.where(low > 0.0, np.sqrt(low) * np.sqrt(high), 0.5 * high)
        is_long = (_over(pull, gaps + middle[..., None]) ** 2).sum(axis=-1) > 1.0
        low, high = np.where(is_long, middle, low), np.where(is_long, high, middle)
    direction = _over(pull, gaps + high[..., None])
    # The softest direction takes what is left: all of it where nothing pulls along it.
    rest = 1.0 - (direction[..., :-1] ** 2).sum(axis=-1)
    direction[..., -1] = np.sqrt(np.maximum(rest, 0.0)) * np.where(along[..., -1] < 0.0, -1.0, 1.0)
    return direction


def _over(pull: FloatArray, divisor: FloatArray) -> FloatArray:
    return np.divide(pull, divisor, out=np.zeros(divisor.shape), where=pull != 0.0)


def principal_compliances(compliance: FloatArray) -> PrincipalCompliances:
    """Return the six principal directions of a compliance C, three of forces and three of moments.

    In a singular pose the values are infinite and the directions NaN.
    """
    displacement, forces = _principal(compliance[..., :3, :3])
    turn, moments = _principal(compliance[..., 3:, 3:])
    return PrincipalCompliances(displacement, forces, turn, moments)


def _principal(block: FloatArray) -> tuple[FloatArray, FloatArray]:
    regular = np.asarray(np.isfinite(block).all(axis=(-1, -2)))[..., None]
    finite = np.where(regular[..., None], block, 0.0)
    values, vectors = np.linalg.eigh(finite)
    values = np.where(regular, values[..., ::-1], np.inf)
    rows = np.swapaxes(vectors[..., ::-1], -1, -2)
    return values, np.where(regular[..., None], rows, np.nan)


def compliance_shares(
    configuration: Configuration,
    load: ArrayLike,
    stiffness: ArrayLike,
    bending_stiffness: ArrayLike | None = None,
) -> ComplianceShares:
    """Return which parts of the deflection's work guide, struts and actuators take.

    The shares add up to 1; they are NaN where nothing gives way, and in singular poses. Stiffnesses
    are those of `compliance_of`, and the load acts at the tool.

    Raises:
        InputError: A stiffness is not positive, the load is not finite, or batch axes do not
            broadcast.
    """
    w = load_array(load)
    soft, bending = _softness(stiffness, bending_stiffness)
    poses = configuration.spread(w, soft, bending)
    twists = twists_of_actuators(poses).reshape(-1, 6, 6)
    regular = np.isfinite(twists[:, 0, 0])
    forces = np.einsum("nji,nj->ni", np.where(regular[:, None, None], twists, 0.0), poses.rows(w))
    lengths = poses.joints[..., STRUT_ROWS].reshape(-1, 2)
    work = forces**2 * poses.rows(soft)
    bent = (forces[:, GUIDE_ROWS] ** 2 * poses.rows(bending) * lengths**3).sum(axis=1)
    guide, actuators = work[:, GUIDE_ROWS].sum(axis=1), work[:, LENGTH_ROWS].sum(axis=1)
    total: FloatArray = guide + actuators + bent
    parts = [
        np.divide(part, total, out=np.full(total.shape, np.nan), where=total > 0.0)
        for part in (guide, bent, actuators)
    ]
    return ComplianceShares(*(part.reshape(poses.batch) for part in parts))


def _softness(
    stiffness: ArrayLike, bending_stiffness: ArrayLike | None
) -> tuple[FloatArray, FloatArray]:
    """Return 1 / k, shape (..., 6), and 1 / 3EI, shape (..., 2)."""
    k = positive_array("the stiffness of the actuators", stiffness, 6)
    if bending_stiffness is None:
        return 1.0 / k, np.zeros(2)
    return 1.0 / k, 1.0 / (3.0 * positive_array("the bending stiffness", bending_stiffness, 2))
