"""The tracks of sliders: their ranges, which follow the state, and their tinted parts."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import TypeAlias

import viser

from explorer.app.state.state import State
from explorer.app.widgets.assigning import Update
from explorer.mechanism.feasible_intervals import Interval

# Least width of a close-up over the whole range, and least part of the track that is tinted before
# the close-up is made anew.
LEAST_CLOSE_UP, LEAST_TINTED = 0.1, 0.25


@dataclass(frozen=True)
class Span:
    """The range of a slider, in the unit of its value."""

    low: float
    high: float
    step: float


Intervals: TypeAlias = tuple[Interval, ...]
"""Disjoint ascending intervals, in the unit of a slider's value; an end may be infinite."""


class Track:
    """The range of a slider, which follows the state and holds every value of its thumbs.

    Args:
        handle: The slider.
        span: Range, or the function that returns it.
        closes_up: Whether it shows only the surroundings of the tinted parts.
    """

    def __init__(
        self,
        handle: viser.GuiSliderHandle[float] | viser.GuiMultiSliderHandle[float],
        span: Span | Callable[[State], Span],
        *,
        closes_up: bool = False,
    ) -> None:
        self._handle = handle
        self._span = span
        self._closes_up = closes_up
        self._shown: Span | None = None
        self._whole: Span | None = None

    def span(
        self, state: State, values: tuple[float, ...], tinted: Intervals = (), *, is_own: bool
    ) -> Span:
        """Return the range in a state.

        Args:
            state: The state.
            values: Values of the thumbs.
            tinted: The tinted parts.
            is_own: Whether the slider itself was changed last: then its range may only grow, so
                that it holds still under the pointer, unless `span` itself has changed.
        """
        span = whole = self._span if isinstance(self._span, Span) else self._span(state)
        if self._closes_up:
            span = close_up(span, tinted, self._shown)
        low, high = min(span.low, *values), max(span.high, *values)
        if is_own and self._shown is not None and whole == self._whole:
            low, high = min(low, self._shown.low), max(high, self._shown.high)
        self._whole = whole
        return Span(low, high, span.step)

    def updates(self, span: Span) -> Iterator[Update]:
        """Yield the updates that give the slider its range."""
        if span == self._shown:
            return
        self._shown = span
        yield self._handle, "min", span.low
        yield self._handle, "max", span.high
        yield self._handle, "step", span.step
        yield self._handle, "precision", decimals(span.step)


def tint_marks(intervals: Intervals, span: Span) -> tuple[float, ...]:
    """Return the ends of intervals within a range as marks, from which a stylesheet tints a track.

    The track is tinted from each mark of odd number to the next one.

    Args:
        intervals: The intervals.
        span: Range of the slider.
    """
    return tuple(
        min(max(end, span.low), span.high)
        for low, high in intervals
        if low < span.high and high > span.low
        for end in (low, high)
    )


def close_up(whole: Span, intervals: Intervals, before: Span | None) -> Span:
    """Return the part of a range around intervals, as wide again as they are.

    Args:
        whole: The range.
        intervals: The intervals, disjoint and ascending.
        before: The part that was shown before, which stays as long as it serves; None if none was.
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

    A slider's values are whole steps from its lower end.

    Args:
        low: Lower end.
        high: Upper end.
        step: Step of the slider, a power of ten.
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
