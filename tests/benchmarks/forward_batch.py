"""The forward kinematics of a large batch on one core, all eight modes."""

from __future__ import annotations

from collections.abc import Iterator

from benchmarks.samples import DESIGN, around_home, searches
from benchmarks.table import Row, per_second, times
from benchmarks.timing import best_of
from explorer import forward
from explorer.numerics.compiled import warm

COUNT = 100_000


def run() -> Iterator[Row]:
    """Yield the row."""
    joints = around_home(COUNT).joints
    warm()
    forward(DESIGN, joints)
    rate = COUNT / best_of(100, lambda: forward(DESIGN, joints))
    root = searches()
    root_rate = 1.0 / root.seconds_each
    yield Row(
        f"forward kinematics, batch of {COUNT:,}, all 8 modes, one core",
        per_second(rate),
        "5 million/s",
        f"scipy.optimize.root: {per_second(root_rate)} ({root}); {times(rate / root_rate)}",
    )
