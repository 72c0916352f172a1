"""The step from variables that miss some demands by little to the nearest that meet all.

A solver that lowers an objective ends where rounding keeps it from lowering both that and the
misses, which are then larger than the tolerance of limits. Here the demands alone count: each step
is the shortest that meets them to first order, found by least distance programming (C. L. Lawson,
R. J. Hanson, "Solving Least Squares Problems", 1974, chapter 23).
"""

from __future__ import annotations

import numpy as np

from explorer.errors import DesignError
from explorer.numerics.arrays import FloatArray
from explorer.optimise.search.model import Evaluation, Model

# Demands that are missed by more than this, dimensionless, are not missed by little.
NEARLY = 1e-6
# Each step squares the misses.
MOST_STEPS = 4
# Below this residual no step meets the demands to first order.
CONTRADICTION = 1e-9
# Cap on what a demand has to spare, over the worst miss.
FAR = 1e3


def nearest_feasible(model: Model, at: Evaluation) -> Evaluation | None:
    """Return the nearest evaluation that meets all demands; None if no step leads to one.

    Args:
        model: The problem.
        at: Evaluation that misses demands by little.
    """
    lows, highs = model.bounds.T
    for _ in range(MOST_STEPS):
        spare = model.worst(at)[0]
        if spare >= 0.0:
            break
        missed = np.abs(at.values[model.equalities]).max(initial=-spare)
        if not missed <= NEARLY:
            return None
        step = _shortest(model, at)
        if step is None:
            return None
        try:
            at = model.at(np.clip(at.u + step, lows, highs))
        except DesignError:
            return None
    return at if model.worst(at)[0] >= 0.0 else None


def _shortest(model: Model, at: Evaluation) -> FloatArray | None:
    """Return the shortest step that meets all demands and bounds to first order."""
    from scipy.optimize import nnls

    lows, highs = model.bounds.T
    equal, identity = model.equalities, np.eye(len(at.u))
    low, high = np.isfinite(lows), np.isfinite(highs)
    # The step is to make rows · step at least what is missing.
    rows = np.vstack([at.gradients, -at.gradients[equal], identity[low], -identity[high]])
    missing = np.concatenate(
        [-at.values, at.values[equal], (lows - at.u)[low], (at.u - highs)[high]]
    )
    # The step is proportional to the misses, so these may be in units of the worst one.
    unit = missing.max()
    goal = np.zeros(len(at.u) + 1)
    goal[-1] = 1.0
    matrix = np.vstack([rows.T, np.maximum(missing / unit, -FAR)])
    factors, norm = nnls(matrix, goal)
    if norm <= CONTRADICTION:
        return None
    residual = matrix @ factors - goal
    return -unit * residual[:-1] / residual[-1]
