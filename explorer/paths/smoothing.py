"""Shorter and rounder paths: shortcuts between random points, then corners cut off.

Every new piece is a straight move with a proof that it is valid (see
`explorer.workspace.limits.valid_moves`); the rest of an old move is valid as a part of it.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from explorer.legs.moves import poses_between
from explorer.mechanism.design import Design
from explorer.mechanism.pose import Pose
from explorer.numerics.arrays import FloatArray
from explorer.paths.proofs import Proofs, positions_and_rotations
from explorer.singularity.nearest import displacement

# Shortcuts tried in a round, rounds without gain that end the search, and the most rounds.
TRIES, MOST_IDLE_ROUNDS, MOST_ROUNDS = 24, 4, 60
# The least gain, as a share of the path's length.
GAIN = 1e-3
# Cuts of a corner, as shares of the two moves beside it, widest first; rounds of cutting.
CUTS, CUT_ROUNDS = (0.25, 0.08), 3


@dataclass(frozen=True)
class Smoother:
    """A smoother of paths.

    Attributes:
        proofs: Proofs that moves are valid.
        seed: Seed of the random shortcuts.
    """

    proofs: Proofs
    seed: int = 0

    def smooth(self, poses: Sequence[Pose]) -> tuple[Pose, ...]:
        """Return a path with the same ends, shorter and with its corners cut off."""
        return tuple(self._cut_corners(self._shorten(list(poses))))

    def _shorten(self, poses: list[Pose]) -> list[Pose]:
        rng = np.random.default_rng(self.seed)
        idle_rounds = 0
        for _ in range(MOST_ROUNDS):
            if len(poses) < 3 or idle_rounds >= MOST_IDLE_ROUNDS:
                break
            ends = np.concatenate([[0.0], np.cumsum(self._lengths(poses))])
            pairs = np.sort(rng.uniform(0.0, ends[-1], (TRIES, 2)), axis=1)
            # Some shortcuts go from corner to corner.
            pairs[0] = ends[0], ends[-1]
            pairs[1:4] = np.sort(ends[rng.integers(0, len(ends), (3, 2))], axis=1)
            shortcuts = [self._shortcut(poses, ends, *pair) for pair in pairs.tolist()]
            worthwhile = [cut for cut in shortcuts if cut.gain > GAIN * float(ends[-1])]
            shortened: list[Pose] | None = None
            if worthwhile:
                worthwhile.sort(key=lambda cut: -cut.gain)
                valid = self.proofs.are_valid([cut.piece for cut in worthwhile])
                checked = zip(worthwhile, valid, strict=True)
                shortened = next((cut.poses for cut, is_valid in checked if is_valid), None)
            idle_rounds = 0 if shortened else idle_rounds + 1
            poses = shortened or poses
        return poses

    def _shortcut(
        self, poses: list[Pose], ends: FloatArray, first: float, last: float
    ) -> _Shortcut:
        """Return the path with a straight move between two points of it."""
        i, start = self._pose_after(poses, ends, first)
        j, end = self._pose_after(poses, ends, last)
        if i == j:
            return _Shortcut(poses, (start, end), 0.0)
        gain = last - first - float(self._lengths([start, end])[0])
        path = [*poses[: i + 1], start, end, *poses[j + 1 :]]
        return _Shortcut(_without_repeats(path), (start, end), gain)

    def _pose_after(self, poses: list[Pose], ends: FloatArray, distance: float) -> tuple[int, Pose]:
        """Return the number of the move, and the pose, at a distance along the path."""
        index = int(np.searchsorted(ends, distance, side="right")) - 1
        if index >= len(poses) - 1:
            return len(poses) - 2, poses[-1]
        length = float(ends[index + 1] - ends[index])
        share = (distance - float(ends[index])) / length
        return index, poses[index] if share == 0.0 else self._pose_between(
            poses[index], poses[index + 1], share
        )

    def _lengths(self, poses: Sequence[Pose]) -> FloatArray:
        return lengths_of_moves(self.proofs.design, poses)

    def _pose_between(self, start: Pose, end: Pose, share: float) -> Pose:
        return Pose.of(*poses_between(start, end, share, self.proofs.tool))

    def _cut_corners(self, poses: list[Pose]) -> list[Pose]:
        for _ in range(CUT_ROUNDS):
            if len(poses) < 3:
                break
            corners = list(zip(poses, poses[1:], poses[2:], strict=False))
            cuts = [
                [
                    (self._pose_between(b, a, share), self._pose_between(b, c, share))
                    for share in CUTS
                ]
                for a, b, c in corners
            ]
            valid = iter(self.proofs.are_valid([cut for choices in cuts for cut in choices]))
            path: list[Pose] = [poses[0]]
            for corner, choices in zip(corners, cuts, strict=True):
                possible = [cut for cut in choices if next(valid)]
                path += list(possible[0]) if possible else [corner[1]]
            poses = [*path, poses[-1]]
        return poses


@dataclass(frozen=True)
class _Shortcut:
    """A path with one new straight piece, and the length that it saves."""

    poses: list[Pose]
    piece: tuple[Pose, Pose]
    gain: float


def lengths_of_moves(design: Design, poses: Sequence[Pose]) -> FloatArray:
    """Return the root-mean-square displacement of b1 to b4 between n + 1 poses, shape (n,)."""
    p, r = positions_and_rotations(poses)
    return displacement(design, p[:-1], r[:-1], p[1:], r[1:])


def _without_repeats(poses: list[Pose]) -> list[Pose]:
    return [poses[0], *(b for a, b in itertools.pairwise(poses) if a != b)]
