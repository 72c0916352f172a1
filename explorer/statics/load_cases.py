"""The shares of their limits that a load asks of the parts of the machine, at one orientation.

A part has two limits: its value must not exceed the largest and not fall below the least one. The
load is held where the share s of every limit is at most 1. Each limit has a function of position
that is zero there, 1 where the share is far below zero and −1 where it is infinite:
(1 − s) / √(1 + s²). It is smooth, also towards a singular plane of the home mode, whether the share
grows there or not. Beyond the plane it is that of the nearest position on it; the plane itself is a
limit of the workspace.
"""

from __future__ import annotations

import math
from typing import TypeAlias

import numpy as np

from explorer.mechanism.design import Design
from explorer.mechanism.margins import planes_of_singularity
from explorer.motion.inverse_jacobian import B2, B3, holding_forces, is_singular
from explorer.motion.weights import payload_wrench
from explorer.numerics.arrays import BoolArray, FloatArray, IntArray, for_kernel
from explorer.numerics.compiled import helper, kernel
from explorer.numerics.vectors import norm3
from explorer.statics.reactions import part_limits

# Distance from a singular plane of a position on it, over |p|: what is below rounding at this
# distance does not grow towards the plane.
BESIDE = 1e-9
# Halvings of an edge onto the limit, and the least part of the edge from its ends, so that no two
# points coincide.
HALVINGS, LEAST_PART = 36, 1e-6
# Number of parts, see `explorer.statics.reactions.part_limits`.
PARTS = 10

# Places in the row of numbers that the kernels take, see `load_case`.
TOOL, WRENCH, FORCE, LIMITS, INWARD = 6, 9, 15, 16, 36

Forces: TypeAlias = tuple[float, float, float, float, float, float]
"""Six numbers in the order of `explorer.mechanism.design.JOINTS`."""


def load_case(
    design: Design, rotation: FloatArray, load: FloatArray, limits: FloatArray | None = None
) -> FloatArray:
    """Return what the kernels need of a design, an orientation and a load at the tool, shape (45,).

    It is the design variables, the tool from b4 along the axes of the base, the load and the
    payload's weight about b4, the force of any direction, the limits of the parts as of
    `part_limits` (those of the design if None), and the unit normals of the singular planes towards
    the home mode.
    """
    tool = rotation @ np.array(design.tool.position)
    wrench = payload_wrench(design, rotation) + load
    wrench[3:] += np.cross(tool, wrench[:3])
    planes = planes_of_singularity(rotation)
    lengths = np.linalg.norm(planes, axis=1)
    # Of parallel lines every position is singular, and δ2 has no plane.
    scale = np.array(design.home_signs) / np.where(lengths > 0.0, lengths, 1.0)
    inward = scale[:, None] * planes
    bounds = part_limits(design) if limits is None else limits
    parts = (design.variables, tool, wrench, design.payload.force_n, bounds, inward)
    return np.concatenate([np.ravel(part) for part in parts])


@helper
def forces_at(
    case: FloatArray, r: FloatArray, p: FloatArray
) -> tuple[Forces, Forces, float, float]:
    """Return what acts in a regular position: actuator forces, their spreads, d2 and d4.

    A spread is the most by which the force of any direction increases a force.
    """
    x, t, w, force = case[:TOOL], case[TOOL:WRENCH], case[WRENCH:FORCE], case[FORCE]
    f = holding_forces(x, p, r, (w[0], w[1], w[2]), (w[3], w[4], w[5]))
    e = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    if force > 0.0:
        gx = holding_forces(x, p, r, (1.0, 0.0, 0.0), (0.0, t[2], -t[1]))
        gy = holding_forces(x, p, r, (0.0, 1.0, 0.0), (-t[2], 0.0, t[0]))
        gz = holding_forces(x, p, r, (0.0, 0.0, 1.0), (t[1], -t[0], 0.0))
        e = (
            force * norm3((gx[0], gy[0], gz[0])),
            force * norm3((gx[1], gy[1], gz[1])),
            force * norm3((gx[2], gy[2], gz[2])),
            force * norm3((gx[3], gy[3], gz[3])),
            force * norm3((gx[4], gy[4], gz[4])),
            force * norm3((gx[5], gy[5], gz[5])),
        )
    d2 = norm3((0.0, p[1] + x[B2] * r[1, 0], p[2] + x[B2] * r[2, 0]))
    d4 = norm3((0.0, p[1] + x[B3] * r[1, 0], p[2] + x[B3] * r[2, 0]))
    return f, e, d2, d4


@helper
def write_shares(case: FloatArray, r: FloatArray, p: FloatArray, out: FloatArray) -> None:
    """Write the shares of all limits at a position, shape (20,), infinite if it is singular."""
    if is_singular(case[:TOOL], p, r):
        for i in range(2 * PARTS):
            out[i] = math.inf
        return
    limits = case[LIMITS:INWARD]
    f, e, d2, d4 = forces_at(case, r, p)
    values = (f[0], f[1], f[2], f[3], f[4], f[5], f[1] * d2, f[3] * d4, f[2], f[4])
    spreads = (e[0], e[1], e[2], e[3], e[4], e[5], e[1] * d2, e[3] * d4, e[2], e[4])
    for i in range(PARTS):
        out[i] = (spreads[i] + values[i]) / limits[i]
        out[PARTS + i] = (spreads[i] - values[i]) / limits[PARTS + i]


@helper
def room_of(share: float) -> float:
    """Return the function of a limit for a share of it."""
    if math.isinf(share):
        return -1.0 if share > 0.0 else 1.0
    return (1.0 - share) / math.sqrt(1.0 + share * share)


@helper
def lacking(case: FloatArray, plane: int, p: FloatArray, least: float) -> float:
    """Return what the distance of a position from a singular plane lacks of the least one."""
    at = INWARD + 3 * plane
    return least - (case[at] * p[0] + case[at + 1] * p[1] + case[at + 2] * p[2])


@helper
def move_into_mode(case: FloatArray, p: FloatArray, near: FloatArray) -> bool:
    """Write the nearest position of the home mode; return whether there is one but a1.

    It is `p` itself, or on one singular plane, or where two of them meet.
    """
    least = BESIDE * norm3((p[0], p[1], p[2]))
    lacks = (lacking(case, 0, p, least), lacking(case, 1, p, least), lacking(case, 2, p, least))
    for i in range(3):
        near[i] = p[i]
    if max(lacks[0], lacks[1], lacks[2]) <= 0.0:
        return True
    for a in range(3):
        for b in range(a, 3):
            m, n = INWARD + 3 * a, INWARD + 3 * b
            first, second = lacks[a], 0.0
            if b > a:
                cosine = case[m] * case[n] + case[m + 1] * case[n + 1] + case[m + 2] * case[n + 2]
                square = 1.0 - cosine * cosine
                if square <= BESIDE:
                    continue
                first = (lacks[a] - cosine * lacks[b]) / square
                second = (lacks[b] - cosine * lacks[a]) / square
            if first < 0.0 or second < 0.0:
                continue
            for i in range(3):
                near[i] = p[i] + first * case[m + i] + second * case[n + i]
            if (
                lacking(case, 0, near, 0.5 * least) <= 0.0
                and lacking(case, 1, near, 0.5 * least) <= 0.0
                and lacking(case, 2, near, 0.5 * least) <= 0.0
            ):
                return True
    return False


@kernel("void(f8[::1], f8[:,::1], f8[:,::1], f8[::1], i8[::1])")
def share_rows(
    case: FloatArray, r: FloatArray, positions: FloatArray, out: FloatArray, parts: IntArray
) -> None:
    """Write the largest shares of a limit at n positions, and the indices of the parts."""
    shares = np.empty(2 * PARTS)
    for k in range(positions.shape[0]):
        write_shares(case, r, positions[k], shares)
        out[k], parts[k] = 0.0, 0
        for i in range(2 * PARTS):
            if shares[i] > out[k]:
                out[k], parts[k] = shares[i], i % PARTS


@kernel("void(f8[::1], f8[:,::1], i8[::1], f8[:,::1], f8[:,::1])")
def value_rows(
    case: FloatArray, r: FloatArray, limits: IntArray, positions: FloatArray, out: FloatArray
) -> None:
    """Write the functions of m limits at n positions, shape (m, n)."""
    near, shares = np.empty(3), np.empty(2 * PARTS)
    for k in range(positions.shape[0]):
        if move_into_mode(case, positions[k], near):
            write_shares(case, r, near, shares)
        else:
            shares[:] = math.inf
        for i in range(limits.shape[0]):
            out[i, k] = room_of(shares[int(limits[i])])


def largest_shares(
    case: FloatArray, rotation: FloatArray, positions: FloatArray
) -> tuple[FloatArray, IntArray]:
    """Return the largest shares of a limit at positions (n, 3), and the parts, shape (n,) each.

    Shares are infinite if singular; if the limits of the `load_case` are 1, a share is the value
    itself. The parts are indices of those of `explorer.statics.reactions.part_limits`.
    """
    out, parts = np.empty(len(positions)), np.empty(len(positions), dtype=np.int64)
    share_rows(len(positions), case, for_kernel(rotation), for_kernel(positions), out, parts)
    return out, parts


def limit_values(
    case: FloatArray, rotation: FloatArray, limits: IntArray, positions: FloatArray
) -> FloatArray:
    """Return the functions of m limits at positions (n, 3), shape (m, n).

    A limit is the index of its part, plus 10 for the least value.
    """
    out = np.empty((len(limits), len(positions)))
    rows = for_kernel(rotation), limits, for_kernel(positions), out
    value_rows(len(positions), case, *rows)
    return out


def settle_on_limit(
    case: FloatArray,
    rotation: FloatArray,
    limit: int,
    points: FloatArray,
    beside: FloatArray,
    step: FloatArray,
) -> FloatArray:
    """Return points on a limit, as of `limit_values`, near points (n, 3), shape (n, 3).

    Each point lies on an edge of a grid whose cells have a size on each axis, the step, shape (3,),
    and has the node at the end of its edge that keeps the limit beside it, shape (n, 3). It moves
    along the edge, or stays if the other end keeps the limit too, or none does.
    """
    way, limits = points - beside, np.array([limit], dtype=np.int64)
    parts = np.divide(step, np.abs(way), out=np.full(way.shape, np.inf), where=way != 0.0)
    edges = parts.min(axis=1)[:, None] * way

    def keeps(share: FloatArray) -> BoolArray:
        at = beside + share[:, None] * edges
        return np.asarray(limit_values(case, rotation, limits, at)[0] > 0.0)

    low, high = np.zeros(len(points)), np.ones(len(points))
    crosses = keeps(low) & ~keeps(high)
    for _ in range(HALVINGS):
        middle = 0.5 * (low + high)
        is_kept = keeps(middle)
        low, high = np.where(is_kept, middle, low), np.where(is_kept, high, middle)
    share = np.clip(low, LEAST_PART, 1.0 - LEAST_PART)[:, None]
    return np.where(crosses[:, None], beside + share * edges, points)
