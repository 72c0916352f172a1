"""Incidences of points, lines and planes, each computed in its own way, from points alone.

Nothing here shares a formula with the package: distances come from determinants, dimensions
of intersections from the ranks of homogeneous coordinates.
"""

from __future__ import annotations

import math

import numpy as np

from explorer.numerics.arrays import FloatArray


def tetrahedron_volume(a: FloatArray, b: FloatArray, c: FloatArray, d: FloatArray) -> float:
    """Return the volume from the determinant of the four points' homogeneous coordinates."""
    points = np.stack([a, b, c, d])
    size = float(np.abs(points).max()) or 1.0
    scaled = points / size
    # LAPACK divides by pivots, so a subnormal one would overflow.
    scaled[np.abs(scaled) < 1e-200] = 0.0
    matrix = np.column_stack([scaled, np.ones(4)])
    return abs(float(np.linalg.det(matrix))) * size**3 / 6.0


def distance_to_plane(point: FloatArray, plane: tuple[FloatArray, FloatArray, FloatArray]) -> float:
    """Return the distance of a point from the plane through three points."""
    a, b, c = plane
    height = tetrahedron_volume(point, a, b, c) * 6.0
    return height / float(np.linalg.norm(np.cross(b - a, c - a)))


def distance_of_lines(
    one: tuple[FloatArray, FloatArray], other: tuple[FloatArray, FloatArray]
) -> float:
    """Return the distance between two lines, each through two points, by least squares."""
    (p, q), (r, s) = one, other
    directions = np.column_stack([q - p, r - s])
    parameters = np.linalg.lstsq(directions, r - p, rcond=None)[0]
    return math.sqrt(float(np.sum((directions @ parameters - (r - p)) ** 2)))


def sine_of_lines(
    one: tuple[FloatArray, FloatArray], other: tuple[FloatArray, FloatArray]
) -> float:
    """Return the sine of the angle between two lines, each through two points."""
    (p, q), (r, s) = one, other
    directions = np.column_stack([(q - p) / np.linalg.norm(q - p), (s - r) / np.linalg.norm(s - r)])
    return float(np.prod(np.linalg.svd(directions, compute_uv=False)))


def permutation_of_flags(
    position: FloatArray, rotation: FloatArray, tolerance: float = 1e-6
) -> tuple[int, ...]:
    """Return the relative position of the two flags from ranks of homogeneous coordinates.

    The flags are spanned by (point, direction of the line, direction of the plane), and
    dim(F ∩ G) = dim F + dim G - rank[F G].
    """
    base = np.eye(4)[:, [3, 0, 1]]
    platform = np.zeros((4, 3))
    platform[:3, 0], platform[3, 0] = position, 1.0
    platform[:3, 1], platform[:3, 2] = rotation[:, 0], rotation[:, 1]

    meet = np.zeros((5, 5), dtype=np.int64)
    for i in range(5):
        for j in range(5):
            if i == 4 or j == 4:
                meet[i, j] = min(i, j)
            elif i and j:
                spanned = np.hstack([base[:, :i], platform[:, :j]])
                meet[i, j] = i + j - np.linalg.matrix_rank(spanned, tol=tolerance)
    matrix = meet[1:, 1:] - meet[:-1, 1:] - meet[1:, :-1] + meet[:-1, :-1]
    assert ((matrix == 0) | (matrix == 1)).all()
    assert (matrix.sum(axis=0) == 1).all()
    assert (matrix.sum(axis=1) == 1).all()
    return tuple((np.argmax(matrix, axis=1) + 1).tolist())
