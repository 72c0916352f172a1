"""Incidences of points, lines, planes and flags, independently of the package's formulas.

Distances come from determinants, dimensions of intersections from the ranks of homogeneous
coordinates.
"""

from __future__ import annotations

import math

import numpy as np
from scipy.spatial.transform import Rotation
from strategies import Case

from explorer import margins
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


def is_below(lower: tuple[int, ...], upper: tuple[int, ...]) -> bool:
    """Return the Bruhat order by the tableau criterion: sorted beginnings, entry by entry."""
    return all(
        a <= b
        for i in range(1, 5)
        for a, b in zip(sorted(lower[:i]), sorted(upper[:i]), strict=True)
    )


def is_clear_cut(case: Case, length: float | None = None) -> bool:
    """Return whether each distance and angle is either rounding or far above the tolerance.

    In between, incidences that imply others need not agree. Distances are relative to a length,
    by default that of a1 from b4.
    """
    p = case.position / (math.hypot(*case.position) or 1.0 if length is None else length)
    r = case.rotation
    measures = np.abs([*r.ravel(), *p, *(r.T @ p), *np.cross(r[:, 0], p), *margins(p, r)])
    return not ((measures > 1e-13) & (measures < 1e-6)).any()


def special_poses() -> list[tuple[FloatArray, FloatArray]]:
    """Return poses with incidences of every kind, built from turns and directions.

    Turns about z keep the planes parallel, those about x the lines; z then x keeps b2b3
    along the base plane, x then z keeps a1a2 along the platform plane.
    """
    turns = [
        Rotation.from_euler(axes, angles).as_matrix()
        for axes, angles in (
            ("z", [0.0]),
            ("Z", [0.7]),
            ("X", [0.6]),
            ("Y", [0.5]),
            ("ZX", [0.7, 0.6]),
            ("XZ", [0.6, 0.7]),
            ("ZYX", [0.7, 0.5, -0.6]),
        )
    ]
    x, y, z = np.eye(3)
    return [
        (np.asarray(position, dtype=np.float64), rotation)
        for rotation in turns
        for u, v, n in (rotation.T,)
        for position in (
            0.0 * x,
            2.0 * x,
            2.0 * u,
            2.0 * x + 3.0 * u,
            2.0 * x + 3.0 * y,
            2.0 * u + 3.0 * v,
            3.0 * np.cross(z, n),
            2.0 * x + 3.0 * y + 5.0 * z,
        )
    ]


REPRESENTATIVES = {permutation_of_flags(*pose): pose for pose in special_poses()}
"""A pose in each stratum, by the ranks of homogeneous coordinates."""
