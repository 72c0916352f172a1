"""The largest share of a limit that a load uses at positions of one orientation.

Where the load is held, this share s is at most 1. A function that is zero at this limit tells it:
1 / s − 1. Towards a singular plane s grows beyond all bounds, and the function falls linearly to
−1; beyond the plane it goes on falling, so that it has no fold there. It is bounded above, where
nothing loads a part.
"""

from __future__ import annotations

import math

import numpy as np

from explorer.mechanism.design import Design
from explorer.mechanism.home import home_pose
from explorer.numerics.arrays import FloatArray, IntArray, for_kernel
from explorer.numerics.compiled import helper, kernel
from explorer.statics.equilibrium import B2, B3, holding_forces, is_singular
from explorer.statics.reactions import part_limits
from explorer.statics.weights import payload_wrench

# Largest value of the function, where shares are below 1 / (1 + HIGHEST).
HIGHEST = 2.0
# Newton steps onto the limit, halvings where they fail, and the step of differences over |p|.
STEPS, HALVINGS, DIFFERENCE = 8, 40, 1e-6
# Largest step and largest move, in cells, and the size of the function on the limit.
STEP_OF_CELL, MOST_OF_CELL, ON_LIMIT = 0.5, 1.0, 1e-9
# Number of parts, see `explorer.statics.reactions.part_limits`.
PARTS = 10


# Places in the row of numbers that the kernels take, see `held_load`.
TOOL, WRENCH, FORCE, LIMITS, SIGNS, END = 6, 9, 15, 16, 36, 39


def held_load(
    design: Design, rotation: FloatArray, load: FloatArray, limits: FloatArray | None = None
) -> FloatArray:
    """Return what the kernels need of a design, an orientation and a load, shape (39,).

    It is the design variables, the tool from b4 along the axes of the base, the load
    about b4, the force of any direction, the limits of the parts, and the signs of z_R · p, δ2 and
    δ3 at home.

    Args:
        design: The manipulator, with its payload and limits.
        rotation: Platform to base, shape (3, 3).
        load: (F; M) at the tool besides the payload, base axes, shape (6,), in N and N × unit.
        limits: Limits as of `part_limits`, shape (2, 10); those of the design if None.
    """
    tool = rotation @ np.array(design.tool.position)
    wrench = payload_wrench(design, rotation) + load
    wrench[3:] += np.cross(tool, wrench[:3])
    home = np.array(home_pose(design).position)
    delta2 = rotation[1, 0] * home[2] - rotation[2, 0] * home[1]
    signs = np.sign([rotation[:, 2] @ home, delta2, home[2]])
    bounds = part_limits(design) if limits is None else limits
    parts = (design.variables, tool, wrench, design.payload.force_n, bounds, signs)
    return np.concatenate([np.ravel(part) for part in parts])


@helper
def share_at(held: FloatArray, r: FloatArray, p: FloatArray) -> tuple[float, int]:
    """Return the largest share of a limit at a position, infinite if singular, and its part."""
    x = held[:TOOL]
    if is_singular(x, p, r):
        return math.inf, 0
    t, w = held[TOOL:WRENCH], held[WRENCH:FORCE]
    force, limits = held[FORCE], held[LIMITS:SIGNS]
    f = holding_forces(x, p, r, (w[0], w[1], w[2]), (w[3], w[4], w[5]))
    e = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    if force > 0.0:
        gx = holding_forces(x, p, r, (1.0, 0.0, 0.0), (0.0, t[2], -t[1]))
        gy = holding_forces(x, p, r, (0.0, 1.0, 0.0), (-t[2], 0.0, t[0]))
        gz = holding_forces(x, p, r, (0.0, 0.0, 1.0), (t[1], -t[0], 0.0))
        e = (
            force * length(gx[0], gy[0], gz[0]),
            force * length(gx[1], gy[1], gz[1]),
            force * length(gx[2], gy[2], gz[2]),
            force * length(gx[3], gy[3], gz[3]),
            force * length(gx[4], gy[4], gz[4]),
            force * length(gx[5], gy[5], gz[5]),
        )
    d2 = length(0.0, p[1] + x[B2] * r[1, 0], p[2] + x[B2] * r[2, 0])
    d4 = length(0.0, p[1] + x[B3] * r[1, 0], p[2] + x[B3] * r[2, 0])
    values = (f[0], f[1], f[2], f[3], f[4], f[5], f[1] * d2, f[3] * d4, f[2], f[4])
    spreads = (e[0], e[1], e[2], e[3], e[4], e[5], e[1] * d2, e[3] * d4, e[2], e[4])
    share, part = 0.0, 0
    for i in range(PARTS):
        up = (values[i] + spreads[i]) / limits[i]
        down = (spreads[i] - values[i]) / limits[PARTS + i]
        if max(up, down) > share:
            share, part = max(up, down), i
    return share, part


@helper
def held_at(held: FloatArray, r: FloatArray, p: FloatArray) -> tuple[float, int]:
    """Return the function at a position, and the part with the largest share of its limit."""
    signs = held[SIGNS:END]
    delta1 = r[0, 2] * p[0] + r[1, 2] * p[1] + r[2, 2] * p[2]
    delta2 = r[1, 0] * p[2] - r[2, 0] * p[1]
    is_beyond = signs[0] * delta1 < 0.0 or signs[1] * delta2 < 0.0 or signs[2] * p[2] < 0.0
    share, part = share_at(held, r, p)
    reciprocal = min(1.0 / share if share > 0.0 else math.inf, 1.0 + HIGHEST)
    return (-reciprocal if is_beyond else reciprocal) - 1.0, part


@helper
def length(x: float, y: float, z: float) -> float:
    """Return the length of a vector."""
    return math.sqrt(x * x + y * y + z * z)


@helper
def rate_along(
    held: FloatArray, r: FloatArray, at: FloatArray, near: FloatArray, axis: int, h: float
) -> float:
    """Return the derivative along an axis by a central difference; `near` is a place to work in."""
    for i in range(3):
        near[i] = at[i]
    near[axis] = at[axis] + h
    ahead = held_at(held, r, near)[0]
    near[axis] = at[axis] - h
    return (ahead - held_at(held, r, near)[0]) / (2.0 * h)


@helper
def follow_slope(
    held: FloatArray, r: FloatArray, at: FloatArray, near: FloatArray, cell: float
) -> bool:
    """Move a point onto the limit by Newton's method; return whether it gets there.

    `near` is a place to work in, shape (3,).
    """
    h = DIFFERENCE * max(abs(at[0]), abs(at[1]), abs(at[2]), cell)
    for _ in range(STEPS):
        value = held_at(held, r, at)[0]
        if abs(value) <= ON_LIMIT:
            return True
        x = rate_along(held, r, at, near, 0, h)
        y = rate_along(held, r, at, near, 1, h)
        z = rate_along(held, r, at, near, 2, h)
        steepness = length(x, y, z)
        if steepness == 0.0:
            return False
        step = min(1.0, STEP_OF_CELL * cell * steepness / abs(value)) * value / steepness**2
        at[0] -= step * x
        at[1] -= step * y
        at[2] -= step * z
    return False


@helper
def halve(
    held: FloatArray, r: FloatArray, at: FloatArray, point: FloatArray, beside: FloatArray
) -> None:
    """Move a point onto the limit along the line from a position beside it that holds the load."""
    for i in range(3):
        at[i] = 2.0 * point[i] - beside[i]
    low, high = 0.0, 2.0
    if held_at(held, r, at)[0] > 0.0:
        low, high = 1.0, 1.0
    for _ in range(HALVINGS):
        middle = 0.5 * (low + high)
        for i in range(3):
            at[i] = beside[i] + middle * (point[i] - beside[i])
        if held_at(held, r, at)[0] > 0.0:
            low = middle
        else:
            high = middle


@kernel("void(f8[::1], f8[:,::1], f8[:,::1], f8[::1])")
def share_rows(held: FloatArray, r: FloatArray, positions: FloatArray, out: FloatArray) -> None:
    """Write the largest shares of a limit at n positions."""
    for k in range(positions.shape[0]):
        out[k] = share_at(held, r, positions[k])[0]


@kernel("void(f8[::1], f8[:,::1], f8[:,::1], f8[::1], i8[::1])")
def held_rows(
    held: FloatArray, r: FloatArray, positions: FloatArray, out: FloatArray, parts: IntArray
) -> None:
    """Write the function at n positions, and the indices of the parts that decide."""
    for k in range(positions.shape[0]):
        out[k], parts[k] = held_at(held, r, positions[k])


@kernel("void(f8[::1], f8[:,::1], f8[:,::1], f8[:,::1], f8[::1], f8[::1], f8[:,::1])")
def settle_rows(
    held: FloatArray,
    r: FloatArray,
    points: FloatArray,
    beside: FloatArray,
    step: FloatArray,
    near: FloatArray,
    out: FloatArray,
) -> None:
    """Write points on the limit near n points; one beside which no load is held stays.

    Where Newton's method fails, the segment from the position beside through the point and as far
    beyond is halved. `near` is a place to work in, shape (3,).
    """
    cell = min(step[0], step[1], step[2])
    for k in range(points.shape[0]):
        at = out[k]
        for i in range(3):
            at[i] = points[k, i]
        if held_at(held, r, beside[k])[0] > 0.0:
            is_there = follow_slope(held, r, at, near, cell)
            for i in range(3):
                is_there = is_there and abs(at[i] - points[k, i]) <= MOST_OF_CELL * step[i]
            if not is_there:
                halve(held, r, at, points[k], beside[k])


def largest_shares(held: FloatArray, rotation: FloatArray, positions: FloatArray) -> FloatArray:
    """Return the largest shares of a limit at positions (n, 3), shape (n,); infinite if singular.

    Args:
        held: What `held_load` returns; with a limit of 1 a share is the value itself.
        rotation: Platform to base, shape (3, 3).
        positions: b4 in the base frame, in design units.
    """
    out = np.empty(len(positions))
    share_rows(len(positions), held, for_kernel(rotation), for_kernel(positions), out)
    return out


def held_values(
    held: FloatArray, rotation: FloatArray, positions: FloatArray
) -> tuple[FloatArray, IntArray]:
    """Return the function at positions (n, 3), shape (n,), and the parts that decide, (n,).

    The parts are indices of those of `explorer.statics.reactions.part_limits`.
    """
    out, parts = np.empty(len(positions)), np.empty(len(positions), dtype=np.int64)
    held_rows(len(positions), held, for_kernel(rotation), for_kernel(positions), out, parts)
    return out, parts


def settle_on_limit(
    held: FloatArray,
    rotation: FloatArray,
    points: FloatArray,
    beside: FloatArray,
    step: FloatArray,
) -> FloatArray:
    """Return points on the limit near points (n, 3), shape (n, 3).

    Args:
        held: What `held_load` returns.
        rotation: Platform to base, shape (3, 3).
        points: Points near the limit.
        beside: A position near each of them, shape (n, 3).
        step: Size of a cell on each axis, shape (3,); points move by no more than one.
    """
    out = np.empty(points.shape)
    rows = for_kernel(rotation), for_kernel(points), for_kernel(beside), for_kernel(step)
    settle_rows(len(points), held, *rows, np.empty(3), out)
    return out
