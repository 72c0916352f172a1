"""What a limit is: its demands on quantities, in numbers and in words, and how it is edited.

A limit demands low ≤ g(pose) ≤ high of one quantity g, or of each of several
(`explorer.workspace.limits.quantities`); `explorer.workspace.limits.table` lists the limits.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from operator import attrgetter
from typing import Any

from explorer.mechanism.design import TOLERANCE, Design, Pair
from explorer.numerics.arrays import FloatArray
from explorer.numerics.number_text import format_number
from explorer.workspace.limits.quantities import ANGLE, GAP, L1

# Digits of a bound in lists of limits.
DIGITS = 5


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

    def text_of(self, value: float, **form: Any) -> str:
        """Return a value of the quantity in words; `form` as for `format_number`."""
        return f"{format_number(value, **form)}{'°' if self.angle else ''}"

    def words(self, unit: float = 1.0) -> str:
        """Return the range in words.

        Args:
            unit: Design unit in the unit of lengths that is asked for.
        """
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
        if not self.is_range:
            return f"at most {number(self.high)}"
        return f"{number(self.low)} to {number(self.high)}"

    @property
    def has_length(self) -> bool:
        """Whether the words of the range have a length in them."""
        ends = self.low.value, self.high.value
        return self.angle is None and any(end and math.isfinite(end) for end in ends)

    @property
    def is_range(self) -> bool:
        """Whether both ends exclude something; no length or angle is below zero."""
        least = 0.0 if self.quantity in MAGNITUDES else -math.inf
        return self.low.value > least and self.high.value < math.inf


MAGNITUDES = (GAP, *range(L1, ANGLE + 1))
"""Quantities that are never negative."""


@dataclass(frozen=True)
class LimitCase:
    """What the demands of a limit follow from.

    Attributes:
        design: The manipulator.
        value: Value of the limit's field.
        signs: Sign triple to demand, even if no margin is; None for the home's.
        order: Sign of d3 − d1 to demand, 0 for either; the design's if None.
    """

    design: Design
    value: Any
    signs: tuple[int, int, int] | None
    order: int | None


@dataclass(frozen=True)
class Switch:
    """A checkbox, for one field or for several.

    Attributes:
        label, hint: Words beside it, and a sentence on what it does.
        turn: Function of a design, the field's value and on or off, which returns the new value;
            None if off is None, and on the value that the entries show while it is None.
        is_on: Function of the value.
    """

    label: str
    hint: str
    turn: Callable[[Design, Any, bool], object] | None = None
    is_on: Callable[[Any], bool] = lambda value: value is not None


@dataclass(frozen=True)
class Entry:
    """A slider for a number or for the ends of a range.

    Attributes:
        label, hint: Words beside it, and a sentence on what it sets.
        track: Function of a design that returns the range of the slider.
        axis: Index in each of the two corners of a box; None for the field itself.
        is_number: Whether the value is one number.
        is_angle: Whether it is in degrees, rather than in design units.
        free: Number in place of None; without a switch the field becomes None there. A range shows
            its track.
        least: Least value of the track.
    """

    label: str
    hint: str
    track: Callable[[Design], Pair]
    axis: int | None = None
    is_number: bool = False
    is_angle: bool = False
    free: float | None = None
    least: float = -math.inf


@dataclass(frozen=True)
class Limit:
    """A row of the table.

    Attributes:
        path: Field below `Design.limits`, such as "guide" or "swing.a1".
        subjects: The field at the beginning of a sentence, and its parts by the words that
            follow its path in messages.
        demands: Function that yields the demands that are in force.
        entries: Sliders that edit it.
        switch: Checkbox before the entries.
    """

    path: str
    subjects: Mapping[str, str]
    demands: Callable[[LimitCase], Iterable[Demand]]
    entries: tuple[Entry, ...] = ()
    switch: Switch | None = None

    def value(self, design: Design) -> Any:
        """Return the value of the field in a design."""
        return attrgetter(self.path)(design.limits)
