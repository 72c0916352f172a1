"""Proofs that straight moves, and straight lines in the folds, keep rules; loads are sampled.

A straight line in fold coordinates between two poses of one mode meets no singularity, and along
it no |δi| is below the smaller of its two ends (see `explorer.mechanism.folds`). It is cut into
straight moves, which come the closer to it the shorter they are, until each is proven valid. There
is an end of that where another limit is exceeded, and for lines that run along a wall of the mode
so closely, at some 10⁻⁵ of the reach or less, that they would need more moves than are tried.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from explorer.legs.moves import StraightMoves
from explorer.mechanism.design import Design
from explorer.mechanism.folds import from_folds, write_pose
from explorer.mechanism.pose import Pose, Triple
from explorer.numerics.arrays import FloatArray, IntArray
from explorer.numerics.compiled import kernel
from explorer.paths.loads import DemandedLoad
from explorer.workspace.limits.valid_moves import (
    DEFAULT_TOLERANCE,
    count_steps,
    make_check,
    moves_are_valid,
)
from explorer.workspace.limits.valid_poses import Rules

# The shortest move is this share of a line; a line has at most so many moves.
SHORTEST, MOST_MOVES = 2.0**-12, 256
# Steps along all moves that are tried on a line; a step takes half a microsecond.
MOST_STEPS = 50_000
# Number of poses whose check takes as long as that of a line, by which a kernel is loaded at once.
ROWS_OF_LINE = 400


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
        valid = moves_are_valid(
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
            tolerance = DEFAULT_TOLERANCE * self.design.reach
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
