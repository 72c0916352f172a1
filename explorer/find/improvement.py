"""The improvement of a machine by SQP, with the demands at some poses and their exact gradients.

Shortest and longest lengths are variables of their own, and so is the worst of each quantity that a
preference lowers: they stay beyond all values at the poses, which keeps the functions smooth.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from explorer.find import machine_values as m
from explorer.find.certificate import lengths_over
from explorer.find.demands import demands_of, limits_of, sizes_of
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

LENGTH, FORCE, STIFFNESS, ERROR, SINGULAR, CLEARANCE, RATIO, MISS = range(8)
"""What is lowered: the longest leg; the largest force, the compliance and the error of the tool for
equal actuators; one over the transmission index; one over the least distance of legs; the largest
ratio of the lengths of a leg; the amount by which one demand is missed."""

LOWERED: Mapping[int, Callable[[m.MachineValues], list[Any]]] = {
    # The rate of leg 1 does not move a tool at b4.
    FORCE: lambda at: [0.5 * np.log(each * each + 1e-9) for each in at.tool_speeds],
    STIFFNESS: lambda at: [np.log(sum(each * each for each in at.tool_speeds))],
    ERROR: lambda at: [np.log(sum(at.tool_speeds))],
    SINGULAR: lambda at: [-np.log(each) for each in at.transmissions],
    CLEARANCE: lambda at: [-np.log(m.size(each)) for each in at.distances],
}
"""The logarithms of these quantities, but for the longest leg."""

WEIGHTS: Mapping[Preference, Mapping[int, float]] = {
    # Of needs in the tests, legs a fifth longer than the shortest ones (355 to 434 mm, 229 to
    # 272 mm) lower the force from 18.8 and 12 N to 1.9 N for each newton, and raise the index
    # from 0.06 and 0.07 to 0.59 and 0.53; weights of 0.5 take 46 % longer legs for 0.81.
    "balanced": {LENGTH: 1.0, FORCE: 0.15, SINGULAR: 0.15},
    "small": {LENGTH: 1.0},
    "little-force": {LENGTH: 0.2, FORCE: 1.0},
    "stiff": {LENGTH: 0.2, STIFFNESS: 1.0},
    "precise": {LENGTH: 0.2, ERROR: 1.0},
    "far-from-singular": {LENGTH: 0.2, SINGULAR: 1.0},
    "easy-to-build": {LENGTH: 1.0, CLEARANCE: 0.5, SINGULAR: 0.1},
}
"""Exponents of the quantities whose product a preference makes least."""

RELAXED: Mapping[str, str] = {
    "swing_deg": "swing",
    "legs.push_n": "force",
    "legs.apart_mm": "clearance",
    "legs.speed_mm_s": "speed",
    "transmission": "transmission index",
    "error_mm": "error",
    "deflection_mm": "deflection",
}
"""Fields of a requirement with the demands that they limit."""

GROWING: Mapping[str, int] = {"tilt_deg": m.TILT, "box_mm": m.SIZE}
"""Fields of a requirement with the variables that are factors on them."""

# Weight of the longest leg beside a demand that is missed as little as possible.
BESIDE = 0.02


class Improved(NamedTuple):
    """A machine (18,), the most by which it misses a demand at the poses, and its cost."""

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
    demand has an amount to spare, over the diagonal of the box or over its limit. In place of a
    preference a field of the requirement may be given: its demand is then missed as little as the
    others allow.
    """

    def __init__(
        self,
        terms: Terms,
        aim: str,
        start: FloatArray,
        before_each: Callable[[], None] = lambda: None,
        spare: float = 0.0,
    ) -> None:
        every = [*limits_of(terms), *sizes_of(terms), *demands_of(terms)]
        self.spare, self.start = spare, start
        self.relaxed = [each for each in every if each.name == RELAXED.get(aim)]
        self.demands = [each for each in every if each.name != RELAXED.get(aim)]
        self.factor = GROWING.get(aim)
        weights: dict[str, Mapping[int, float]] = {**WEIGHTS, "legs.longest_mm": {LENGTH: 1.0}}
        if aim in weights:
            self.weights = weights[aim]
        else:
            own = {MISS: 1.0} if self.relaxed else {RATIO: 1.0} if aim == "legs.ratio" else {}
            self.weights = {LENGTH: BESIDE} | own
        longest = math.inf if aim == "legs.longest_mm" else terms.longest
        ratio = math.inf if aim == "legs.ratio" else terms.ratio
        self.terms = replace(terms, longest=longest, ratio=ratio)
        self.sides = terms.values(start, m.HOME).sides
        self.free, self._before_each = free_variables(terms), before_each
        self.free += [] if self.factor is None else [self.factor]
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
        if math.isfinite(terms.longest):
            rows.append(terms.longest * (1.0 - RESERVE) - longest)
        if math.isfinite(terms.ratio):
            ratio = terms.ratio * (1.0 - RESERVE - self.spare)
            rows += [ratio * short - each for each, short in zip(at.lengths, shortest, strict=True)]
        for demand in self.demands:
            rows += [-each - demand.reserve - self.spare for each in demand.missed(at)]
        if terms.parts is not None:
            rows += self._parts(terms.parts, shortest, at)
        for bound, each in zip(bounds.T[5:, :, None], self._lowered(at, shortest), strict=True):
            rows += [bound - value for value in each]
        found = np.empty((len(x), len(rows), len(poses)), dtype=x.dtype)
        for index, row in enumerate(rows):
            found[:, index] = row
        return found

    def _parts(self, parts: Parts, shortest: Any, at: m.MachineValues) -> list[FloatArray]:
        """Return the slacks of the distances that the parts need at home, and of the strokes."""
        rows = part_slacks(parts, at.home)
        pairs = zip(at.lengths, shortest, (1.0 + ROOM) * parts.dead, strict=True)
        return rows + [2.0 * short - dead - each for each, short, dead in pairs]

    def _lowered(self, at: m.MachineValues, shortest: Any) -> Iterator[list[Any]]:
        """Yield the values of each quantity that is lowered beside the longest leg.

        They are logarithms, but for the amounts by which a demand is missed.
        """
        for kind in self.extra:
            if kind == RATIO:
                pairs = zip(at.lengths, shortest, strict=True)
                yield [np.log(each / short) for each, short in pairs]
            elif kind == MISS:
                yield [each for demand in self.relaxed for each in demand.missed(at)]
            else:
                yield LOWERED[kind](at)

    def _first_bounds(self, x: FloatArray, poses: FloatArray) -> FloatArray:
        """Return the least bounds that one machine keeps in poses, shape (5 + extra,)."""
        at, lengths = self.terms.values(x, poses), lengths_over(x, self.terms, poses)
        at.distances, at.sides = at.uncrossed_distances, self.sides
        with np.errstate(all="ignore"):
            lowered = self._lowered(at, lengths[:, 0])
            worst = [float(max(map(np.max, each))) for each in lowered]
        return np.array([*lengths[:, 0], lengths[:, 1].max(), *worst])

    def run(self, poses: FloatArray, *, rounds: int = 20) -> Improved:
        """Return the machine after the solver's rounds, and what it still misses at the poses.

        A round that neither lowers the cost nor what is missed is taken back, and the next one goes
        less far.
        """
        x, trusted = self.start.copy(), TRUSTED
        lows, highs = _ranges(self, x)
        free = len(self.free)
        bounds = np.clip(self._first_bounds(x, poses), lows[free:], highs[free:])
        missed, cost = self.missed(x, poses, bounds), self._cost(x, bounds)
        rows = self._worst_rows(x, poses, bounds)
        for turn in range(rounds):
            new_x, new_bounds = self._step(x, bounds, poses, rows, trusted)
            new_missed = self.missed(new_x, poses, new_bounds)
            new_cost = self._cost(new_x, new_bounds)
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
            if trusted < LEAST_TRUSTED or (turn >= SHORT and is_hopeless):
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

        # The last variable is an amount by which all demands may be missed, at a cost, so that
        # some step is always open.
        def evaluate(z: FloatArray) -> Point:
            self._before_each()
            y, spare = z[:-1], z[-1]
            given = np.concatenate([y[None] + 0j, y + steps])
            machines = np.repeat(x[None] + 0j, len(given), axis=0)
            machines[:, free] = given[:, :n]
            table = self.table(machines, looked, given[:, n:])[:, rows[:, 0], places]
            slope = np.zeros(len(z))
            slope[n + 4] = self.weights[LENGTH] / y[n + 4]
            slope[n + 5 : -1] = [self.weights[kind] for kind in self.extra]
            slope[-1] = COST_OF_MISSES
            if self.factor is not None:
                slope[n - 1] = -1.0 / y[n - 1]
            cost = self._cost(machines[0].real, y[n:]) + COST_OF_MISSES * spare
            slopes = np.column_stack([(table[1:].imag / STEP).T, np.ones(len(rows))])
            return cost, slope, table[0].real + spare, slopes

        y = np.concatenate([x[free], bounds])
        near = np.full(len(y), math.inf)
        near[:n] = trusted
        lows, highs = _ranges(self, self.start)
        ends = np.column_stack([np.clip(each, lows, highs) for each in (y - near, y + near)])
        with np.errstate(all="ignore"), one_thread():
            missed = max(0.0, -float(self.table(x[None], looked, bounds[None])[0].min()))
            start, ends = np.append(y, missed), np.append(ends, [[0.0, 2.0 * missed + 1.0]], axis=0)
            equal = np.zeros(len(rows), dtype=bool)
            found = slsqp(
                evaluate, lambda _: None, start, ends, equal, most=STEPS, precision=PRECISION
            )
        y = found[:-1] if np.isfinite(found).all() else y
        moved = x.copy()
        moved[free] = y[:n]
        return moved, y[n:]

    def cost(self, poses: FloatArray) -> float:
        """Return the cost of the start, with the least bounds that it keeps in poses."""
        return self._cost(self.start, self._first_bounds(self.start, poses))

    def _cost(self, x: FloatArray, bounds: FloatArray) -> float:
        weights = [self.weights[kind] for kind in self.extra]
        growing = 0.0 if self.factor is None else math.log(x[self.factor])
        cost = self.weights[LENGTH] * math.log(bounds[4]) - growing
        return cost + float(np.dot(weights, bounds[5:]))

    def missed(self, x: FloatArray, poses: FloatArray, bounds: FloatArray) -> float:
        """Return the largest amount by which a demand is missed in poses; 0 if none is."""
        with np.errstate(all="ignore"):
            least = float(np.min(self.table(x[None], poses, bounds[None])))
        return max(0.0, -least) if math.isfinite(least) else math.inf


# Poses at which each demand is looked at in the beginning, and amount that is no miss.
LOOKS = 3
FEASIBLE = 1e-6
# Largest change of a variable in a round, and change of the cost that ends the rounds.
TRUSTED, LEAST_TRUSTED, SETTLED = 0.3, 2e-3, 1e-3
# Weight of what is missed beside the cost, and steps of the solver in a round.
COST_OF_MISSES, STEPS = 30.0, 12
# Rounds after which a machine that misses a demand by more than this is given up, and those after
# which it is for any miss.
SHORT, HOPELESS, LONG = 3, 0.02, 10


def _ranges(search: Improvement, x: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return lows and highs of the variables and of the bounds of an improvement."""
    farthest = FARTHEST * search.terms.spread
    lows, highs = np.full(m.VARIABLES, -farthest), np.full(m.VARIABLES, farthest)
    for index in (m.A3Y, m.B1Y):
        (lows if x[index] > 0.0 else highs)[index] = math.copysign(LEAST, x[index])
    for index in (m.BOX_YAW, m.YAW, m.PITCH, m.ROLL):
        lows[index], highs[index] = x[index] - 1.0, x[index] + 1.0
    for index in (m.TILT, m.SIZE):
        lows[index], highs[index] = 0.02, 1.0
    free = search.free
    count = len(search.extra)
    # A demand that is kept is lowered no further.
    least = [0.02] * 4 + [0.1] + [0.0 if each == MISS else -30.0 for each in search.extra]
    most = [farthest] * 5 + [30.0] * count
    return np.array([*lows[free], *least]), np.array([*highs[free], *most])
