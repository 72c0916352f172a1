"""All claims of the paper, measured again."""

from __future__ import annotations

import time
from collections.abc import Iterator

from benchmarks.table import Row, seconds
from explorer.numerics.compiled import warm
from explorer.reproduce.claims import CLAIMS, measure_claims


def run() -> Iterator[Row]:
    """Yield the rows."""
    warm()
    began = time.perf_counter()
    list(measure_claims())
    yield Row(
        f"the {len(CLAIMS)} claims of the paper", seconds(time.perf_counter() - began), "60 s"
    )
