"""Where searches begin: designs out of a low-discrepancy sequence, positions on a grid."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from explorer.arrays import FloatArray
from explorer.errors import DesignError
from explorer.optimise.problem import DISTANCES, Problem, distance_of

# Positions an axis at which clearance is demanded at first; more come where they matter.
POSITIONS = 9
# Tries for each start, before the bounds are taken to leave no room.
TRIES = 64


def more_starts(problem: Problem, count: int, seed: int) -> Iterator[tuple[float, ...]]:
    """Yield values of the variables, spread evenly within their bounds (Sobol, scrambled).

    Those nearer to a degenerate design than is allowed are left out.
    """
    if count <= 0:
        return
    from scipy.stats import qmc

    lows = np.array([each.low for each in problem.variables])
    highs = np.array([each.high for each in problem.variables])
    sequence = qmc.Sobol(len(lows), rng=seed)
    found = 0
    for _ in range(TRIES * count):
        values = tuple((lows + (highs - lows) * sequence.random(1)[0]).tolist())
        try:
            design = problem.design_at(values)
        except DesignError:
            continue
        if all(abs(distance_of(design, name)) >= problem.demands.least for name in DISTANCES):
            yield values
            found += 1
            if found == count:
                return


def first_positions(problem: Problem) -> FloatArray:
    """Return the positions at which clearance is demanded at first, shape (k, 3).

    They fill the box, or without one the cube of the start's reach.
    """
    if problem.demands.clearance is None:
        return np.zeros((0, 3))
    reach = problem.start.reach
    lows, highs = problem.start.limits.box or ((-reach,) * 3, (reach,) * 3)
    axes = [np.linspace(low, high, POSITIONS) for low, high in zip(lows, highs, strict=True)]
    return np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
