"""Proofs that moves and lines in the folds are valid, and paths by search.

A straight line in fold coordinates between two poses of one mode meets no singularity, and along
it no |δi| is below the smaller of its two ends (see `explorer.mechanism.folds`). It is cut into
straight moves, which come the closer to it the shorter they are, until each is proven valid. There
is an end of that where another limit is exceeded, and for lines that run along a wall of the mode
so closely, at some 10⁻⁵ of the reach or less, that they would need more moves than are tried.

A search has to avoid the other limits alone. OMPL's RRT-Connect (Kuffner and LaValle 2000) grows a
tree of such lines from both ends. Then random points of the path are joined by straight moves where
that is shorter. A proof covers every line and every new move as a whole, so no step is too coarse;
the rest of an old move is valid as part of it. Loads are sampled.
"""

from __future__ import annotations

import functools
import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from explorer.files.extras import load_extra
from explorer.legs.moves import StraightMoves, poses_between
from explorer.mechanism.design import Design
from explorer.mechanism.folds import from_folds, write_pose, write_poses
from explorer.mechanism.pose import Pose, Triple
from explorer.numerics.arrays import FloatArray, IntArray
from explorer.numerics.compiled import kernel
from explorer.paths.loads import DemandedLoad
from explorer.singularity.nearest import displacement
from explorer.workspace.limits import valid_moves
from explorer.workspace.limits.quantities import valid_rows
from explorer.workspace.limits.valid_moves import count_steps, make_check
from explorer.workspace.limits.valid_poses import Rules

# The shortest move is this share of a line; a line has at most so many moves.
SHORTEST, MOST_MOVES = 2.0**-12, 256
# Steps along all moves that are tried on a line; a step takes half a microsecond.
MOST_STEPS = 50_000
# Number of poses whose check takes as long as that of a line, by which a kernel is loaded at once.
ROWS_OF_LINE = 400
# The longest line of a tree, as a share of the extent of the space.
LONGEST_LINE = 0.25
# Shortcuts tried in a round, rounds without gain that end the search, and the most rounds.
TRIES, MOST_IDLE_ROUNDS, MOST_ROUNDS = 24, 4, 60
# The least gain, as a share of the path's length.
GAIN = 1e-3


@dataclass(frozen=True)
class Proofs:
    """Proofs under one set of rules.

    Attributes:
        design: The manipulator.
        rules: Rules that every pose keeps.
        tool: Point that moves straight in the platform frame, in design units; None for b4.
        load: Load that the moves hold; None for none.
        tolerance: Length by which limits may be exceeded between poses that keep them, in design
            units; a 10,000th of the reach if None.
    """

    design: Design
    rules: Rules
    tool: Triple | None = None
    load: DemandedLoad | None = None
    tolerance: float | None = None

    def are_valid(self, moves: Sequence[tuple[Pose, Pose]]) -> list[bool]:
        """Return whether each straight move, given by its ends, is proven valid; one or more."""
        (p, r), (q, s) = (positions_and_rotations(ends) for ends in zip(*moves, strict=True))
        rules, tool, tolerance = self.rules, self.tool, self.tolerance
        valid = valid_moves.moves_are_valid(
            self.design, p, r, q, s, rules=rules, tolerance=tolerance, tool=tool
        )
        if self.load is not None and valid.any():
            ends = p[valid], r[valid], q[valid], s[valid]
            valid[valid] = self.load.holds_along(StraightMoves.between(*ends, tool))
        return valid.tolist()

    def prove_line(self, first: FloatArray, last: FloatArray) -> FloatArray | None:
        """Return the corners of a straight line in the folds, (n, 6), or None if it is not proven.

        The moves between the corners are straight, and as long as is proven. The first and the last
        corner are in the same mode.
        """
        tool = np.zeros(3) if self.tool is None else np.array(self.tool)
        shares, count = np.zeros(MOST_MOVES + 1), np.zeros(1, dtype=np.int64)
        row, demands, tolerance = self.rules.row, self.rules.demands, self.tolerance
        if tolerance is None:
            tolerance = valid_moves.DEFAULT_TOLERANCE * self.design.reach
        divide_line(ROWS_OF_LINE, row, demands, first, last, tool, tolerance, shares[1:], count)
        if not count[0]:
            return None
        share = shares[: count[0] + 1, None]
        corners = (1.0 - share) * first + share * last
        if self.load is not None:
            p, r = from_folds(corners)
            moves = StraightMoves.between(p[:-1], r[:-1], p[1:], r[1:], tool)
            if not self.load.holds_along(moves).all():
                return None
        return corners


def positions_and_rotations(poses: Sequence[Pose]) -> tuple[FloatArray, FloatArray]:
    """Return the positions (n, 3) and the rotations (n, 3, 3) of poses."""
    return np.array([pose.position for pose in poses]), np.array([pose.rotation for pose in poses])


@kernel("void(f8[::1], f8[:,::1], f8[::1], f8[::1], f8[::1], f8, f8[::1], i8[::1])")
def divide_line(
    row: FloatArray,
    demands: FloatArray,
    first: FloatArray,
    last: FloatArray,
    tool: FloatArray,
    tolerance: float,
    shares: FloatArray,
    count: IntArray,
) -> None:
    """Halve a straight line in the folds until each piece is a valid straight move.

    The shares of the line at which its pieces end, shape (MOST_MOVES,), and their number, shape
    (1,), 0 if the line is not proven valid, are written. The other arguments are those of
    `MoveCheck` and `Proofs.prove_line`.
    """
    check = make_check(row, demands, tool)
    p, r, q, s = np.zeros(3), np.zeros((3, 3)), np.zeros(3), np.zeros((3, 3))
    corner = np.zeros(6)
    count[0] = 0
    low, size, pieces, left = 0.0, 1.0, 0, MOST_STEPS
    write_pose(first, p, r)
    while low < 1.0:
        high = low + size
        for i in range(6):
            corner[i] = (1.0 - high) * first[i] + high * last[i]
        write_pose(corner, q, s)
        steps = count_steps(check, p, r, q, s, tolerance, left)
        left -= abs(steps)
        if steps > 0:
            if pieces == shares.shape[0]:
                return
            shares[pieces] = high
            pieces += 1
            low = high
            write_pose(corner, p, r)
            # The next piece is as long as halving allows; powers of two are exact.
            while size < 1.0 and low % (2.0 * size) == 0.0:
                size *= 2.0
        else:
            size *= 0.5
            if size < SHORTEST or left <= 0:
                return
    count[0] = pieces


@functools.cache
def load_ompl() -> tuple[Any, Any]:
    """Return OMPL's modules of spaces and of planners, which have no types.

    It is quiet, and its random numbers are the same in every process.

    Raises:
        MissingExtraError: OMPL is not installed.
    """
    names = ("ompl.util", "ompl.base", "ompl.geometric")
    util, base, geometric = load_extra("planning", *names)
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
    """Return a shorter path with the same ends, by proved shortcuts, some of them random."""
    rng = np.random.default_rng(seed)
    corners, idle_rounds = list(poses), 0

    def pose_at(place: float) -> Pose:
        move = int(place)
        if move == place:
            return corners[move]
        ends = corners[move], corners[move + 1]
        return Pose.of(*poses_between(*ends, place - move, proofs.tool))

    for _ in range(MOST_ROUNDS):
        if len(corners) < 3 or idle_rounds >= MOST_IDLE_ROUNDS:
            break
        ends = np.concatenate([[0.0], np.cumsum(lengths_of_moves(proofs.design, corners))])
        pairs = np.sort(rng.uniform(0.0, ends[-1], (TRIES, 2)), axis=1)
        # Some shortcuts go from corner to corner.
        pairs[0] = ends[0], ends[-1]
        pairs[1:4] = np.sort(ends[rng.integers(0, len(ends), (3, 2))], axis=1)
        shortcuts: list[tuple[float, tuple[Pose, Pose], list[Pose]]] = []
        places = np.interp(pairs, ends, np.arange(len(ends)))
        for (first, last), length in zip(places.tolist(), np.diff(pairs)[:, 0], strict=True):
            move = pose_at(first), pose_at(last)
            gain = float(length - lengths_of_moves(proofs.design, move)[0])
            path = [*corners[: int(first) + 1], *move, *corners[math.ceil(last) :]]
            if gain > GAIN * float(ends[-1]):
                distinct = [path[0], *(b for a, b in itertools.pairwise(path) if a != b)]
                shortcuts.append((gain, move, distinct))
        shortcuts.sort(key=lambda cut: -cut[0])
        valid = proofs.are_valid([cut[1] for cut in shortcuts]) if shortcuts else []
        shortened = next(itertools.compress((path for _, _, path in shortcuts), valid), None)
        idle_rounds = 0 if shortened else idle_rounds + 1
        corners = shortened or corners
    return tuple(corners)
