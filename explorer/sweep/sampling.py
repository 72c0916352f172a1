"""Samples of a study: each is a function of the study and its index alone.

Any process can therefore compute any chunk, in any order, repeatedly, in constant memory.

A Latin hypercube of n points needs a permutation of n for each variable. It is computed
entry by entry: a keyed Feistel network permutes the numbers of 2k bits, and an image that is n
or more is permuted again until it is less (cycle walking; J. Black and
P. Rogaway, "Ciphers with arbitrary finite domains", 2002).
"""

from __future__ import annotations

from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from explorer.numerics.arrays import FloatArray
from explorer.sweep.study import Study

WordArray: TypeAlias = NDArray[np.uint64]

# Rounds of the Feistel network; four make a permutation that looks random.
ROUNDS = 6


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
            shares = _latin(study, rows)
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


def _latin(study: Study, rows: range) -> FloatArray:
    count = study.count
    indices = np.arange(rows.start, rows.stop, dtype=np.uint64)
    columns: list[FloatArray] = []
    for seed in np.random.SeedSequence(study.sampling.seed).spawn(len(study.variables)):
        keys: WordArray = np.asarray(seed.generate_state(ROUNDS + 1, np.uint64), dtype=np.uint64)
        cell = permuted(indices, count, keys[:ROUNDS])
        # 53 bits of the mixed index make a number from 0 up to 1.
        within = (mixed(indices ^ keys[ROUNDS]) >> np.uint64(11)).astype(np.float64) * 2.0**-53
        columns.append((cell.astype(np.float64) + within) / count)
    return np.column_stack(columns)


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


def permuted(numbers: WordArray, count: int, keys: WordArray) -> WordArray:
    """Return the images of numbers under a keyed permutation of 0 to count − 1.

    Args:
        numbers: Numbers below the count, shape (n,).
        count: Count of all numbers, up to 2^62.
        keys: Key of each round, shape (ROUNDS,).
    """
    half = np.uint64(max(1, -(-(count - 1).bit_length() // 2)))
    mask = (np.uint64(1) << half) - np.uint64(1)
    images = numbers.copy()
    outside = np.ones(len(images), dtype=np.bool_)
    while outside.any():
        left, right = images[outside] >> half, images[outside] & mask
        for key in keys:
            left, right = right, left ^ (mixed(right ^ key) & mask)
        images[outside] = (left << half) | right
        outside = images >= count
    return images


def mixed(words: WordArray) -> WordArray:
    """Return 64-bit words with all bits mixed (the finaliser of SplitMix64, S. Vigna)."""
    words = words + np.uint64(0x9E3779B97F4A7C15)
    words = (words ^ (words >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
    words = (words ^ (words >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
    return words ^ (words >> np.uint64(31))
