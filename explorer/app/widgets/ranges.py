"""The ranges of the sliders, from the design as it was opened, so that they hold still."""

from __future__ import annotations

import functools
import math

from explorer.app.state.state import State
from explorer.app.widgets.controls import Span

# Ends of sliders over the size of the design: beyond usual limits, so that users run into them.
BEYOND = 1.5


def fine_step(size: float, parts: float) -> float:
    """Return the power of ten at or below a share of a size."""
    return 10.0 ** math.floor(math.log10(size / parts))


def length_span(state: State) -> Span:
    """Return the range of a length."""
    return _length_span(state.base.reach)


@functools.lru_cache(64)
def _length_span(reach: float) -> Span:
    return Span(0.0, round_up(BEYOND * reach), fine_step(reach, 2e3))


def radius_span(state: State) -> Span:
    """Return the range of the radius of a leg."""
    reach = state.base.reach
    return Span(0.0, round_up(0.1 * reach), fine_step(reach, 5e3))


def coordinate_span(state: State) -> Span:
    """Return the range of a coordinate."""
    return _coordinate_span(state.base.reach)


@functools.lru_cache(64)
def _coordinate_span(reach: float) -> Span:
    edge = round_up(BEYOND * reach)
    return Span(-edge, edge, fine_step(reach, 2e3))


def variable_span(state: State) -> Span:
    """Return the range of a design variable, in steps as fine as designs are published with."""
    return _variable_span(max(map(abs, state.base.variables)))


@functools.lru_cache(64)
def _variable_span(size: float) -> Span:
    edge = round_up(BEYOND * size)
    return Span(-edge, edge, fine_step(size, 1e5))


def round_up(value: float) -> float:
    """Return the next number of two significant digits."""
    power = 10.0 ** (math.floor(math.log10(value)) - 1)
    return math.ceil(value / power - 1e-9) * power
