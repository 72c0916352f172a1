"""Parsers of option values for tyro, whose messages name the expected values, and their hints."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterable, Mapping
from typing import Annotated, Any, TypeAlias

import tyro
from tyro.constructors import PrimitiveConstructorSpec

from explorer.cli.parsing import UsageError
from explorer.numerics.checks import LEAST, MOST, STIFFEST, size_problem

_COUNTS = {2: "two", 3: "three", 4: "four", 6: "six", 7: "seven"}

Numbers = tuple[float, ...]
Flag: TypeAlias = Annotated[bool, tyro.conf.FlagCreatePairsOff]
"""An option without a value, and without an opposite."""


def hint(words: str, metavar: str | None = None) -> Any:
    """Return the marker of an option whose help has these words in place of the default.

    Args:
        words: Hint; the help puts it in parentheses.
        metavar: Name of the value in the help; that of the parser if None.
    """
    return tyro.conf.arg(metavar=metavar, help_behavior_hint=f"({words})")


OPTIONAL = hint("optional")
OF_DESIGN, OF_HOME = hint("default: as in the design"), hint("default: as in the home pose")
FILE = hint("optional", "FILE")
DESIGN_NAME = "PRESET_OR_FILE"


def _parser(
    metavar: str,
    read: Callable[[list[str]], Any],
    write: Callable[[Any], Iterable[object]] = lambda value: [value],
    *,
    many: bool = False,
) -> PrimitiveConstructorSpec[Any]:
    """Return the parser of an option; a parser of many words must take any number of them."""
    return PrimitiveConstructorSpec(
        nargs="*" if many else 1,
        metavar=metavar,
        instance_from_str=read,
        is_instance=lambda value: value is None or isinstance(value, tuple | float | int),
        str_from_instance=lambda value: [str(word) for word in write(value)],
    )


def numbers(option: str, order: str, *, or_one: bool = False) -> PrimitiveConstructorSpec[Any]:
    """Return the parser of an option with one finite number per name.

    Args:
        option: Option, such as ``--joints``.
        order: Names of the numbers in their order, separated by spaces.
        or_one: Whether a single number may stand for all of them.
    """
    names = order.split()

    def read(words: list[str]) -> Numbers:
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
            if problem := size_problem(value, most=STIFFEST):
                raise UsageError(f"{option}: {name} {problem}")
        return tuple(values)

    return _parser(order.upper(), read, lambda value: value or (), many=True)


def numbers_or_none(option: str, order: str) -> PrimitiveConstructorSpec[Any]:
    """Return the parser of an option with one number per name, or the word none, which gives ()."""
    all_numbers = numbers(option, order)

    def read(words: list[str]) -> Numbers:
        return () if words == ["none"] else all_numbers.instance_from_str(words)

    metavar = f"{order.upper()} | none"
    return _parser(metavar, read, lambda value: ["none"] if value == () else value or (), many=True)


def _numbers_in_orders(
    option: str, orders: Mapping[int, str], metavar: str, needs: str, length: int = 0
) -> PrimitiveConstructorSpec[Any]:
    """Return the parser of an option whose numbers have one of some orders, by their count.

    Zeros fill what is missing of a length.
    """

    def read(words: list[str]) -> Numbers:
        if len(words) not in orders:
            raise UsageError(f"{option} needs {needs}; got {len(words)} numbers")
        values = numbers(option, orders[len(words)]).instance_from_str(words)
        return (*values, *(0.0,) * (length - len(values)))

    return _parser(metavar, read, lambda value: value or (), many=True)


def pose_numbers(option: str) -> PrimitiveConstructorSpec[Any]:
    """Return the parser of an option with a position and, optionally, an orientation.

    Three numbers are a position; six add yaw, pitch and roll, seven a quaternion.
    """
    orders = {3: "x y z", 6: "x y z yaw pitch roll", 7: "x y z qw qx qy qz"}
    needs = "a position x y z, and may go on with yaw pitch roll or with a quaternion w x y z"
    return _numbers_in_orders(option, orders, "X Y Z [...]", needs)


def load_numbers(option: str) -> PrimitiveConstructorSpec[Any]:
    """Return the parser of an option with a force and, optionally, a moment.

    Three numbers are a force without a moment; the value always has six.
    """
    orders = {3: "fx fy fz", 6: "fx fy fz mx my mz"}
    needs = "a force fx fy fz, and may go on with a moment mx my mz"
    return _numbers_in_orders(option, orders, "FX FY FZ [MX MY MZ]", needs, 6)


def fold_numbers(option: str) -> PrimitiveConstructorSpec[Any]:
    """Return the parser of an option with the folds of a pose, angles in degrees.

    r must not be negative, beta and epsilon must lie within 0° to 180°, phi1, phi2 and phi3 within
    ±180°.
    """
    order = "r beta epsilon phi1 phi2 phi3"

    def read(words: list[str]) -> Numbers:
        values = numbers(option, order).instance_from_str(words)
        if values[0] < 0.0:
            raise UsageError(f"{option}: r is a distance, 0 or more; got {values[0]!r}")
        lows = 0.0, 0.0, -180.0, -180.0, -180.0
        for name, value, low in zip(order.split()[1:], values[1:], lows, strict=True):
            if not low <= value <= 180.0:
                raise UsageError(
                    f"{option}: {name} must lie within {low:g}° to 180°; got {value!r}°"
                )
        return values

    return _parser(order.upper(), read, lambda value: value or (), many=True)


def texts(option: str, metavar: str) -> PrimitiveConstructorSpec[Any]:
    """Return the parser of an option with one word or more."""

    def read(words: list[str]) -> tuple[str, ...]:
        if not words:
            raise UsageError(f"{option} needs at least one value, such as {metavar}")
        return tuple(words)

    return _parser(metavar, read, list, many=True)


def finite_number(option: str) -> PrimitiveConstructorSpec[Any]:
    """Return the parser of an option with one finite number."""

    def read(words: list[str]) -> float:
        value = _number(option, words[0])
        if not math.isfinite(value):
            raise UsageError(f"{option} must be a finite number; got {words[0]}")
        return value

    return _parser("NUMBER", read)


def positive(option: str, power: int = 1) -> PrimitiveConstructorSpec[Any]:
    """Return the parser of an option with one finite number above zero.

    Args:
        option: The option.
        power: Exponent of length in its unit; 3 for a volume.
    """

    def read(words: list[str]) -> float:
        value = _number(option, words[0])
        if not value > 0.0:
            raise UsageError(f"{option} must be a positive number; got {words[0]}")
        if problem := size_problem(value, LEAST**power, MOST**power):
            raise UsageError(f"{option} {problem}")
        return value

    return _parser("NUMBER", read)


def not_negative(option: str) -> PrimitiveConstructorSpec[Any]:
    """Return the parser of an option with one finite number of at least zero."""

    def read(words: list[str]) -> float:
        value = _number(option, words[0])
        if not value >= 0.0:
            raise UsageError(f"{option} must be a number of at least 0; got {words[0]}")
        if problem := size_problem(value):
            raise UsageError(f"{option} {problem}")
        return value

    return _parser("NUMBER", read)


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

    return _parser("N", read)


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

    return _parser("WIDTHxHEIGHT", read, lambda value: ["x".join(map(str, value))])


def _number(option: str, word: str) -> float:
    try:
        return float(word)
    except ValueError:
        advice = "; separate numbers by blanks" if "," in word else ""
        raise UsageError(f"{option}: {word!r} is not a number{advice}") from None
