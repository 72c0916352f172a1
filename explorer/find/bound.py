"""Bounds that hold for every machine: the least longest leg, and demands that no machine keeps.

At home's orientation the upper end of leg 4 goes through a box like that of the tool, seen from a3:
the largest distance of a corner over the least distance of the box is at most the ratio of the
legs, each corner lies within the cone at a3 about the centre of the box, and the whole box lies by
the margin above the base plane, or below it. With the tool at b4 it goes through that very box at
every tilt, and the leg stays within the cone at b4 too. In the platform a tilt turns the leg back.

From a3 the centre of the box lies in some direction at some distance. A demand that is missed at a
distance is also missed at any shorter one, since a box enlarged from its centre contains itself.
That leaves the directions of an eighth of a sphere, by the symmetry of the box, for a search over
cells of them. Some turn brings each direction of a cell to the middle; it moves the corners a
little, and the axes of the tilts.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from explorer.find.over_tilts import CORNERS
from explorer.find.requirement import Requirement
from explorer.find.terms import Terms
from explorer.mechanism.machine import STANDARD_GRAVITY
from explorer.numerics.arrays import BoolArray, FloatArray, dot, lengths_of
from explorer.prototype.sizes import THINNEST_LEG

# Share of the swing beyond the tilt by which a tilt may turn less about the nearest axis that is
# looked at, and the fewest and the most of half of these axes.
LESS, FEWEST_AXES, MOST_AXES = 0.006, 4, 30
# Cells along each angle at first, and the most cells of a search.
FIRST, MOST = 8, 8000
# Share by which the bound may be below what the cells can show.
LOOSE = 0.003
# Halvings of a range of distances.
HALVINGS = 24
# Length of a leg, over the diagonal of the box, beyond which no bound is told.
FARTHEST = 1e6


@lru_cache(maxsize=4)
def least_longest_mm(requirement: Requirement) -> float:
    """Return a length that the longest leg of every machine has at least, in millimetres.

    It is infinite if no swing as small as the required one allows the tilt.
    """
    # Some axis parallel to the base plane is square to leg 4 at home. Seen from the platform, a
    # tilt about it turns the direction at home by the whole angle. With the tool at b4 the leg has
    # that direction in the centre of the box at every tilt, so that b4 swings as much, and more in
    # other positions. With another tool the swings at a3 and b4 share it.
    share, swing = 0.5 if "tool" in requirement.free else 1.0, requirement.swing_deg
    if swing is not None and swing <= share * requirement.tilt_deg:
        return math.inf
    terms = Terms.of(requirement)
    leg, size, done = _Leg4(terms), 0.5 * math.pi / FIRST, 0
    lows = size * np.stack(np.divmod(np.arange(FIRST**2), FIRST), axis=-1)
    best, parts = FARTHEST, CORNERS[:4, 1:].clip(0.0)
    while True:
        middles, done = lows + 0.5 * size, done + len(lows)
        best = leg.longest(middles, best)
        bound = (1.0 - LOOSE) * best
        is_open = ~leg.is_longer(middles, size, bound)
        if not is_open.any():
            break
        if done + 4 * np.count_nonzero(is_open) > MOST:
            while not leg.is_longer(middles, size, bound).all():
                bound *= 0.98
            break
        size *= 0.5
        lows = (lows[is_open, None] + size * parts).reshape(-1, 2)
    return terms.scale_mm * bound


class _Leg4:
    """What leg 4 must keep over the box, with lengths over the diagonal of the box.

    A direction is an angle from the normal of the base plane and an azimuth in the frame of the
    box, each up to a right angle. Sizes of the box are over its distance from a3.
    """

    def __init__(self, terms: Terms) -> None:
        self.terms, self.half = terms, 0.5 * terms.edges
        self.corners = self.half * CORNERS
        self.height = float(self.half[2]) + terms.margin
        self.dead = -math.inf if terms.parts is None else float(terms.parts.dead[3])
        self.tilt = 0.0 if "tool" in terms.requirement.free else terms.tilt
        self.angles = np.zeros(0)
        if self.tilt and terms.swing < math.pi:
            between = math.sqrt(2.0 * LESS * (terms.swing / self.tilt - 1.0))
            half = min(max(math.ceil(0.5 * math.pi / between), FEWEST_AXES), MOST_AXES)
            self.angles = math.pi / half * np.arange(2 * half)

    def longest(self, directions: FloatArray, most: float) -> float:
        """Return the least longest leg in some directions (n, 2), or `most` if none is below it."""
        cells = self._cells(directions, 0.0)
        lower = self._sizes(cells, most)
        is_less = ~self._misses(cells, lower)
        cells, lower = self._cells(directions[is_less], 0.0), lower[is_less]
        upper = cells.toward[:, 0, 2] / self.height
        for _ in range(HALVINGS):
            middle = np.sqrt(lower * upper)
            is_missed = self._misses(cells, middle)
            upper, lower = np.where(is_missed, middle, upper), np.where(is_missed, lower, middle)
        return float(np.min(self._ends(cells, lower)[1] / lower, initial=most))

    def is_longer(self, middles: FloatArray, size: float, bound: float) -> BoolArray:
        """Return whether all longest legs of cells are above a bound, (n,) boolean.

        Cells are given by their middles (n, 2) and their edge.
        """
        cells = self._cells(middles, size)
        return self._misses(cells, self._sizes(cells, bound))

    def _cells(self, middles: FloatArray, size: float) -> _Cells:
        """Return cells with what tilts make of their middles.

        The axes of the tilts lie at fixed angles from the one that is square to the direction.
        """
        c = _vectors(middles)[:, None]
        turned = self.angles - middles[:, 1:]
        n = np.stack([np.sin(turned), np.cos(turned), 0.0 * turned], axis=-1)
        along = (1.0 - math.cos(self.tilt)) * dot(n, c)[..., None] * n
        tilted = math.cos(self.tilt) * c + math.sin(self.tilt) * np.cross(n, c) + along
        ends = 0.5 * size * CORNERS[:4, 1:] if size else np.zeros((1, 2))
        return _Cells(np.concatenate([c, tilted], axis=1), _vectors(middles[:, None] + ends), size)

    def _sizes(self, cells: _Cells, bound: float) -> FloatArray:
        """Return the sizes of boxes up to which a bound of the longest leg is exceeded."""
        slope = cells.least(self.half)
        distance = np.sqrt(slope**2 + max(bound**2 - 0.25, 0.0)) - slope
        return 1.0 / np.maximum(distance, 1e-9)

    def _ends(self, cells: _Cells, box: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return upper bounds of shortest and lower bounds of longest lengths over the distance.

        The square of the shortest length is one less convex functions of the three coordinates.
        """
        longest = np.sqrt(1.0 + 0.25 * box**2 + 2.0 * box * cells.least(self.half))
        half, c = box[:, None] * self.half, cells.toward[:, 0]
        slopes = 2.0 * np.minimum(c, half)
        rest = 1.0 + (0.25 * slopes**2).sum(axis=-1) - cells.least(slopes)
        return np.sqrt(np.maximum(rest, 0.0)), longest

    def _misses(self, cells: _Cells, box: FloatArray) -> BoolArray:
        """Return whether every direction of cells misses a demand with a box of some size."""
        terms, size, toward = self.terms, cells.size, cells.toward
        shortest, longest = self._ends(cells, box)
        misses = cells.corners[..., 2].max(axis=1) < self.height * box
        misses |= longest / terms.ratio > shortest
        misses |= 2.0 * shortest - longest < self.dead * box
        if terms.swing < math.pi:
            corners = toward[:, :1] + box[:, None, None] * self.corners
            # A direction comes to the middle of its cell by a turn about the axis square to it, and
            # one about the normal of the base plane, each by at most half an edge of the cell.
            moved = math.sqrt(1.0 - math.cos(0.25 * size) ** 4) * box[:, None]
            length = lengths_of(corners)
            # With the direction, an axis turns by less than its distance from the square one.
            apart = np.array([0.0, *np.abs(np.sin(self.angles))]) * math.sin(0.25 * size)
            swing = terms.swing + 4.0 * np.arcsin(math.sin(0.5 * self.tilt) * apart)
            # The cosine of the swing and of the angle by which a corner is seen to move, times the
            # length; cones of a right angle or more demand nothing here.
            rest = np.sqrt(np.maximum(length**2 - moved**2, 0.0))
            least = np.cos(swing)[:, None] * rest[:, None] - np.sin(swing)[:, None] * moved[:, None]
            outside = toward @ np.swapaxes(corners, 1, 2) < least - 1e-12
            outside &= (swing < 0.5 * math.pi)[:, None] & (moved < length)[:, None]
            misses |= outside.any(axis=(1, 2))
        return misses


class _Cells(NamedTuple):
    """Cells of directions.

    Attributes:
        toward: Their middles, and what tilts make of these, shape (n, 1 + axes, 3).
        corners: Their corners, shape (n, 4, 3), or the middles alone, shape (n, 1, 3).
        size: Their edge, in radians.
    """

    toward: FloatArray
    corners: FloatArray
    size: float

    def least(self, weights: FloatArray) -> FloatArray:
        """Return the least inner products with vectors that have no negative part, (n,).

        They are concave in each of the two angles, so that the least is at a corner.
        """
        return np.asarray(dot(self.corners, weights.reshape(-1, 1, 3)).min(axis=1))


def _vectors(directions: FloatArray) -> FloatArray:
    """Return directions (..., 2) as unit vectors (..., 3)."""
    lean, azimuth = directions[..., 0], directions[..., 1]
    flat = np.sin(lean)
    return np.stack([flat * np.cos(azimuth), flat * np.sin(azimuth), np.cos(lean)], axis=-1)


def impossible_demands(requirement: Requirement) -> tuple[str, ...]:
    """Return clauses on demands that no machine keeps, proven."""
    return tuple(_impossible(requirement))


def _impossible(requirement: Requirement) -> Iterator[str]:
    """Yield clauses on demands that no machine keeps.

    In a pure translation no joint is faster than the platform. So one of the tool along leg 4 asks
    all its speed of the actuator, and errors of equal size allow a translation by that size.
    """
    legs, payload, box = requirement.legs, requirement.payload, requirement.box_mm
    least = least_longest_mm(requirement)
    if math.isinf(least):
        share = "half " if "tool" in requirement.free else ""
        yield (
            f"no joints that swing {requirement.swing_deg:g}° allow a tilt of "
            f"{requirement.tilt_deg:g}°: about some axis it turns leg 4 by as much, and its joints "
            f"need more than {share}that"
        )
        least = 0.0
    elif legs.longest_mm is not None and legs.longest_mm < least:
        yield f"no machine has legs below {round_down(least)} mm"
    if requirement.buildable and 0.0 < 0.5 * legs.diameter_mm < THINNEST_LEG:
        yield f"no leg is built thinner than {2.0 * THINNEST_LEG:g} mm"
    if legs.push_n is not None:
        # The actuators of legs 2 and 3 push at right angles to each other.
        most = (2.0 + math.sqrt(8.0)) * max(legs.push_n, legs.pull_n or 0.0)
        load = payload.mass_kg * STANDARD_GRAVITY + payload.force_n
        if load > most:
            yield f"no machine holds more than {round_down(most)} N with actuators of that force"
    fastest, change = legs.speed_mm_s or math.inf, legs.acceleration_mm_s2 or math.inf
    if requirement.tool.speed_mm_s > fastest:
        speed = f"{fastest:g} mm/s"
        yield f"no machine moves its tool faster than its actuators, {speed}, in every direction"
    if requirement.move_s is not None:
        # A carriage moves by the part of a diagonal along the guide, however the box is turned.
        way = min(box[:2])
        speed = min(fastest, math.sqrt(way * change))
        least_s = way / speed + speed / change
        if least_s > requirement.move_s:
            words = f"{way:g} mm along the guide in less than {round_down(least_s)} s"
            yield f"no carriage moves {words}"
    if requirement.error_mm is not None and requirement.error_mm < legs.error_mm:
        yield f"no machine has an error below that of its actuators, {legs.error_mm:g} mm"
    if requirement.deflection_mm is not None and legs.stiffness_n_mm is not None:
        # The squares of the six directions' parts along some direction add up to 2 at most.
        bend = 0.5 * payload.force_n / legs.stiffness_n_mm
        if requirement.deflection_mm < bend:
            least_mm = round_down(bend)
            yield f"no machine with actuators of that stiffness deflects less than {least_mm} mm"
    if requirement.hull_mm is not None:
        a, b, c = box
        flat = min(max(a, b), (a + b) / math.sqrt(2.0))
        edge = max(flat, c + requirement.least_margin_mm, least / math.sqrt(3.0))
        if requirement.hull_mm < edge:
            yield f"no machine is smaller than {round_down(edge)} mm along all axes"


def round_down(value: float) -> str:
    """Return a number above zero with four digits, not above it but for rounding."""
    step = 10.0 ** (math.floor(math.log10(value)) - 3)
    return f"{math.floor(value / step + 1e-9) * step:.6g}"
