"""Checks of the values in a design, and the bounds of all sizes that a user gives.

Every function that checks a value raises `DesignError` with one line: the field, what it must be,
and the value. A length, mass, force, moment or stress is at most `MOST` in its unit, and one that
must be positive at least `LEAST`; a stiffness is at most `STIFFEST`. The size of a design is the
largest of its variables. What may be zero may also be as small as the rounding errors of what
computed it.
"""

from __future__ import annotations

import math
import operator
import unicodedata
from collections.abc import Mapping, Sequence, Set
from typing import Any, SupportsIndex, cast

from explorer.errors import DesignError
from explorer.numerics.number_text import format_apart

LEAST, MOST = 1e-7, 1e6
"""Bounds of the size of a number that a user gives, in its unit."""

FARTHEST = 1e100
"""Largest coordinate of a position and largest joint, of which powers are numbers still: a
computation, such as that of the nearest singular pose, finds some far beyond what a user gives."""

STIFFEST = 1e12
"""Largest stiffness in N/mm: one rigid actuator among springs is stated by a large number."""

LONGEST_NAME = 100
"""Largest number of characters of the name of a design or a study."""

# Types that Python converts to a number or a sequence although no caller means one.
_NOT_A_NUMBER = (str, bytes, bytearray, bool)
_NOT_A_SEQUENCE = (str, bytes, bytearray, Set, Mapping)


def size_problem(value: float, least: float = 0.0, most: float = MOST) -> str:
    """Return the fault in the size of a number, to follow its name; "" if nothing is.

    It must be finite, at most the largest size and, unless it is zero, at least the least one.
    """
    if not math.isfinite(value):
        return f"must be a finite number; got {value}"
    if abs(value) > most:
        return f"must not exceed {most:g} in size; got {format_apart((value, most), 12)[0]}"
    if 0.0 < abs(value) < least:
        return f"must be at least {least:g} in size; got {format_apart((value, least), 12)[0]}"
    return ""


def number(name: str, value: object, least: float = 0.0, most: float = MOST) -> float:
    """Return the value as a finite float, zero or of a size from `least` to `most`."""
    try:
        checked = None if isinstance(value, _NOT_A_NUMBER) else float(cast("Any", value))
    except (TypeError, ValueError, OverflowError):
        checked = None
    if checked is None:
        raise DesignError(f"{name} must be a number; got {_short_repr(value)}", name)
    if problem := size_problem(checked, least, most):
        raise DesignError(f"{name} {problem}", name)
    return checked


def not_negative(name: str, value: object, most: float = MOST) -> float:
    """Return the value as a float from 0 to `most`."""
    checked = number(name, value, most=most)
    if checked < 0.0:
        raise DesignError(f"{name} must not be negative; got {checked:g}", name)
    return checked


def positive(name: str, value: object, most: float = MOST) -> float:
    """Return the value as a float from `LEAST` to `most`."""
    checked = number(name, value, LEAST, most)
    if checked <= 0.0:
        raise DesignError(f"{name} must be positive; got {checked:g}", name)
    return checked


def ordered_pair(name: str, low: object, high: object) -> tuple[float, float]:
    """Return both values as floats, the first not above the second."""
    first, second = number(f"{name} low", low), number(f"{name} high", high)
    if first > second:
        low, high = format_apart((first, second))
        raise DesignError(f"{name}: the low end {low} exceeds the high end {high}", name)
    return first, second


def two(name: str, value: Any) -> tuple[Any, Any]:
    """Return the two entries of the value."""
    entries = _entries(value)
    if len(entries) != 2:
        raise DesignError(f"{name} must be two values; got {_short_repr(value)}", name)
    return entries[0], entries[1]


def numbers(name: str, value: Any, count: int, most: float = MOST) -> list[float]:
    """Return the entries of the value, `count` finite floats of at most `most` in size."""
    entries = _entries(value)
    if len(entries) != count:
        raise DesignError(f"{name} must be {count} numbers; got {_short_repr(value)}", name)
    return [number(name, entry, most=most) for entry in entries]


def box(name: str, value: Any) -> tuple[tuple[float, float, float], tuple[float, float, float]]:
    """Return the value as lows and highs along x, y and z, no low above its high."""
    lows, highs = (
        numbers(f"{name} {end}", each, 3)
        for end, each in zip(("lows", "highs"), two(name, value), strict=True)
    )
    x, y, z = (
        ordered_pair(f"{name} {axis}", low, high)
        for axis, low, high in zip("xyz", lows, highs, strict=True)
    )
    return (x[0], y[0], z[0]), (x[1], y[1], z[1])


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


def title(name: str, value: object, longest: int = LONGEST_NAME) -> str:
    """Return the value as the name of a design or a study, in the form of `tidy_name`.

    It is one printable line, and not of blanks and points alone: it becomes a part of the names of
    files.
    """
    instance(name, value, str)
    tidy = tidy_name(str(value))
    if not tidy.strip(" .") or len(tidy) > longest or not tidy.isprintable():
        raise DesignError(
            f"{name} must be one printable line of 1 to {longest} characters, and not of "
            f"blanks and points alone; got {_short_repr(value)}",
            name,
        )
    return tidy


def tidy_name(text: str) -> str:
    """Return a name without surrounding space, in normal form, so that equal looks are equal."""
    return unicodedata.normalize("NFC", text).strip()


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
