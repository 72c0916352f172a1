"""The limits of a design that a pose violates, other than the clearances of the legs."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from explorer.mechanism.configuration import Configuration
from explorer.workspace.limits.limit import Demand
from explorer.workspace.limits.quantities import HIGH, LOW, quantity_rows
from explorer.workspace.limits.table import demands_of, rows_of


@dataclass(frozen=True)
class Violation:
    """A limit that a pose violates.

    Attributes:
        demand: Range in which the limit demands a quantity.
        value: Value of the quantity, in design units, of an angle in degrees.
        above: Whether the value exceeds a maximum, rather than falling below a minimum.
    """

    demand: Demand
    value: float
    above: bool

    @property
    def limit(self) -> str:
        """Name of the limit, such as "l1", "gap |d1 − d3|" or "swing a1"."""
        return self.demand.name

    @property
    def bound(self) -> float:
        """The maximum or the minimum of the value."""
        return (self.demand.high if self.above else self.demand.low).value

    def __str__(self) -> str:
        demand = self.demand
        value = demand.text_of(self.value, size=abs(self.bound))
        if demand.is_sign and self.bound == 0.0:
            sign = "negative" if self.above else "positive"
            of = "" if demand.name.endswith(demand.symbol) else f": {demand.symbol}"
            return f"{self.limit}{of} = {value}, but it is {sign} in the home pose"
        relation = "above its maximum" if self.above else "below its minimum"
        return f"{self.limit} = {value} is {relation} {demand.text_of(self.bound)}"


def violations(
    configuration: Configuration,
    signs: tuple[int, int, int] | None = None,
    order: int | None = None,
) -> list[tuple[Violation, ...]]:
    """Return the limits that each pose of a batch violates, in the order of the design file.

    Args:
        configuration: A design in n poses, or in one.
        signs: Sign triple to demand instead of the home's, even if no margin is demanded.
        order: Sign of d3 − d1 to demand, 0 for either; the design's if None.
    """
    design = configuration.design
    demands, row = demands_of(design, signs, order), configuration.variables
    rows = rows_of(design, demands)
    values = np.empty((len(configuration.positions), len(demands)))
    poses = configuration.positions, configuration.rotations
    quantity_rows(len(values), row, rows, *poses, values)
    lows, highs = rows[:, LOW], rows[:, HIGH]
    beyond = np.greater(values, highs) * 1 - np.less(values, lows)
    return [
        tuple(
            Violation(demand, math.degrees(value) if demand.angle else value, above=side > 0)
            for demand, value, side in zip(demands, row, sides, strict=True)
            if side
        )
        for row, sides in zip(values.tolist(), beyond.tolist(), strict=True)
    ]
