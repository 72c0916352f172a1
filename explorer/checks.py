"""Checks of the numbers in a design; each failure names the field and what it must be.

All of them raise `DesignError`.
"""

from __future__ import annotations

import math
from typing import Any, cast

from explorer.errors import DesignError


def number(name: str, value: object) -> float:
    """Return the value as a finite float."""
    try:
        checked = float(cast("Any", value))
    except (TypeError, ValueError, OverflowError):
        raise DesignError(f"{name} must be a number; got {value!r}") from None
    if not math.isfinite(checked):
        raise DesignError(f"{name} must be a finite number; got {checked}")
    return checked


def not_negative(name: str, value: object) -> float:
    """Return the value as a finite float of at least zero."""
    checked = number(name, value)
    if checked < 0.0:
        raise DesignError(f"{name} must not be negative; got {checked:g}")
    return checked


def positive(name: str, value: object) -> float:
    """Return the value as a finite float above zero."""
    checked = number(name, value)
    if checked <= 0.0:
        raise DesignError(f"{name} must be positive; got {checked:g}")
    return checked


def ordered(name: str, low: object, high: object) -> tuple[float, float]:
    """Return both values as floats, the first not above the second."""
    first, second = number(f"{name} low", low), number(f"{name} high", high)
    if first > second:
        raise DesignError(f"{name}: the low end {first:g} exceeds the high end {second:g}")
    return first, second


def two(name: str, value: Any) -> tuple[Any, Any]:
    """Return the two entries of the value."""
    try:
        first, second = value
    except (TypeError, ValueError):
        raise DesignError(f"{name} must be two values; got {value!r}") from None
    return first, second


def numbers(name: str, value: Any, count: int) -> list[float]:
    """Return the entries of the value, `count` finite floats."""
    try:
        values = list(value)
    except TypeError:
        values = []
    if len(values) != count:
        raise DesignError(f"{name} must be {count} numbers; got {value!r}")
    return [number(name, entry) for entry in values]
