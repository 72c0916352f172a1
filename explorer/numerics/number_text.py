"""Numbers as text, in which rounding errors read 0 and no zero has a minus sign.

Whether a value is a rounding error follows from the size of the numbers from which it was
computed: a design may have any unit, so no length is small in itself.
"""

from __future__ import annotations

# Share of its size up to which a number is a rounding error.
ROUNDING = 1e-12


def drop_rounding(value: float, size: float) -> float:
    """Return a number, or 0 if it is a rounding error; never −0.

    Args:
        value: The number.
        size: Magnitude of the numbers from which it was computed; 0 keeps every number.
    """
    return 0.0 if abs(value) <= ROUNDING * size else value


def format_ascii(value: float, digits: int, *, size: float = 0.0, padded: bool = False) -> str:
    """Return a number with at most `digits` significant digits and an ASCII minus sign.

    The text has a power of ten where that is below −4 or not below `digits`, as in Python's
    format "g": 0.0001, 1e-05, and 1.235e+05 to four digits.

    Args:
        value: The number.
        digits: Number of significant digits.
        size: Magnitude of the numbers from which it was computed, see `drop_rounding`.
        padded: Whether trailing zeros stay.
    """
    return f"{drop_rounding(value, size):{'#' if padded else ''}.{digits}g}"


def format_fixed(value: float, decimals: int) -> str:
    """Return a number with a fixed number of decimals; one that rounds to zero has no sign."""
    return f"{value:z.{decimals}f}"


def set_true_minus(text: str) -> str:
    """Return text with a minus sign (U+2212) in place of each hyphen."""
    return text.replace("-", "−")


def format_number(value: float, digits: int = 4, *, size: float = 0.0) -> str:
    """Return the text of `format_ascii` with true minus signs (U+2212)."""
    return set_true_minus(format_ascii(value, digits, size=size))
