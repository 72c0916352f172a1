"""Conflicts of the demands of a problem with its limits, found before a search starts.

A demand is in conflict if a bound in closed form shows that no design within the bounds of the
variables can keep it. Other demands may still be impossible.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from functools import cached_property
from typing import NamedTuple

import msgspec
import numpy as np
from numpy.typing import ArrayLike

from explorer.mechanism.design import LENGTHS, Design, Limits
from explorer.mechanism.design_file import PRESETS
from explorer.mechanism.margins import SINGULAR, planes_of_singularity
from explorer.numerics.arrays import FloatArray
from explorer.numerics.number_text import UNITS, Unit, format_apart
from explorer.optimise import problem as problems
from explorer.workspace.limits.table import GAP

# Excess over its bound that makes a demand impossible, as a share: searches have tolerances.
SPARE, ROUNDING = 1e-6, 1e-9

BOX_LIMIT, LONGEST_LEG = "box", "longest leg"
"""Names of the limit on the position, and of that on all lengths that are tied to the reach."""

PAPER_BOX = PRESETS["paper-optimal"].limits.box


class Conflict(NamedTuple):
    """A demand that a limit, such as "box" or "l1 maximum", makes impossible, in a clause."""

    limit: str
    message: str


def find_conflicts(problem: problems.Problem, unit: Unit = UNITS) -> tuple[Conflict, ...]:
    """Return why no design within the bounds meets the demands, one conflict for each limit."""
    intervals, found = Intervals(problem, unit), dict[str, Conflict]()
    for find in (_of_volume, _of_lengths, _of_required_box, _of_margins):
        for conflict in find(intervals):
            found.setdefault(conflict.limit, conflict)
    return tuple(found.values())


def paper_box(problem: problems.Problem) -> problems.Box | None:
    """Return the box of the paper's optimum, or None if it is too small for the demands too."""
    boxed = msgspec.structs.replace(problem, start=problems.with_box(problem.start, PAPER_BOX))
    is_too_small = any(conflict.limit == BOX_LIMIT for conflict in find_conflicts(boxed))
    return None if is_too_small else PAPER_BOX


def without_limit(design: Design, limit: str) -> Design | None:
    """Return a design without one limit, its home where it was; None if it has no such limit.

    The limit is named as in a conflict or a `DesignStartError`. A maximum becomes the reach.
    """
    name = limit.partition(" ")[0]
    lengths = LENGTHS if limit == problems.MAXIMA else {name}.intersection(LENGTHS)
    free = {length: (getattr(design.limits, length)[0], None) for length in lengths}
    if name in ("box", "guide", "margin", "gap", "swing"):
        free[name] = getattr(Limits(), name)
    lifted = design.with_limits(**free)
    return None if lifted == design else msgspec.structs.replace(lifted, home=design.home_pose)


class Intervals:
    """Intervals that hold every value of a quantity within the bounds, and may be wider."""

    def __init__(self, problem: problems.Problem, unit: Unit = UNITS) -> None:
        self.problem, self.unit = problem, unit
        self.rotation = problem.start.home_pose.rotation
        self._bounds = {each.name: (each.low, each.high) for each in problem.variables}
        self.is_turning = len({*self._bounds.get(problems.YAW, ())}) > 1

    def of(self, *names: str) -> FloatArray:
        """Return the intervals of k design variables or shifts of the required box, (k, 2)."""
        start, bounds = self.problem.start, self._bounds
        return np.array(
            [bounds.get(name) or (problems.start_value(start, name),) * 2 for name in names]
        )

    def in_base(self, vector: ArrayLike) -> FloatArray:
        """Return the base intervals (3, 2) of a vector with x and y (2, 2) on the platform."""
        found = np.array([_sum_of(row[:2], vector) for row in self.rotation])
        if self.is_turning:
            most = math.hypot(*np.abs(found[:2]).max(axis=1))
            found[:2] = -most, most
        return found

    @cached_property
    def apart(self) -> FloatArray:
        """The interval of the distance d3 − d1 of the carriages, with its sign."""
        b2, b3 = self.of("b2", "b3")
        return self.in_base([b3 - b2[::-1], (0.0, 0.0)])[0]

    def maximum(self, name: str) -> tuple[str, float, float]:
        """Return the limit that is the maximum of a length, and its least and its most."""
        fixed, a3 = getattr(self.problem.start.limits, name)[1], self.of("a3x", "a3y")
        if problems.REACH not in self._bounds and fixed is not None:
            return f"{name} maximum", fixed, fixed
        of_a3 = (math.hypot(*_smallest(a3)), math.hypot(*np.abs(a3).max(axis=1)))
        low, high = self._bounds.get(problems.REACH, of_a3)
        return LONGEST_LEG, low, min(high, self.problem.demands.reach or math.inf)


def _sum_of(factors: ArrayLike, intervals: ArrayLike) -> FloatArray:
    """Return the interval of the sum of k factors times values of k intervals (k, 2)."""
    ends = np.asarray(factors)[:, None] * np.asarray(intervals)
    return np.array([ends.min(axis=1).sum(), ends.max(axis=1).sum()])


def _smallest(intervals: FloatArray) -> FloatArray:
    """Return the smallest magnitude in each interval."""
    return np.maximum(0.0, np.maximum(intervals[..., 0], -intervals[..., 1]))


def needed_lengths(intervals: Intervals, required: problems.Box) -> dict[str, float]:
    """Return the least that each length must reach over a box, wherever the bounds place it."""
    (lows, highs), still = np.array(required), (0.0, 0.0)
    # What is to be added to b4 to have the offset from the centre or axis of each length.
    arms = {
        "l1": intervals.in_base(intervals.of("b1x", "b1y")),
        "d2": intervals.in_base([*intervals.of("b2"), still])[1:],
        "d4": intervals.in_base([*intervals.of("b3"), still])[1:],
        "l4": np.array([*-intervals.of("a3x", "a3y")[:, ::-1], still]),
    }
    half, shifts = 0.5 * (highs - lows), intervals.of(*problems.SHIFTS)
    middle = 0.5 * (lows + highs)[:, None] + shifts
    return {
        name: math.hypot(*(half[-len(arm) :] + _smallest(middle[-len(arm) :] + arm)))
        for name, arm in arms.items()
    }


def volume_bounds(intervals: Intervals) -> Iterator[tuple[str, str, float]]:
    """Yield upper bounds of the volume: the limit, its words with a verb, and the most."""
    start = intervals.problem.start
    box, guide, margin = start.limits.box, start.limits.guide, start.limits.margin
    if box is not None:
        yield BOX_LIMIT, "the box holds", math.prod(np.subtract(box[1], box[0]))
    # Least height of b4 over the centre of each ball, on the home's side of the base plane.
    over_b1 = start.home_signs[2] * intervals.in_base(intervals.of("b1x", "b1y"))[2]
    areas: list[float] = []
    for name, height in (("l4", 0.0), ("l1", float(over_b1.min()))):
        limit, _, radius = intervals.maximum(name)
        is_halved = margin is not None and height >= -ROUNDING * radius
        areas.append((0.5 if is_halved else 1.0) * math.pi * radius**2)
        words = f"the {limit} of {intervals.unit.text(radius, 6)} leaves room for"
        yield limit, words, 4.0 / 3.0 * radius * areas[-1]
    if guide is not None:
        low, high = intervals.unit.number(guide[0], 6), intervals.unit.text(guide[1], 6)
        free = max(0.0, guide[1] - guide[0] - float(_smallest(intervals.apart)))
        yield "guide", f"a guide from {low} to {high} leaves room for", free * min(areas)


def _of_volume(intervals: Intervals) -> Iterator[Conflict]:
    wanted = intervals.problem.demands.volume or 0.0
    unit = intervals.unit.to_power(3, wanted)
    for limit, words, most in volume_bounds(intervals):
        if most < wanted * (1.0 - SPARE):
            room, demanded = format_apart((most, wanted), 4, unit.number)
            amounts = f"at most {room} of the {demanded} {unit.name} asked for"
            yield Conflict(limit, f"{words} {amounts}")


def _of_lengths(intervals: Intervals) -> Iterator[Conflict]:
    gap, demanded = intervals.problem.start.limits.gap, intervals.problem.demands.reach
    unit = intervals.unit
    longest = max(intervals.maximum(name)[1] for name in LENGTHS)
    if demanded is not None and longest > demanded * (1.0 + SPARE):
        least, most = format_apart((longest, demanded), 6, unit.text)
        words = f"the longest leg is at least {least}, and {most} are asked for"
        yield Conflict(LONGEST_LEG, words)
    apart = float(np.abs(intervals.apart).max())
    if apart < gap * (1.0 - SPARE):
        most, least = format_apart((apart, gap), 4, unit.text)
        words = f"the carriages are at most {most} apart, and the gap is to be {least}"
        yield Conflict(GAP, words)


def _of_required_box(intervals: Intervals) -> Iterator[Conflict]:
    box, required = intervals.problem.start.limits.box, intervals.problem.demands.required_box
    if required is None:
        return
    shifts, unit = intervals.of(*problems.SHIFTS), intervals.unit
    for axis, name in enumerate("xyz" if box is not None else ""):
        (low, high), (least, most) = np.array([required, box])[:, :, axis].tolist()
        # It may be shifted by what lies in both intervals, if anything does.
        back, on = max(least - low, shifts[axis, 0]), min(most - high, shifts[axis, 1])
        if back > on + SPARE * max(most - least, high - low):
            texts = format_apart([low, high, least, most], 6, unit.number)
            own, other = (f"{a} to {b} {unit.name}" for a, b in (texts[:2], texts[2:]))
            words = f"along {name} the required box from {own} lies beyond the box from {other}"
            yield Conflict(BOX_LIMIT, words)
    for name, needed in needed_lengths(intervals, required).items():
        limit, _, most = intervals.maximum(name)
        if needed > most * (1.0 + SPARE):
            up, end = format_apart((needed, most), 4, unit.text)
            words = f"the required box needs {name} up to {up}, and the {limit} is {end}"
            yield Conflict(limit, words)


def _of_margins(intervals: Intervals) -> Iterator[Conflict]:
    problem, demands = intervals.problem, intervals.problem.demands
    required, least = demands.required_box, problem.start.limits.margin
    if required is None:
        return
    is_loaded = demands.held or demands.error or demands.deflection or demands.acceleration
    needs_regular = is_loaded or problem.objective in problems.OF_THE_MACHINE
    corners, shifts = np.transpose(required), intervals.of(*problems.SHIFTS)
    rounding = SINGULAR * float(np.linalg.norm(corners[:, 1] - corners[:, 0]))
    planes, signs = planes_of_singularity(intervals.rotation), problem.start.home_signs
    # The planes of δ1 and δ2 turn with the yaw.
    for index in (2,) if intervals.is_turning else (2, 0, 1):
        # The largest margin of the worst corner on the home's side, and on the other one.
        own, other = (
            float(_sum_of(normal, corners)[0] + _sum_of(normal, shifts)[1])
            for normal in (signs[index] * planes[index], -signs[index] * planes[index])
        )
        if least is not None and own < least - SPARE * problem.size:
            most, demanded = format_apart((own, least), 4, intervals.unit.text)
            words = f"the margin over the required box is at most {most}, and the limits demand"
            yield Conflict("margin", f"{words} {demanded}")
        if needs_regular and max(own, other) <= rounding:
            words = f"the required box is on or across the singular plane δ{index + 1} = 0, where"
            more = "no unique forces hold a load and errors are infinite"
            yield Conflict("singular plane", f"{words} {more}")
