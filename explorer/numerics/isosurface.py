"""The closed surface around a grid's negative values, by marching tetrahedra.

Each cell is divided into the six tetrahedra that follow its edges from one corner to the
opposite one (H. W. Kuhn, 1960). Neighbouring cells divide their common face in the same way,
so the surface is closed for any values; that of marching cubes need not be.
"""

from __future__ import annotations

import itertools
from typing import TypeAlias

import numpy as np

from explorer.numerics.arrays import FloatArray, IntArray

# Share of an edge between a vertex and the edge's ends, so that no two vertices coincide.
LEAST_SHARE = 1e-3

Edge: TypeAlias = tuple[int, int]


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


_CASES = [
    (negative, _triangles(negative))
    for count in (1, 2, 3)
    for negative in itertools.combinations(range(4), count)
]


def surface_below_zero(values: FloatArray) -> tuple[FloatArray, IntArray]:
    """Return the surface where values on a grid change their sign.

    Args:
        values: Values at the nodes, shape (nx, ny, nz); none on the grid's boundary is negative.

    Returns:
        Vertices in grid steps, linearly interpolated, shape (n, 3); faces, shape (m, 3),
        counter-clockwise as seen from the side of positive values.
    """
    shape = np.array(values.shape)
    strides = np.array([shape[1] * shape[2], shape[2], 1])
    below = values < 0.0
    corners = np.array(list(itertools.product((0, 1), repeat=3)))
    last = shape - 1
    corner_below = np.stack([below[tuple(map(slice, c, c + last))] for c in corners], axis=-1)
    cells = np.argwhere(corner_below.any(axis=-1) & ~corner_below.all(axis=-1)) @ strides
    flat, level = below.ravel(), values.ravel()
    edges: list[IntArray] = []
    for axes in itertools.permutations(range(3)):
        steps = np.cumsum([0, *(strides[axis] for axis in axes)])
        nodes = cells[:, None] + steps
        odd = sum(a > b for a, b in itertools.combinations(axes, 2)) % 2 == 1
        signs = flat[nodes] @ np.array([1, 2, 4, 8])
        for negative, triangles in _CASES:
            rows = nodes[signs == sum(1 << k for k in negative)]
            for triangle in triangles:
                ends = np.stack([rows[:, edge] for edge in triangle], axis=1)
                edges.append(ends[:, ::-1] if odd else ends)
    corner = np.sort(np.concatenate(edges), axis=-1).reshape(-1, 2)
    keys, faces = np.unique(corner @ np.array([values.size, 1]), return_inverse=True)
    first, second = np.divmod(keys, values.size)
    share = level[first] / (level[first] - level[second])
    share = np.clip(share, LEAST_SHARE, 1.0 - LEAST_SHARE)[:, None]
    start, end = (np.stack(np.unravel_index(k, values.shape), axis=-1) for k in (first, second))
    return start + share * (end - start), np.asarray(faces.reshape(-1, 3), dtype=np.int64)
