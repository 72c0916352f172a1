"""What tests ask of meshes: area, genus, and whether a position is inside."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from explorer.numerics.arrays import BoolArray, FloatArray
from explorer.workspace.solids.solid import Solid


def corners_of(solid: Solid) -> tuple[FloatArray, FloatArray, FloatArray]:
    a, b, c = (solid.vertices[solid.faces[:, k]] for k in range(3))
    return a, b, c


def area_of(solid: Solid) -> float:
    a, b, c = corners_of(solid)
    return float(0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=1).sum())


def euler_characteristic(solid: Solid) -> int:
    """Return V - E + F: two for each ball, none for a ring."""
    return len(np.unique(solid.faces)) - len(solid.faces) // 2


def contains(solid: Solid, points: FloatArray) -> BoolArray:
    """Return whether points (n, 3) are inside, by the solid angle of all faces, shape (n,)."""
    angles = np.zeros(len(points))
    for index, point in enumerate(points):
        a, b, c = (corner - point for corner in corners_of(solid))
        la, lb, lc = (np.linalg.norm(each, axis=1) for each in (a, b, c))
        above = np.einsum("ij,ij->i", a, np.cross(b, c))
        below = la * lb * lc + lc * (a * b).sum(1) + lb * (a * c).sum(1) + la * (b * c).sum(1)
        angles[index] = float(np.arctan2(above, below).sum()) / (2.0 * np.pi)
    return angles > 0.5


def edges_are_paired(faces: NDArray[np.int32]) -> bool:
    """Whether each edge is used once in each direction, counted one by one."""
    seen: dict[tuple[int, int], int] = {}
    for a, b, c in faces.tolist():
        for edge in ((a, b), (b, c), (c, a)):
            seen[edge] = seen.get(edge, 0) + 1
    return all(count == 1 and seen.get((b, a)) == 1 for (a, b), count in seen.items())
