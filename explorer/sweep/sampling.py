"""Samples of a study: each is a function of the study and its index alone.

Any process can therefore compute any chunk, in any order, repeatedly.
"""

from __future__ import annotations

import functools

import numpy as np

from explorer.numerics.arrays import FloatArray
from explorer.sweep.study import Study


def samples(study: Study, rows: range) -> FloatArray:
    """Return the values of the variables of some designs.

    Args:
        study: The study.
        rows: Indices of the designs, without gaps.

    Returns:
        Values in the order of the study's variables, shape (len(rows), d).
    """
    ends = np.array(list(study.variables.values()))
    lows, highs = ends[:, 0], ends[:, 1]
    match study.sampling.method:
        case "sobol":
            shares = _sobol(study, rows)
        case "latin-hypercube":
            shares = _hypercube(len(ends), study.count, study.sampling.seed)[rows.start : rows.stop]
        case "grid":
            shares = _grid(study, rows)
    # Rounding must not lead beyond the ends.
    return np.clip(lows + (highs - lows) * shares, lows, highs)


def _sobol(study: Study, rows: range) -> FloatArray:
    from scipy.stats import qmc

    sequence = qmc.Sobol(len(study.variables), rng=study.sampling.seed)
    # SciPy warns of other than powers of two in the first draw, so that is one point.
    first = sequence.random(1)
    if rows.start > 1:
        sequence.fast_forward(rows.start - 1)
    others = len(rows) - (rows.start == 0)
    points = sequence.random(others) if others else first[:0]
    return points if rows.start > 0 else np.concatenate([first, points])


@functools.lru_cache(1)
def _hypercube(variables: int, count: int, seed: int) -> FloatArray:
    """Return the whole hypercube, shape (count, variables), which a process makes once."""
    from scipy.stats import qmc

    return qmc.LatinHypercube(variables, rng=seed).random(count)


def _grid(study: Study, rows: range) -> FloatArray:
    shape = study.shape
    at = np.unravel_index(np.arange(rows.start, rows.stop), shape)
    # A single value lies in the middle of the range.
    return np.column_stack(
        [
            index / (count - 1.0) if count > 1 else np.full(len(rows), 0.5)
            for index, count in zip(at, shape, strict=True)
        ]
    )
