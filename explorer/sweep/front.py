"""Pareto fronts: the designs than which no other is better in one respect and worse in none."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from explorer.numerics.arrays import BoolArray, FloatArray, IntArray
from explorer.sweep.study import Objective


def costs(columns: Mapping[str, Any], objectives: Sequence[Objective]) -> FloatArray:
    """Return what is to be small of each row, shape (n, m).

    Args:
        columns: By name, shape (n,) each.
        objectives: m of them.
    """
    signs = {"min": 1.0, "max": -1.0}
    return np.column_stack(
        [
            signs[each.sense] * np.asarray(columns[each.measure], dtype=np.float64)
            for each in objectives
        ]
    )


def front(columns: Mapping[str, Any], objectives: Sequence[Objective]) -> BoolArray:
    """Return which rows are on the Pareto front, shape (n,).

    Only rows that are done and have all objectives can be. Of equal rows all are.

    Args:
        columns: By name, shape (n,) each, with the status among them.
        objectives: At least one.
    """
    cost = costs(columns, objectives)
    rows = np.flatnonzero(_is_done(columns) & np.isfinite(cost).all(axis=1))
    found = np.zeros(len(cost), dtype=np.bool_)
    found[rows[undominated(cost[rows])]] = True
    return found


def incomparable(columns: Mapping[str, Any], objectives: Sequence[Objective]) -> BoolArray:
    """Return which rows are done and lack an objective, so that no front has them; see `front`."""
    return _is_done(columns) & ~np.isfinite(costs(columns, objectives)).all(axis=1)


def _is_done(columns: Mapping[str, Any]) -> BoolArray:
    return np.asarray(columns["status"], dtype=object) == "done"


def undominated(cost: FloatArray) -> IntArray:
    """Return the rows of costs (n, m) that no other row dominates, ascending.

    A row dominates another if it is no larger anywhere and smaller somewhere.
    """
    # A row is dominated only by such as come before it in this order.
    order = np.lexsort(cost.T[::-1])
    left = cost[order]
    done = 0
    while done < len(left):
        best = left[done]
        beaten = (left >= best).all(axis=1) & (left > best).any(axis=1)
        order, left = order[~beaten], left[~beaten]
        done += 1
    return np.sort(order)
