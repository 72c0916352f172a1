"""Numbers as people read them: rounding errors read 0, and no zero has a minus sign.

Every panel, label and command writes its numbers through this module. What is rounding is told
by the size of the numbers that a value comes from: designs may have any unit, so that no length
is small in itself.
"""

from __future__ import annotations

# The share of its size below which a number is rounding.
ROUNDING = 1e-12


def settled(value: float, size: float) -> float:
    """Return a number, or 0 where it is rounding; never −0.

    Args:
        value: The number.
        size: The size of the numbers that it comes from; 0 to keep however small a number.
    """
    return 0.0 if abs(value) <= ROUNDING * size else value


def significant(value: float, digits: int, *, size: float = 0.0, padded: bool = False) -> str:
    """Return a number with significant digits in the shorter of both notations.

    Args:
        value: The number.
        digits: How many at most.
        size: As in `settled`.
        padded: Whether zeros at the end stay.
    """
    return f"{settled(value, size):{'#' if padded else ''}.{digits}g}"


def fixed(value: float, decimals: int) -> str:
    """Return a number with a fixed number of decimals; what rounds to zero has no sign."""
    return f"{value:z.{decimals}f}"


def with_true_minus(text: str) -> str:
    """Return text with a minus sign in the place of each hyphen."""
    return text.replace("-", "−")


def scientific(value: float, digits: int = 4, *, size: float = 0.0) -> str:
    """Return a number as `significant` does, with a true minus sign."""
    return with_true_minus(significant(value, digits, size=size))
