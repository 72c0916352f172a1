"""The ranges of the sliders: what the limits of the design leave possible, and a little more.

Sliders that change the design have ranges that follow the design as it was opened, and so hold
still while they are dragged.
"""

from __future__ import annotations

import functools
import math

from explorer.app.inputs.tracks import Span, round_span
from explorer.app.state.state import State
from explorer.mechanism.configuration import Point, point_of
from explorer.mechanism.design import JOINTS, LENGTHS, Design, Pair
from explorer.mechanism.feasible_intervals import possible_ranges

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
    reach = state.base.reach
    return Span(0.0, round_up(BEYOND * reach), fine_step(reach, 2e3))


def radius_span(state: State) -> Span:
    """Return the range of the radius of a leg."""
    reach = state.base.reach
    return Span(0.0, round_up(0.1 * reach), fine_step(reach, 5e3))


def coordinate_span(state: State) -> Span:
    """Return the range of a coordinate, or of a displacement."""
    reach = state.base.reach
    edge = round_up(BEYOND * reach)
    return Span(-edge, edge, fine_step(reach, 2e3))


def platform_span(state: State) -> Span:
    """Return the range of a coordinate of a point of the platform, such as that of the tool."""
    reach = state.base.reach
    edge = round_up(0.5 * reach)
    return Span(-edge, edge, fine_step(reach, 2e3))


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
