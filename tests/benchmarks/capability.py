"""The share of all orientations that a position allows, beside asking pose by pose."""

from __future__ import annotations

from collections.abc import Iterator

from benchmarks.samples import DESIGN
from benchmarks.table import Row, seconds, times
from benchmarks.timing import best_of, elapsed
from explorer import Pose, evaluate, home_pose
from explorer.numerics.compiled import warm
from explorer.workspace.orientations import orientation_capability, uniform_rotations

ORIENTATIONS, ONE_BY_ONE = 100_000, 1_000


def run() -> Iterator[Row]:
    """Yield the row."""
    warm()
    position = home_pose(DESIGN).position
    rotations = uniform_rotations(ORIENTATIONS)
    duration = best_of(10, lambda: orientation_capability(DESIGN, position, rotations))
    poses = [Pose.of(position, rotation) for rotation in rotations[:ONE_BY_ONE]]
    mode = evaluate(DESIGN, home_pose(DESIGN)).mode

    def one_by_one() -> int:
        found = (evaluate(DESIGN, pose) for pose in poses)
        return sum(not each.violations and each.mode == mode for each in found)

    single = elapsed(one_by_one) * ORIENTATIONS / ONE_BY_ONE
    yield Row(
        "orientation capability, 100,000 orientations",
        seconds(duration),
        "50 ms",
        f"explorer.evaluate pose by pose: {seconds(single)}; {times(single / duration)}",
    )
