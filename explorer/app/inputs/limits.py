"""The controls of limits: what they show of a field of the limits, and what they make of it."""

from __future__ import annotations

import functools
from typing import Any

from explorer.app.inputs.bindings import ControlBinding
from explorer.app.inputs.ranges import Span, span_around
from explorer.app.state.actions import Set
from explorer.app.state.parts import with_value
from explorer.app.state.state import State
from explorer.mechanism.design import Design, Pair
from explorer.workspace.limits.table import LIMITS, Limit, LimitSlider, Switch

ANGLE_STEP = 0.5


@functools.lru_cache(256)
def limit_span(base: Design, entry: LimitSlider) -> Span:
    """Return the range of a slider, which follows the design as it was opened."""
    if entry.is_angle:
        return Span(*entry.track(base), ANGLE_STEP)
    return span_around(entry.track(base), base.reach, entry.least)


def bound_switch(switch: Switch) -> ControlBinding[bool]:
    """Return the binding of a checkbox to all fields that have it."""

    def write(state: State, on: bool) -> Set:
        limits = state.design.limits
        for limit in _limits_of(switch):
            value: object = _start(state, limit) if on else None
            if switch.turn is not None:
                value = switch.turn(state.design, limit.value(state.design), on)
            limits = with_value(limits, limit.path, value)
        return Set("design.limits", limits, switch.label, "on" if on else "off")

    return ControlBinding(
        lambda frame: all(
            switch.is_on(limit.value(frame.state.design)) for limit in _limits_of(switch)
        ),
        write,
    )


def bound_entry(limit: Limit, entry: LimitSlider) -> ControlBinding[Any]:
    """Return the binding of a slider to a field."""

    def write(state: State, new: Any) -> Set:
        value, path = _value(state, limit), f"design.limits.{limit.path}"
        if entry.is_number:
            is_free = limit.switch is None and entry.free is not None and new >= entry.free
            return Set(path, None if is_free else new, entry.label)
        before = _visible_value(state, limit, entry)
        low, high = push_other_end(before, new)
        if entry.axis is not None:
            lows, highs = map(list, value)
            lows[entry.axis], highs[entry.axis] = low, high
            return Set(path, (tuple(lows), tuple(highs)))
        # A maximum at the reach stays there while only the minimum is moved.
        return Set(path, (low, None if value[1] is None and high == before[1] else high))

    return ControlBinding(lambda frame: _visible_value(frame.state, limit, entry), write)


def push_other_end(before: Pair, after: Pair) -> Pair:
    """Return the ends of a range after a change of one of them, which pushes the other along."""
    low, high = after
    if low <= high:
        return after
    return (high, high) if low == before[0] else (low, low)


def _limits_of(switch: Switch) -> list[Limit]:
    return [limit for limit in LIMITS if limit.switch is switch]


def _visible_value(state: State, limit: Limit, entry: LimitSlider) -> Any:
    """Return the value that a slider shows: a number, or the ends of a range."""
    value = _value(state, limit)
    if entry.is_number:
        return value
    low, high = value if entry.axis is None else (corner[entry.axis] for corner in value)
    return low, state.design.reach if high is None else high


def _value(state: State, limit: Limit) -> Any:
    value = limit.value(state.design)
    return _start(state, limit) if value is None else value


def _start(state: State, limit: Limit) -> Any:
    """Return the value of a field in place of None, which excludes nothing."""
    if limit.entries[0].is_number:
        return limit.entries[0].free
    spans = [limit_span(state.base, entry) for entry in limit.entries]
    ends = [(span.low, span.high) for span in spans]
    return tuple(zip(*ends, strict=True)) if len(ends) > 1 else ends[0]
