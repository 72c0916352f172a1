"""Intervals of quantities of a design whose variables lie within their bounds.

Each interval holds every value that such a design can have, and may be wider.
"""

from __future__ import annotations

import itertools
import math
from functools import cached_property

from explorer.mechanism.design import LENGTHS, VARIABLES, Pair
from explorer.optimise.demands import Box
from explorer.optimise.problem import REACH, SHIFTS, YAW, Problem


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
        return self._axis(0, 1)[0]

    def _axis(self, column: int, pieces: int) -> list[tuple[Pair, Pair, Pair]]:
        """Return the intervals of an axis of the platform in the base frame, by pieces of yaw."""
        x, y, z = self.problem.start.home_pose.rotation[:, column].tolist()
        if not self.is_turning:
            return [((x, x), (y, y), (z, z))]
        low, high = (math.radians(end) for end in self._bounds[YAW])
        start_yaw = math.radians(self.problem.start_values[self.problem.names.index(YAW)])
        angle, length = math.atan2(y, x) - start_yaw, math.hypot(x, y)
        ends = [angle + low + (high - low) * piece / pieces for piece in range(pieces + 1)]
        return [
            (
                product((length, length), _cosines(*turned)),
                product((length, length), _cosines(*(end - 0.5 * math.pi for end in turned))),
                (z, z),
            )
            for turned in itertools.pairwise(ends)
        ]

    def best_margin(self, index: int, side: int, box: Box) -> float:
        """Return an upper bound of the least margin over a box on one side, over all its shifts.

        It is exact unless the yaw may change.

        Args:
            index: Index of the margin, 0 to 2.
            side: Sign of the margin on that side.
            box: Lows and highs of the box before its shift.
        """
        still = (0.0, 0.0)
        match index:
            case 0:
                normals = [(negative(x), negative(y), negative(z)) for x, y, z in self._axis(2, 64)]
            case 1:
                normals = [(still, negative(z), y) for _, y, z in self._axis(0, 64)]
            case _:
                normals = [(still, still, (1.0, 1.0))]

        def best(slope: Pair, axis: int) -> float:
            # Of the worst end and the best shift; it has a kink at a slope of zero.
            return max(
                min(each * box[0][axis], each * box[1][axis])
                + max(each * shift for shift in self.of(SHIFTS[axis]))
                for each in (side * slope[0], side * slope[1], 0.0)
                if each or slope[0] <= 0.0 <= slope[1]
            )

        return max(sum(map(best, normal, range(3))) for normal in normals)

    @cached_property
    def arm_height(self) -> Pair:
        """The interval of the height of b1 over b4, which no turn about z changes."""
        rotation = self.problem.start.home_pose.rotation
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
        return self.reach[1] if demanded is None else min(demanded, self.reach[1])

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
        return self.problem.start.home_signs


def _cosines(low: float, high: float) -> Pair:
    """Return the interval of the cosine between two angles in radians, low <= high."""
    ends = (math.cos(low), math.cos(high))
    turns = 2.0 * math.pi
    has_top = math.floor(high / turns) >= math.ceil(low / turns)
    half = math.pi
    has_bottom = math.floor((high - half) / turns) >= math.ceil((low - half) / turns)
    return -1.0 if has_bottom else min(ends), 1.0 if has_top else max(ends)
