"""Clearances of the legs over a whole straight move, with a bound between all poses.

Over a straight move one point of the platform, b4 or the tool point, goes along a line and the
platform turns about one fixed axis (slerp). An interval of the move is halved until a lower bound
over all of it is within the tolerance of the least evaluated distance, see
`explorer.legs.clearance`. The bound holds for every pose of the move, not only for those that
were evaluated.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple, TypeAlias

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial.transform import Rotation

from explorer.errors import InputError
from explorer.legs.clearance import PAIRS, joined_pairs, least_rows, leg_clearances, radii_of_pairs
from explorer.legs.interference import step_overlaps
from explorer.mechanism.configuration import Configuration, one_tool, tool_offset
from explorer.mechanism.design import Design
from explorer.mechanism.pose import Pose, Triple, rotation_array
from explorer.numerics import arrays
from explorer.numerics.arrays import BoolArray, FloatArray, IntArray
from explorer.numerics.number_text import format_apart

# Tolerances as shares of the reach, or of the longest travel of a leg's end if that is longer.
DEFAULT_TOLERANCE = 1e-6
SMALLEST_TOLERANCE = 1e-9
# Approximate number of poses of a move that the kernel evaluates, on which compiling depends.
POSES_OF_MOVE = 64
# Length of a move, over the reach, up to which it has no clearances; and that up to which it is
# rounding of its ends in a table and takes no time.
NO_LENGTH, ROUNDED = 1e-12, 1e-6

Ends: TypeAlias = tuple[FloatArray, FloatArray, FloatArray, FloatArray]
"""b4 (n, 3) and the rotation (n, 3, 3) at the start of n moves, then those at the end."""


class MoveClearances(NamedTuple):
    """The least clearances of all pairs of legs over moves; inf for those that share a joint.

    Attributes:
        bound: Lower bound of the clearance over the move, to rounding, shape (..., 6).
        clearance: That at `share`, greater than the bound by at most the tolerance, (..., 6).
        share: Share of the move, from 0 to 1, shape (..., 6).
    """

    bound: FloatArray
    clearance: FloatArray
    share: FloatArray


@dataclass(frozen=True)
class MoveClearance:
    """One move under both tests: the exact one with radii, and the paper's without.

    Attributes:
        start, end: The two poses.
        bound, clearance, share: Those of `MoveClearances`, shape (6,).
        points: Closest points of the two axes at `share`, shape (6, 2, 3).
        tolerance: Largest difference of `clearance` and `bound`, in design units.
        steps: Number of steps of the paper's test.
        overlaps: Whether the swept tetrahedra of each pair overlap in a step, shape (6,).
        tool: Point that moves straight in the platform frame, in design units; None for b4.
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
    tool: Triple | None = None

    @property
    def closest(self) -> int:
        """Index into `PAIRS` of the pair with the least clearance."""
        return int(self.clearance.argmin())

    @property
    def is_clear(self) -> bool:
        """Whether no two legs collide anywhere on the move: every bound is positive."""
        return bool((self.bound > 0.0).all())

    @property
    def is_free(self) -> bool:
        """Whether the move is free by the paper's test, without radii, at this number of steps."""
        return not self.overlaps.any()

    @property
    def poses(self) -> tuple[FloatArray, FloatArray]:
        """Positions of b4 and rotations where each pair is closest, shapes (6, 3), (6, 3, 3)."""
        return poses_between(self.start, self.end, self.share, self.tool)


@dataclass(frozen=True)
class StraightMoves:
    """Straight moves: a point of the platform goes along a line while the platform turns evenly.

    Attributes:
        start: That point at the start, in the base frame, shape (n, 3), in design units.
        step: Its displacement, shape (n, 3).
        rotation: Platform to base at the start, shape (n, 3, 3).
        turn: Rotation vector of the whole turn along the axes of the base, shape (n, 3).
        tool: The point in the platform frame, shape (3,).
    """

    start: FloatArray
    step: FloatArray
    rotation: FloatArray
    turn: FloatArray
    tool: FloatArray

    @staticmethod
    def between(
        p: FloatArray, r: FloatArray, q: FloatArray, s: FloatArray, tool: ArrayLike | None = None
    ) -> StraightMoves:
        """Return the moves from poses p (n, 3), r (n, 3, 3) to q, s, the shorter way round.

        The tool is the point that moves straight in the platform frame, shape (3,); None for b4.

        Raises:
            InputError: The tool is not finite.
        """
        point = one_tool(tool)
        start = p + tool_offset(r, point)
        turn = Rotation.from_matrix(s @ np.swapaxes(r, -1, -2)).as_rotvec()
        return StraightMoves(start, q + tool_offset(s, point) - start, r, turn, point)

    @staticmethod
    def along(poses: Sequence[Pose], tool: ArrayLike | None = None) -> StraightMoves:
        """Return the moves of a path, given by its corners."""
        p, r = np.array([e.position for e in poses]), np.array([e.rotation for e in poses])
        return StraightMoves.between(p[:-1], r[:-1], p[1:], r[1:], tool)

    def lengths(self, reach: float, number: IntArray | slice = slice(None)) -> FloatArray:
        """Return the lengths of moves by number: steps, and turns times the reach, shape (...)."""
        steps, turns = (arrays.lengths_of(each[number]) for each in (self.step, self.turn))
        return steps + reach * turns

    def have_length(self, reach: float) -> BoolArray:
        """Return which moves are longer than the rounding of a table of poses, shape (n,)."""
        return self.lengths(reach) > ROUNDED * reach

    def poses(self, number: IntArray, share: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return b4 (..., 3) and rotations (..., 3, 3) at shares, 0 to 1, of moves by number."""
        turn = Rotation.from_rotvec(share[..., None] * self.turn[number])
        rotation = turn.as_matrix() @ self.rotation[number]
        at = self.start[number] + share[..., None] * self.step[number]
        return at - tool_offset(rotation, self.tool), rotation

    def slopes(self, number: IntArray, rotation: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return twist and acceleration of b4 by the share of moves, (..., 6) each.

        At a rate of the share the motion has rate × twist and rate² × acceleration, and with a
        change of the rate also change × twist. The rotations are those of `poses`.
        """
        turn = self.turn[number]
        swing = np.cross(turn, tool_offset(rotation, self.tool))
        twist = np.concatenate([self.step[number] - swing, turn], axis=-1)
        inwards = -np.cross(turn, swing)
        return twist, np.concatenate([inwards, np.zeros(turn.shape)], axis=-1)


def poses_between(
    start: Pose, end: Pose, shares: ArrayLike, tool: ArrayLike | None = None
) -> tuple[FloatArray, FloatArray]:
    """Return b4 (..., 3) and rotations (..., 3, 3) at shares (...), 0 to 1, of a straight move.

    The tool is the point that moves straight in the platform frame, shape (3,); None for b4.

    Raises:
        InputError: Shares or the tool are not finite.
    """
    share = arrays.finite_array("shares of the move", shares, ())
    return StraightMoves.along((start, end), tool).poses(np.zeros(share.shape, np.int64), share)


def ends_of_moves(
    start_position: ArrayLike,
    start_rotation: ArrayLike,
    end_position: ArrayLike,
    end_rotation: ArrayLike,
) -> tuple[tuple[int, ...], Ends]:
    """Return the batch axes of moves and their ends as one row each, in the same order.

    Raises:
        InputError: A position is not finite, a rotation is not one, or they do not broadcast.
    """
    p = arrays.position_array("start position", start_position)
    q = arrays.position_array("end position", end_position)
    r, s = rotation_array(start_rotation), rotation_array(end_rotation)
    batch = arrays.batch_shape((p, 1), (r, 2), (q, 1), (s, 2))
    p, q = (arrays.rows_for_kernel(each, batch, 1) for each in (p, q))
    r, s = (arrays.rows_for_kernel(each, batch, 2) for each in (r, s))
    return batch, (p, r, q, s)


def move_clearances(
    design: Design,
    start_position: ArrayLike,
    start_rotation: ArrayLike,
    end_position: ArrayLike,
    end_rotation: ArrayLike,
    *,
    tolerance: float | None = None,
) -> MoveClearances:
    """Return the least clearances over straight moves of b4; those of no length are allowed.

    The ends are positions of b4, shape (..., 3), and rotations from platform to base, (..., 3, 3).
    The tolerance of the least clearances is in design units; by default it is a millionth of the
    reach, or of the longest travel of a leg's end if that is longer.

    Raises:
        InputError: A pose is not finite, not a rotation, or the tolerance is too small.
    """
    ends = ends_of_moves(start_position, start_rotation, end_position, end_rotation)
    bound, least, share, _ = _least_distances(design, *ends, tolerance=tolerance)
    radii = radii_of_pairs(design)
    return MoveClearances(bound - radii, least - radii, share)


def pairs_are_clear(
    design: Design,
    start_position: ArrayLike,
    start_rotation: ArrayLike,
    end_position: ArrayLike,
    end_rotation: ArrayLike,
    *,
    clearance: float = 0.0,
    tool: ArrayLike | None = None,
) -> BoolArray:
    """Return which pairs have more than a clearance over whole moves, shape (..., 6).

    This is much faster than `move_clearances`, since the search ends once the result is certain.
    True is proven, also for a pair that shares a joint. The result may be False if the clearance is
    exceeded by less than the default tolerance. The tool is that of `poses_between`, the rest as
    there.
    """
    ends = ends_of_moves(start_position, start_rotation, end_position, end_rotation)
    bound, *_ = _least_distances(design, *ends, target=clearance, tool=tool)
    return np.asarray(bound > radii_of_pairs(design) + clearance)


def move_clearance(
    design: Design,
    start: Pose,
    end: Pose,
    *,
    steps: int = 1,
    tool: Triple | None = None,
) -> MoveClearance:
    """Return the least clearances over a straight move, with the paper's test in steps beside them.

    The platform turns about one axis, the shorter way. The tool is that of `poses_between`.

    Raises:
        InputError: The move has no length or no steps.
    """
    if steps < 1:
        raise InputError(f"a move has at least one step; got {steps}")
    way = StraightMoves.along((start, end), tool)
    if way.lengths(design.reach)[0] <= NO_LENGTH * max(design.reach, *map(abs, start.position)):
        place = ", ".join(f"{x:g}" for x in start.position)
        raise InputError(
            f"a move needs two poses that differ; both have the position ({place}) and the "
            "same orientation"
        )
    ends = ends_of_moves(start.position, start.rotation, end.position, end.rotation)
    bound, least, share, tolerances = _least_distances(design, *ends, tool=tool)
    radii = radii_of_pairs(design)
    shares = np.linspace(0.0, 1.0, steps + 1)
    before, after = (poses_between(start, end, at, tool) for at in (shares[:-1], shares[1:]))
    overlaps = step_overlaps(Configuration(design, *before), Configuration(design, *after))
    closest = leg_clearances(Configuration(design, *poses_between(start, end, share, tool)))
    pairs = np.arange(len(PAIRS))
    return MoveClearance(
        start=start,
        end=end,
        bound=bound - radii,
        clearance=least - radii,
        share=share,
        points=closest.points[pairs, pairs],
        tolerance=float(tolerances[0]),
        steps=steps,
        overlaps=np.asarray(overlaps.any(axis=0)),
        tool=tool,
    )


def _least_distances(
    design: Design,
    batch: tuple[int, ...],
    ends: Ends,
    tolerance: float | None = None,
    target: float = math.nan,
    tool: ArrayLike | None = None,
) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """Return lower bounds, least distances, their shares, (..., 6) each, and tolerances (n,).

    The search ends once it is certain whether the least clearance is greater than the target; NaN
    for a search to the tolerance.
    """
    moves = StraightMoves.between(*ends, tool)
    # At the share t of a move a platform point is
    # start + t step + fixed + cos(t angle) across + sin(t angle) up.
    angle = np.linalg.norm(moves.turn, axis=-1)
    axis = moves.turn / np.where(angle > 0.0, angle, 1.0)[:, None]
    arms = (design.platform_points - moves.tool) @ np.swapaxes(moves.rotation, -1, -2)
    fixed = (arms @ axis[:, :, None]) * axis[:, None, :]
    up = np.cross(axis[:, None, :], arms)
    across = np.where(angle[:, None, None] > 0.0, arms - fixed, 0.0)
    parts = np.stack([arms - across, across, up], axis=2)
    swing = angle * np.linalg.norm(across, axis=-1).max(axis=-1)
    size = np.maximum(design.reach, np.linalg.norm(moves.step, axis=-1) + swing)
    tolerances = DEFAULT_TOLERANCE * size
    if tolerance is not None:
        least_one = SMALLEST_TOLERANCE * float(size.max(initial=design.reach))
        if not tolerance >= least_one:
            least_text, got = format_apart((least_one, tolerance), 3)
            raise InputError(f"the tolerance must be at least {least_text}; got {got}")
        tolerances = np.full(len(size), tolerance)
    bound = np.full((len(size), len(PAIRS)), np.inf)
    least, share = bound.copy(), np.zeros(bound.shape)
    targets = np.where(joined_pairs(design), -math.inf, radii_of_pairs(design) + target)
    rows = moves.start, moves.step, np.asarray(angle), parts, np.array([*design.a3, 0.0])
    least_rows(POSES_OF_MOVE * len(size), *rows, tolerances, targets, bound, least, share)
    bound, least, share = (each.reshape(*batch, len(PAIRS)) for each in (bound, least, share))
    return bound, least, share, tolerances
