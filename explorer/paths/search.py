"""Paths by search: a tree of lines in the fold coordinates of a mode, made shorter and rounder.

A mode is a box of fold coordinates without a singularity inside, so the search has to avoid the
other limits alone. OMPL's RRT-Connect (Kuffner and LaValle 2000) grows a tree of straight lines
from both ends. Then random points of the path are joined by straight moves where that is shorter,
and its corners are cut off. A proof covers every line and every new move as a whole (see
`explorer.paths.proofs`), so no step is too coarse; the rest of an old move is valid as part of it.
"""

from __future__ import annotations

import functools
import importlib
import itertools
import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from explorer.errors import MissingExtraError
from explorer.legs.moves import poses_between
from explorer.mechanism.design import Design
from explorer.mechanism.folds import write_poses
from explorer.mechanism.pose import Pose
from explorer.numerics.arrays import FloatArray
from explorer.paths.proofs import Proofs, positions_and_rotations
from explorer.singularity.nearest import displacement
from explorer.workspace.limits.quantities import valid_rows

# The longest line of a tree, as a share of the extent of the space.
LONGEST_LINE = 0.25
# Shortcuts tried in a round, rounds without gain that end the search, and the most rounds.
TRIES, MOST_IDLE_ROUNDS, MOST_ROUNDS = 24, 4, 60
# The least gain, as a share of the path's length.
GAIN = 1e-3
# Cuts of a corner, as shares of the two moves beside it, widest first; rounds of cutting.
CUTS, CUT_ROUNDS = (0.25, 0.08), 3


@functools.cache
def load_ompl() -> tuple[Any, Any]:
    """Return OMPL's modules of spaces and of planners, which have no types.

    It is quiet, and its random numbers are the same in every process.

    Raises:
        MissingExtraError: OMPL is not installed.
    """
    names = ("ompl.util", "ompl.base", "ompl.geometric")
    try:
        util, base, geometric = map(importlib.import_module, names)
    except ImportError:
        raise MissingExtraError(
            "a path that is not straight in the folds needs OMPL: pip install "
            "'flagged-explorer[planning]'"
        ) from None
    util.setLogLevel(util.LOG_NONE)
    util.RNG.setSeed(1)
    return base, geometric


def search_tree(
    proofs: Proofs, first: FloatArray, last: FloatArray, seconds: float
) -> tuple[FloatArray | None, int]:
    """Return the corners of a path in folds, (n, 6), and the number of lines checked.

    The corners are None if the time was too short. The first and the last corner, shape (6,), are
    in the same mode, and the moves between corners straight.

    Raises:
        MissingExtraError: OMPL is not installed.
    """
    base, geometric = load_ompl()
    # OMPL measures distances in all coordinates alike, hence r over the reach.
    units = np.array([proofs.design.reach, 1.0, 1.0, 1.0, 1.0, 1.0])
    checked = 0

    def folds_of(state: Any) -> FloatArray:
        return np.array([state[i] for i in range(6)]) * units

    def state_of(folds: FloatArray) -> Any:
        state = space.allocState()
        for axis, value in enumerate((folds / units).tolist()):
            state[axis] = value
        return state

    def state_is_valid(state: Any) -> bool:
        p, r, valid = np.empty((1, 3)), np.empty((1, 3, 3)), np.empty(1, dtype=np.bool_)
        write_poses(1, folds_of(state)[None], p, r)
        valid_rows(1, proofs.rules.row, proofs.rules.demands, p, r, valid)
        return bool(valid[0])

    def line_is_valid(_: Any, start: Any, end: Any) -> bool:
        nonlocal checked
        checked += 1
        return proofs.prove_line(folds_of(start), folds_of(end)) is not None

    space, bounds = base.RealVectorStateSpace(6), base.RealVectorBounds(6)
    lows, highs = _box(proofs.design, first, last)
    for axis, (low, high) in enumerate(zip(lows / units, highs / units, strict=True)):
        bounds.setLow(axis, low)
        bounds.setHigh(axis, high)
    space.setBounds(bounds)
    setup = geometric.SimpleSetup(space)
    information = setup.getSpaceInformation()
    setup.setStateValidityChecker(state_is_valid)
    # The class is made here since OMPL is imported late.
    validator = type("LineValidator", (base.MotionValidator,), {"checkMotion": line_is_valid})
    motions = validator(information)
    information.setMotionValidator(motions)
    setup.setStartAndGoalStates(state_of(first), state_of(last))
    planner = geometric.RRTConnect(information)
    planner.setRange(LONGEST_LINE * space.getMaximumExtent())
    setup.setPlanner(planner)
    setup.solve(seconds)
    if not setup.haveExactSolutionPath():
        return None, checked
    corners = [first[None]]
    for ends in itertools.pairwise(map(folds_of, setup.getSolutionPath().getStates())):
        line = proofs.prove_line(*ends)
        if line is None:
            # It was proven from its other end, and has too many steps from this one.
            line = proofs.prove_line(*reversed(ends))
            if line is None:
                return None, checked
            line = line[::-1]
        corners.append(line[1:])
    return np.concatenate(corners), checked


def _box(design: Design, first: FloatArray, last: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return lows and highs of a box of fold coordinates that holds the poses of the mode."""
    # A mode has one sign for each fold, and leg 4 and the box bound the distance of b4 from a1.
    farthest = design.reach + design.length_range("l4")[1]
    if design.limits.box is not None:
        farthest = min(farthest, math.hypot(*np.abs(design.limits.box).max(axis=0)))
    lows = np.array([0.0, 0.0, 0.0, *np.minimum(np.sign(first[3:]) * math.pi, 0.0)])
    highs = np.array([farthest, math.pi, math.pi, *(lows[3:] + math.pi)])
    # The ends may be beyond the limits by rounding.
    return np.minimum(lows, np.minimum(first, last)), np.maximum(highs, np.maximum(first, last))


def lengths_of_moves(design: Design, poses: Sequence[Pose]) -> FloatArray:
    """Return the root-mean-square displacement of b1 to b4 between n + 1 poses, shape (n,)."""
    p, r = positions_and_rotations(poses)
    return displacement(design, p[:-1], r[:-1], p[1:], r[1:])


def smooth(proofs: Proofs, poses: Sequence[Pose], seed: int = 0) -> tuple[Pose, ...]:
    """Return a path with the same ends, shorter and with its corners cut off.

    Args:
        proofs: Proofs that moves are valid.
        poses: Corners of the path.
        seed: Seed of the random shortcuts.
    """
    return tuple(_cut_corners(proofs, _shorten(proofs, list(poses), seed)))


def _shorten(proofs: Proofs, poses: list[Pose], seed: int) -> list[Pose]:
    rng = np.random.default_rng(seed)
    idle_rounds = 0
    for _ in range(MOST_ROUNDS):
        if len(poses) < 3 or idle_rounds >= MOST_IDLE_ROUNDS:
            break
        ends = np.concatenate([[0.0], np.cumsum(lengths_of_moves(proofs.design, poses))])
        pairs = np.sort(rng.uniform(0.0, ends[-1], (TRIES, 2)), axis=1)
        # Some shortcuts go from corner to corner.
        pairs[0] = ends[0], ends[-1]
        pairs[1:4] = np.sort(ends[rng.integers(0, len(ends), (3, 2))], axis=1)
        shortcuts = [_shortcut(proofs, poses, ends, *pair) for pair in pairs.tolist()]
        least = GAIN * float(ends[-1])
        worthwhile = sorted((cut for cut in shortcuts if cut[0] > least), key=lambda cut: -cut[0])
        valid = proofs.are_valid([cut[1] for cut in worthwhile]) if worthwhile else []
        shortened = next(itertools.compress((path for _, _, path in worthwhile), valid), None)
        idle_rounds = 0 if shortened else idle_rounds + 1
        poses = shortened or poses
    return poses


def _shortcut(
    proofs: Proofs, poses: list[Pose], ends: FloatArray, first: float, last: float
) -> tuple[float, tuple[Pose, Pose], list[Pose]]:
    """Return what a straight move between two points of a path saves, the move, and the new path.

    The points are given by their distances along the path, as are its corners, shape (n,).
    """
    (i, start), (j, end) = (_pose_after(proofs, poses, ends, each) for each in (first, last))
    if i == j:
        return 0.0, (start, end), poses
    gain = last - first - float(lengths_of_moves(proofs.design, [start, end])[0])
    path = [*poses[: i + 1], start, end, *poses[j + 1 :]]
    return gain, (start, end), [path[0], *(b for a, b in itertools.pairwise(path) if a != b)]


def _pose_after(
    proofs: Proofs, poses: list[Pose], ends: FloatArray, distance: float
) -> tuple[int, Pose]:
    """Return the number of the move, and the pose, at a distance along the path."""
    index = int(np.searchsorted(ends, distance, side="right")) - 1
    if index >= len(poses) - 1:
        return len(poses) - 2, poses[-1]
    share = (distance - float(ends[index])) / float(ends[index + 1] - ends[index])
    return index, _pose_between(proofs, poses[index], poses[index + 1], share)


def _pose_between(proofs: Proofs, start: Pose, end: Pose, share: float) -> Pose:
    return Pose.of(*poses_between(start, end, share, proofs.tool)) if share else start


def _cut_corners(proofs: Proofs, poses: list[Pose]) -> list[Pose]:
    for _ in range(CUT_ROUNDS):
        if len(poses) < 3:
            break
        corners = list(zip(poses, poses[1:], poses[2:], strict=False))
        cuts = [
            [
                (_pose_between(proofs, b, a, share), _pose_between(proofs, b, c, share))
                for share in CUTS
            ]
            for a, b, c in corners
        ]
        valid = iter(proofs.are_valid([cut for choices in cuts for cut in choices]))
        path: list[Pose] = [poses[0]]
        for (_, corner, _), choices in zip(corners, cuts, strict=True):
            possible = [cut for cut in choices if next(valid)]
            path += possible[0] if possible else (corner,)
        poses = [*path, poses[-1]]
    return poses
