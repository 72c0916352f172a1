"""Validity of poses: whether they satisfy all demands of a design, and which limits they violate.

The demands are the limits, the home's sign triple and the clearances of all pairs of legs. They
are tested in compiled loops. A pose is valid exactly if it violates nothing.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from explorer.legs.clearance import (
    PAIRS,
    joined_pairs,
    leg_clearances,
    pair_name,
    radii_of_pairs,
)
from explorer.mechanism.configuration import Configuration
from explorer.mechanism.design import Design
from explorer.numerics.arrays import BoolArray, FloatArray, IntArray
from explorer.numerics.number_text import Unit, drop_rounding, format_apart, format_number
from explorer.workspace.limits import quantities
from explorer.workspace.limits.quantities import Demand
from explorer.workspace.limits.table import by_quantity, demands_of, rows_of


class Rules(NamedTuple):
    """The demands of a design on a pose, as kernels take them.

    Attributes:
        row: Design variables and sums of radii, shape (GEOMETRY_COLUMNS,).
        demands: Rows of the demands of limits in force, widened by their tolerance, see
            `explorer.workspace.limits.quantities`, shape (n, DEMAND_COLUMNS).
    """

    row: FloatArray
    demands: FloatArray

    @staticmethod
    def of(
        design: Design, signs: tuple[int, int, int] | None = None, order: int | None = None
    ) -> Rules:
        """Return the rules of a design; signs and order as for `demands_of`."""
        # What takes the least time comes first, since most invalid poses violate that too.
        demands = by_quantity(demands_of(design, signs, order))
        return Rules(geometry_of(design), rows_of(design, demands))

    def without_clearances(self) -> Rules:
        """Return rules that demand no clearance."""
        row = self.row.copy()
        row[quantities.RADII :] = -1.0
        return Rules(row, self.demands)

    def tighten(self, margin: float, clearance: float) -> Rules:
        """Return rules that demand at least a margin and a clearance beyond the radii, in units.

        The margin is ignored if the rules demand none.
        """
        row, demands = self.row.copy(), self.demands.copy()
        radii = row[quantities.RADII :]
        radii[radii >= 0.0] += clearance
        low, high = demands[:, quantities.LOW], demands[:, quantities.HIGH]
        kind = demands[:, quantities.QUANTITY]
        of_margins = (kind >= quantities.DELTA1) & (kind <= quantities.DELTA3)
        low[of_margins & np.isfinite(low) & (low < margin)] = margin
        high[of_margins & np.isfinite(high) & (high > -margin)] = -margin
        return Rules(row, demands)


def geometry_of(design: Design) -> FloatArray:
    """Return the design variables and the sums of radii, shape (GEOMETRY_COLUMNS,)."""
    row = np.empty(quantities.GEOMETRY_COLUMNS)
    row[: quantities.RADII] = design.variables
    # No clearance is demanded of a pair that shares a joint.
    row[quantities.RADII :] = np.where(joined_pairs(design), -1.0, radii_of_pairs(design))
    return row


def poses_are_valid(
    design: Design, position: ArrayLike, rotation: ArrayLike, *, rules: Rules | None = None
) -> BoolArray:
    """Return whether poses satisfy all limits and clearances, shape (...).

    A clearance of zero is a collision, as for `explorer.tetrahedra_overlap`. Positions of b4,
    (..., 3), are in design units, rotations (..., 3, 3) from platform to base. The rules are those
    of the design, if they have been computed before.

    Raises:
        InputError: A pose that is not finite or not a rotation.
    """
    at = Configuration(design, position, rotation)
    valid = np.empty(len(at.positions), dtype=np.bool_)
    quantities.valid_rows(
        len(valid), *(rules or Rules.of(design)), at.positions, at.rotations, valid
    )
    return valid.reshape(at.batch)


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
        return self.words()

    def words(self, unit: Unit | None = None) -> str:
        """Return the violation in words, in which lengths have a unit if one is given."""
        demand = self.demand
        size = abs(self.bound)
        value, bound = format_apart(
            (self.value, self.bound),
            4,
            lambda each, digits: demand.text_of(each, unit, digits=digits, size=size),
        )
        if demand.is_sign and self.bound == 0.0:
            sign = "negative" if self.above else "positive"
            of = "" if demand.name.endswith(demand.symbol) else f": {demand.symbol}"
            return f"{self.limit}{of} = {value}, but it is {sign} in the home pose"
        relation = "above its maximum" if self.above else "below its minimum"
        return f"{self.limit} = {value} is {relation} {bound}"


COLLISIONS = tuple(f"legs {pair_name(pair)}" for pair in PAIRS)
"""Names of the limits that legs must not collide, such as "legs 2–3", in the order of `PAIRS`."""


@dataclass(frozen=True)
class Collision:
    """Two legs that touch or overlap in a pose.

    Attributes:
        legs: Numbers of the two legs.
        depth: Length by which they overlap, in design units; 0 if they only touch.
    """

    legs: tuple[int, int]
    depth: float

    @property
    def limit(self) -> str:
        """Name of the limit, as in `COLLISIONS`."""
        return COLLISIONS[PAIRS.index(self.legs)]

    def __str__(self) -> str:
        return self.words()

    def words(self, unit: Unit | None = None) -> str:
        """Return the collision in words, in which the length has a unit if one is given."""
        length = format_number(self.depth) if unit is None else unit.text(self.depth)
        manner = f"overlap by {length}" if self.depth else "touch"
        return f"legs {self.legs[0]} and {self.legs[1]} {manner}"


def violations(
    configuration: Configuration,
    signs: tuple[int, int, int] | None = None,
    order: int | None = None,
) -> list[tuple[Violation | Collision, ...]]:
    """Return the limits that each pose of a batch violates, and the legs that collide in it.

    The limits are in the order of the design file. For the signs and the order of the carriages
    see `demands_of`.
    """
    demands, values, beyond = sides_of_limits(configuration, signs, order)
    found = [
        tuple(
            Violation(demand, math.degrees(value) if demand.angle else value, above=side > 0)
            for demand, value, side in zip(demands, row, sides, strict=True)
            if side
        )
        for row, sides in zip(values.tolist(), beyond.tolist(), strict=True)
    ]
    colliding = colliding_pairs(configuration)
    if not colliding.any():
        return [*found]
    depths = -leg_clearances(configuration).clearance.reshape(-1, len(PAIRS))
    reach = configuration.design.reach
    return [
        (
            *broken,
            *(
                Collision(pair, max(0.0, drop_rounding(depth, reach)))
                for pair, collides, depth in zip(PAIRS, pairs, row, strict=True)
                if collides
            ),
        )
        for broken, pairs, row in zip(found, colliding.tolist(), depths.tolist(), strict=True)
    ]


def colliding_pairs(configuration: Configuration) -> BoolArray:
    """Return which pairs of legs touch or overlap in n poses, as validity has it, shape (n, 6)."""
    row = geometry_of(configuration.design)
    poses = configuration.positions, configuration.rotations
    colliding = np.zeros((len(poses[0]), len(PAIRS)), dtype=np.bool_)
    is_clear = np.empty(len(colliding), dtype=np.bool_)
    no_demands = np.empty((0, quantities.DEMAND_COLUMNS))
    quantities.valid_rows(len(is_clear), row, no_demands, *poses, is_clear)
    if is_clear.all():
        return colliding
    for pair in range(len(PAIRS)):
        alone = row.copy()
        alone[quantities.RADII :] = -1.0
        alone[quantities.RADII + pair] = row[quantities.RADII + pair]
        quantities.valid_rows(len(is_clear), alone, no_demands, *poses, is_clear)
        colliding[:, pair] = ~is_clear
    return colliding


def sides_of_limits(
    configuration: Configuration,
    signs: tuple[int, int, int] | None = None,
    order: int | None = None,
) -> tuple[tuple[Demand, ...], FloatArray, IntArray]:
    """Return the m demands of a design, their quantities in n poses (n, m), and the sides, (n, m).

    Quantities are in design units and radians. The side is 1 above a maximum, −1 below a minimum,
    and otherwise 0. The demands are in the order of the design file; for the signs and the order of
    the carriages see `demands_of`.
    """
    design = configuration.design
    demands, row = demands_of(design, signs, order), configuration.variables
    rows = rows_of(design, demands)
    values = np.empty((len(configuration.positions), len(demands)))
    poses = configuration.positions, configuration.rotations
    quantities.quantity_rows(len(values), row, rows, *poses, values)
    lows, highs = rows[:, quantities.LOW], rows[:, quantities.HIGH]
    return demands, values, np.greater(values, highs) * 1 - np.less(values, lows)
