"""The load along a path: the largest share of a limit that it uses, and where.

Besides the load act the payload's weight and its force of any direction. The largest share of
each straight move is found with a proof, see `explorer.paths.move_shares`.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from explorer.legs.moves import poses_between
from explorer.mechanism.configuration import Configuration
from explorer.mechanism.design import Design
from explorer.mechanism.machine import STANDARD_GRAVITY
from explorer.mechanism.pose import Pose, Triple
from explorer.numerics.arrays import BoolArray, FloatArray, finite_array, for_kernel
from explorer.paths.crossings import SAMPLES, PathMargins, path_margins
from explorer.paths.move_shares import (
    BOUND,
    CARRIAGE,
    COLUMNS,
    CYLINDER,
    CYLINDER_MOMENT,
    END,
    FIRST_MOMENT,
    FORCE,
    GRAVITY,
    LEG,
    LEGS,
    LIMITS,
    LOAD,
    PLACE,
    POINT,
    ROD,
    ROD_MOMENT,
    SHARE,
    WEIGHT,
    share_rows_of_moves,
)
from explorer.statics.reactions import limit_shares, part_limits, reactions
from explorer.statics.weights import Weights, design_weights

# Largest error of the largest share, over that share if it exceeds 1.
TOLERANCE = 1e-6
# Number of rows for each move, on which compiling depends; a row of this kernel takes long.
ROWS_OF_MOVE = 256


class LargestShare(NamedTuple):
    """The largest share of a limit over a path.

    Attributes:
        share: The share, of which 1 is the limit; infinite if the path is singular somewhere.
        bound: Upper bound of the share over the whole path, at most a millionth above it, or a
            millionth of it if it exceeds 1; infinite where no bound was found near a singular pose.
        place: Number of the move plus the share of it where the share is largest.
        part: Index in `LIMITED` of the part with this share; None without a limit or load, and if
            the path is singular.
    """

    share: float
    bound: float
    place: float
    part: int | None


@dataclass(frozen=True)
class PathLoads:
    """The shares of the limits that a load uses over a path.

    Attributes:
        poses: Corners of the path.
        at: Place of the samples: number of the move plus the share of it, shape (n,).
        shares: Shares of the samples in the order of `LIMITED`, shape (n, 12); infinite in a
            singular pose.
        largest: The largest share over the path.
    """

    poses: tuple[Pose, ...]
    at: FloatArray
    shares: FloatArray
    largest: LargestShare


@dataclass(frozen=True)
class DemandedLoad:
    """A load that every pose of a path has to hold within the limits.

    Attributes:
        design: The manipulator.
        load: (F; M) at the tool point of the design, shape (6,), in N and N × unit.
        weights: All masses, the payload's included.
        row: Numbers of the kernel.
        tool: Point that moves straight in the platform frame, shape (3,), in design units.
    """

    design: Design
    load: FloatArray
    weights: Weights
    row: FloatArray
    tool: FloatArray

    @staticmethod
    def of(
        design: Design,
        load: ArrayLike,
        weights: Weights | None = None,
        tool: ArrayLike | None = None,
    ) -> DemandedLoad:
        """Return a load on a design.

        Arguments and errors are those of `path_loads`.
        """
        checked = finite_array("load (FX FY FZ MX MY MZ)", load, (6,))
        point = np.zeros(3) if tool is None else finite_array("tool", tool, (3,))
        masses = design_weights(design) if weights is None else weights
        row = _row(design, checked, masses)
        return DemandedLoad(design, checked, masses, row, for_kernel(point))

    def shares(self, position: ArrayLike, rotation: ArrayLike) -> FloatArray:
        """Return the shares of the limits in poses, shape (..., 12), in the order of `LIMITED`.

        Args:
            position: b4 in the base frame, shape (..., 3), in design units.
            rotation: Platform to base, shape (..., 3, 3).
        """
        poses = Configuration(self.design, position, rotation, self.design.tool.position)
        return limit_shares(self.design, reactions(poses, self.load, self.weights))

    def holds_along(
        self,
        start: FloatArray,
        start_rotation: FloatArray,
        end: FloatArray,
        end_rotation: FloatArray,
    ) -> BoolArray:
        """Return whether the load is held all along straight moves, shape (n,).

        True is a proof that no share exceeds 1 by more than `TOLERANCE`, to rounding.

        Args:
            start: b4 at the start, shape (n, 3), in design units.
            start_rotation: Platform to base, shape (n, 3, 3).
            end: b4 at the end, shape (n, 3), in design units.
            end_rotation: Platform to base at the end, shape (n, 3, 3).
        """
        most = 1.0 + TOLERANCE
        bound, _, _ = self._largest(start, start_rotation, end, end_rotation, most)
        return np.asarray(bound <= most)

    def largest_along(
        self,
        start: FloatArray,
        start_rotation: FloatArray,
        end: FloatArray,
        end_rotation: FloatArray,
    ) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return upper bound, largest share and its share of straight moves, shape (n,) each.

        Arguments are those of `holds_along`.
        """
        return self._largest(start, start_rotation, end, end_rotation, math.nan)

    def largest_over(self, path: PathMargins) -> LargestShare:
        """Return the largest share over a path of the same tool, given with its crossings."""
        moves = list(itertools.pairwise(path.poses))
        p, r = (
            np.array([each.position for each in path.poses]),
            np.array([each.rotation for each in path.poses]),
        )
        bounds, shares, places = self.largest_along(p[:-1], r[:-1], p[1:], r[1:])
        places = places + np.arange(len(moves))
        singular = [crossing.move + crossing.share for crossing in path.crossings]
        singular += places[np.isinf(shares)].tolist()
        if singular:
            return LargestShare(math.inf, math.inf, min(singular), None)
        move = int(shares.argmax())
        share, place = float(shares[move]), float(places[move])
        part: int | None = None
        if share > 0.0:
            there = poses_between(*moves[move], place - move, self.tool)
            part = int(self.shares(*there).argmax())
        return LargestShare(share, float(bounds.max()), place, part)

    def _largest(
        self,
        start: FloatArray,
        start_rotation: FloatArray,
        end: FloatArray,
        end_rotation: FloatArray,
        target: float,
    ) -> tuple[FloatArray, FloatArray, FloatArray]:
        out = np.empty((len(start), COLUMNS))
        share_rows_of_moves(
            ROWS_OF_MOVE * len(start),
            self.row,
            for_kernel(start),
            for_kernel(start_rotation),
            for_kernel(end),
            for_kernel(end_rotation),
            self.tool,
            TOLERANCE,
            target,
            out,
        )
        return out[:, BOUND], out[:, SHARE], out[:, PLACE]


def path_loads(
    design: Design,
    poses: Sequence[Pose],
    load: ArrayLike,
    *,
    tool: Triple | None = None,
    weights: Weights | None = None,
    samples: int = SAMPLES,
) -> PathLoads:
    """Return the shares of the limits that a load uses over a path of straight moves.

    The payload's force of any direction acts besides.

    Args:
        design: The manipulator, with its tool, payload and limits.
        poses: Corners of the path, two or more.
        load: (F; M) on the platform at the tool point of the design, base axes, shape (6,), in N
            and N × unit.
        tool: Point that moves straight in the platform frame, in design units; None for b4.
        weights: All masses, the payload's included; None for the payload alone.
        samples: Number of samples of a move, both ends included.

    Raises:
        InputError: There are fewer than two poses or samples, or a number is not finite.
    """
    demanded = DemandedLoad.of(design, load, weights, tool)
    along = path_margins(poses, samples, tool)
    moves = list(itertools.pairwise(poses))
    number = np.minimum(along.at.astype(np.int64), len(moves) - 1)
    positions, rotations = np.empty((len(number), 3)), np.empty((len(number), 3, 3))
    for index, (start, end) in enumerate(moves):
        at = number == index
        positions[at], rotations[at] = poses_between(start, end, along.at[at] - index, tool)
    shares = demanded.shares(positions, rotations)
    return PathLoads(along.poses, along.at, shares, demanded.largest_over(along))


def _row(design: Design, load: FloatArray, weights: Weights) -> FloatArray:
    """Return what `explorer.paths.move_shares` needs of a machine and its load."""
    gravity = STANDARD_GRAVITY * np.array(design.gravity)
    first_moment = np.zeros(3)
    for body in weights.on_platform:
        first_moment += body.mass_kg * np.array(body.centre)
    mass = sum(body.mass_kg for body in weights.on_platform)
    legs = np.empty((4, LEG))
    legs[:, CARRIAGE], legs[:, CYLINDER] = weights.carriages, weights.cylinders
    legs[:, CYLINDER_MOMENT] = np.multiply(weights.cylinders, weights.cylinder_centres)
    legs[:, ROD] = weights.rods
    legs[:, ROD_MOMENT] = np.multiply(weights.rods, weights.rod_centres)
    row = np.empty(END)
    row[:POINT], row[POINT:LOAD] = design.variables, design.tool.position
    row[LOAD:FORCE], row[FORCE] = load, design.payload.force_n
    row[FIRST_MOMENT:WEIGHT], row[WEIGHT:GRAVITY] = first_moment, mass * gravity
    row[GRAVITY:LEGS], row[LEGS:LIMITS] = gravity, legs.ravel()
    row[LIMITS:] = part_limits(design).ravel()
    return row
