"""Checks of the values in a design.

Every function raises `DesignError` with one line: the field, what it must be, and the value.
"""

from __future__ import annotations

import math
import operator
from collections.abc import Mapping, Sequence, Set
from typing import Any, SupportsIndex, cast

from explorer.errors import DesignError

# The Jacobian's determinant is a product of seven numbers, which must not overflow.
LARGEST_NUMBER = 1e40
SMALLEST_POSITIVE = 1e-40

# Types that Python converts to a number or a sequence although no caller means one.
_NOT_A_NUMBER = (str, bytes, bytearray, bool)
_NOT_A_SEQUENCE = (str, bytes, bytearray, Set, Mapping)


def number(name: str, value: object) -> float:
    """Return the value as a finite float of at most `LARGEST_NUMBER` in magnitude."""
    try:
        checked = None if isinstance(value, _NOT_A_NUMBER) else float(cast("Any", value))
    except (TypeError, ValueError, OverflowError):
        checked = None
    if checked is None:
        raise DesignError(f"{name} must be a number; got {_short_repr(value)}", name)
    if not math.isfinite(checked):
        raise DesignError(f"{name} must be a finite number; got {checked}", name)
    if abs(checked) > LARGEST_NUMBER:
        raise DesignError(
            f"{name} must not exceed {LARGEST_NUMBER:g} in magnitude; got {checked:g}", name
        )
    return checked


def not_negative(name: str, value: object) -> float:
    """Return the value as a finite float of at least zero."""
    checked = number(name, value)
    if checked < 0.0:
        raise DesignError(f"{name} must not be negative; got {checked:g}", name)
    return checked


def positive(name: str, value: object) -> float:
    """Return the value as a finite float above zero, of at least `SMALLEST_POSITIVE`."""
    checked = number(name, value)
    if checked <= 0.0:
        raise DesignError(f"{name} must be positive; got {checked:g}", name)
    if checked < SMALLEST_POSITIVE:
        raise DesignError(f"{name} must be at least {SMALLEST_POSITIVE:g}; got {checked:g}", name)
    return checked


def ordered(name: str, low: object, high: object) -> tuple[float, float]:
    """Return both values as floats, the first not above the second."""
    first, second = number(f"{name} low", low), number(f"{name} high", high)
    if first > second:
        raise DesignError(f"{name}: the low end {first:g} exceeds the high end {second:g}", name)
    return first, second


def two(name: str, value: Any) -> tuple[Any, Any]:
    """Return the two entries of the value."""
    entries = _entries(value)
    if len(entries) != 2:
        raise DesignError(f"{name} must be two values; got {_short_repr(value)}", name)
    return entries[0], entries[1]


def numbers(name: str, value: Any, count: int) -> list[float]:
    """Return the entries of the value, `count` finite floats."""
    entries = _entries(value)
    if len(entries) != count:
        raise DesignError(f"{name} must be {count} numbers; got {_short_repr(value)}", name)
    return [number(name, entry) for entry in entries]


def whole(name: str, value: object, low: int, high: int) -> int:
    """Return the value as a plain integer from `low` to `high`."""
    if isinstance(value, bool) or not isinstance(value, SupportsIndex):
        raise DesignError(f"{name} must be a whole number; got {_short_repr(value)}", name)
    checked = operator.index(value)
    if not low <= checked <= high:
        raise DesignError(f"{name} must lie within {low} to {high}; got {checked}", name)
    return checked


def one_of(name: str, value: object, allowed: Sequence[str]) -> str:
    """Return the value as the plain string that it equals, one of the allowed words."""
    if not isinstance(value, str) or value not in allowed:
        words = " or ".join(f'"{word}"' for word in allowed)
        raise DesignError(f"{name} must be {words}; got {_short_repr(value)}", name)
    return str(value)


def instance(name: str, value: object, *kinds: type) -> None:
    """Check that a value is of one of the types; a file's decoder checks them itself."""
    if not isinstance(value, kinds):
        names = " or ".join(kind.__name__ for kind in kinds)
        raise DesignError(f"{name} must be of type {names}; got {_short_repr(value)}", name)


def _entries(value: Any) -> list[Any]:
    if isinstance(value, _NOT_A_SEQUENCE):
        return []
    try:
        return list(value)
    except TypeError:
        return []


def _short_repr(value: object) -> str:
    """Return the value's representation on one line of at most 80 characters."""
    try:
        text = " ".join(repr(value).split())
    except ValueError:
        # Python refuses to print integers of thousands of digits.
        text = f"a huge {type(value).__name__}"
    return text if len(text) <= 80 else f"{text[:77]}..."
