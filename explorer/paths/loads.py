"""The load along a path: utilisations of limits at samples, and a bound of all between them.

A sample is in the middle of an interval of a straight move. In the axes of the platform the force
f_j of joint j acts at a fixed point, and within the interval it turns by ν_j at most. By virtual
work that asks |v_ij| ν_j f_j of actuator i at most, where v_ij is the velocity of the point at a
unit rate of actuator i. Where m = max_i Σ_j |v_ij| ν_j is below 1, no pose of the interval is
singular, and all that is asked changes the forces by at most 1 / (1 − m) times as much. Intervals
are halved until the bounds are near the largest utilisation.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from explorer.legs.moves import StraightMoves
from explorer.mechanism.configuration import Configuration
from explorer.mechanism.design import GUIDE_ROWS, LENGTH_ROWS, STRUT_ROWS, Design
from explorer.mechanism.machine import STANDARD_GRAVITY
from explorer.mechanism.pose import Pose, Triple
from explorer.motion.inverse_jacobian import load_array, twists_of_actuators
from explorer.motion.weights import FIRST_MOMENT, ROD, ROD_CENTRE, TOTAL, MovingBodies
from explorer.numerics.arrays import BoolArray, FloatArray, IntArray, lengths_of, rotate
from explorer.paths.crossings import PathMargins, path_margins
from explorer.statics.reactions import LIMITED, Reactions, limit_shares, reactions

# Difference of bound and largest utilisation, over the latter, at which halving ends; and rounding.
TOLERANCE, ROUNDING = 0.02, 1e-9
# Samples within a move at first, and the most samples of all moves.
FIRST_SAMPLES, MOST_SAMPLES = 16, 20_000


@dataclass(frozen=True)
class PathLoads:
    """The utilisations of the limits by a load over a path, at samples.

    Attributes:
        at: Place of the samples: number of the move plus the share of it, ascending, shape (n,).
        utilisations: Those of the samples in the order of `LIMITED`, shape (n, 12); infinite in a
            singular pose.
        bound: Upper bound of them over the whole path; infinite if the path is singular, or
            so nearly that none was found.
    """

    at: FloatArray
    utilisations: FloatArray
    bound: float

    @property
    def utilisation(self) -> float:
        """The largest utilisation of the samples."""
        return float(self.utilisations.max())

    @property
    def place(self) -> float:
        """Where the largest utilisation is: number of the move plus the share of it."""
        return float(self.at[self.utilisations.max(axis=1).argmax()])

    @property
    def part(self) -> int | None:
        """Index in `LIMITED` of the part with the largest utilisation.

        It is None without a limit or load, and if the path is singular.
        """
        part = int(self.utilisations.max(axis=0).argmax())
        return part if 0.0 < self.utilisation < math.inf else None


@dataclass(frozen=True)
class DemandedLoad:
    """A load that every pose of a path must hold within the limits, as in `path_loads`."""

    design: Design
    load: FloatArray
    weights: MovingBodies

    @staticmethod
    def of(design: Design, load: ArrayLike, weights: MovingBodies | None = None) -> DemandedLoad:
        """Return a load on a design; arguments and errors are those of `path_loads`."""
        six = load_array(load)
        return DemandedLoad(design, six, weights or MovingBodies().with_payload(design))

    def utilisations(self, position: ArrayLike, rotation: ArrayLike) -> FloatArray:
        """Return the utilisations of the limits in poses, shape (..., 12), as in `LIMITED`.

        The poses are positions of b4, shape (..., 3), and rotations, shape (..., 3, 3).
        """
        poses = Configuration(self.design, position, rotation)
        return limit_shares(self.design, self._reactions(poses))

    def holds_along(self, moves: StraightMoves) -> BoolArray:
        """Return whether no sample of moves exceeds a limit, shape (m,).

        No pose between then exceeds it by more than `TOLERANCE` of it.
        """
        return np.asarray(self._sample(moves, only_holds=True)[2] <= 1.0 + TOLERANCE)

    def over(self, path: PathMargins, tool: ArrayLike | None = None) -> PathLoads:
        """Return the utilisations over a path of a tool, given with its crossings."""
        at, used, bounds = self._sample(StraightMoves.along(path.poses, tool))
        at = np.append(at, [crossing.move + crossing.share for crossing in path.crossings])
        infinite = np.full((len(path.crossings), len(LIMITED)), np.inf)
        used = np.append(used, infinite, axis=0)
        order = np.argsort(at, kind="stable")
        bound = math.inf if path.crossings else float(bounds.max())
        return PathLoads(at[order], used[order], bound)

    def _sample(
        self, moves: StraightMoves, *, only_holds: bool = False
    ) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return places (n,), utilisations (n, 12), and bounds of these over the moves (m,).

        With `only_holds` halving of a move ends once it is certain whether it holds the load, and
        the bound of a move that does not is infinite.
        """
        count = len(moves.step)
        best, bounds = np.zeros(count), np.zeros(count)
        # The ends of moves are samples too, of intervals without a length.
        number = np.repeat(np.arange(count), FIRST_SAMPLES + 2)
        middles, half = (np.arange(FIRST_SAMPLES) + 0.5) / FIRST_SAMPLES, 0.5 / FIRST_SAMPLES
        share: FloatArray = np.tile([0.0, *middles, 1.0], count)
        half = np.tile([0.0, *[half] * FIRST_SAMPLES, 0.0], count)
        found: list[tuple[FloatArray, FloatArray]] = []
        left = MOST_SAMPLES
        while True:
            used, bound = self._bound(moves, number, share, half)
            found.append((number + share, used))
            np.maximum.at(best, number, used.max(axis=1))
            is_loose = bound > (1.0 + TOLERANCE) * (1.0 if only_holds else best.max())
            if only_holds:
                bounds[best > 1.0 + ROUNDING] = np.inf
                is_loose &= bounds[number] < np.inf
            left -= len(number)
            if 2 * np.count_nonzero(is_loose) > left:
                is_loose[:] = False
            np.maximum.at(bounds, number[~is_loose], bound[~is_loose])
            if not is_loose.any():
                places, samples = map(np.concatenate, zip(*found, strict=True))
                return places, samples, bounds
            number, half = np.repeat(number[is_loose], 2), np.repeat(0.5 * half[is_loose], 2)
            share = np.repeat(share[is_loose], 2) + half * np.tile([-1.0, 1.0], len(half) // 2)

    def _bound(
        self, moves: StraightMoves, number: IntArray, share: FloatArray, half: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """Return the utilisations in the middle of intervals, (n, 12), and their bounds, (n,).

        An interval is given by the number of its move, the share of that in its middle, and its
        half as a share, shape (n,) each.
        """
        design, (platform, legs) = self.design, self.weights.arrays
        position, rotation = moves.poses(number, share)
        poses = Configuration(design, position, rotation)
        middle = self._reactions(poses)
        forces = np.abs(middle.actuators) + middle.spread[:, :6]
        lengths, turn = poses.joints, moves.turn[number]
        mass, gravity = float(platform[3, 3]), STANDARD_GRAVITY * math.hypot(*design.gravity)
        joints = design.platform_points[[0, 1, 1, 2, 2, 3]]
        points = [*joints, design.tool.position, platform[:3, 3] / (mass or 1.0)]
        arms = np.array(points) @ np.swapaxes(rotation, 1, 2)
        twists = np.swapaxes(twists_of_actuators(poses), 1, 2)[:, :, None]
        with np.errstate(invalid="ignore", divide="ignore"):
            # Speeds of the points for unit rates of the actuators, shape (n, 6, 8).
            speeds = lengths_of(twists[..., :3] + np.cross(twists[..., 3:], arms[:, None]))
            # How far the joints' points move, the platform turns, and the legs turn.
            swing = np.cross(turn[:, None], arms[:, :6] - rotate(rotation, moves.tool)[:, None])
            way = half[:, None] * (lengths_of(moves.step[number])[:, None] + lengths_of(swing))
            angle = half[:, None] * lengths_of(turn)[:, None]
            least = lengths - way
            tilt = np.where(least > 0.0, way / least, np.inf)[:, LENGTH_ROWS]
            turns = np.repeat(angle, 6, axis=1)
            turns[:, LENGTH_ROWS] += tilt
            asked = speeds[:, :, :6] * turns[:, None]
            # Loads that keep their direction in the base turn in the axes of the platform.
            sizes = np.array([lengths_of(self.load[:3]), mass * gravity])
            change = rotate(asked, forces) + angle * (speeds[:, :, 6:] @ sizes)
            change += angle * lengths_of(twists[:, :, 0, 3:]) * lengths_of(self.load[3:])
            # The weights of the legs act at their joints, partly across the legs, with the first
            # moment over the length that `explorer.motion.weights.leg_inertia` swings.
            leaning = np.abs(legs[:, FIRST_MOMENT] - legs[:, ROD] * legs[:, ROD_CENTRE])
            leaning = gravity * leaning / lengths[:, LENGTH_ROWS]
            standing = gravity * legs[:, TOTAL]
            tilting = 2.0 * leaning * tilt
            change += rotate(speeds[:, :, LENGTH_ROWS], tilting + angle * (leaning + standing))
            sums = asked.sum(axis=2)
            most = sums.max(axis=1, keepdims=True)
            change += sums * change.max(axis=1, keepdims=True) / (1.0 - most)
            longer, along = way[:, STRUT_ROWS], forces[:, GUIDE_ROWS] + standing[1:3]
            bending = change[:, GUIDE_ROWS] * (lengths[:, STRUT_ROWS] + longer) + along * longer
            across = change[:, STRUT_ROWS]
            if standing.any():
                across = across + tilting[:, 1:3] + forces[:, STRUT_ROWS] * tilt[:, 1:3]
            widening = np.concatenate([change, bending, across, bending], axis=1)
        is_bounded = (most < 1.0) & np.isfinite(widening).all(axis=1, keepdims=True)
        wider = middle._replace(spread=middle.spread + np.where(is_bounded, widening, 0.0))
        bound = np.where(is_bounded, limit_shares(design, wider), np.inf).max(axis=1)
        return limit_shares(design, middle), bound

    def _reactions(self, poses: Configuration) -> Reactions:
        return reactions(poses.with_tool(self.design.tool.position), self.load, self.weights)


def path_loads(
    design: Design,
    poses: Sequence[Pose],
    load: ArrayLike,
    *,
    tool: Triple | None = None,
    weights: MovingBodies | None = None,
) -> PathLoads:
    """Return the utilisations of the limits by a load over a path of straight moves.

    The payload's force of any direction acts besides.

    Args:
        design: The manipulator, with its tool, payload and limits.
        poses: Corners of the path, two or more.
        load: (F; M) at the tool point of the design, base axes, shape (6,), in N and N × unit.
        tool: Point that moves straight in the platform frame, in design units; None for b4.
        weights: All masses, the payload's included; None for the payload alone.

    Raises:
        InputError: There are fewer than two poses, or a number is not finite.
    """
    return DemandedLoad.of(design, load, weights).over(path_margins(poses, tool=tool), tool)
