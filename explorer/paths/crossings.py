"""Singular poses on a path, also those that are close together.

Over a straight move one point of the platform, b4 or the tool point, goes along a line and the
platform turns about one axis, so a margin is (a + a' t) + (b + b' t) cos ωt + (c + c' t) sin ωt for
ω up to π. The polynomial through its values at Chebyshev points of the move is the margin to
rounding. Between two zeros of its rate the margin is monotonic, so that it has one root or none.
See L. N. Trefethen, "Approximation theory and approximation practice" (2013), chapters 8 and 18.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from itertools import groupby, pairwise

import numpy as np
from numpy.polynomial import chebyshev
from numpy.typing import ArrayLike
from scipy.optimize import brentq

from explorer.errors import InputError
from explorer.legs.moves import StraightMoves
from explorer.mechanism.margins import margins
from explorer.mechanism.pose import Pose
from explorer.numerics.arrays import FloatArray, lengths_of, triple

# A margin is zero at a pose, and over a whole move, below these shares of |position| + |way|.
ROUNDING, ALL_ALONG = 1e-13, 1e-12
# Points of a move through which the polynomial goes. Coefficient k falls like (π/4)ᵏ / k!.
POINTS = 33
# Two roots at a corner closer than this share of a move are one.
NEAREST_ROOTS = 1e-6


@dataclass(frozen=True)
class Crossing:
    """A singular pose on a path.

    Attributes:
        incidence: 1, 2 or 3, for the vanishing margin δ1, δ2 or δ3.
        move: Number of the move in the path, from 0.
        share: Share of that move, from 0 to 1.
        pose: The singular pose.
        changes_sign: Whether the margin has opposite signs before and after; False where it
            only touches zero, and at both ends of the path.
        side: Sign of the margin before the crossing; after it where the move starts there.
    """

    incidence: int
    move: int
    share: float
    pose: Pose
    changes_sign: bool
    side: int


@dataclass(frozen=True)
class PathMargins:
    """The course of the margins over a path.

    Attributes:
        poses: Corners of the path.
        least: Least |δ1|, |δ2| and |δ3| over the path, in design units.
        crossings: Singular poses in the order of the path.
        lies_in: Incidences (1, 2, 3) that hold over some whole move, such as 3 for one in the
            base plane; such a move has no crossings of that margin.
    """

    poses: tuple[Pose, ...]
    least: tuple[float, float, float]
    crossings: tuple[Crossing, ...]
    lies_in: tuple[int, ...]


def path_margins(poses: Sequence[Pose], tool: ArrayLike | None = None) -> PathMargins:
    """Return the least margins over a path of straight moves, and its singular poses.

    The tool, shape (3,), moves straight in the platform frame; b4 if None.

    Raises:
        InputError: There are fewer than two poses, or the tool is not finite.
    """
    if len(poses) < 2:
        raise InputError("a path has at least two poses")
    moves = StraightMoves.along(poses, tool)
    sizes = lengths_of(moves.start) + lengths_of(moves.step) + lengths_of(moves.tool)
    points = 0.5 + 0.5 * chebyshev.chebpts1(POINTS)
    crossings: list[Crossing] = []
    lies_in: set[int] = set()
    least = np.full(3, np.inf)
    for index, size in enumerate(sizes.tolist()):
        values = margins(*moves.poses(np.full(POINTS, index), points))
        found: list[Crossing] = []
        for number in range(3):
            if np.abs(values[:, number]).max() <= ALL_ALONG * size:
                lies_in.add(number + 1)
                least[number] = 0.0
                continue
            roots, smallest = _roots(values[:, number], size)
            least[number] = min(least[number], smallest)
            for share, changes, side in roots:
                pose = Pose.of(*moves.poses(np.array(index), np.array(share)))
                found.append(Crossing(number + 1, index, share, pose, changes, side))
        crossings += sorted(found, key=lambda crossing: crossing.share)
    merged = tuple(_merge_corners(crossings))
    return PathMargins(tuple(poses), triple(least), merged, tuple(sorted(lies_in)))


def _merge_corners(crossings: list[Crossing]) -> list[Crossing]:
    """Return the crossings, with one instead of two where both moves of a corner cross at it."""
    merged: list[Crossing] = []
    ends: dict[tuple[int, int], int] = {}
    for crossing in crossings:
        twin = ends.get((crossing.incidence, crossing.move - 1))
        if twin is not None and crossing.share <= NEAREST_ROOTS:
            changes_sign = merged[twin].side != crossing.side
            merged[twin] = dataclasses.replace(merged[twin], changes_sign=changes_sign)
            continue
        if crossing.share > 1.0 - NEAREST_ROOTS:
            ends[crossing.incidence, crossing.move] = len(merged)
        merged.append(crossing)
    return merged


def _roots(values: FloatArray, size: float) -> tuple[list[tuple[float, bool, int]], float]:
    """Return the roots of a margin over a move, and its least magnitude.

    The margin is given at the Chebyshev points, with the size of the numbers that it comes from. A
    root is the share of the move, whether the sign changes there, and the sign before it; after it
    if the move starts there.
    """
    # Over x from −1 to 1.
    coefficients = chebyshev.chebfit(chebyshev.chebpts1(POINTS), values, POINTS - 1)
    rate = chebyshev.chebtrim(chebyshev.chebder(coefficients), ROUNDING * size)
    # A point that is no extreme does no harm.
    extremes = np.real(chebyshev.chebroots(rate))
    places = np.array([-1.0, *np.sort(extremes[np.abs(extremes) < 1.0]), 1.0])
    margin = partial(chebyshev.chebval, c=coefficients)
    at = margin(places)
    signs = np.where(np.abs(at) <= ROUNDING * size, 0.0, np.sign(at)).astype(int).tolist()
    roots: list[tuple[float, bool, int]] = []
    sign = 0
    for is_zero, group in groupby(range(len(signs)), lambda k: signs[k] == 0):
        members = list(group)
        if is_zero:
            # Extremes that are zero side by side are one root of higher order.
            nearest = min(members, key=lambda k: abs(at[k]))
            after = signs[members[-1] + 1] if members[-1] + 1 < len(signs) else 0
            roots.append((0.5 + 0.5 * float(places[nearest]), sign * after < 0, sign or after))
            continue
        for k, following in pairwise(members):
            if signs[k] != signs[following]:
                x = float(brentq(margin, places[k], places[following], xtol=1e-16))
                share = 0.5 + 0.5 * x
                roots.append((share, True, signs[k] if share > NEAREST_ROOTS else -signs[k]))
        sign = signs[members[-1]]
    return roots, 0.0 if roots else float(np.abs(at).min())
