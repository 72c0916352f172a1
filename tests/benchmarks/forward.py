"""The forward kinematics: a batch on one core, and one call."""

from __future__ import annotations

from collections.abc import Iterator

from benchmarks.samples import DESIGN, around_home, searches
from benchmarks.table import Row, per_second, seconds, times
from benchmarks.timing import best_of
from explorer import forward
from explorer.numerics.compiled import warm

COUNT, CALLS, ROUNDS = 100_000, 500, 100


def run() -> Iterator[Row]:
    """Yield the rows."""
    joints = around_home(COUNT).joints
    rows = [tuple(row) for row in joints[:CALLS].tolist()]
    warm()
    rate = COUNT / best_of(ROUNDS, lambda: forward(DESIGN, joints))
    once = best_of(ROUNDS, lambda: [forward(DESIGN, row) for row in rows]) / CALLS
    root = searches()
    yield Row(
        f"forward kinematics, batch of {COUNT:,}, all 8 modes, one core",
        per_second(rate),
        "5 million/s",
        f"scipy.optimize.root: {per_second(1.0 / root.seconds_each)} ({root}); "
        f"{times(rate * root.seconds_each)}",
    )
    yield Row(
        "one forward call, all 8 modes",
        seconds(once),
        "50 µs",
        f"scipy.optimize.root: {seconds(root.seconds_each)}, 1 mode; "
        f"{times(root.seconds_each / once)}",
    )
