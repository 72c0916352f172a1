"""Numbers as text, in which rounding errors read 0 and no zero has a minus sign.

Whether a value is a rounding error follows from the size of the numbers from which it was
computed: a design may have any unit, so no length is small in itself. Files and the command line
have ASCII text, see `format_ascii`; pages and reports have `format_number`,
`format_decimals`, `format_fitted` and `format_column`.

The `size` of a number is the magnitude of those from which it was computed; 0 keeps every number.
`digits` are significant ones, `decimals` those after the point, and `infinite` is the word for
infinity. For people "–" stands for what is not a number, thousands are separated by commas, and a
number that rounds to zero has no sign.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import NamedTuple

# Powers of ten from which on, and below which, a number for people is written without one.
LEAST_POWER, MOST_POWER = -4, 9
POWERS = {1: "", 2: "²", 3: "³"}
"""Signs of powers of units."""
_SUPERSCRIPTS = str.maketrans("0123456789-", "⁰¹²³⁴⁵⁶⁷⁸⁹⁻")
# Sizes from which on, and below which, a number fitted to its size is written without one.
LEAST_SIZE, MOST_SIZE = 1e-3, 1e7
# Digits that tell any two numbers apart.
MOST_DIGITS = 17
# Share of its size up to which a number is a rounding error.
ROUNDING = 1e-12


class Unit(NamedTuple):
    """A unit in which values are written for people.

    Attributes:
        name: Its name, such as "mm"; "" for a plain number.
        factor: Number in this unit of a value of 1: of one design unit, or of a power of it.
    """

    name: str
    factor: float = 1.0

    def convert(self, value: float) -> float:
        """Return a value in this unit, given one in design units.

        It has fifteen significant digits, so that a text such as 0.7 mm is read as it was written.
        """
        return value if self.factor == 1.0 else float(f"{value * self.factor:.15g}")

    def read(self, value: float) -> float:
        """Return a value in design units, of fifteen digits too, given one in this unit."""
        return value if self.factor == 1.0 else float(f"{value / self.factor:.15g}")

    def text(self, value: float, digits: int = 4, *, size: float = 0.0) -> str:
        """Return a value for people, given in design units as its size is."""
        return f"{self.number(value, digits, size=size)} {self.name}".rstrip()

    def head(self, words: str) -> str:
        """Return the head of a column or an axis of values in this unit, such as "l1 [mm]"."""
        return f"{words} [{self.name}]" if self.name else words

    def number(self, value: float, digits: int = 4, *, size: float = 0.0) -> str:
        """Return the number of `text` alone."""
        return format_number(value * self.factor, digits, size=size * self.factor)

    def to_power(self, power: int, size: float = 0.0) -> Unit:
        """Return the unit of a power of length; in place of mm³, cm³ for volumes of 1 cm³ or more.

        Args:
            power: Exponent of length, 1 to 3.
            size: Magnitude of the volumes in design units.
        """
        if power == 1:
            return self
        cubic = (0.1 * self.factor) ** 3
        if power == 3 and self.name == "mm" and size * cubic >= 1.0:
            return Unit("cm³", cubic)
        return Unit(f"{self.name}{POWERS[power]}", self.factor**power)


UNITS = Unit("units")
"""The design unit itself."""


def drop_rounding(value: float, size: float) -> float:
    """Return a number, or 0 if it is a rounding error; never −0."""
    return 0.0 if abs(value) <= ROUNDING * size else value


def snap_to_decimals(value: float, decimals: int, size: float) -> float:
    """Return a number, or the one of so many decimals from which rounding errors alone part it."""
    rounded = round(value, decimals)
    return rounded + drop_rounding(value - rounded, size)


def format_ascii(value: float, digits: int, *, size: float = 0.0, padded: bool = False) -> str:
    """Return a number with at most `digits` significant digits and an ASCII minus sign.

    The text has a power of ten where that is below −4 or not below `digits`, as in Python's
    format "g": 0.0001, 1e-05, and 1.235e+05 to four digits. Trailing zeros stay if `padded`.
    """
    return f"{drop_rounding(value, size):{'#' if padded else ''}.{digits}g}"


def format_apart(
    values: Sequence[float], digits: int = 6, write: Callable[[float, int], str] = format_ascii
) -> list[str]:
    """Return numbers with so many digits, or with as many more as make unequal ones differ.

    A message that a value exceeds a limit shows both. `write` formats a number to some digits.
    """
    texts: list[str] = []
    for count in range(digits, MOST_DIGITS + 1):
        texts = [write(value, count) for value in values]
        if len({*texts}) == len({*values}):
            break
    return texts


def set_true_minus(text: str) -> str:
    """Return text with a minus sign (U+2212) in place of each hyphen."""
    return text.replace("-", "−")


def format_number(
    value: float, digits: int = 4, *, size: float = 0.0, infinite: str = "infinite"
) -> str:
    """Return a number for people, with at least `digits` significant digits; all of a whole one.

    Trailing zeros are left out, and only a number that is tiny or huge has a power of ten: 0.0001,
    12,346, and 1.235 × 10⁻⁵ to four digits.
    """
    value = drop_rounding(value, size)
    if not math.isfinite(value):
        return format_decimals(value, 0, infinite=infinite)
    mantissa, _, exponent = f"{value:.{digits - 1}e}".partition("e")
    power = int(exponent)
    if value != 0.0 and not LEAST_POWER <= power < MOST_POWER:
        return set_true_minus(f"{_without_zeros(mantissa)} × {power_of_ten(power)}")
    return _without_zeros(format_decimals(value, max(0, digits - 1 - power)))


def format_decimals(
    value: float, decimals: int, *, signed: bool = False, infinite: str = "infinite"
) -> str:
    """Return a number for people with a fixed number of decimals, and a plus sign if `signed`."""
    if math.isnan(value):
        return "–"
    if math.isinf(value):
        return infinite if value > 0.0 else f"−{infinite}"
    text = f"{value:z,.{decimals}f}"
    plus = "+" if signed and value > 0.0 and text.strip("0.,") else ""
    return plus + set_true_minus(text)


def format_column(
    values: Sequence[float], digits: int = 4, *, size: float = 0.0, infinite: str = "infinite"
) -> list[str]:
    """Return numbers for people with equal decimals, which give the largest so many digits."""
    finite = [abs(value) for value in values if math.isfinite(value)]
    largest = max(finite, default=0.0)
    if largest > 0.0 and not 10.0**LEAST_POWER <= largest < 10.0**MOST_POWER:
        return [format_number(value, digits, size=size, infinite=infinite) for value in values]
    decimals = decimals_for(largest, digits)
    return [
        format_decimals(drop_rounding(value, size), decimals, infinite=infinite) for value in values
    ]


def format_fitted(value: float, size: float, digits: int, *, infinite: str = "infinite") -> str:
    """Return a number whose decimals depend on a size alone and do not change with the number.

    The size is that of the largest number expected, which has so many digits. A number that would
    look like 0, though it is none, has digits of its own.
    """
    value = drop_rounding(value, size)
    decimals = decimals_for(size, digits)
    is_zero = abs(value) < 0.5 * 10.0**-decimals
    if (size != 0.0 and not LEAST_SIZE <= size < MOST_SIZE) or (value != 0.0 and is_zero):
        return format_number(value, min(digits, 3) if is_zero else digits, infinite=infinite)
    return format_decimals(value, decimals, infinite=infinite)


def decimals_for(size: float, digits: int) -> int:
    """Return the decimals that give a number of a size so many digits."""
    return max(0, digits - 1 - math.floor(math.log10(size))) if size > 0.0 else digits - 1


def power_of_ten(exponent: int) -> str:
    """Return a power of ten, such as 10⁻³."""
    return f"10{str(exponent).translate(_SUPERSCRIPTS)}"


def _without_zeros(text: str) -> str:
    """Return the text of a number without zeros at the end of its decimals."""
    return text.rstrip("0").rstrip(".") if "." in text else text
