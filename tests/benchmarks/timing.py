"""Durations that stand up to other work: the best of several, or the median; and commands."""

from __future__ import annotations

import os
import subprocess
import sys
import time
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

ROOT = Path(__file__).resolve().parents[2]
EXPLORER = (sys.executable, "-m", "explorer")


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


def run_to_end(*command: str, environment: Mapping[str, str] = os.environ) -> None:
    """Run a command and wait for it; its output is dropped.

    Raises:
        subprocess.CalledProcessError: it did not end well.
    """
    subprocess.run(command, cwd=ROOT, check=True, capture_output=True, env=environment)
