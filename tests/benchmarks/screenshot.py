"""`explorer screenshot` on a machine that has never run the explorer."""

from __future__ import annotations

import statistics
import tempfile
from collections.abc import Iterator
from pathlib import Path

from benchmarks.processes import EXPLORER, fresh_home, run_to_end
from benchmarks.table import Row, seconds
from benchmarks.timing import elapsed
from explorer.app.browser.chromium import find_chromium

RUNS = 5
TITLE = "first `explorer screenshot` of 1280 × 800, software renderer"
TARGET = "7 s"


def run() -> Iterator[Row]:
    """Yield the row."""
    if find_chromium() is None:
        yield Row(TITLE, "not measured: no Chromium", TARGET)
        return
    times = [_screenshot() for _ in range(RUNS)]
    yield Row(
        f"{TITLE}, median of {RUNS}",
        f"{seconds(statistics.median(times))}, best {seconds(min(times))}",
        TARGET,
    )


def _screenshot() -> float:
    """Return the seconds of one command with an empty home."""
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as folder:
        environment = {**fresh_home(Path(folder)), "HOME": folder}
        out = str(Path(folder) / "shot.png")
        command = (*EXPLORER, "screenshot", "--size", "1280x800", "--out", out)
        return elapsed(lambda: run_to_end(*command, environment=environment))
