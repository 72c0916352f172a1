"""Validity of poses: whether they satisfy all demands of a design, and which limits they violate.

The demands are the limits, the home's sign triple and the clearances of all pairs of legs. They
are tested in compiled loops. `explorer.legs.clearance` names the legs that collide.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from explorer.legs.clearance import closest_shares, joined_pairs, radii_of_pairs, square_at
from explorer.mechanism.configuration import Configuration
from explorer.mechanism.design import Design
from explorer.mechanism.pose import checked_rotation
from explorer.numerics.arrays import (
    BoolArray,
    FloatArray,
    batch_shape,
    position_array,
    rows_for_kernel,
)
from explorer.numerics.compiled import helper, kernel
from explorer.numerics.vectors import minus, vector
from explorer.workspace.limits.limit import Demand
from explorer.workspace.limits.quantities import (
    ANGLE,
    DELTA1,
    DELTA3,
    GEOMETRY_COLUMNS,
    HIGH,
    LOW,
    QUANTITY,
    RADII,
    angle_at,
    quantity_at,
    quantity_rows,
    write_ends,
)
from explorer.workspace.limits.table import by_quantity, demands_of, rows_of


@dataclass(frozen=True)
class Rules:
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
        row = np.empty(GEOMETRY_COLUMNS)
        row[:RADII] = design.variables
        # No clearance is demanded of a pair that shares a joint.
        row[RADII:] = np.where(joined_pairs(design), -1.0, radii_of_pairs(design))
        # What takes the least time comes first, since most invalid poses violate that too.
        return Rules(row, rows_of(design, by_quantity(demands_of(design, signs, order))))

    def without_clearances(self) -> Rules:
        """Return rules that demand no clearance."""
        row = self.row.copy()
        row[RADII:] = -1.0
        return Rules(row, self.demands)

    def tighten(self, margin: float, clearance: float) -> Rules:
        """Return rules that demand at least a margin and a clearance beyond the radii, in units.

        The margin is ignored if the rules demand none.
        """
        row, demands = self.row.copy(), self.demands.copy()
        row[RADII:] = np.where(row[RADII:] < 0.0, row[RADII:], row[RADII:] + clearance)
        low, high = demands[:, LOW], demands[:, HIGH]
        of_margins = (demands[:, QUANTITY] >= DELTA1) & (demands[:, QUANTITY] <= DELTA3)
        low[of_margins & np.isfinite(low) & (low < margin)] = margin
        high[of_margins & np.isfinite(high) & (high > -margin)] = -margin
        return Rules(row, demands)


def poses_are_valid(
    design: Design, position: ArrayLike, rotation: ArrayLike, *, rules: Rules | None = None
) -> BoolArray:
    """Return whether poses satisfy all limits and clearances, shape (...).

    A clearance of zero is a collision, as for `explorer.tetrahedra_overlap`.

    Args:
        design: The manipulator.
        position: b4 in the base frame, shape (..., 3), in design units.
        rotation: Platform to base, shape (..., 3, 3).
        rules: Rules of the design, if they have been computed before.

    Raises:
        InputError: A pose that is not finite or not a rotation.
    """
    p, r = position_array("position", position), checked_rotation(rotation)
    batch = batch_shape((p, 1), (r, 2))
    p_rows, r_rows = rows_for_kernel(p, batch, 1), rows_for_kernel(r, batch, 2)
    valid = np.empty(len(p_rows), dtype=np.bool_)
    rules = rules or Rules.of(design)
    valid_rows(len(p_rows), rules.row, rules.demands, p_rows, r_rows, valid)
    return valid.reshape(batch)


@helper
def satisfies_limits(
    demands: FloatArray, p: FloatArray, r: FloatArray, base: FloatArray, ends: FloatArray
) -> bool:
    """Return whether a pose satisfies the demands of its limits."""
    for index in range(demands.shape[0]):
        kind = int(demands[index, QUANTITY])
        if kind == ANGLE:
            value = angle_at(demands, index, r, base, ends)
        else:
            value = quantity_at(kind, p, r, base, ends)
        if not demands[index, LOW] <= value <= demands[index, HIGH]:
            return False
    return True


@helper
def square_between(i: int, j: int, base: FloatArray, ends: FloatArray) -> float:
    """Return the squared distance of the axes of two legs."""
    first, second = vector(base, i), vector(base, j)
    u, v = minus(vector(ends, i), first), minus(vector(ends, j), second)
    w = minus(first, second)
    s, t = closest_shares(u, v, w)
    return square_at(s, t, u, v, w)


@helper
def is_clear(i: int, j: int, radius: float, base: FloatArray, ends: FloatArray) -> bool:
    """Return whether the axes of two legs are farther apart than a sum of radii."""
    if radius < 0.0:
        return True
    # The projections on an axis of the base already separate most pairs.
    for axis in range(3):
        a, b = base[i, axis], ends[i, axis]
        c, d = base[j, axis], ends[j, axis]
        if max(min(a, b) - max(c, d), min(c, d) - max(a, b)) > radius:
            return True
    return square_between(i, j, base, ends) > radius * radius


@helper
def is_valid(
    row: FloatArray,
    demands: FloatArray,
    p: FloatArray,
    r: FloatArray,
    base: FloatArray,
    ends: FloatArray,
) -> bool:
    """Return whether a pose satisfies all rules; write the ends of the legs."""
    write_ends(row, p, r, base, ends)
    if not satisfies_limits(demands, p, r, base, ends):
        return False
    pair = RADII
    for i in range(3):
        for j in range(i + 1, 4):
            if not is_clear(i, j, row[pair], base, ends):
                return False
            pair += 1
    return True


@kernel("void(f8[::1], f8[:,::1], f8[:,::1], f8[:,:,::1], b1[::1])")
def valid_rows(
    row: FloatArray,
    demands: FloatArray,
    position: FloatArray,
    rotation: FloatArray,
    valid: BoolArray,
) -> None:
    """Write whether n poses satisfy all rules, given as the row and the demands of `Rules`."""
    base, ends = np.zeros((4, 3)), np.zeros((4, 3))
    for index in range(position.shape[0]):
        valid[index] = is_valid(row, demands, position[index], rotation[index], base, ends)


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

    For the signs and the order of the carriages see `demands_of`.
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
