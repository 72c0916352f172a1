"""Contraction of a box around the positions that satisfy all limits, with certainty.

The box is divided into cells. The slack of a limit anywhere in a cell exceeds the slack at the
middle of the cell by at most half its diagonal, so cells whose slack remains negative are
discarded (branch and prune).
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from explorer.numerics.arrays import FloatArray
from explorer.workspace.limits.constraints import Cone, Constraint, HalfSpace

# The approximate count of cells in each round.
CELLS = 4096
MOST_ROUNDS = 60
# A round that leaves more than this share of the box's volume is the last.
WORTH_WHILE = 0.8


def contract_box(
    limits: Sequence[Constraint], lows: FloatArray, highs: FloatArray
) -> tuple[FloatArray, FloatArray] | None:
    """Return (lows, highs) of a smaller box that holds all positions within the limits.

    Ends have the shape (3,), in design units. The result is None if no position of the box is
    within the limits. Cones are ignored.
    """
    for _ in range(MOST_ROUNDS):
        size, volume = float((highs - lows).max()), float(np.prod(highs - lows))
        edge = max(volume / CELLS, (size / CELLS) ** 3) ** (1.0 / 3.0)
        counts = np.maximum(1, np.ceil((highs - lows) / edge)).astype(np.int64)
        step = (highs - lows) / counts
        cells = np.indices(tuple(counts.tolist())).reshape(3, -1).T
        middles, half = lows + (cells + 0.5) * step, 0.5 * float(np.linalg.norm(step))
        # Rounding must not discard a cell of which only a corner satisfies the limits.
        half += 1e-12 * (size + float(np.abs([lows, highs]).max()))
        for limit in limits:
            if not isinstance(limit, Cone):
                steepest = np.linalg.norm(limit.normal) if isinstance(limit, HalfSpace) else 1.0
                satisfiable = limit.slack(middles) >= -half * float(steepest)
                cells, middles = cells[satisfiable], middles[satisfiable]
        if not len(cells):
            return None
        highs = lows + (cells.max(axis=0) + 1) * step
        lows = lows + cells.min(axis=0) * step
        if float(np.prod(highs - lows)) > WORTH_WHILE * volume:
            break
    return lows, highs
