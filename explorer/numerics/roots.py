"""Roots of many functions of a parameter at once, each between two ends."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from explorer.numerics.arrays import FloatArray

# Most steps of a search.
STEPS = 40


def find_roots(
    value: Callable[[FloatArray], FloatArray], low: FloatArray, high: FloatArray, tolerance: float
) -> FloatArray:
    """Return where n functions of a parameter from 0 to 1 are zero, shape (n,).

    They are `low` at 0, not above zero, and `high` at 1, not below it. Their roots are found to a
    tolerance of their values by the method of false position in the Illinois variant, which keeps
    the root between two ends.
    """
    start, end = np.zeros(len(low)), np.ones(len(low))
    last = np.zeros(len(low), dtype=np.int64)
    at = start
    for _ in range(STEPS * bool(len(low))):
        # A function that is zero at both ends has the root 0.
        share = np.divide(-low, high - low, out=np.zeros(len(low)), where=high > low)
        at = start + (end - start) * share
        here = value(at)
        if float(np.abs(here).max()) <= tolerance:
            break
        below = here < 0.0
        side = np.where(below, -1, 1)
        # An end that stays for the second time counts half.
        again = side == last
        low = np.where(below, here, np.where(again, 0.5 * low, low))
        high = np.where(below, np.where(again, 0.5 * high, high), here)
        start, end = np.where(below, at, start), np.where(below, end, at)
        last = side
    return at
