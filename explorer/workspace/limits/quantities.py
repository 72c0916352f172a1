"""The quantities that limits bound, what a limit demands of them, and which poses satisfy that.

A limit demands low ≤ g(pose) ≤ high of one quantity g, or of each of several. Kernels take demands
as rows of numbers. `explorer.workspace.limits.table` lists the limits.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from explorer.legs.clearance import closest_shares, square_at
from explorer.mechanism.design import TOLERANCE, Design
from explorer.mechanism.margins import margins_at
from explorer.numerics.arrays import BoolArray, FloatArray
from explorer.numerics.compiled import helper, kernel
from explorer.numerics.number_text import Unit, format_number
from explorer.numerics.vectors import along, cross3, dot3, minus, norm3, times, vector, vector_of

# Quantities, those first that take the least time: b4, the margins, the carriages, their distance,
# d3 − d1, the lengths in the order of the legs, and the angle in radians of a leg from an axis.
X, Y, Z, DELTA1, DELTA2, DELTA3, D1, D3, GAP, ORDER, L1, D2, D4, L4, ANGLE = range(15)

# Columns of the rows of demands: the quantity, its range, and what an angle needs: the index of the
# leg, the axis, which is zero if there is none, and whether it turns with the platform.
QUANTITY, LOW, HIGH, LEG, AXIS_X, AXIS_Y, AXIS_Z, TURNS, DEMAND_COLUMNS = range(9)

# Columns of the row of geometry: the design variables and the sums of radii of the pairs of legs.
A3, B1, B2, B3, RADII, GEOMETRY_COLUMNS = 0, 2, 4, 5, 6, 12

# Speeds over a move, after those of the quantities: bounds of the second derivatives of the
# margins. The speed of an angle is that of a direction of the platform, in radians.
BENDS, SPEEDS = 15, 18


@helper
def write_ends(
    row: FloatArray, p: FloatArray, r: FloatArray, base: FloatArray, ends: FloatArray
) -> None:
    """Write the base ends and the platform ends of the four legs, shape (4, 3) each."""
    for i in range(3):
        ends[0, i] = p[i] + row[B1] * r[i, 0] + row[B1 + 1] * r[i, 1]
        ends[1, i] = p[i] + row[B2] * r[i, 0]
        ends[2, i] = p[i] + row[B3] * r[i, 0]
        ends[3, i] = p[i]
        base[0, i] = base[1, i] = base[2, i] = base[3, i] = 0.0
    base[1, 0], base[2, 0] = ends[1, 0], ends[2, 0]
    base[3, 0], base[3, 1] = row[A3], row[A3 + 1]


@helper
def quantity_at(
    kind: int, p: FloatArray, r: FloatArray, base: FloatArray, ends: FloatArray
) -> float:
    """Return a quantity that is no angle, in a pose, given the ends of its legs."""
    if kind <= Z:
        return p[kind - X]
    if kind <= DELTA3:
        return margins_at(p, r)[kind - DELTA1]
    if kind <= D3:
        return ends[kind - D1 + 1, 0]
    if kind <= ORDER:
        apart = ends[2, 0] - ends[1, 0]
        return apart if kind == ORDER else abs(apart)
    return norm3(minus(vector(ends, kind - L1), vector(base, kind - L1)))


@helper
def angle_at(
    demands: FloatArray, index: int, r: FloatArray, base: FloatArray, ends: FloatArray
) -> float:
    """Return the angle of a leg that a demand is on, in radians; half a turn without an axis."""
    axis = (demands[index, AXIS_X], demands[index, AXIS_Y], demands[index, AXIS_Z])
    if axis == (0.0, 0.0, 0.0):
        return math.pi
    if demands[index, TURNS] > 0.0:
        axis = times(r, axis)
    leg = int(demands[index, LEG])
    own = minus(vector(ends, leg), vector(base, leg))
    return math.atan2(norm3(cross3(own, axis)), dot3(own, axis))


@helper
def write_speeds(
    row: FloatArray,
    p: FloatArray,
    r: FloatArray,
    step: FloatArray,
    axis: FloatArray,
    angle: float,
    tool: FloatArray,
    speeds: FloatArray,
) -> None:
    """Write upper bounds of the speeds over a move, per share of it, shape (SPEEDS,).

    The point of the platform that moves straight is `tool`, in platform coordinates; it starts at
    p and moves by `step`. The lengths and the carriages have the speed of the leg's platform end.
    """
    forward = norm3(vector_of(step))
    ends = ((row[B1], row[B1 + 1]), (row[B2], 0.0), (row[B3], 0.0), (0.0, 0.0))
    swing = 0.0
    for leg in range(4):
        arm = times(r, (ends[leg][0] - tool[0], ends[leg][1] - tool[1], -tool[2]))
        swing = angle * norm3(cross3(vector_of(axis), arm))
        speeds[L1 + leg] = forward + swing
    speeds[D1], speeds[D3] = speeds[D2], speeds[D4]
    speeds[GAP] = speeds[ORDER] = angle * abs(row[B3] - row[B2])
    speeds[ANGLE] = angle
    # b4 came last of the ends; it swings about the tool, perpendicular to the axis of the turn.
    for i in range(3):
        share = math.sqrt(max(0.0, 1.0 - axis[i] * axis[i]))
        speeds[X + i] = abs(step[i]) + swing * share
    # On its line the tool is farthest from a1 at one of the ends.
    start = vector_of(p)
    farthest = max(norm3(start), norm3(along(start, 1.0, vector_of(step))))
    # With c the position of the tool, δ1 = tool z − R ẑ·c and δ2 = (x̂ × R x̂)·c − x̂·R (x̂ × tool).
    speeds[DELTA1] = forward + angle * farthest
    speeds[DELTA2] = speeds[DELTA1] + angle * math.hypot(tool[1], tool[2])
    speeds[DELTA3] = speeds[Z]
    # c goes straight, and directions turn evenly; δ3 = ẑ·c − ẑ·R tool.
    square = angle * angle
    speeds[BENDS] = square * farthest + 2.0 * angle * forward
    speeds[BENDS + 1] = speeds[BENDS] + square * math.hypot(tool[1], tool[2])
    speeds[BENDS + 2] = square * norm3(vector_of(tool))


@kernel("void(f8[::1], f8[:,::1], f8[:,::1], f8[:,:,::1], f8[:,::1])")
def quantity_rows(
    row: FloatArray,
    demands: FloatArray,
    positions: FloatArray,
    rotations: FloatArray,
    values: FloatArray,
) -> None:
    """Write the quantities of m demands in n poses, shape (n, m)."""
    base, ends = np.zeros((4, 3)), np.zeros((4, 3))
    for k in range(positions.shape[0]):
        p, r = positions[k], rotations[k]
        write_ends(row, p, r, base, ends)
        for index in range(demands.shape[0]):
            kind = int(demands[index, QUANTITY])
            if kind == ANGLE:
                values[k, index] = angle_at(demands, index, r, base, ends)
            else:
                values[k, index] = quantity_at(kind, p, r, base, ends)


# Digits of a bound in lists of limits.
DIGITS = 5


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
class Bound:
    """An end of a range.

    Attributes:
        value: Value in design units, of an angle in degrees; infinite if nothing is demanded.
        rates: Derivatives by parameter, such as {"l1 maximum": 1.0}.
        words: What the value is, such as "the reach".
    """

    value: float
    rates: Mapping[str, float] = field(default_factory=dict[str, float])
    words: str = ""


@dataclass(frozen=True)
class LegAngle:
    """The angle of a leg from an axis.

    Attributes:
        leg: Index of the leg, 0 to 3.
        axis: Unit axis, shape (3,), in the frame of the platform or the base; None if it is not
            known, so that no pose satisfies the limit.
        in_platform: Whether the axis turns with the platform.
    """

    leg: int
    axis: FloatArray | None
    in_platform: bool


@dataclass(frozen=True)
class Demand:
    """The range in which a limit demands a quantity.

    Solids and turns rely on it that the distance of the carriages has no maximum and an angle no
    minimum, and moves that a margin is bounded on one side of zero.

    Attributes:
        name: Name of the limit, such as "l1", "box x" or "margin δ1".
        quantity: Index of the quantity.
        low, high: Ends of the range.
        symbol: Symbol of the quantity; the name if empty.
        has_ends: Whether each end is a limit of its own, such as "l1 maximum".
        is_sign: Whether the demand is on the sign that the quantity has at home.
        angle: The angle that is meant, if the quantity is one.
    """

    name: str
    quantity: int
    low: Bound = Bound(-math.inf)
    high: Bound = Bound(math.inf)
    symbol: str = ""
    has_ends: bool = True
    is_sign: bool = False
    angle: LegAngle | None = None

    def row(self, design: Design) -> list[float]:
        """Return the demand as kernels take it, widened by the tolerance."""
        low, high, angle = self.low.value, self.high.value, self.angle
        if angle is None:
            ends = low - design.tolerance, high + design.tolerance
            return [self.quantity, *ends, 0.0, 0.0, 0.0, 0.0, 0.0]
        if angle.axis is None:
            return [self.quantity, low, -math.inf, angle.leg, 0.0, 0.0, 0.0, 0.0]
        ends = math.radians(low) - TOLERANCE, math.radians(high) + TOLERANCE
        return [self.quantity, *ends, angle.leg, *angle.axis.tolist(), angle.in_platform]

    def end_names(self) -> tuple[str, str]:
        """Return the names of the limits at the low and the high end."""
        ends = ("minimum", "maximum") if self.has_ends else ("", "")
        first, second = (f"{self.name} {end}".rstrip() for end in ends)
        return first, second

    def finite_ends(self) -> list[tuple[Bound, str, float]]:
        """Return the finite ends, each with its name and −1 for the low or 1 for the high one."""
        ends = zip((self.low, self.high), self.end_names(), (-1.0, 1.0), strict=True)
        return [end for end in ends if math.isfinite(end[0].value)]

    def text_of(self, value: float, unit: Unit | None = None, **form: Any) -> str:
        """Return a value of the quantity in words, a length with its unit if one is given.

        The `form` is as for `format_number`.
        """
        if unit is not None and self.has_length:
            return unit.text(value, **form)
        return f"{format_number(value, **form)}{'°' if self.angle else ''}"

    def words(self, unit: float = 1.0) -> str:
        """Return the range in words; the design unit is given in the unit that is asked for."""
        factor = unit if self.angle is None else 1.0

        def number(bound: Bound) -> str:
            size = abs(bound.value) if self.is_sign else bound.value
            text = self.text_of(factor * size, digits=DIGITS)
            return f"{text} ({bound.words})" if bound.words else text

        if self.is_sign:
            bound = self.low if math.isfinite(self.low.value) else self.high
            least = f", magnitude at least {number(bound)}" if bound.value else ""
            return f"sign as at home{least}"
        if self.high.value == math.inf:
            return f"at least {number(self.low)}"
        # No length or angle is below zero.
        least = 0.0 if self.quantity in (GAP, *range(L1, ANGLE + 1)) else -math.inf
        if self.low.value <= least:
            return f"at most {number(self.high)}"
        return f"{number(self.low)} to {number(self.high)}"

    @property
    def has_length(self) -> bool:
        """Whether the words of the range have a length in them."""
        ends = self.low.value, self.high.value
        return self.angle is None and any(end and math.isfinite(end) for end in ends)
