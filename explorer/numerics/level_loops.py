"""Outlines of the parts of a grid in which a field is at least a level, by marching squares."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from explorer.numerics.arrays import FloatArray, IntArray
from explorer.numerics.roots import find_roots

# The corners of a cell, counter-clockwise, as (row, column); edge k goes from corner k to the next.
_CORNERS = ((0, 0), (0, 1), (1, 1), (1, 0))
# Largest error of the field at a corner, over the level.
ROOT_ERROR = 1e-4


def level_loops(
    columns: FloatArray,
    rows: FloatArray,
    values: FloatArray,
    level: float,
    field_at: Callable[[FloatArray], FloatArray] | None = None,
) -> list[FloatArray]:
    """Return closed polygons around the parts of a grid where a field is at least a level.

    Those around holes run clockwise, all others counter-clockwise; where a part reaches the end of
    the grid, its polygon runs along that end.

    Args:
        columns: Coordinates on the first axis, ascending, shape (n,).
        rows: Coordinates on the second axis, ascending, shape (m,).
        values: Values of the field, shape (m, n).
        level: The level, in the unit of the values.
        field_at: Continuous function from points (k, 2) to the field; None if only nodes are known.
    """
    # Low values around the grid close the polygons at its ends.
    field = np.pad(np.asarray(values, dtype=np.float64), 1, constant_values=-np.inf)
    across, up = np.pad(columns, 1, mode="edge"), np.pad(rows, 1, mode="edge")
    high = field >= level
    width = field.shape[1]

    def edge_of(row: int, column: int, index: int) -> int:
        """Return the number of an edge of a cell, which the cell beyond it shares."""
        if index in (0, 2):
            return 2 * ((row + (index == 2)) * width + column)
        return 2 * (row * width + column + (index == 1)) + 1

    counts = sum(high[r : r + len(high) - 1, c : c + width - 1].astype(int) for r, c in _CORNERS)
    following: dict[int, int] = {}
    for row, column in np.argwhere((counts > 0) & (counts < 4)).tolist():
        corners = [bool(high[row + r, column + c]) for r, c in _CORNERS]
        leaving = [k for k in range(4) if corners[k] and not corners[k - 3]]
        entering = [k for k in range(4) if corners[k - 3] and not corners[k]]
        if len(leaving) == 2:
            # Two high corners face each other: the middle decides whether they are joined.
            middle = float(np.mean([field[row + r, column + c] for r, c in _CORNERS]))
            # The edge by which the part is entered that is left at k: before it, or after it.
            turn = 1 if middle >= level else 3
            entering = [(k + turn) % 4 for k in leaving]
        for out, into in zip(leaving, entering, strict=True):
            following[edge_of(row, column, out)] = edge_of(row, column, into)
    chains: list[list[int]] = []
    while following:
        edge, after = following.popitem()
        chains.append([edge])
        while after != edge:
            chains[-1].append(after)
            after = following.pop(after)
    if not chains:
        return []
    edges = np.concatenate([np.array(chain, dtype=np.int64) for chain in chains])
    nodes, is_upright = np.divmod(edges, 2)
    others = nodes + np.where(is_upright == 1, width, 1)
    is_inner = high.ravel()[nodes]
    inner, outer = np.where(is_inner, nodes, others), np.where(is_inner, others, nodes)

    def place(of: IntArray) -> FloatArray:
        row, column = np.divmod(of, width)
        return np.stack([across[column], up[row]], axis=1)

    above, below = field.ravel()[inner] - level, field.ravel()[outer] - level
    # At the end of the grid the polygon runs along it.
    is_crossed = np.isfinite(below)
    share = np.zeros(len(edges))
    share[is_crossed] = (above / (above - below))[is_crossed]
    start, end = place(inner), place(outer)
    if field_at is not None and is_crossed.any():
        first, span = end[is_crossed], (start - end)[is_crossed]
        share[is_crossed] = 1.0 - find_roots(
            lambda at: field_at(first + at[:, None] * span) - level,
            below[is_crossed],
            above[is_crossed],
            ROOT_ERROR * abs(level),
        )
    points = start + share[:, None] * (end - start)
    return np.split(points, np.cumsum([len(chain) for chain in chains])[:-1])
