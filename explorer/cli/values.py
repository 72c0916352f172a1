"""Parsers of option values for tyro, with messages that name the expected values."""

from __future__ import annotations

import math
import re
from typing import Any

from tyro.constructors import PrimitiveConstructorSpec

from explorer.cli.usage import UsageError
from explorer.mechanism.design import LARGEST_SIZE

_COUNTS = {2: "two", 3: "three", 4: "four", 6: "six", 7: "seven"}


def numbers(option: str, order: str, *, or_one: bool = False) -> PrimitiveConstructorSpec[Any]:
    """Return the parser of an option with one finite number per name.

    Args:
        option: Option, such as ``--joints``.
        order: Names of the numbers in their order, separated by spaces.
        or_one: Whether a single number may stand for all of them.
    """
    names = order.split()

    def read(words: list[str]) -> tuple[float, ...]:
        values = [_number(option, word) for word in words]
        if or_one and len(values) == 1:
            values *= len(names)
        if len(values) != len(names):
            alternative = ", or one for all" if or_one else ""
            raise UsageError(
                f"{option} needs {_COUNTS[len(names)]} numbers in the order {order}"
                f"{alternative}; got {len(values)}"
            )
        for name, value in zip(names, values, strict=True):
            if not math.isfinite(value):
                raise UsageError(f"{option}: {name} must be a finite number; got {value}")
            if abs(value) > LARGEST_SIZE:
                raise UsageError(
                    f"{option}: {name} must lie within ±{LARGEST_SIZE:g}; got {value:g}"
                )
        return tuple(values)

    return PrimitiveConstructorSpec(
        nargs="*",
        metavar=order.upper(),
        instance_from_str=read,
        is_instance=lambda value: value is None or isinstance(value, tuple),
        str_from_instance=lambda value: [str(entry) for entry in value or ()],
    )


def numbers_or_none(option: str, order: str) -> PrimitiveConstructorSpec[Any]:
    """Return the parser of an option with one number per name, or the word none, which gives ()."""
    all_numbers = numbers(option, order)

    def read(words: list[str]) -> tuple[float, ...]:
        return () if words == ["none"] else all_numbers.instance_from_str(words)

    return PrimitiveConstructorSpec(
        nargs="*",
        metavar=f"{order.upper()} | none",
        instance_from_str=read,
        is_instance=all_numbers.is_instance,
        str_from_instance=lambda value: (
            ["none"] if value == () else all_numbers.str_from_instance(value)
        ),
    )


def pose_numbers(option: str) -> PrimitiveConstructorSpec[Any]:
    """Return the parser of an option with a position and, optionally, an orientation.

    Three numbers are a position; six add yaw, pitch and roll, seven a quaternion.
    """
    orders = {
        count: numbers(option, order).instance_from_str
        for count, order in (
            (3, "x y z"),
            (6, "x y z yaw pitch roll"),
            (7, "x y z qw qx qy qz"),
        )
    }

    def read(words: list[str]) -> tuple[float, ...]:
        if len(words) not in orders:
            raise UsageError(
                f"{option} needs a position x y z, and may go on with yaw pitch roll or with a "
                f"quaternion w x y z; got {len(words)} numbers"
            )
        return orders[len(words)](words)

    return PrimitiveConstructorSpec(
        nargs="*",
        metavar="X Y Z [...]",
        instance_from_str=read,
        is_instance=lambda value: value is None or isinstance(value, tuple),
        str_from_instance=lambda value: [str(each) for each in value or ()],
    )


def positive(option: str) -> PrimitiveConstructorSpec[Any]:
    """Return the parser of an option with one finite number above zero."""

    def read(words: list[str]) -> float:
        value = _number(option, words[0])
        if not (math.isfinite(value) and value > 0.0):
            raise UsageError(f"{option} must be a positive number; got {words[0]}")
        return value

    return PrimitiveConstructorSpec(
        nargs=1,
        metavar="NUMBER",
        instance_from_str=read,
        is_instance=lambda value: value is None or isinstance(value, float),
        str_from_instance=lambda value: [str(value)],
    )


def whole_number(option: str, low: int, high: int) -> PrimitiveConstructorSpec[Any]:
    """Return the parser of an option with a whole number from low to high."""

    def read(words: list[str]) -> int:
        try:
            value = int(words[0])
        except ValueError:
            raise UsageError(f"{option} must be a whole number; got {words[0]!r}") from None
        if not low <= value <= high:
            raise UsageError(f"{option} must lie within {low} to {high}; got {value}")
        return value

    return PrimitiveConstructorSpec(
        nargs=1,
        metavar="N",
        instance_from_str=read,
        is_instance=lambda value: value is None or isinstance(value, int),
        str_from_instance=lambda value: [str(value)],
    )


def pixels(option: str, low: int, high: int) -> PrimitiveConstructorSpec[Any]:
    """Return the parser of an option with a size in pixels, such as 1280x800."""

    def read(words: list[str]) -> tuple[int, int]:
        match = re.fullmatch(r"([0-9]{1,9})[xX×]([0-9]{1,9})", words[0])
        if match is None:
            raise UsageError(
                f"{option} must be WIDTHxHEIGHT in pixels, such as 1280x800; got {words[0]!r}"
            )
        width, height = int(match[1]), int(match[2])
        for name, value in (("width", width), ("height", height)):
            if not low <= value <= high:
                raise UsageError(
                    f"{option}: the {name} must lie within {low} to {high} pixels; got {value}"
                )
        return width, height

    return PrimitiveConstructorSpec(
        nargs=1,
        metavar="WIDTHxHEIGHT",
        instance_from_str=read,
        is_instance=lambda value: isinstance(value, tuple),
        str_from_instance=lambda value: ["x".join(map(str, value))],
    )


def _number(option: str, word: str) -> float:
    try:
        return float(word)
    except ValueError:
        hint = "; separate numbers by blanks" if "," in word else ""
        raise UsageError(f"{option}: {word!r} is not a number{hint}") from None
