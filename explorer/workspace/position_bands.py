"""Measures of positions at one orientation, and the bands of colour that show them.

Each value is zero in singular positions and grows away from them. For a load it is the reciprocal
of what the load asks of the machine, which is infinite there: the first band has no end of its
own, so that it holds whatever is beyond the last round number.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

import numpy as np

from explorer.mechanism.design import Design
from explorer.mechanism.margins import margins
from explorer.numerics.arrays import FloatArray
from explorer.singularity.colours import (
    BAND_EDGES,
    CLEAR,
    FAR,
    SINGULAR,
    WARN_CONDITION,
    WARNED,
    Rgb,
    band_colours,
    mix,
)
from explorer.singularity.jacobian import inverse_condition, jacobian
from explorer.statics.held import held_load, largest_shares
from explorer.workspace.limits.constraints import constraints, slacks
from explorer.workspace.limits.region import region_of
from explorer.workspace.slices.volume import bounds

PositionMeasure = Literal["margin", "condition", "share", "force", "bending"]
LoadMeasure = Literal["share", "force", "bending"]

LOAD_WORDS: dict[PositionMeasure, tuple[str, str, float]] = {
    "share": ("largest share of a limit", "%", 100.0),
    "force": ("largest actuator force", "N", 1.0),
    "bending": ("largest bending of a strut", "N m", 1.0),
}
"""Words and unit for what a load asks, and the factor from the measure to that unit.
The measures are in 1, N and N m."""

SHARES = (0.25, 0.5, 0.75, 1.0)
"""Ends of the bands of shares of a limit; the last one is the limit."""
SHARE_COLOURS: tuple[Rgb, ...] = (FAR, mix(FAR, CLEAR, 0.5), CLEAR, WARNED, SINGULAR)

STEPS = (1.0, 2.0, 5.0)
"""Ends of the bands of forces and moments, over powers of ten."""
# Number of these ends. The lowest exceeds this share of the values within the limits.
LEVELS, LEAST_SHARE = 6, 0.05
STEP_COLOURS: tuple[Rgb, ...] = (
    *(mix(FAR, CLEAR, share) for share in (0.0, 1 / 3, 2 / 3, 1.0)),
    *(mix(WARNED, SINGULAR, share) for share in (0.0, 0.5, 1.0)),
)
# Nodes on each axis of the grid that finds the lowest end; largest value over the last edge.
NODES, FARTHEST = 16, 2.0


@dataclass(frozen=True)
class PositionBands:
    """A measure of positions at one orientation, in bands.

    Attributes:
        measure: The measure.
        edges: Least value of each band, ascending from 0.
        colours: Colour of each band.
        levels: The measure at each edge, in units for a margin; infinite at the first for a load.
        values: Function from positions (n, 3) to values (n,), which are zero in singular ones.
        held: Row of numbers of a load, see `explorer.statics.held.held_load`; None without one.
    """

    measure: PositionMeasure
    edges: tuple[float, ...]
    colours: tuple[Rgb, ...]
    levels: tuple[float, ...]
    values: Callable[[FloatArray], FloatArray]
    held: FloatArray | None = None


def position_bands(
    design: Design,
    rotation: FloatArray,
    measure: PositionMeasure,
    *,
    warn_below: float,
    load: FloatArray | None = None,
) -> PositionBands:
    """Return the bands of a measure.

    Args:
        design: The manipulator.
        rotation: Platform to base, shape (3, 3).
        measure: The measure.
        warn_below: Length below which margins raise a warning, in design units.
        load: (F; M) on the platform at the tool point besides the payload, base axes, shape (6,),
            in N and N × unit; None for none. Only measures of a load need it.
    """
    if measure == "margin":

        def smallest_margin(points: FloatArray) -> FloatArray:
            return np.abs(margins(points, rotation)).min(axis=-1) / warn_below

        return _proximity(measure, warn_below, smallest_margin)
    if measure == "condition":

        def condition(points: FloatArray) -> FloatArray:
            rates = jacobian(design, points, rotation)
            return inverse_condition(rates, design.reach) / WARN_CONDITION

        return _proximity(measure, WARN_CONDITION, condition)
    w = np.zeros(6) if load is None else load
    held = held_load(design, rotation, w, measured_limits(design, measure))
    return _of_load(design, rotation, measure, held)


def measured_limits(design: Design, measure: LoadMeasure) -> FloatArray | None:
    """Return the limits of which the largest share is the measure, shape (2, 10).

    They are those of the design, as None, for a share. For a force or a moment they are one newton
    or one newton metre, in N × unit, of each part concerned.
    """
    if measure == "share":
        return None
    limits = np.full((2, 10), np.inf)
    if measure == "force":
        limits[:, :6] = 1.0
    else:
        limits[:, 6:8] = 1e3 / design.unit_mm
    return limits


def _proximity(
    measure: PositionMeasure, unit: float, values: Callable[[FloatArray], FloatArray]
) -> PositionBands:
    """Return the bands of the proximity to singularities."""
    levels = tuple(unit * edge for edge in BAND_EDGES)
    return PositionBands(measure, BAND_EDGES, band_colours(), levels, values)


def _of_load(
    design: Design, rotation: FloatArray, measure: LoadMeasure, held: FloatArray
) -> PositionBands:
    """Return the bands of what a load asks; values are the highest level over it."""
    if measure == "share":
        levels, colours = SHARES, SHARE_COLOURS
    else:
        levels, colours = _round_levels(design, rotation, held), STEP_COLOURS
    highest = levels[-1]
    edges = (0.0, *(highest / level for level in reversed(levels)))

    def values(points: FloatArray) -> FloatArray:
        asked = largest_shares(held, rotation, points)
        return highest / np.maximum(asked, highest / (FARTHEST * edges[-1]))

    ends = (math.inf, *reversed(levels))
    return PositionBands(measure, edges, colours[::-1], ends, values, held)


def _round_levels(design: Design, rotation: FloatArray, held: FloatArray) -> tuple[float, ...]:
    """Return round numbers that suit the values at positions within the limits, ascending."""
    limits = constraints(design, rotation)
    lows, highs = bounds(region_of(limits))
    if not (lows < highs).all():
        lows, highs = np.zeros(3), np.full(3, design.reach)
    axes = np.linspace(lows, highs, NODES + 2)[1:-1].T
    nodes = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
    within = nodes[(slacks(limits, nodes) >= 0.0).all(axis=-1)]
    asked = largest_shares(held, rotation, within if len(within) else nodes)
    asked = asked[np.isfinite(asked) & (asked > 0.0)]
    least = float(np.quantile(asked, LEAST_SHARE)) if len(asked) else 1.0
    exponent = math.floor(math.log10(least))
    # Division by a power of ten is exact where a product with a negative one is not.
    steps = (
        step * 10.0**power if power >= 0 else step / 10.0**-power
        for power in itertools.count(exponent)
        for step in STEPS
    )
    above = itertools.dropwhile(lambda step: step < least, steps)
    return tuple(itertools.islice(above, LEVELS))
