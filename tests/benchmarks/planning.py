"""Paths between random poses of one mode, beside OMPL with the checks in plain Python."""

from __future__ import annotations

import functools
import importlib
import itertools
from collections.abc import Iterator
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from benchmarks.samples import DESIGN
from benchmarks.table import Row, seconds, times
from benchmarks.timing import Spread, elapsed
from explorer import Pose, evaluate
from explorer.numerics.compiled import warm
from explorer.paths.planning import NoPathError, plan_path
from explorer.workspace.accessible.radii import with_radius
from explorer.workspace.limits.valid_poses import poses_are_valid

PATHS, PLAIN, SECONDS = 100, 10, 2.0
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
    joined: list[tuple[Pose, Pose]] = []
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
            joined.append((start, goal))
            if took <= SECONDS:
                solved.append(took)
            else:
                late += 1
    spread = Spread.of(solved)
    plain = [_plain(*pair) for pair in itertools.islice(joined, PLAIN)]
    slow = Spread.of([took for _, took in plain])
    yield Row(
        f"paths between random poses of one mode, radius {RADIUS}, within {SECONDS:g} s each",
        f"{len(solved)} of {PATHS} ({apart} more pairs proved to have none)",
        "95 of 100",
        f"OMPL with a plain Python check: {sum(found for found, _ in plain)} of {PLAIN}",
    )
    yield Row(
        "such a path found, proved and smoothed: median, 95 of 100, longest",
        f"{seconds(spread.p50)}, {seconds(spread.p95)}, {seconds(spread.longest)}",
        beside=f"not proved nor smoothed: median {seconds(slow.p50)}; "
        f"{times(slow.p50 / spread.p50)}",
    )


def _plain(start: Pose, goal: Pose) -> tuple[bool, float]:
    """Let OMPL look for a path by the snapshot of each pose, at its own resolution."""
    base: Any = importlib.import_module("ompl.base")
    geometric: Any = importlib.import_module("ompl.geometric")
    space = base.SE3StateSpace()
    bounds = base.RealVectorBounds(3)
    for axis in range(3):
        bounds.setLow(axis, LOWS[axis])
        bounds.setHigh(axis, HIGHS[axis])
    space.setBounds(bounds)
    setup = geometric.SimpleSetup(space)

    def is_valid(state: Any) -> bool:
        q = state.rotation()
        pose = Pose((state.getX(), state.getY(), state.getZ()), (q.w, q.x, q.y, q.z))
        snapshot = evaluate(THICK, pose)
        return not snapshot.violations and bool((snapshot.clearances.clearance > 0.0).all())

    setup.setStateValidityChecker(is_valid)
    ends: list[Any] = []
    for pose in (start, goal):
        state = space.allocState()
        state.setXYZ(*pose.position)
        q = state.rotation()
        q.w, q.x, q.y, q.z = pose.quaternion
        ends.append(state)
    setup.setStartAndGoalStates(*ends)
    setup.setPlanner(geometric.RRTConnect(setup.getSpaceInformation()))
    took = elapsed(lambda: setup.solve(SECONDS))
    return bool(setup.haveExactSolutionPath()), took
