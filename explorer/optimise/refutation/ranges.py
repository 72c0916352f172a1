"""Intervals of quantities of a design whose variables lie within their bounds.

Each interval holds every value that such a design can have, and may be wider.
"""

from __future__ import annotations

import math
from functools import cached_property

from explorer.mechanism.design import LENGTHS, VARIABLES, Pair
from explorer.mechanism.home import home_pose
from explorer.optimise.problem import REACH, SHIFTS, YAW, Problem
from explorer.workspace.limits.constraints import home_signs


def smallest(interval: Pair) -> float:
    """Return the smallest magnitude in an interval."""
    low, high = interval
    return max(0.0, low, -high)


def largest(interval: Pair) -> float:
    """Return the largest magnitude in an interval."""
    return max(map(abs, interval))


def product(one: Pair, other: Pair) -> Pair:
    """Return the interval of the products of values of two intervals."""
    ends = [a * b for a in one for b in other]
    return min(ends), max(ends)


def total(one: Pair, other: Pair) -> Pair:
    """Return the interval of the sums of values of two intervals."""
    return one[0] + other[0], one[1] + other[1]


def negative(interval: Pair) -> Pair:
    """Return the interval of the negated values."""
    return -interval[1], -interval[0]


class Ranges:
    """The intervals of a problem.

    Args:
        problem: The problem; its start gives what may not change.
    """

    def __init__(self, problem: Problem) -> None:
        self.problem = problem
        self._bounds = {
            variable.name: (variable.low, variable.high) for variable in problem.variables
        }

    def of(self, name: str) -> Pair:
        """Return the interval of a design variable, or of a shift of the required box."""
        fixed = 0.0
        if name not in SHIFTS:
            fixed = self.problem.start.variables[VARIABLES.index(name)]
        return self._bounds.get(name, (fixed, fixed))

    @cached_property
    def is_turning(self) -> bool:
        """Whether the yaw of home may change."""
        low, high = self._bounds.get(YAW, (0.0, 0.0))
        return low < high

    @cached_property
    def along(self) -> tuple[Pair, Pair, Pair]:
        """The intervals of the coordinates of the platform's x-axis in the base frame."""
        x, y, z = home_pose(self.problem.start).rotation[:, 0].tolist()
        if not self.is_turning:
            return (x, x), (y, y), (z, z)
        low, high = (math.radians(end) for end in self._bounds[YAW])
        start_yaw = math.radians(self.problem.start_values[self.problem.names.index(YAW)])
        angle, length = math.atan2(y, x), math.hypot(x, y)
        turned = (angle + low - start_yaw, angle + high - start_yaw)
        return (
            product((length, length), _cosines(*turned)),
            product((length, length), _cosines(*(end - 0.5 * math.pi for end in turned))),
            (z, z),
        )

    @cached_property
    def arm_height(self) -> Pair:
        """The interval of the height of b1 over b4, which no turn about z changes."""
        rotation = home_pose(self.problem.start).rotation
        u, v = float(rotation[2, 0]), float(rotation[2, 1])
        return total(product(self.of("b1x"), (u, u)), product(self.of("b1y"), (v, v)))

    @cached_property
    def arm(self) -> float:
        """The largest distance of b1 from b4."""
        return math.hypot(largest(self.of("b1x")), largest(self.of("b1y")))

    @cached_property
    def span(self) -> Pair:
        """The interval of b3 − b2."""
        return total(self.of("b3"), negative(self.of("b2")))

    @cached_property
    def apart(self) -> float:
        """The largest distance |d1 − d3| of the carriages."""
        return largest(self.span) * largest(self.along[0])

    @cached_property
    def distance_a3(self) -> Pair:
        """The interval of |a3|."""
        x, y = self.of("a3x"), self.of("a3y")
        least = math.hypot(smallest(x), max(smallest(y), self.problem.demands.least))
        return least, math.hypot(largest(x), largest(y))

    @cached_property
    def reach(self) -> Pair:
        """The interval of the reach, its own variable or |a3|, without what is demanded."""
        return self._bounds.get(REACH, self.distance_a3)

    @property
    def least_longest_leg(self) -> float:
        """The least that the longest leg can be, without what is demanded."""
        limits = self.problem.start.limits
        return max(
            self.reach[0] if self.is_tied(name) else getattr(limits, name)[1] for name in LENGTHS
        )

    @cached_property
    def most_reach(self) -> float:
        """The largest reach that both bounds and demands allow."""
        demanded = self.problem.demands.reach
        if demanded is None or self.problem.objective == "smallest-reach":
            return self.reach[1]
        return min(demanded, self.reach[1])

    def is_tied(self, name: str) -> bool:
        """Whether the maximum of a length is the reach."""
        return REACH in self._bounds or getattr(self.problem.start.limits, name)[1] is None

    def length(self, name: str) -> Pair:
        """Return the minimum and the maximum of a length where both leave the most room."""
        limits, ratio = self.problem.start.limits, self.problem.demands.stroke_ratio
        least, most = getattr(limits, name)
        high = self.most_reach if self.is_tied(name) else most
        return max(least, 0.0 if ratio is None else high / ratio), high

    @cached_property
    def signs(self) -> tuple[int, int, int]:
        """The sign triple of home."""
        return home_signs(self.problem.start)


def _cosines(low: float, high: float) -> Pair:
    """Return the interval of the cosine between two angles in radians, low <= high."""
    ends = (math.cos(low), math.cos(high))
    turns = 2.0 * math.pi
    has_top = math.floor(high / turns) >= math.ceil(low / turns)
    half = math.pi
    has_bottom = math.floor((high - half) / turns) >= math.ceil((low - half) / turns)
    return -1.0 if has_bottom else min(ends), 1.0 if has_top else max(ends)
