"""A box drawn in around what keeps all limits, with certainty.

The box is divided into cells. At the best place of a cell a limit is kept by no more than at its
middle and half its diagonal, so that cells that break a limit even so are out (branch and prune).
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from explorer.numerics.arrays import FloatArray
from explorer.workspace.limits.constraints import Cone, Constraint, HalfSpace

# About as many cells are looked at in each round.
CELLS = 4096
MOST_ROUNDS = 60
# A round that leaves more of the box than this share is the last.
WORTH_WHILE = 0.8


def contracted(
    limits: Sequence[Constraint], lows: FloatArray, highs: FloatArray
) -> tuple[FloatArray, FloatArray] | None:
    """Return (lows, highs) of a smaller box with all of a box that keeps all limits, each (3,).

    None if nothing in it does. Cones count for nothing.
    """
    for _ in range(MOST_ROUNDS):
        size, volume = float((highs - lows).max()), float(np.prod(highs - lows))
        edge = max(volume / CELLS, (size / CELLS) ** 3) ** (1.0 / 3.0)
        many = np.maximum(1, np.ceil((highs - lows) / edge)).astype(np.int64)
        step = (highs - lows) / many
        cells = np.indices(tuple(many.tolist())).reshape(3, -1).T
        middles, half = lows + (cells + 0.5) * step, 0.5 * float(np.linalg.norm(step))
        # Rounding must not discard a cell whose very corner keeps the limits.
        half += 1e-12 * (size + float(np.abs([lows, highs]).max()))
        for limit in limits:
            if not isinstance(limit, Cone):
                steepest = np.linalg.norm(limit.normal) if isinstance(limit, HalfSpace) else 1.0
                kept = limit.slack(middles) >= -half * float(steepest)
                cells, middles = cells[kept], middles[kept]
        if not len(cells):
            return None
        highs = lows + (cells.max(axis=0) + 1) * step
        lows = lows + cells.min(axis=0) * step
        if float(np.prod(highs - lows)) > WORTH_WHILE * volume:
            break
    return lows, highs
