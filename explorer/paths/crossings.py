"""Singular poses on a path, also those that are close together.

Over a straight move one point of the platform, b4 or the tool point, goes along a line and the
platform turns about one axis, so a margin is (a + a' t) + (b + b' t) cos ωt + (c + c' t) sin ωt.
Its roots are isolated by halving intervals until a bound of the second derivative proves that an
interval has no root, or one at most.
"""

from __future__ import annotations

import dataclasses
import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial.transform import Rotation

from explorer.errors import InputError
from explorer.legs.moves import poses_between
from explorer.mechanism.margins import margins
from explorer.mechanism.pose import Pose
from explorer.numerics.arrays import FloatArray, finite_array

# A margin is zero at a pose, and over a whole move, below these shares of |position| + |way|.
ROUNDING, ALL_ALONG = 1e-14, 1e-12
# The most intervals examined for a margin; only a margin that is nearly zero for long needs them.
MOST_INTERVALS = 20_000
# Two roots closer than this share of a move, without a change of sign between, are one.
NEAREST_ROOTS = 1e-6
# The distance from a crossing, as a share of the move, at which the margin's sign is read.
ASIDE = 1e-5
# Samples of a move for a plot of the margins.
SAMPLES = 101


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
    """The margins over a path, and its crossings.

    Attributes:
        poses: Corners of the path.
        at: Place of the samples: number of the move plus the share of it, shape (n,).
        margins: (δ1, δ2, δ3) of the samples, in design units, shape (n, 3).
        least: Least |δ1|, |δ2| and |δ3| over the path, not of the samples, in design units.
        crossings: Singular poses in the order of the path.
        lies_in: Incidences (1, 2, 3) that hold over some whole move, such as 3 for one in the
            base plane; such a move has no crossings of that margin.
    """

    poses: tuple[Pose, ...]
    at: FloatArray
    margins: FloatArray
    least: tuple[float, float, float]
    crossings: tuple[Crossing, ...]
    lies_in: tuple[int, ...]


def path_margins(
    poses: Sequence[Pose], samples: int = SAMPLES, tool: ArrayLike | None = None
) -> PathMargins:
    """Return the margins over a path of straight moves, and its singular poses.

    Args:
        poses: Corners of the path, two or more.
        samples: Number of samples of a move, both ends included.
        tool: Point that moves straight in the platform frame, shape (3,), in design units; None
            for b4.

    Raises:
        InputError: there are fewer than two poses or samples, or the tool is not finite.
    """
    if len(poses) < 2 or samples < 2:
        raise InputError("a path has at least two poses and at least two samples of a move")
    at: list[FloatArray] = []
    values: list[FloatArray] = []
    crossings: list[Crossing] = []
    lies_in: set[int] = set()
    leasts: list[list[float]] = []
    shares = np.linspace(0.0, 1.0, samples, dtype=np.float64)
    for index, (start, end) in enumerate(itertools.pairwise(poses)):
        # A corner is a sample of the move that ends there.
        new_shares = shares if index == 0 else shares[1:]
        at.append(index + new_shares)
        values.append(margins(*poses_between(start, end, new_shares, tool)))
        along = _move_margins(start, end, tool)
        leasts.append([margin.least() for margin in along])
        of_move, lasting = _find_crossings_of_move(along, start, end, index, tool)
        crossings += of_move
        lies_in.update(lasting)
    merged = tuple(_merge_corners(crossings))
    samples_at = np.concatenate(at), np.concatenate(values)
    least1, least2, least3 = map(min, zip(*leasts, strict=True))
    least = least1, least2, least3
    return PathMargins(tuple(poses), *samples_at, least, merged, tuple(sorted(lies_in)))


def _merge_corners(crossings: list[Crossing]) -> list[Crossing]:
    """Return the crossings, with one instead of two where both moves of a corner cross at it."""
    merged: list[Crossing] = []
    for crossing in crossings:
        corner = (crossing.incidence, crossing.move - 1)
        twins = [
            index
            for index, other in enumerate(merged)
            if (other.incidence, other.move) == corner and other.share > 1.0 - NEAREST_ROOTS
        ]
        if twins and crossing.share <= NEAREST_ROOTS:
            before = merged[twins[-1]]
            merged[twins[-1]] = dataclasses.replace(
                before, changes_sign=before.side != crossing.side
            )
        else:
            merged.append(crossing)
    return merged


def _find_crossings_of_move(
    along: Sequence[_MoveMargin], start: Pose, end: Pose, index: int, tool: ArrayLike | None
) -> tuple[list[Crossing], list[int]]:
    """Return the crossings of a move in order, and the incidences that hold all along it."""
    crossings: list[Crossing] = []
    lasting: list[int] = []
    for number, margin in enumerate(along):
        if margin.is_zero:
            lasting.append(number + 1)
            continue
        for share, changes in margin.roots:
            position, rotation = poses_between(start, end, share, tool)
            aside = share - ASIDE if share > NEAREST_ROOTS else share + ASIDE
            side = 1 if margin.at(aside)[0] > 0.0 else -1
            pose = Pose.of(position, rotation)
            crossings.append(Crossing(number + 1, index, share, pose, changes, side))
    return sorted(crossings, key=lambda crossing: crossing.share), lasting


@dataclass(frozen=True)
class _MoveMargin:
    """A margin on a move, (a + a' t) + (b + b' t) cos ωt + (c + c' t) sin ωt for t from 0 to 1."""

    a: float
    da: float
    b: float
    db: float
    c: float
    dc: float
    angle: float
    size: float

    @cached_property
    def is_zero(self) -> bool:
        """Whether the margin is zero all along the move, to rounding."""
        samples = [self.at(t)[0] for t in np.linspace(0.0, 1.0, 17).tolist()]
        return max(map(abs, samples)) <= ALL_ALONG * self.size

    def at(self, t: float) -> tuple[float, float]:
        """Return the value and the rate."""
        cosine, sine = math.cos(self.angle * t), math.sin(self.angle * t)
        b, c = self.b + t * self.db, self.c + t * self.dc
        value = self.a + t * self.da + b * cosine + c * sine
        rate = self.da + self.db * cosine + self.dc * sine
        return value, rate + self.angle * (c * cosine - b * sine)

    def curvature_bound(self) -> float:
        """Return an upper bound of the second derivative's magnitude."""
        b = max(abs(self.b), abs(self.b + self.db))
        c = max(abs(self.c), abs(self.c + self.dc))
        rates = math.hypot(self.db, self.dc)
        return self.angle * (self.angle * math.hypot(b, c) + 2.0 * rates)

    def least(self) -> float:
        """Return the least magnitude over the move: at an end, a root or where the rate is zero."""
        if self.is_zero or self.roots:
            return 0.0
        w = self.angle
        rate = _MoveMargin(
            a=self.da,
            da=0.0,
            b=self.db + w * self.c,
            db=w * self.dc,
            c=self.dc - w * self.b,
            dc=-w * self.db,
            angle=w,
            size=(1.0 + w) * self.size,
        )
        stationary = [] if rate.is_zero else [t for t, _ in rate.roots]
        return min(abs(self.at(t)[0]) for t in (0.0, 1.0, *stationary))

    @cached_property
    def roots(self) -> list[tuple[float, bool]]:
        """All roots in ascending order, with whether the sign changes there."""
        curvature, zero = self.curvature_bound(), ROUNDING * self.size
        roots: list[tuple[float, bool]] = []
        queue = [(0.0, 1.0)]
        examined = 0
        while queue:
            examined += 1
            low, high = queue.pop()
            half, middle = 0.5 * (high - low), 0.5 * (low + high)
            value, rate = self.at(middle)
            deviation = 0.5 * curvature * half * half
            if abs(value) > abs(rate) * half + deviation + zero:
                continue
            if abs(rate) > curvature * half or deviation <= zero or examined > MOST_INTERVALS:
                roots += self._isolated_root(low, high)
                continue
            # The left half is next, so that roots come in order.
            queue += [(middle, high), (low, middle)]
        return self._merge(roots)

    def _merge(self, roots: list[tuple[float, bool]]) -> list[tuple[float, bool]]:
        """Return ascending roots, one for all that rounding or neighbouring intervals have made."""
        merged: list[tuple[float, bool]] = []
        for share, changes in roots:
            if merged and share - merged[-1][0] <= NEAREST_ROOTS:
                before, changed = merged[-1]
                middle = self.at(0.5 * (before + share))[0]
                # Two changes of sign are a touch if nothing but rounding is between them.
                if not (changes and changed) or abs(middle) <= ROUNDING * self.size:
                    merged[-1] = (share if changes and not changed else before, changes != changed)
                    continue
            merged.append((share, changes))
        return merged

    def _isolated_root(self, low: float, high: float) -> list[tuple[float, bool]]:
        """Return the root in an interval where the margin is monotonic or zero to rounding."""
        zero = ROUNDING * self.size
        first, last = self.at(low)[0], self.at(high)[0]
        if (first > 0.0) == (last > 0.0):
            # The root is at an end of the move, or the margin only touches zero.
            least, t = min((abs(self.at(t)[0]), t) for t in (low, 0.5 * (low + high), high))
            return [(t, False)] if least <= zero else []
        # Newton's steps, within the interval that brackets the root.
        t = 0.5 * (low + high)
        for _ in range(100):
            value, rate = self.at(t)
            if value == 0.0:
                break
            if (value > 0.0) == (first > 0.0):
                low = t
            else:
                high = t
            following = t - value / rate if rate != 0.0 else low
            if not low < following < high:
                following = 0.5 * (low + high)
            if abs(following - t) <= 1e-16:
                break
            t = following
        return [(t, True)]


def _move_margins(
    start: Pose, end: Pose, tool: ArrayLike | None
) -> tuple[_MoveMargin, _MoveMargin, _MoveMargin]:
    """Return the three margins of a move of a tool point t.

    With c its position, δ1 = t z − R ẑ·c, δ2 = (x̂ × R x̂)·c − x̂·R (x̂ × t) and δ3 = ẑ·c − ẑ·R t.
    """
    t = np.zeros(3) if tool is None else finite_array("tool", tool, (3,))
    first = start.rotation
    p = np.array(start.position) + first @ t
    step = np.array(end.position) + end.rotation @ t - p
    turn = Rotation.from_matrix(end.rotation @ first.T).as_rotvec()
    angle = float(np.linalg.norm(turn))
    axis = turn / angle if angle > 0.0 else np.array([1.0, 0.0, 0.0])
    size = float(np.linalg.norm(p) + np.linalg.norm(step) + np.linalg.norm(t)) or 1.0

    def parts_of(direction: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return the constant, cosine and sine parts of a direction that turns."""
        stays = axis * float(axis @ direction)
        return stays, direction - stays, np.cross(axis, direction)

    def margin_along(directions: Sequence[FloatArray], less: Sequence[float]) -> _MoveMargin:
        terms = [(float(d @ p) - x, float(d @ step)) for d, x in zip(directions, less, strict=True)]
        (a, da), (b, db), (c, dc) = terms
        return _MoveMargin(a, da, b, db, c, dc, angle, size)

    x, z, zero = np.array([1.0, 0.0, 0.0]), np.array([0.0, 0.0, 1.0]), np.zeros(3)
    around = [float(part[0]) for part in parts_of(first @ np.cross(x, t))]
    above = [float(part[2]) for part in parts_of(first @ t)]
    delta1 = margin_along([-part for part in parts_of(first[:, 2])], [-float(t[2]), 0.0, 0.0])
    delta2 = margin_along([np.cross(x, part) for part in parts_of(first[:, 0])], around)
    delta3 = margin_along([z, zero, zero], above)
    return delta1, delta2, delta3
