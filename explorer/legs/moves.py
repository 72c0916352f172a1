"""Clearances of the legs over a whole straight move, whatever the sampling step.

The position goes on a straight line, the orientation about one fixed axis (slerp). An
interval of the move is cut in half until a lower bound over all of it is as good as the
least distance found so far, see `explorer.legs.move_bounds`. So the answer comes with a proof:
nothing between the poses that were looked at is nearer than the bound.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial.transform import Rotation

from explorer.errors import InputError
from explorer.legs.clearance import PAIRS, joined_pairs, leg_clearances, radii_of_pairs
from explorer.legs.interference import step_overlaps
from explorer.legs.move_bounds import least_rows
from explorer.mechanism.design import Design
from explorer.mechanism.pose import Pose, checked_rotation
from explorer.numerics.arrays import BoolArray, FloatArray, batch_shape, finite_array

# Of the reach, or of the longest way of a leg's end where that is longer.
DEFAULT_TOLERANCE = 1e-6
SMALLEST_TOLERANCE = 1e-9
# Poses of one move that are looked at, about; interpreting them is slow.
LOOKS = 64
# A move is none if no point of a platform of the reach's size gets farther than this share.
NO_LENGTH = 1e-12


class MoveClearances(NamedTuple):
    """The least clearances of all pairs of legs over moves, in the order of `PAIRS`.

    A pair that shares a joint has the clearance inf, as in `explorer.LegClearances`.

    Attributes:
        bound: Not undercut anywhere on the move (up to rounding), shape (..., 6).
        clearance: Attained at `share`, above the bound by the tolerance at most, shape
            (..., 6).
        share: How far into the move that is, from 0 to 1, shape (..., 6).
    """

    bound: FloatArray
    clearance: FloatArray
    share: FloatArray


@dataclass(frozen=True)
class MoveClearance:
    """One move by both answers: the exact one with radii, and the paper's without.

    Attributes:
        start, end: The two poses.
        bound: Per pair of `PAIRS`, what its clearance never undercuts, shape (6,).
        clearance: Per pair, the clearance attained at `share`, shape (6,).
        share: Per pair, how far into the move that is, from 0 to 1, shape (6,).
        points: Per pair, the closest points of the axes there, shape (6, 2, 3).
        tolerance: What `clearance` exceeds `bound` by at the most, in design units.
        steps: Into how many the move was cut for the paper's test.
        overlaps: Per pair, whether its swept tetrahedra overlap in a step, shape (6,).
    """

    start: Pose
    end: Pose
    bound: FloatArray
    clearance: FloatArray
    share: FloatArray
    points: FloatArray
    tolerance: float
    steps: int
    overlaps: BoolArray

    @property
    def closest(self) -> int:
        """The index into `PAIRS` of the pair with the least clearance."""
        return int(self.clearance.argmin())

    @property
    def is_clear(self) -> bool:
        """Whether no two legs collide anywhere on the move: every bound is above zero."""
        return bool((self.bound > 0.0).all())

    @property
    def is_free(self) -> bool:
        """The paper's answer, which has no radii, at this number of steps."""
        return not self.overlaps.any()


def poses_between(start: Pose, end: Pose, shares: ArrayLike) -> tuple[FloatArray, FloatArray]:
    """Return the poses of a straight move.

    Args:
        start: Where it starts.
        end: Where it ends; the platform turns the shorter way.
        shares: How far into the move, from 0 to 1, shape (...).

    Returns:
        Positions, shape (..., 3), and rotations, shape (..., 3, 3).
    """
    share = finite_array("shares of the move", shares, ())[..., None]
    first, last = np.array(start.position), np.array(end.position)
    turn = Rotation.from_matrix(end.rotation @ start.rotation.T).as_rotvec()
    return first + share * (last - first), Rotation.from_rotvec(share * turn).as_matrix() @ (
        start.rotation
    )


def move_clearances(
    design: Design,
    start_position: ArrayLike,
    start_rotation: ArrayLike,
    end_position: ArrayLike,
    end_rotation: ArrayLike,
    *,
    tolerance: float | None = None,
) -> MoveClearances:
    """Return the least clearances over straight moves; a pose that stays is one too.

    Args:
        design: The manipulator; the radii are those of its limits.
        start_position: b4 in the base frame, shape (..., 3), in design units.
        start_rotation: Platform to base, shape (..., 3, 3).
        end_position: Where b4 goes, shape (..., 3).
        end_rotation: How the platform turns, shape (..., 3, 3), the shorter way.
        tolerance: As for `move_clearance`.

    Raises:
        InputError: a pose that is not finite or not a rotation, or a tolerance too small.
    """
    moves = _Moves.of(design, start_position, start_rotation, end_position, end_rotation)
    bound, least, share = moves.least(design, moves.tolerance(design, tolerance), math.nan)
    radii = radii_of_pairs(design)
    return MoveClearances(bound - radii, least - radii, share)


def moves_are_clear(
    design: Design,
    start_position: ArrayLike,
    start_rotation: ArrayLike,
    end_position: ArrayLike,
    end_rotation: ArrayLike,
    *,
    clearance: float = 0.0,
) -> BoolArray:
    """Return whether all pairs keep more than a clearance all along, shape (...).

    Arguments and errors are those of `pairs_are_clear`.
    """
    arrays = (start_position, start_rotation, end_position, end_rotation)
    return np.asarray(pairs_are_clear(design, *arrays, clearance=clearance).all(axis=-1))


def pairs_are_clear(
    design: Design,
    start_position: ArrayLike,
    start_rotation: ArrayLike,
    end_position: ArrayLike,
    end_rotation: ArrayLike,
    *,
    clearance: float = 0.0,
) -> BoolArray:
    """Return which pairs keep more than a clearance all along, shape (..., 6).

    Much faster than `move_clearances`, since it ends as soon as that is certain. True is
    a proof; a least clearance that exceeds the asked one by less than the default
    tolerance of `move_clearance` may count as one that does not. A pair that shares a
    joint is clear. Other arguments and errors are those of `move_clearances`.
    """
    moves = _Moves.of(design, start_position, start_rotation, end_position, end_rotation)
    bound, _, _ = moves.least(design, moves.tolerance(design, None), clearance)
    return np.asarray(bound > radii_of_pairs(design) + clearance)


def move_clearance(
    design: Design, start: Pose, end: Pose, *, steps: int = 1, tolerance: float | None = None
) -> MoveClearance:
    """Return how close the legs come over a straight move, by both tests.

    Args:
        design: The manipulator; the radii are those of its limits.
        start: Where the move starts.
        end: Where it ends; the platform turns about one axis, the shorter way.
        steps: Into how many steps the paper's test cuts it.
        tolerance: Of the least clearances, in design units; by default a millionth of the
            reach, or of the way of the farthest leg's end if that is longer.

    Raises:
        InputError: a move of no length, no steps, or a tolerance too small to be met.
    """
    if steps < 1:
        raise InputError(f"a move has at least one step; got {steps}")
    arrays = (np.array(start.position), start.rotation, np.array(end.position), end.rotation)
    moves = _Moves.of(design, *arrays)
    if float(moves.way[0]) <= NO_LENGTH * max(design.reach, *map(abs, start.position)):
        shown = ", ".join(f"{x:g}" for x in start.position)
        raise InputError(
            f"a move needs two poses that differ; both have the position ({shown}) and the "
            "same orientation"
        )
    finest = moves.tolerance(design, tolerance)
    found = move_clearances(design, *arrays, tolerance=float(finest[0]))
    positions, rotations = poses_between(start, end, np.linspace(0.0, 1.0, steps + 1))
    overlaps = step_overlaps(design, positions[:-1], rotations[:-1], positions[1:], rotations[1:])
    at = leg_clearances(design, *poses_between(start, end, found.share))
    pairs = np.arange(len(PAIRS))
    return MoveClearance(
        start=start,
        end=end,
        bound=found.bound,
        clearance=found.clearance,
        share=found.share,
        points=at.points[pairs, pairs],
        tolerance=float(finest[0]),
        steps=steps,
        overlaps=np.asarray(overlaps.any(axis=0)),
    )


@dataclass(frozen=True)
class _Moves:
    """Moves in the form of the kernel, one row each.

    A platform point is at start + t step + fixed + cos(t angle) across + sin(t angle) up.

    Attributes:
        batch: The batch axes.
        start, step: Of b4, shape (n, 3).
        angle: By which the platform turns, shape (n,).
        parts: fixed, across and up of each leg's platform end, shape (n, 4, 3, 3).
        way: The longest way of an end of a leg, at the most, shape (n,).
    """

    batch: tuple[int, ...]
    start: FloatArray
    step: FloatArray
    angle: FloatArray
    parts: FloatArray
    way: FloatArray

    @staticmethod
    def of(
        design: Design,
        start_position: ArrayLike,
        start_rotation: ArrayLike,
        end_position: ArrayLike,
        end_rotation: ArrayLike,
    ) -> _Moves:
        """Return the moves from start to end poses, batch axes broadcast."""
        p = finite_array("start position", start_position, (3,))
        q = finite_array("end position", end_position, (3,))
        r, s = checked_rotation(start_rotation), checked_rotation(end_rotation)
        batch = batch_shape((p, 1), (r, 2), (q, 1), (s, 2))
        start, end = (np.broadcast_to(x, (*batch, 3)).reshape(-1, 3) for x in (p, q))
        first, last = (np.broadcast_to(x, (*batch, 3, 3)).reshape(-1, 3, 3) for x in (r, s))
        turn = Rotation.from_matrix(last @ np.swapaxes(first, -1, -2)).as_rotvec()
        angle = np.linalg.norm(turn, axis=-1)
        axis = turn / np.where(angle > 0.0, angle, 1.0)[:, None]
        points = np.zeros((4, 3))
        points[0, :2] = design.b1
        points[1, 0], points[2, 0] = design.b2, design.b3
        arms = points @ np.swapaxes(first, -1, -2)
        fixed = (arms @ axis[:, :, None]) * axis[:, None, :]
        up = np.cross(axis[:, None, :], arms)
        across = np.where(angle[:, None, None] > 0.0, arms - fixed, 0.0)
        parts = np.stack([arms - across, across, up], axis=2)
        step = end - start
        way = np.linalg.norm(step, axis=-1) + angle * np.linalg.norm(across, axis=-1).max(axis=-1)
        return _Moves(batch, start.copy(), step, np.asarray(angle), parts, np.asarray(way))

    def tolerance(self, design: Design, asked: float | None) -> FloatArray:
        """Return the tolerance of each move, shape (n,).

        Raises:
            InputError: one that is asked for is too small to be met.
        """
        size = np.maximum(design.reach, self.way)
        if asked is None:
            return DEFAULT_TOLERANCE * size
        least = SMALLEST_TOLERANCE * float(size.max(initial=design.reach))
        if not asked >= least:
            raise InputError(f"the tolerance must be at least {least:.2g}; got {asked:g}")
        return np.full(len(size), asked)

    def least(
        self, design: Design, tolerance: FloatArray, enough: float
    ) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return bound, least distance and its share of the move, each of shape (..., 6).

        Args:
            design: The manipulator.
            tolerance: Shape (n,).
            enough: A clearance; the search ends once it is certain whether there is more.
                NaN for no such end.
        """
        rows = len(self.start)
        bound, least, share = (np.full((rows, len(PAIRS)), math.inf) for _ in range(3))
        share[:] = 0.0
        target = np.where(joined_pairs(design), -math.inf, radii_of_pairs(design) + enough)
        fixed = np.array([*design.a3, 0.0])
        least_rows(
            LOOKS * rows,
            self.start,
            self.step,
            self.angle,
            self.parts,
            fixed,
            tolerance,
            target,
            bound,
            least,
            share,
        )
        shape = (*self.batch, len(PAIRS))
        return bound.reshape(shape), least.reshape(shape), share.reshape(shape)
