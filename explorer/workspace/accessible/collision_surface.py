"""Where legs begin to collide, as a surface in the positions at one orientation.

Between the nodes of a grid the surface is interpolated, then moved onto the true one. Legs
without a thickness collide only where their axes cross, on a surface that separates nothing
but its two sides; so the side counts, not the distance alone.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from explorer.legs.clearance import PAIRS, leg_axes, leg_clearances, point_rates, radii_of_pairs
from explorer.mechanism.design import Design
from explorer.numerics.arrays import BoolArray, FloatArray, IntArray, dot

# Newton steps onto the surface; each may go this share of a cell, all together at most one.
STEPS = 6
SHARE = 0.3
# Strides towards a collision, and what counts as before it, a share of a cell.
STRIDES = 16
NEAR = 0.05
# Slopes of clearance over position below this are not followed.
LEAST_SLOPE = 0.02


def settle(
    design: Design,
    rotation: FloatArray,
    pairs: Sequence[int],
    touching: float,
    step: FloatArray,
    points: FloatArray,
    kept: FloatArray,
) -> FloatArray:
    """Return points moved onto the surface where the nearest pair begins to collide.

    Args:
        design: The manipulator.
        rotation: Platform to base, shape (3, 3).
        pairs: Indices of the pairs that count.
        touching: How far beyond a mere crossing the surface lies, for pairs without radii.
        step: Of the grid, shape (3,).
        points: Near the surface, shape (n, 3).
        kept: For each a place on the side that is kept, shape (n, 3).
    """
    if not len(points):
        return points
    # Legs may pass through one another between the two, so the way there is followed.
    hit, which, passed = _first_hit(design, rotation, pairs, step, kept, points)
    side = np.sign(_apart(design, rotation, which, kept)[3])[:, 0]
    has_side = _apart(design, rotation, which, points)[2][:, 0]
    radii = radii_of_pairs(design)[which[:, 0]]
    target = np.where(radii > 0.0, 0.0, -touching)
    at = np.where((passed & ~has_side)[:, None], hit, points)
    for _ in range(STEPS):
        values, gradients, sides, _ = _apart(design, rotation, which, at)
        value, gradient, has_side = values[:, 0], gradients[:, 0], sides[:, 0]
        turned = np.where(has_side, side, 1.0)
        value, gradient = value * turned - radii, gradient * turned[:, None]
        square = dot(gradient, gradient)
        ratio = np.where(square > LEAST_SLOPE**2, (target - value) / np.maximum(square, 1e-300), 0)
        move = ratio[:, None] * gradient
        cells = np.abs(move / step).max(axis=1)
        at += move * np.minimum(1.0, SHARE / np.maximum(cells, 1e-300))[:, None]
    astray = np.abs((at - points) / step).max(axis=1) > 1.0
    at[astray] = np.where(passed[:, None], hit, points)[astray]
    return at


def _first_hit(
    design: Design,
    rotation: FloatArray,
    pairs: Sequence[int],
    step: FloatArray,
    start: FloatArray,
    end: FloatArray,
) -> tuple[FloatArray, IntArray, BoolArray]:
    """Return where the way from start to end first meets a collision, else the end.

    A clearance is safe to go, as it changes no faster than the position. All of shape
    (n, 3); then the pair, shape (n, 1), and whether it is met before the end, shape (n,).
    """
    way = end - start
    length = np.linalg.norm(way, axis=1)
    near = NEAR * float(step.min())
    chosen = np.asarray(pairs, dtype=np.int64)
    gone, at = np.zeros(len(start)), start
    clearance = leg_clearances(design, at, rotation).clearance[:, chosen]
    for _ in range(STRIDES):
        gone = np.minimum(length, gone + np.maximum(clearance.min(axis=1), 0.0))
        at = start + (gone / np.maximum(length, 1e-300))[:, None] * way
        clearance = leg_clearances(design, at, rotation).clearance[:, chosen]
    return at, chosen[clearance.argmin(axis=1)][:, None], gone < length - near


def nearest_pair(
    design: Design, rotation: FloatArray, pairs: Sequence[int], points: FloatArray
) -> IntArray:
    """Return the pair with the least clearance at positions (n, 3), shape (n,)."""
    clearance = leg_clearances(design, points, rotation).clearance
    return np.asarray(pairs, dtype=np.int64)[clearance[:, list(pairs)].argmin(axis=1)]


def _apart(
    design: Design, rotation: FloatArray, which: IntArray, at: FloatArray
) -> tuple[FloatArray, FloatArray, BoolArray, FloatArray]:
    """Return how far pairs are apart at positions, its rates, and on which side they are.

    Where the closest points lie between the ends, that is the signed distance of the lines,
    which tells the side; whether they do comes third, the signed distance itself last.

    Args:
        design: The manipulator.
        rotation: Platform to base, shape (3, 3).
        which: Indices of m pairs, shape (m,), or for each position, shape (n, m).
        at: Positions, shape (n, 3).

    Returns:
        Shapes (n, m), (n, m, 3), (n, m) and (n, m).
    """
    found = leg_clearances(design, at, rotation)
    axes = leg_axes(design, at, rotation)
    rows = np.arange(len(at))[:, None]
    ends = np.array(PAIRS)[which] - 1
    one, two = axes[rows, ends[..., 0]], axes[rows, ends[..., 1]]
    u, v = one[..., 1, :] - one[..., 0, :], two[..., 1, :] - two[..., 0, :]
    normal = np.cross(u, v)
    length = np.linalg.norm(normal, axis=-1)
    scale = np.linalg.norm(u, axis=-1) * np.linalg.norm(v, axis=-1)
    normal = normal / np.where(length > 0.0, length, 1.0)[..., None]
    signed = dot(one[..., 0, :] - two[..., 0, :], normal)
    distance = found.distance[rows, which]
    has_side = (length > 1e-6 * scale) & (np.abs(np.abs(signed) - distance) <= 1e-9 * design.reach)
    points = found.points[rows, which]
    off = points[..., 0, :] - points[..., 1, :]
    outward = off / np.where(distance > 0.0, distance, 1.0)[..., None]
    rates = point_rates(axes, found.points)[rows, which]
    return (
        np.where(has_side, signed, distance),
        np.where(has_side[..., None], normal, outward) * rates,
        has_side,
        signed,
    )
