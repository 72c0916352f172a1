"""The exact volume of the workspace and its gradient, beside counting voxels."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from benchmarks.samples import DESIGN
from benchmarks.table import Row, seconds, times
from benchmarks.timing import best_of
from explorer.numerics.compiled import warm
from explorer.workspace.limits.constraints import constraints
from explorer.workspace.limits.region import region_of
from explorer.workspace.slices.nodes import count_nodes
from explorer.workspace.slices.volume import bounds, home_rotation, workspace_volume

CALLS, ROUNDS = 20, 20
VOXELS = 480


def run() -> Iterator[Row]:
    """Yield the rows."""
    warm()
    exact = workspace_volume(DESIGN).volume

    def calls() -> None:
        for _ in range(CALLS):
            workspace_volume(DESIGN)

    duration = best_of(ROUNDS, calls) / CALLS
    counted, count_time = _voxels()
    yield Row(
        "exact volume with its gradient, one core",
        seconds(duration),
        "2 ms, gradient 4 times",
        f"{VOXELS}³ voxels, compiled: {seconds(count_time)} at an error of "
        f"{abs(counted / exact - 1.0):.1g}; {times(count_time / duration)}",
    )


def _voxels() -> tuple[float, float]:
    """Return the volume by voxels whose centre is inside, and how long counting takes."""
    region = region_of(constraints(DESIGN, home_rotation(DESIGN)))
    lows, highs = bounds(region)
    step = float((highs - lows).max()) / VOXELS
    counts = np.ceil((highs - lows) / step).astype(np.int64)
    found = np.zeros(7, dtype=np.int64)

    def count() -> None:
        count_nodes(
            int(counts.prod()),
            region.circles,
            region.planes,
            region.cones,
            np.array([region.low, region.high]),
            0.0,
            lows / step + 0.5,
            counts,
            step,
            found,
        )

    duration = best_of(3, count)
    return int(found[0]) * step**3, duration
