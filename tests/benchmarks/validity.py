"""Whether poses keep limits, margins and clearances, beside the same in plain Python."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from benchmarks.samples import DESIGN, around_home
from benchmarks.table import Row, per_second, seconds, times
from benchmarks.timing import best_of
from explorer import Pose, evaluate
from explorer.numerics.compiled import warm
from explorer.workspace.accessible.radii import with_radius
from explorer.workspace.limits.valid_moves import moves_are_valid
from explorer.workspace.limits.valid_poses import Rules, poses_are_valid, valid_rows

POSES, MOVES, PLAIN, ROUNDS = 200_000, 5_000, 200, 10
RADIUS = 0.2
THICK = with_radius(DESIGN, RADIUS)


def run() -> Iterator[Row]:
    """Yield the rows."""
    positions, rotations, _ = around_home(POSES)
    # Those that keep everything take the longest: nothing ends the check early.
    keep = poses_are_valid(THICK, positions, rotations)
    places = np.resize(positions[keep], (POSES, 3))
    turns = np.resize(rotations[keep], (POSES, 3, 3))
    rules, valid = Rules.of(THICK), np.empty(POSES, dtype=np.bool_)
    warm()

    def check() -> None:
        valid_rows(POSES, rules.row, rules.cones, places, turns, valid)

    rate = POSES / best_of(ROUNDS, check)
    poses = [Pose.of(p, r) for p, r in zip(places[:PLAIN], turns[:PLAIN], strict=True)]

    def plain() -> bool:
        snapshots = [evaluate(THICK, pose) for pose in poses]
        return all(
            not each.violations and bool((each.clearances.clearance > 0.0).all())
            for each in snapshots
        )

    slow = PLAIN / best_of(3, plain)
    yield Row(
        f"validity of a valid pose, {keep.mean():.0%} of those at hand, radius {RADIUS}, one core",
        per_second(rate),
        "2 million/s",
        f"the snapshot of each pose: {per_second(slow)}; {times(rate / slow)}",
    )
    ends, last = places[1 : MOVES + 1], turns[1 : MOVES + 1]

    def move() -> None:
        moves_are_valid(THICK, places[:MOVES], turns[:MOVES], ends, last, rules=rules)

    yield Row("validity of a whole straight move, proved", seconds(best_of(ROUNDS, move) / MOVES))
