"""Drags of a slider to and fro about a value, never to the same value twice in a row."""

from __future__ import annotations

import math


def sweep(middle: float, reach: float, count: int) -> list[float]:
    """Return values that swing about the middle, as far as the reach, in periods of two seconds."""
    return [middle + reach * math.sin(k / 10.0) for k in range(1, count + 1)]
