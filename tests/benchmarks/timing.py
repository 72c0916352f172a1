"""Durations that stand up to other work on the machine: the best of several, or the median."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np


def best_of(repeats: int, work: Callable[[], object]) -> float:
    """Return the shortest of several runs, in seconds: what the code takes undisturbed."""
    return min(elapsed(work) for _ in range(repeats))


def elapsed(work: Callable[[], object]) -> float:
    """Return the duration of one run in seconds."""
    start = time.perf_counter()
    work()
    return time.perf_counter() - start


class Spread(NamedTuple):
    """How durations are spread, in seconds."""

    p50: float
    p95: float
    longest: float

    @staticmethod
    def of(durations: Sequence[float]) -> Spread:
        """Return the spread of some durations."""
        p50, p95, longest = np.percentile(durations, [50, 95, 100]).tolist()
        return Spread(p50, p95, longest)
