"""The ranges of the sliders: what the limits of the design leave possible, and a little more.

Sliders that change the design have ranges that follow the design as it was opened, and so hold
still while they are dragged. Parts of a track may be tinted.
"""

from __future__ import annotations

import functools
import math
from dataclasses import dataclass
from typing import TypeAlias

from explorer.app.state.state import State
from explorer.mechanism.configuration import Point, point_of
from explorer.mechanism.design import JOINTS, LENGTHS, Design, Pair
from explorer.mechanism.feasible_intervals import Interval, possible_ranges
from explorer.numerics.number_text import Unit

# Least width of a close-up over the whole range, and least part of the track that is tinted before
# the close-up is made anew.
LEAST_CLOSE_UP, LEAST_TINTED = 0.1, 0.25


@dataclass(frozen=True)
class Span:
    """The range of a slider, in the unit of its value."""

    low: float
    high: float
    step: float


@functools.lru_cache(256)
def in_whole_steps(span: Span, unit: Unit) -> Span:
    """Return a range in a unit, with round ends and a round step."""
    if unit.factor == 1.0:
        return span
    step = unit_step(span.step, unit)
    # Rounding must not put a round end a step farther.
    room = 0.1 * step
    return round_span(span.low * unit.factor + room, span.high * unit.factor - room, step)


def unit_step(step: float, unit: Unit) -> float:
    """Return a step in a unit, a power of ten."""
    return step if unit.factor == 1.0 else fine_step(step * unit.factor * (1.0 + 1e-9), 1.0)


Intervals: TypeAlias = tuple[Interval, ...]
"""Disjoint ascending intervals, in the unit of a slider's value; an end may be infinite."""


def tint_marks(intervals: Intervals, span: Span) -> tuple[float, ...]:
    """Return the ends of intervals within a range as marks, from which a stylesheet tints a track.

    The track is tinted from each mark of odd number to the next one.
    """
    return tuple(
        min(max(end, span.low), span.high)
        for low, high in intervals
        if low < span.high and high > span.low
        for end in (low, high)
    )


def close_up(whole: Span, intervals: Intervals, before: Span | None) -> Span:
    """Return the part of a range around disjoint ascending intervals, as wide again as they are.

    The part that was shown before, if any, stays as long as it serves.
    """
    inside = [(low, high) for low, high in intervals if low < whole.high and high > whole.low]
    if not inside:
        return whole
    low, high = max(inside[0][0], whole.low), min(inside[-1][1], whole.high)
    width = max(high - low, LEAST_CLOSE_UP * (whole.high - whole.low))
    if before is not None and before.step == whole.step:
        is_inside = whole.low <= before.low <= low and high <= before.high <= whole.high
        if is_inside and width >= LEAST_TINTED * (before.high - before.low):
            return before
    middle = 0.5 * (low + high)
    part = round_span(middle - width, middle + width, whole.step)
    return Span(max(part.low, whole.low), min(part.high, whole.high), whole.step)


def round_span(low: float, high: float, step: float) -> Span:
    """Return a range whose ends are whole multiples of ten steps, no narrower than asked for.

    The step is a power of ten, and a slider's values are whole steps from its lower end.
    """
    unit = 10.0 * step
    digits = -round(math.log10(unit))
    ends = (math.floor(low / unit), math.ceil(high / unit))
    lowest, highest = (round(end * unit, digits) for end in ends)
    return Span(lowest, highest, step)


def decimals(step: float) -> int:
    """Return the number of decimals of a step."""
    digits = 0
    while digits < 12 and round(step, digits) != step:
        digits += 1
    return digits


# Ends of sliders over the size of what they change, so that users run into limits.
BEYOND = 1.5
# Room beyond each end of what is possible, as a share of the range.
ROOM = 0.05


def fine_step(size: float, parts: float) -> float:
    """Return the power of ten at or below a share of a size."""
    return 10.0 ** math.floor(math.log10(size / parts))


def joint_span(state: State, joint: int) -> Span:
    """Return the range of a joint, by its index in `JOINTS`."""
    return _joint_spans(state.design)[joint]


@functools.lru_cache(64)
def _joint_spans(design: Design) -> tuple[Span, ...]:
    ranges = possible_ranges(design).joints
    return tuple(
        span_around(ends, design.reach, least=0.0 if name in LENGTHS else -math.inf)
        for name, ends in zip(JOINTS, ranges, strict=True)
    )


def position_span(state: State, axis: int) -> Span:
    """Return the range of a coordinate of b4, or of the tool point at any orientation."""
    return _position_spans(state.design, state.view.at)[axis]


@functools.lru_cache(64)
def _position_spans(design: Design, at: Point) -> tuple[Span, ...]:
    room = math.hypot(*point_of(design, at))
    return tuple(
        span_around((low - room, high + room), design.reach)
        for low, high in possible_ranges(design).position
    )


def length_span(state: State) -> Span:
    """Return the range of a length, such as a margin."""
    return _share_span(state.base.reach, BEYOND)


def radius_span(state: State) -> Span:
    """Return the range of the radius of a leg."""
    return _share_span(state.base.reach, 0.1, 5e3)


def coordinate_span(state: State) -> Span:
    """Return the range of a coordinate, or of a displacement."""
    return _share_span(state.base.reach, BEYOND, is_signed=True)


def platform_span(state: State) -> Span:
    """Return the range of a coordinate of a point of the platform, such as that of the tool."""
    return _share_span(state.base.reach, 0.5, is_signed=True)


def _share_span(size: float, share: float, parts: float = 2e3, *, is_signed: bool = False) -> Span:
    """Return a range up to a share of a size, and from its negative if it is signed."""
    edge = round_up(share * size)
    return Span(-edge if is_signed else 0.0, edge, fine_step(size, parts))


def variable_span(state: State, index: int) -> Span:
    """Return the range of a design variable, by its index in `VARIABLES`.

    The base and the platform have a size each, and steps are as fine as designs are published with.
    """
    return _variable_span(state.base.variables, in_base=index < 2)


@functools.lru_cache(64)
def _variable_span(variables: tuple[float, ...], *, in_base: bool) -> Span:
    sizes = [abs(value) for value in variables]
    edge = round_up(BEYOND * max(sizes[:2] if in_base else sizes[2:]))
    return Span(-edge, edge, fine_step(max(sizes), 1e5))


def span_around(ends: Pair, reach: float, least: float = -math.inf) -> Span:
    """Return a range with round ends around what is possible, also if that is nothing."""
    low, high = sorted(ends)
    room = max(ROOM * (high - low), 1e-3 * reach)
    span = round_span(low - room, high + room, fine_step(reach, 2e3))
    return Span(max(least, span.low), span.high, span.step)


def round_up(value: float) -> float:
    """Return the next number of two significant digits."""
    power = 10.0 ** (math.floor(math.log10(value)) - 1)
    return math.ceil(value / power - 1e-9) * power
