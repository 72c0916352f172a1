"""One call of the forward kinematics, as a slider makes it."""

from __future__ import annotations

from collections.abc import Iterator

from benchmarks.samples import DESIGN, around_home, searches
from benchmarks.table import Row, seconds, times
from benchmarks.timing import best_of
from explorer import forward
from explorer.numerics.compiled import warm

CALLS = 500


def run() -> Iterator[Row]:
    """Yield the row."""
    rows = [tuple(row) for row in around_home(CALLS).joints.tolist()]
    warm()

    def calls() -> None:
        for joints in rows:
            forward(DESIGN, joints)

    duration = best_of(100, calls) / CALLS
    root = searches().seconds_each
    yield Row(
        "one forward call, all 8 modes",
        seconds(duration),
        "50 µs",
        f"scipy.optimize.root: {seconds(root)}, 1 mode; {times(root / duration)}",
    )
