"""Where a path crosses singularities: all of them, however close together.

Along a straight move the position goes linearly and the platform turns about one axis, so each
margin is (a + a' t) + (b + b' t) cos ωt + (c + c' t) sin ωt. Its roots are isolated by
halving: an interval is done with where the Taylor polynomial of second order, with a bound of
what it leaves out, has no root or one simple root for certain.
"""

from __future__ import annotations

import dataclasses
import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from explorer.errors import InputError
from explorer.legs.moves import poses_between
from explorer.mechanism.margins import margins
from explorer.mechanism.pose import Pose
from explorer.numerics.arrays import FloatArray

# Of the position and the way: a margin is zero below it, and all along a move.
ROUNDING, ALL_ALONG = 1e-14, 1e-12
# Intervals that are looked at for a margin, more than enough but where it is nearly zero long.
MOST_LOOKS = 20_000
# As far apart touches of zero can be told apart.
SAME = 1e-6
# Beside a crossing, to see on which side of zero the margin is.
ASIDE = 1e-5
# For a plot of the margins over a path.
SAMPLES = 101


@dataclass(frozen=True)
class Crossing:
    """A singular pose on a path.

    Attributes:
        incidence: 1, 2 or 3: which of κ1, κ2, κ3 vanishes.
        move: Of the path's moves, from 0.
        share: How far into that move, from 0 to 1.
        pose: The pose there.
        changes_sign: Whether the margin has other signs before and after; not where it only
            touches zero, or where the path starts or ends.
        side: The sign of the margin on the move that is at hand: before it, but after it
            where the move starts with it.
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
        poses: The corners of the path.
        at: Of the samples: the number of the move and the share of it added, shape (n,).
        margins: At the samples, shape (n, 3).
        crossings: In the order of the path.
        lies_in: The incidences (1, 2, 3) that some whole move has, such as 3 for one in the
            base plane; such a move has no crossings of that margin.
    """

    poses: tuple[Pose, ...]
    at: FloatArray
    margins: FloatArray
    crossings: tuple[Crossing, ...]
    lies_in: tuple[int, ...]


def path_margins(poses: Sequence[Pose], samples: int = SAMPLES) -> PathMargins:
    """Return the margins over a path of straight moves, and where it is singular.

    Args:
        poses: The corners of the path, two or more.
        samples: Of each move, both ends included.

    Raises:
        InputError: fewer than two poses or samples.
    """
    if len(poses) < 2 or samples < 2:
        raise InputError("a path has two poses and two samples of each move at least")
    at: list[FloatArray] = []
    values: list[FloatArray] = []
    crossings: list[Crossing] = []
    lies_in: set[int] = set()
    shares = np.linspace(0.0, 1.0, samples, dtype=np.float64)
    for index, (start, end) in enumerate(itertools.pairwise(poses)):
        # A corner is a sample of the move before it.
        own = shares if index == 0 else shares[1:]
        at.append(index + own)
        values.append(margins(*poses_between(start, end, own)))
        found, everywhere = _of_move(start, end, index)
        crossings += found
        lies_in.update(everywhere)
    return PathMargins(
        tuple(poses),
        np.concatenate(at),
        np.concatenate(values),
        tuple(_without_corners_twice(crossings)),
        tuple(sorted(lies_in)),
    )


def _without_corners_twice(crossings: list[Crossing]) -> list[Crossing]:
    """Return the crossings with those of a corner, of the moves before and after it, as one."""
    kept: list[Crossing] = []
    for each in crossings:
        before = next(
            (
                other
                for other in reversed(kept)
                if other.incidence == each.incidence
                and other.move == each.move - 1
                and other.share > 1.0 - SAME
            ),
            None,
        )
        if before is None or each.share > SAME:
            kept.append(each)
        else:
            at = kept.index(before)
            kept[at] = dataclasses.replace(before, changes_sign=before.side != each.side)
    return kept


def _of_move(start: Pose, end: Pose, index: int) -> tuple[list[Crossing], list[int]]:
    """Return the crossings of a move in order, and the incidences that all of it has."""
    found: list[Crossing] = []
    everywhere: list[int] = []
    for which, wave in enumerate(_waves(start, end)):
        if wave.is_zero:
            everywhere.append(which + 1)
            continue
        for share, changes in wave.roots():
            position, rotation = poses_between(start, end, share)
            aside = share - ASIDE if share > SAME else share + ASIDE
            side = 1 if wave.at(aside)[0] > 0.0 else -1
            pose = Pose.of(position, rotation)
            found.append(Crossing(which + 1, index, share, pose, changes, side))
    return sorted(found, key=lambda each: each.share), everywhere


@dataclass(frozen=True)
class _Wave:
    """(a + a' t) + (b + b' t) cos ωt + (c + c' t) sin ωt over t from 0 to 1."""

    a: float
    da: float
    b: float
    db: float
    c: float
    dc: float
    angle: float
    size: float

    @property
    def is_zero(self) -> bool:
        """Whether it vanishes all over, to rounding."""
        samples = [self.at(t)[0] for t in np.linspace(0.0, 1.0, 17).tolist()]
        return max(map(abs, samples)) <= ALL_ALONG * self.size

    def at(self, t: float) -> tuple[float, float]:
        """Return the value and the rate."""
        cosine, sine = math.cos(self.angle * t), math.sin(self.angle * t)
        b, c = self.b + t * self.db, self.c + t * self.dc
        value = self.a + t * self.da + b * cosine + c * sine
        rate = self.da + self.db * cosine + self.dc * sine
        return value, rate + self.angle * (c * cosine - b * sine)

    def bend(self) -> float:
        """Return what the second derivative does not exceed."""
        b = max(abs(self.b), abs(self.b + self.db))
        c = max(abs(self.c), abs(self.c + self.dc))
        rates = math.hypot(self.db, self.dc)
        return self.angle * (self.angle * math.hypot(b, c) + 2.0 * rates)

    def roots(self) -> list[tuple[float, bool]]:
        """Return all roots with whether the sign changes there, in ascending order."""
        bend, zero = self.bend(), ROUNDING * self.size
        found: list[tuple[float, bool]] = []
        waiting = [(0.0, 1.0)]
        looks = 0
        while waiting:
            looks += 1
            low, high = waiting.pop()
            half, middle = 0.5 * (high - low), 0.5 * (low + high)
            value, rate = self.at(middle)
            off = 0.5 * bend * half * half
            if abs(value) > abs(rate) * half + off + zero:
                continue
            if abs(rate) > bend * half or off <= zero or looks > MOST_LOOKS:
                found += self._only_root(low, high)
                continue
            # The left one is looked at first, so that roots come in order.
            waiting += [(middle, high), (low, middle)]
        return _distinct(found)

    def _only_root(self, low: float, high: float) -> list[tuple[float, bool]]:
        """Return the root of an interval on which it is monotonous, or else zero to rounding."""
        zero = ROUNDING * self.size
        first, last = self.at(low)[0], self.at(high)[0]
        if (first > 0.0) == (last > 0.0):
            # At an end of the move, or where it only touches.
            least, t = min((abs(self.at(t)[0]), t) for t in (low, 0.5 * (low + high), high))
            return [(t, False)] if least <= zero else []
        # Newton's steps, kept within what is known to hold the root.
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


def _distinct(roots: list[tuple[float, bool]]) -> list[tuple[float, bool]]:
    """Return ascending roots without what a touch or an end has in neighbouring intervals."""
    kept: list[tuple[float, bool]] = []
    for share, changes in roots:
        if kept and share - kept[-1][0] <= SAME and not (changes and kept[-1][1]):
            if changes:
                kept[-1] = (share, True)
        else:
            kept.append((share, changes))
    return kept


def _waves(start: Pose, end: Pose) -> tuple[_Wave, _Wave, _Wave]:
    """Return the three margins over a move."""
    p, first = np.array(start.position), start.rotation
    step = np.array(end.position) - p
    turn = Rotation.from_matrix(end.rotation @ first.T).as_rotvec()
    angle = float(np.linalg.norm(turn))
    axis = turn / angle if angle > 0.0 else np.array([1.0, 0.0, 0.0])
    size = float(np.linalg.norm(p) + np.linalg.norm(step)) or 1.0

    def turned(direction: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return its parts that stay, go with the cosine and go with the sine."""
        stays = axis * float(axis @ direction)
        return stays, direction - stays, np.cross(axis, direction)

    def wave(directions: Sequence[FloatArray]) -> _Wave:
        terms = [x for d in directions for x in (float(d @ p), float(d @ step))]
        a, da, b, db, c, dc = terms
        return _Wave(a, da, b, db, c, dc, angle, size)

    x, zero = np.array([1.0, 0.0, 0.0]), np.zeros(3)
    kappa1 = wave([-part for part in turned(first[:, 2])])
    kappa2 = wave([np.cross(x, part) for part in turned(first[:, 0])])
    kappa3 = wave([np.array([0.0, 0.0, 1.0]), zero, zero])
    return kappa1, kappa2, kappa3
