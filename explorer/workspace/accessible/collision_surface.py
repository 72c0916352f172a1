"""The surface of positions at which legs begin to collide, at one orientation.

A surface interpolated between the nodes of a grid is projected onto the true one. Legs without
a radius collide only where their axes cross: on a surface with free positions on both sides, so
that a signed distance is needed to tell the sides apart.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from explorer.legs.clearance import PAIRS, leg_axes, leg_clearances, point_rates, radii_of_pairs
from explorer.mechanism.configuration import Configuration
from explorer.mechanism.design import Design
from explorer.numerics.arrays import BoolArray, FloatArray, IntArray, dot

# Newton steps onto the surface, and the largest step as a share of a cell.
STEPS = 6
SHARE = 0.3
# Strides of the search for a first collision, and its tolerance as a share of a cell.
STRIDES = 16
NEAR = 0.05
# The least slope of clearance over position that a Newton step divides by.
LEAST_SLOPE = 0.02


def project_onto_collisions(
    design: Design,
    rotation: FloatArray,
    pairs: Sequence[int],
    touching: float,
    step: FloatArray,
    points: FloatArray,
    beside: FloatArray,
) -> FloatArray:
    """Project points (n, 3) onto the surface at which the nearest pair of legs begins to collide.

    For pairs without radii that surface is `touching` beyond a crossing of axes. Beside each point
    is a free position on the near side of the surface, shape (n, 3). A point that diverges is
    returned as it is. The grid has a step on each axis, shape (3,).
    """
    if not len(points):
        return points
    # On the way from `beside` to a point the legs may pass through one another.
    collision, pair, collides = _first_collisions(design, rotation, pairs, step, beside, points)
    *_, line_distances = _signed_distances(design, rotation, pair, beside)
    side = np.sign(line_distances)[:, 0]
    _, _, is_signed, _ = _signed_distances(design, rotation, pair, points)
    radii = radii_of_pairs(design)[pair[:, 0]]
    target = np.where(radii > 0.0, 0.0, -touching)
    projected = np.where((collides & ~is_signed[:, 0])[:, None], collision, points)
    for _ in range(STEPS):
        values, gradients, sides, _ = _signed_distances(design, rotation, pair, projected)
        value, gradient, has_side = values[:, 0], gradients[:, 0], sides[:, 0]
        direction = np.where(has_side, side, 1.0)
        value, gradient = value * direction - radii, gradient * direction[:, None]
        square = dot(gradient, gradient)
        ratio = np.where(square > LEAST_SLOPE**2, (target - value) / np.maximum(square, 1e-300), 0)
        move = ratio[:, None] * gradient
        cells = np.abs(move / step).max(axis=1)
        projected += move * np.minimum(1.0, SHARE / np.maximum(cells, 1e-300))[:, None]
    astray = np.abs((projected - points) / step).max(axis=1) > 1.0
    projected[astray] = np.where(collides[:, None], collision, points)[astray]
    return projected


def _first_collisions(
    design: Design,
    rotation: FloatArray,
    pairs: Sequence[int],
    step: FloatArray,
    start: FloatArray,
    end: FloatArray,
) -> tuple[FloatArray, IntArray, BoolArray]:
    """Return the first collisions on segments from free starts to ends, shape (n, 3) each.

    A stride as long as the clearance is free, since clearance changes no faster than position.
    Returned are positions, the ends where there is no collision; the pairs of legs nearest there,
    shape (n, 1); and whether a collision precedes the end, shape (n,).
    """
    segment = end - start
    length = np.linalg.norm(segment, axis=1)
    near = NEAR * float(step.min())
    chosen = np.asarray(pairs, dtype=np.int64)
    covered, at = np.zeros(len(start)), start
    clearance = leg_clearances(Configuration(design, at, rotation)).clearance[:, chosen]
    for _ in range(STRIDES):
        covered = np.minimum(length, covered + np.maximum(clearance.min(axis=1), 0.0))
        at = start + (covered / np.maximum(length, 1e-300))[:, None] * segment
        clearance = leg_clearances(Configuration(design, at, rotation)).clearance[:, chosen]
    return at, chosen[clearance.argmin(axis=1)][:, None], covered < length - near


def nearest_pair(
    design: Design, rotation: FloatArray, pairs: Sequence[int], points: FloatArray
) -> IntArray:
    """Return the index of the pair with the least clearance at positions (n, 3), shape (n,)."""
    clearance = leg_clearances(Configuration(design, points, rotation)).clearance
    return np.asarray(pairs, dtype=np.int64)[clearance[:, list(pairs)].argmin(axis=1)]


def _signed_distances(
    design: Design, rotation: FloatArray, pair: IntArray, at: FloatArray
) -> tuple[FloatArray, FloatArray, BoolArray, FloatArray]:
    """Return distances between the axes of pairs of legs at positions, signed where possible.

    Where the closest points lie between the ends of the legs, the distance is that of the two
    lines, and its sign tells on which side of each other they are. `pair` has the indices of m
    pairs, shape (m,), or of m pairs for each of n positions, shape (n, m).

    Returns:
        The distances, shape (n, m); their gradients in position, shape (n, m, 3); whether they are
        signed, shape (n, m); the signed distances of the lines in any case, shape (n, m).
    """
    poses = Configuration(design, at, rotation)
    clearances, axes = leg_clearances(poses), leg_axes(poses)
    rows = np.arange(len(at))[:, None]
    ends = np.array(PAIRS)[pair] - 1
    one, two = axes[rows, ends[..., 0]], axes[rows, ends[..., 1]]
    u, v = one[..., 1, :] - one[..., 0, :], two[..., 1, :] - two[..., 0, :]
    normal = np.cross(u, v)
    length = np.linalg.norm(normal, axis=-1)
    scale = np.linalg.norm(u, axis=-1) * np.linalg.norm(v, axis=-1)
    normal = normal / np.where(length > 0.0, length, 1.0)[..., None]
    signed = dot(one[..., 0, :] - two[..., 0, :], normal)
    distance = clearances.distance[rows, pair]
    has_side = (length > 1e-6 * scale) & (np.abs(np.abs(signed) - distance) <= 1e-9 * design.reach)
    points = clearances.points[rows, pair]
    off = points[..., 0, :] - points[..., 1, :]
    outward = off / np.where(distance > 0.0, distance, 1.0)[..., None]
    rates = point_rates(axes, clearances.points)[rows, pair]
    return (
        np.where(has_side, signed, distance),
        np.where(has_side[..., None], normal, outward) * rates,
        has_side,
        signed,
    )
