"""The closed surface around a grid's negative values, by marching tetrahedra.

Each cell is divided into the six tetrahedra that follow its edges from one corner to the
opposite one (H. W. Kuhn, 1960). Neighbouring cells divide their common face in the same way,
so the surface is closed for any values; that of marching cubes need not be.
"""

from __future__ import annotations

import itertools

import numpy as np

from explorer.numerics.arrays import FloatArray, IntArray

# Share of an edge between a vertex and the edge's ends, so that no two vertices coincide.
LEAST_SHARE = 1e-3

Edge = tuple[int, int]


def _triangles(negative: tuple[int, ...]) -> list[tuple[Edge, Edge, Edge]]:
    """Return the triangles that separate the negative corners of a tetrahedron from the others.

    Each corner of a triangle is an edge of the tetrahedron, a pair of its four corners. For a
    positively oriented tetrahedron the triangles are counter-clockwise as seen from the side
    that is not negative.
    """
    positive = tuple(k for k in range(4) if k not in negative)
    order = (*negative, *positive)
    odd = sum(a > b for a, b in itertools.combinations(order, 2)) % 2 == 1
    if len(negative) == 2:
        (a, b), (c, d) = negative, positive
        loop: tuple[Edge, ...] = ((a, c), (a, d), (b, d), (b, c))
        triangles = [(loop[0], loop[1], loop[2]), (loop[0], loop[2], loop[3])]
    elif len(negative) == 1:
        triangles = [tuple((negative[0], k) for k in positive)]
    else:
        # Three negative corners are the mirror image of one.
        triangles = [tuple((k, positive[0]) for k in negative)]
    return [(x, z, y) if odd else (x, y, z) for x, y, z in triangles]


def _table() -> IntArray:
    """Return the triangles of each case of each of two orientations, shape (2, 16, 2, 3, 2).

    Bit k of a case is set if corner k is negative. Absent triangles are −1.
    """
    table = np.full((2, 16, 2, 3, 2), -1)
    for count in (1, 2, 3):
        for negative in itertools.combinations(range(4), count):
            triangles = np.array(_triangles(negative))
            case = sum(1 << k for k in negative)
            table[0, case, : len(triangles)] = triangles
            table[1, case, : len(triangles)] = triangles[:, ::-1]
    return table


_TABLE = _table()
# The axes along which the tetrahedra of a cell follow its edges, and which of these are odd.
_ORDERS = np.array(list(itertools.permutations(range(3))))
_IS_ODD = np.array([sum(a > b for a, b in itertools.combinations(x, 2)) % 2 for x in _ORDERS])


def surface_below_zero(values: FloatArray) -> tuple[FloatArray, IntArray]:
    """Return the surface where values on a grid, (nx, ny, nz), change their sign.

    No value on the grid's boundary is negative. Vertices (n, 3) are in grid steps, linearly
    interpolated; faces (m, 3) are counter-clockwise as seen from the side of positive values.
    """
    shape = np.array(values.shape)
    strides = np.array([shape[1] * shape[2], shape[2], 1])
    below = values < 0.0
    corners = np.array(list(itertools.product((0, 1), repeat=3)))
    last = shape - 1
    corner_below = np.stack([below[tuple(map(slice, c, c + last))] for c in corners], axis=-1)
    cells = np.argwhere(corner_below.any(axis=-1) & ~corner_below.all(axis=-1)) @ strides
    flat, level = below.ravel(), values.ravel()
    steps = np.concatenate([np.zeros((6, 1), dtype=np.int64), strides[_ORDERS]], axis=1)
    nodes = cells[:, None, None] + np.cumsum(steps, axis=1)
    cases = flat[nodes] @ np.array([1, 2, 4, 8])
    corners_of = _TABLE[_IS_ODD, cases]
    cell, tetrahedron, triangle = np.nonzero(corners_of[..., 0, 0] >= 0)
    own = corners_of[cell, tetrahedron, triangle].reshape(-1, 6)
    edges = np.take_along_axis(nodes[cell, tetrahedron], own, axis=1)
    corner = np.sort(edges.reshape(-1, 2), axis=-1)
    keys, faces = np.unique(corner @ np.array([values.size, 1]), return_inverse=True)
    first, second = np.divmod(keys, values.size)
    share = level[first] / (level[first] - level[second])
    share = np.clip(share, LEAST_SHARE, 1.0 - LEAST_SHARE)[:, None]
    start, end = (np.stack(np.unravel_index(k, values.shape), axis=-1) for k in (first, second))
    return start + share * (end - start), np.asarray(faces.reshape(-1, 3), dtype=np.int64)
