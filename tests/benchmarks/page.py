"""From starting the explorer to the first byte of its page, compiled code kept or not."""

from __future__ import annotations

import statistics
import tempfile
from collections.abc import Iterator
from pathlib import Path

from benchmarks.processes import first_byte, fresh_home
from benchmarks.table import Row, seconds

RUNS, RUNS_WITHOUT_CACHE = 5, 3


def run() -> Iterator[Row]:
    """Yield the row."""
    first_byte()
    usual = [first_byte() for _ in range(RUNS)]
    empty = statistics.median(_without_cache() for _ in range(RUNS_WITHOUT_CACHE))
    yield Row(
        f"start of the explorer to the first byte of its page, median of {RUNS}",
        f"{seconds(statistics.median(usual))}, best {seconds(min(usual))}",
        "2.5 s",
        f"with no compiled code kept: {seconds(empty)}",
    )


def _without_cache() -> float:
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as folder:
        return first_byte(fresh_home(Path(folder)))
