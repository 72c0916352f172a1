"""The improvement of a machine by SQP, with the demands at some poses and their exact gradients.

Shortest and longest lengths are variables of their own, and so is the worst of each quantity that a
preference lowers: they stay beyond all values at the poses, which keeps the functions smooth.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any

import numpy as np

from explorer.find import machine_values as m
from explorer.find.certificate import lengths_over
from explorer.find.demands import demands_of, limits_of
from explorer.find.requirement import Preference
from explorer.find.terms import ROOM, Parts, Terms, part_slacks
from explorer.numerics.arrays import FloatArray
from explorer.numerics.search import one_thread
from explorer.optimise.search.sqp import Point, slsqp

# Imaginary step: far below rounding, so that derivatives have no error of their own.
STEP = 1e-40
# Demands that every pose has to spare, as a share, so that poses between them keep these too.
RESERVE = 1e-4
# Least |a3y|, |b1y| and |b3 − b2| over the diagonal of the box.
LEAST = 0.04
# Bounds of lengths, over the diagonal of the box.
FARTHEST = 8.0
PRECISION = 1e-7

LENGTH, FORCE, STIFFNESS, ERROR, SINGULAR, CLEARANCE = range(6)
"""What preferences lower: the longest leg; the largest force, the compliance and the error of the
tool for equal actuators; one over the transmission index; one over the least distance of legs."""

LOWERED: Mapping[int, Callable[[m.MachineValues], list[Any]]] = MappingProxyType(
    {
        # The rate of leg 1 does not move a tool at b4.
        FORCE: lambda at: [0.5 * np.log(each * each + 1e-9) for each in at.tool_speeds],
        STIFFNESS: lambda at: [np.log(sum(each * each for each in at.tool_speeds))],
        ERROR: lambda at: [np.log(sum(at.tool_speeds))],
        SINGULAR: lambda at: [-np.log(each) for each in at.transmissions],
        CLEARANCE: lambda at: [-np.log(m.size(each)) for each in at.distances],
    }
)
"""The logarithms of these quantities, but for the longest leg."""

WEIGHTS: Mapping[Preference, Mapping[int, float]] = MappingProxyType(
    {
        "balanced": {LENGTH: 1.0, FORCE: 0.5, SINGULAR: 0.5},
        "small": {LENGTH: 1.0},
        "little-force": {LENGTH: 0.2, FORCE: 1.0},
        "stiff": {LENGTH: 0.2, STIFFNESS: 1.0},
        "precise": {LENGTH: 0.2, ERROR: 1.0},
        "far-from-singular": {LENGTH: 0.2, SINGULAR: 1.0},
        "easy-to-build": {LENGTH: 0.5, CLEARANCE: 1.0},
    }
)
"""Exponents of the quantities whose product a preference makes least."""


@dataclass(frozen=True)
class Improved:
    """A machine after an improvement.

    Attributes:
        x: The machine, shape (18,).
        missed: The largest amount by which a demand is missed at the poses; 0 if all are kept.
        cost: Logarithm of the product that the preference makes least.
    """

    x: FloatArray
    missed: float
    cost: float


def free_variables(terms: Terms) -> list[int]:
    """Return the indices of the variables that a search may change."""
    free = [*range(m.YAW + 1)]
    if "orientation" in terms.requirement.free:
        free += [m.PITCH, m.ROLL]
    if "tool" in terms.requirement.free:
        free += [m.TX, m.TY, m.TZ]
    return free


class Improvement:
    """A requirement and a preference as the functions of an SQP solver, from a machine on.

    The demands are looked at in poses; each round takes those that a machine nearly misses. Each
    demand has an amount to spare, over the diagonal of the box or over its limit.
    """

    def __init__(
        self,
        terms: Terms,
        preference: Preference,
        start: FloatArray,
        before_each: Callable[[], None] = lambda: None,
        spare: float = 0.0,
    ) -> None:
        self.terms, self.weights, self.start = terms, WEIGHTS[preference], start
        self.demands = [*limits_of(terms), *demands_of(terms)]
        self.sides = terms.values(start, m.HOME).sides
        self.free, self._before_each = free_variables(terms), before_each
        self.spare = spare
        self.extra = [each for each in self.weights if each != LENGTH]

    def table(self, x: Any, poses: FloatArray, bounds: Any) -> Any:
        """Return the slacks of machines (n, 18) in poses, shape (n, demands, k).

        The bounds, shape (n, 5 + extra), are the shortest length of each leg, the longest of all,
        and the logarithms of what the preference lowers.
        """
        terms = self.terms
        at = terms.values(x, poses)
        # Legs that have crossed are apart by less than nothing, and margins keep their sides.
        at.distances, at.sides = at.uncrossed_distances, self.sides
        shortest, longest = bounds.T[:4, :, None], bounds.T[4, :, None]
        rows = [length - short for length, short in zip(at.lengths, shortest, strict=True)]
        rows += [longest - length for length in at.lengths]
        if math.isfinite(terms.ratio):
            ratio = terms.ratio * (1.0 - RESERVE - self.spare)
            rows += [ratio * short - each for each, short in zip(at.lengths, shortest, strict=True)]
        for demand in self.demands:
            rows += [-each - demand.reserve - self.spare for each in demand.missed(at)]
        if terms.parts is not None:
            rows += self._parts(terms.parts, shortest, at)
        for kind, bound in zip(self.extra, bounds.T[5:, :, None], strict=True):
            rows += [bound - each for each in LOWERED[kind](at)]
        shape = (len(x), len(poses))
        return np.stack([np.broadcast_to(row, shape) for row in rows], axis=1)

    def _parts(self, parts: Parts, shortest: Any, at: m.MachineValues) -> list[FloatArray]:
        """Return the slacks of the distances that the parts need at home, and of the strokes."""
        rows = part_slacks(parts, at.home)
        pairs = zip(at.lengths, shortest, (1.0 + ROOM) * parts.dead, strict=True)
        return rows + [2.0 * short - dead - each for each, short, dead in pairs]

    def _first_bounds(self, x: FloatArray, poses: FloatArray) -> FloatArray:
        """Return the least bounds that one machine keeps in poses, shape (5 + extra,)."""
        at = self.terms.values(x, poses)
        lengths = lengths_over(x, self.terms, poses)
        with np.errstate(all="ignore"):
            preferred = [float(np.max(np.stack(LOWERED[kind](at)))) for kind in self.extra]
        return np.array([*lengths[:, 0], lengths[:, 1].max(), *preferred])

    def run(self, poses: FloatArray, *, rounds: int = 20) -> Improved:
        """Return the machine after the solver's rounds, and what it still misses at the poses.

        A round that neither lowers the cost nor what is missed is taken back, and the next one goes
        less far.
        """
        x, trusted = self.start.copy(), TRUSTED
        lows, highs = _ranges(self, x)
        free = len(self.free)
        bounds = np.clip(self._first_bounds(x, poses), lows[free:], highs[free:])
        missed, cost = self.missed(x, poses, bounds), self._cost(bounds)
        rows = self._worst_rows(x, poses, bounds)
        for turn in range(rounds):
            new_x, new_bounds = self._step(x, bounds, poses, rows, trusted)
            new_missed, new_cost = self.missed(new_x, poses, new_bounds), self._cost(new_bounds)
            gain = cost - new_cost + COST_OF_MISSES * (missed - new_missed)
            if gain > 0.0:
                x, bounds, missed, cost = new_x, new_bounds, new_missed, new_cost
                trusted = min(TRUSTED, 1.5 * trusted)
            else:
                trusted *= 0.5
            more = self._worst_rows(new_x, poses, new_bounds)
            rows = np.unique(np.concatenate([rows, more]), axis=0)
            if missed <= FEASIBLE and abs(gain) < SETTLED:
                break
            is_hopeless = missed > (HOPELESS if turn < LONG else FEASIBLE)
            if trusted < LEAST_TRUSTED or (turn >= PATIENCE and is_hopeless):
                break
        return Improved(x, missed, cost)

    def _worst_rows(self, x: FloatArray, poses: FloatArray, bounds: FloatArray) -> Any:
        """Return pairs of each demand and a pose where it has least to spare, shape (r, 2)."""
        with np.errstate(all="ignore"):
            slacks = self.table(x[None], poses, bounds[None])[0]
        order = np.argsort(slacks, axis=1)[:, :LOOKS]
        return np.column_stack([np.repeat(np.arange(len(slacks)), LOOKS), order.ravel()])

    def _step(
        self, x: FloatArray, bounds: FloatArray, poses: FloatArray, rows: Any, trusted: float
    ) -> tuple[FloatArray, FloatArray]:
        """Return a machine and its bounds after one run of the solver, within a trusted change.

        The rows (r, 2) are pairs of a demand and of a pose, at which it is looked at.
        """
        free, n = self.free, len(self.free)
        used, places = np.unique(rows[:, 1], return_inverse=True)
        looked = poses[used]
        steps = 1j * STEP * np.eye(n + len(bounds))

        def evaluate(y: FloatArray) -> Point:
            self._before_each()
            given = np.concatenate([y[None] + 0j, y + steps])
            machines = np.repeat(x[None] + 0j, len(given), axis=0)
            machines[:, free] = given[:, :n]
            table = self.table(machines, looked, given[:, n:])[:, rows[:, 0], places]
            slope = np.zeros(len(y))
            slope[n + 4] = self.weights[LENGTH] / y[n + 4]
            # Too long a leg costs, so that steps towards shorter ones need not be at the end of it.
            over = max(0.0, y[n + 4] - self.terms.longest * (1.0 - RESERVE))
            slope[n + 4] += COST_OF_LENGTH * (over > 0.0)
            slope[n + 5 :] = [self.weights[kind] for kind in self.extra]
            cost = self._cost(y[n:]) + COST_OF_LENGTH * over
            return cost, slope, table[0].real, (table[1:].imag / STEP).T

        y = np.concatenate([x[free], bounds])
        near = np.full(len(y), math.inf)
        near[:n] = trusted
        lows, highs = _ranges(self, self.start)
        ends = np.column_stack([np.clip(each, lows, highs) for each in (y - near, y + near)])
        equal = np.zeros(len(rows), dtype=bool)
        with np.errstate(all="ignore"), one_thread():
            found = slsqp(evaluate, _ignore, y, ends, equal, most=STEPS, precision=PRECISION)
        y = found if np.isfinite(found).all() else y
        moved = x.copy()
        moved[free] = y[:n]
        return moved, y[n:]

    def cost(self, poses: FloatArray) -> float:
        """Return the cost of the start, with the least bounds that it keeps in poses."""
        return self._cost(self._first_bounds(self.start, poses))

    def _cost(self, bounds: FloatArray) -> float:
        weights = [self.weights[kind] for kind in self.extra]
        return self.weights[LENGTH] * math.log(bounds[4]) + float(np.dot(weights, bounds[5:]))

    def missed(self, x: FloatArray, poses: FloatArray, bounds: FloatArray) -> float:
        """Return the largest amount by which a demand is missed in poses; 0 if none is."""
        with np.errstate(all="ignore"):
            least = float(np.min(self.table(x[None], poses, bounds[None])))
        if not math.isfinite(least):
            return math.inf
        return max(0.0, -least, float(bounds[4]) - self.terms.longest)


# Poses at which each demand is looked at in the beginning, and amount that is no miss.
LOOKS = 3
FEASIBLE = 1e-6
# Largest change of a variable in a round, and change of the cost that ends the rounds.
TRUSTED, LEAST_TRUSTED, SETTLED = 0.3, 2e-3, 1e-3
# Weight of what is missed beside the cost, and steps of the solver in a round.
COST_OF_MISSES, COST_OF_LENGTH, STEPS = 30.0, 20.0, 12
# Rounds after which a machine that misses a demand by more than this is given up.
PATIENCE, HOPELESS, LONG = 3, 0.02, 10


def _ignore(_: FloatArray, __: FloatArray) -> None:
    return


def _ranges(search: Improvement, x: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return lows and highs of the variables and of the bounds of an improvement."""
    lows, highs = np.full(len(m.VARIABLES), -FARTHEST), np.full(len(m.VARIABLES), FARTHEST)
    for index in (m.A3Y, m.B1Y):
        (lows if x[index] > 0.0 else highs)[index] = math.copysign(LEAST, x[index])
    for index in (m.BOX_YAW, m.YAW, m.PITCH, m.ROLL):
        lows[index], highs[index] = x[index] - 1.0, x[index] + 1.0
    free = search.free
    count = len(search.extra)
    least = [0.02] * 4 + [0.1] + [-30.0] * count
    most = [FARTHEST] * 5 + [30.0] * count
    return np.array([*lows[free], *least]), np.array([*highs[free], *most])
