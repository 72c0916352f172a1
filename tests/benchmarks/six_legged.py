"""All numbers of a table on six legs, and its volume, beside random positions in NumPy."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from benchmarks.table import Row, seconds, times
from benchmarks.timing import best_of, elapsed
from explorer.mechanism.design_file import PRESETS
from explorer.numerics.compiled import warm
from explorer.six_legged.case import TableCase
from explorer.six_legged.files import TABLES, made_equal

TABLE = TABLES["two circles"]
REPEATS, POSITIONS = 5, 1_000_000
SHORT = {"REPEATS": 1, "POSITIONS": 10_000}


def run() -> Iterator[Row]:
    """Yield the rows."""
    warm()
    duration = best_of(REPEATS, lambda: TableCase(TABLE).measurements)
    yield Row("all numbers of a table on six legs", seconds(duration), "1 s")
    with_cones = made_equal(TABLE, PRESETS["buildable"])
    duration = best_of(REPEATS, lambda: TableCase(with_cones).measurements)
    yield Row("the same with a cone at each joint", seconds(duration), "1 s")
    duration = best_of(REPEATS, lambda: TableCase(TABLE).volume)
    shares: list[float] = []
    sampled = elapsed(lambda: shares.append(share()))
    error = ((1.0 - shares[0]) / (shares[0] * POSITIONS)) ** 0.5
    yield Row(
        "exact volume of a table, with its gradient",
        seconds(duration),
        beside=f"NumPy with {POSITIONS:,} random positions, to {error:.1%}: {seconds(sampled)}; "
        f"{times(sampled / duration)}",
    )


def share() -> float:
    """Return the share of a box of positions within the lengths at home's orientation."""
    longest, shortest = np.array(TABLE.longest_mm), np.array(TABLE.shortest_mm)
    apexes = np.array(TABLE.base_mm) - np.array(TABLE.platform_mm) @ TABLE.home_pose.rotation.T
    lows, highs = (apexes - longest[:, None]).max(axis=0), (apexes + longest[:, None]).min(axis=0)
    points = np.random.default_rng(1).uniform(lows, highs, (POSITIONS, 3))
    lengths = np.linalg.norm(points[:, None] - apexes, axis=2)
    return float(((lengths >= shortest) & (lengths <= longest)).all(axis=1).mean())
