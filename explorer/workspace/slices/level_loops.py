"""Outlines of the parts of a grid in which a field is at least a level, by marching squares.

The field is taken as linear along each edge of the grid, so that the outline of a smooth field is
off by the square of the step.
"""

from __future__ import annotations

import numpy as np

from explorer.numerics.arrays import FloatArray

# The corners of a cell, counter-clockwise, as (row, column); edge k goes from corner k to the next.
_CORNERS = ((0, 0), (0, 1), (1, 1), (1, 0))


def level_loops(
    columns: FloatArray, rows: FloatArray, values: FloatArray, level: float
) -> list[FloatArray]:
    """Return closed polygons around the parts of a grid where a field is at least a level.

    Those around holes run clockwise, all others counter-clockwise; where a part reaches the end of
    the grid, its polygon runs along that end.

    Args:
        columns: Coordinates on the first axis, ascending, shape (n,).
        rows: Coordinates on the second axis, ascending, shape (m,).
        values: Values of the field, shape (m, n).
        level: The level, in the unit of the values.

    Returns:
        Corners of each polygon, each of shape (k, 2).
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

    def point_on(edge: int) -> tuple[float, float]:
        node, is_upright = divmod(edge, 2)
        row, column = divmod(node, width)
        one, other = (row, column), (row + is_upright, column + 1 - is_upright)
        inner, outer = (one, other) if high[one] else (other, one)
        inside, outside = float(field[inner]), float(field[outer])
        share = 0.0 if np.isinf(outside) else (inside - level) / (inside - outside)
        (v0, u0), (v1, u1) = inner, outer
        return (
            float(across[u0] + share * (across[u1] - across[u0])),
            float(up[v0] + share * (up[v1] - up[v0])),
        )

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
    loops: list[FloatArray] = []
    while following:
        edge, after = following.popitem()
        chain = [edge]
        while after != edge:
            chain.append(after)
            after = following.pop(after)
        loops.append(np.array([point_on(each) for each in chain]))
    return loops
