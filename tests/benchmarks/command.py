"""Wall time of a command, and of importing the package, beside the bare interpreter."""

from __future__ import annotations

import statistics
import sys
from collections.abc import Iterator

from benchmarks.processes import EXPLORER, run_to_end
from benchmarks.table import Row, seconds
from benchmarks.timing import elapsed

RUNS = 9
POSE = ("--position", "10", "5", "9", "--yaw-pitch-roll", "-73", "0", "0")


def run() -> Iterator[Row]:
    """Yield a row of the command and one of the import."""
    command = _median(*EXPLORER, "inverse", "--json", *POSE)
    imported = _median(sys.executable, "-c", "import explorer")
    numpy = _median(sys.executable, "-c", "import numpy")
    bare = _median(sys.executable, "-c", "pass")
    yield Row(
        f"explorer inverse --json, median of {RUNS}",
        seconds(command),
        beside=f"python -c 'import numpy': {seconds(numpy)}",
    )
    yield Row(
        f"python -c 'import explorer', median of {RUNS}",
        seconds(imported),
        beside=f"python -c pass: {seconds(bare)}",
    )


def _median(*command: str) -> float:
    run_to_end(*command)
    return statistics.median(elapsed(lambda: run_to_end(*command)) for _ in range(RUNS))
