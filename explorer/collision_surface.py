"""Where legs begin to collide, as a surface in the positions at one orientation.

Between the nodes of a grid the surface is interpolated, then moved onto the true one. Legs
without a thickness collide only where their axes cross, on a surface that separates nothing
but its two sides; so the side counts, not the distance alone.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from explorer.arrays import BoolArray, FloatArray, IntArray, dot
from explorer.clearance import PAIRS, leg_axes, leg_clearances, point_rates, radii_of_pairs
from explorer.design import Design

# Newton steps onto the surface; each may go this share of a cell, all together at most one.
STEPS = 6
SHARE = 0.3
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
    which = nearest_pair(design, rotation, pairs, points)
    # A line apart from another has a side, a segment beyond its end has none.
    side = np.sign(_apart(design, rotation, which, kept)[0])
    radii = radii_of_pairs(design)[which]
    target = np.where(radii > 0.0, 0.0, -touching)
    at = points.copy()
    for _ in range(STEPS):
        value, gradient, crosses = _apart(design, rotation, which, at)
        turned = np.where(crosses, side, 1.0)
        value, gradient = value * turned - radii, gradient * turned[:, None]
        square = dot(gradient, gradient)
        ratio = np.where(square > LEAST_SLOPE**2, (target - value) / np.maximum(square, 1e-300), 0)
        move = ratio[:, None] * gradient
        cells = np.abs(move / step).max(axis=1)
        at += move * np.minimum(1.0, SHARE / np.maximum(cells, 1e-300))[:, None]
    astray = np.abs((at - points) / step).max(axis=1) > 1.0
    at[astray] = points[astray]
    return at


def nearest_pair(
    design: Design, rotation: FloatArray, pairs: Sequence[int], points: FloatArray
) -> IntArray:
    """Return the pair with the least clearance at positions (n, 3), shape (n,)."""
    clearance = leg_clearances(design, points, rotation).clearance
    return np.asarray(pairs, dtype=np.int64)[clearance[:, list(pairs)].argmin(axis=1)]


def _apart(
    design: Design, rotation: FloatArray, which: IntArray, at: FloatArray
) -> tuple[FloatArray, FloatArray, BoolArray]:
    """Return how far a pair is apart at each position, its rates, and whether it has a side.

    Where the closest points lie between the ends, that is the signed distance of the lines.
    """
    found = leg_clearances(design, at, rotation)
    axes = leg_axes(design, at, rotation)
    rows = np.arange(len(at))
    ends = np.array(PAIRS)[which] - 1
    one, two = axes[rows, ends[:, 0]], axes[rows, ends[:, 1]]
    u, v = one[:, 1] - one[:, 0], two[:, 1] - two[:, 0]
    normal = np.cross(u, v)
    length = np.linalg.norm(normal, axis=1)
    scale = np.linalg.norm(u, axis=1) * np.linalg.norm(v, axis=1)
    points = found.points[rows, which]
    off = points[:, 0] - points[:, 1]
    distance = found.distance[rows, which]
    safe = np.where(length > 0.0, length, 1.0)
    normal = normal / safe[:, None]
    signed = dot(one[:, 0] - two[:, 0], normal)
    crosses = (length > 1e-6 * scale) & (np.abs(np.abs(signed) - distance) <= 1e-9 * design.reach)
    outward = off / np.where(distance > 0.0, distance, 1.0)[:, None]
    rates = point_rates(axes, found.points)[rows, which]
    return (
        np.where(crosses, signed, distance),
        np.where(crosses[:, None], normal, outward) * rates,
        crosses,
    )
