"""Pareto fronts: designs that no other beats in one objective without being worse in another."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from explorer.numerics.arrays import BoolArray, FloatArray, IntArray
from explorer.sweep.study import Objective


def costs(columns: Mapping[str, Any], objectives: Sequence[Objective]) -> FloatArray:
    """Return the objectives of each row with such signs that less is better, shape (n, m).

    Args:
        columns: Columns by name, shape (n,) each.
        objectives: The m objectives.
    """
    signs = [1.0 if objective.sense == "min" else -1.0 for objective in objectives]
    values = [np.asarray(columns[objective.measure], np.float64) for objective in objectives]
    return np.column_stack(values) * signs


def front(columns: Mapping[str, Any], objectives: Sequence[Objective]) -> BoolArray:
    """Return which rows are on the Pareto front, shape (n,).

    Only rows that are done and have all objectives can be on it; equal rows are on it together.

    Args:
        columns: Columns by name, shape (n,) each, with the status among them.
        objectives: At least one objective.
    """
    cost = costs(columns, objectives)
    rows = np.flatnonzero(_is_done(columns) & np.isfinite(cost).all(axis=1))
    is_best = np.zeros(len(cost), dtype=np.bool_)
    is_best[rows[undominated(cost[rows])]] = True
    return is_best


def incomparable(columns: Mapping[str, Any], objectives: Sequence[Objective]) -> BoolArray:
    """Return which rows are done but lack an objective, so that no front has them; see `front`."""
    return _is_done(columns) & ~np.isfinite(costs(columns, objectives)).all(axis=1)


def _is_done(columns: Mapping[str, Any]) -> BoolArray:
    return np.asarray(columns["status"], dtype=object) == "done"


def undominated(cost: FloatArray) -> IntArray:
    """Return the rows of costs (n, m) that no other row dominates, ascending.

    A row dominates another if it is no larger anywhere and smaller somewhere.
    """
    # In this order a row is dominated only by rows before it.
    order = np.lexsort(cost.T[::-1])
    remaining = cost[order]
    done = 0
    while done < len(remaining):
        best = remaining[done]
        beaten = (remaining >= best).all(axis=1) & (remaining > best).any(axis=1)
        order, remaining = order[~beaten], remaining[~beaten]
        done += 1
    return np.sort(order)
