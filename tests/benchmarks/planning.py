"""Paths between random poses of one mode."""

from __future__ import annotations

import functools
from collections.abc import Iterator

import numpy as np
from scipy.spatial.transform import Rotation

from benchmarks.samples import DESIGN
from benchmarks.table import Row, seconds
from benchmarks.timing import Spread, elapsed
from explorer import Pose
from explorer.numerics.compiled import warm
from explorer.paths.planning import NoPathError, plan_path
from explorer.workspace.accessible.radii import with_radius
from explorer.workspace.limits.valid_poses import poses_are_valid

PATHS, SECONDS = 100, 2.0
RADIUS = 0.2
THICK = with_radius(DESIGN, RADIUS)
LOWS, HIGHS = [0.0, -12.0, 0.0], [20.0, 22.0, 18.0]


def random_pairs() -> Iterator[tuple[Pose, Pose]]:
    """Yield pairs of valid poses, anywhere in the box and of any orientation."""
    rng = np.random.default_rng(1)
    while True:
        positions = rng.uniform(LOWS, HIGHS, (2000, 3))
        rotations = Rotation.random(2000, random_state=rng).as_matrix()
        valid = poses_are_valid(THICK, positions, rotations)
        poses = [Pose.of(p, r) for p, r in zip(positions[valid], rotations[valid], strict=True)]
        yield from zip(poses[::2], poses[1::2], strict=False)


def run() -> Iterator[Row]:
    """Yield the rows."""
    warm()
    solved: list[float] = []
    apart = late = 0
    for start, goal in random_pairs():
        if len(solved) + late == PATHS:
            break
        try:
            took = elapsed(functools.partial(plan_path, THICK, start, goal, seconds=SECONDS))
        except NoPathError as error:
            # Proved to have none, so that no time would help.
            apart += error.reason == "other order"
            late += error.reason == "out of time"
        else:
            if took <= SECONDS:
                solved.append(took)
            else:
                late += 1
    spread = Spread.of(solved)
    yield Row(
        f"paths between random poses of one mode, radius {RADIUS}, within {SECONDS:g} s each",
        f"{len(solved)} of {PATHS} ({apart} more pairs proved to have none)",
        "95 of 100",
    )
    yield Row(
        "such a path found, proved and smoothed: median, 95 of 100, longest",
        f"{seconds(spread.p50)}, {seconds(spread.p95)}, {seconds(spread.longest)}",
    )
