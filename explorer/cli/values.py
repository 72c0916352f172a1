"""Types of option values for tyro, whose messages name the expected values, and their hints.

A message continues the name of its option, which `explorer.cli.parsing` puts before it.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable
from functools import partial
from typing import Annotated, Any, TypeAlias, cast

import tyro
from tyro.constructors import PrimitiveConstructorSpec

from explorer.errors import ExplorerError
from explorer.mechanism.machine import Six
from explorer.mechanism.pose import Quadruple, Triple
from explorer.numerics.checks import LEAST, MOST, STIFFEST, size_problem


class UsageError(ExplorerError):
    """Invalid arguments of a program or command; the reason is one line.

    The class is no ValueError, so that tyro does not replace its message.
    """

    def __init__(self, reason: str, program: str = "explorer") -> None:
        super().__init__(reason)
        self.program = program


def hint(words: str, metavar: str | None = None) -> Any:
    """Return the marker of an option whose help has these words in place of the default.

    The help puts the words in parentheses; without a metavar, it names the type of the value.
    """
    return tyro.conf.arg(metavar=metavar, help_behavior_hint=f"({words})")


OPTIONAL = hint("optional")
OF_DESIGN, OF_HOME = hint("default: as in the design"), hint("default: as in the home pose")
FILE = hint("optional", "FILE")
DESIGN_NAME = "PRESET_OR_FILE"

_COUNTS = {2: "two", 3: "three", 4: "four", 6: "six"}

Numbers = tuple[float, ...]
Flag: TypeAlias = Annotated[bool, tyro.conf.FlagCreatePairsOff]
"""An option without a value, and without an opposite."""


def _value(
    metavar: str, read: Callable[[list[str]], Any], *, many: bool = False
) -> PrimitiveConstructorSpec[Any]:
    """Return the type of an option with one word, or with any number of them.

    The function that reads the words raises a `UsageError`.
    """

    def write(value: object) -> list[str]:
        words = cast("tuple[object, ...]", value) if isinstance(value, tuple) else (value,)
        return [] if value is None else [*map(str, words)]

    return PrimitiveConstructorSpec(
        nargs="*" if many else 1,
        metavar=metavar,
        instance_from_str=read,
        is_instance=lambda value: value is None or isinstance(value, tuple | float | int),
        str_from_instance=write,
    )


def numbers(
    order: str, *, or_one: bool = False, or_none: bool = False
) -> PrimitiveConstructorSpec[Any]:
    """Return the type of an option with one finite number per name, names separated by spaces.

    If it may, a single number stands for all of them, or the word none, which gives ().
    """

    def read(words: list[str]) -> Numbers:
        return () if or_none and words == ["none"] else _read_numbers(order, words, or_one=or_one)

    return _value(f"{order.upper()} | none" if or_none else order.upper(), read, many=True)


def _read_numbers(order: str, words: list[str], *, or_one: bool = False) -> Numbers:
    names = order.split()
    values = [_read_number(word) for word in words]
    if or_one and len(values) == 1:
        values *= len(names)
    if len(values) != len(names):
        alternative = ", or one for all" if or_one else ""
        raise UsageError(
            f" needs {_COUNTS[len(names)]} numbers in the order {order}{alternative}; "
            f"got {len(values)}"
        )
    for name, value in zip(names, values, strict=True):
        if problem := size_problem(value, most=STIFFEST):
            raise UsageError(f": {name} {problem}")
    return tuple(values)


def _numbers_in_orders(
    orders: tuple[str, ...], metavar: str, needs: str, length: int = 0
) -> PrimitiveConstructorSpec[Any]:
    """Return the type of an option whose numbers have the one of some orders with their count.

    Zeros fill what is missing of a length.
    """

    def read(words: list[str]) -> Numbers:
        order = next((order for order in orders if len(order.split()) == len(words)), None)
        if order is None:
            raise UsageError(f" needs {needs}; got {len(words)} numbers")
        values = _read_numbers(order, words)
        return (*values, *(0.0,) * (length - len(values)))

    return _value(metavar, read, many=True)


def _read_folds(words: list[str]) -> Numbers:
    names = "r beta epsilon phi1 phi2 phi3"
    values = _read_numbers(names, words)
    if values[0] < 0.0:
        raise UsageError(f": r is a distance, 0 or more; got {values[0]!r}")
    lows = 0.0, 0.0, -180.0, -180.0, -180.0
    for name, value, low in zip(names.split()[1:], values[1:], lows, strict=True):
        if not low <= value <= 180.0:
            raise UsageError(f": {name} must lie within {low:g}° to 180°; got {value!r}°")
    return values


def texts(metavar: str) -> PrimitiveConstructorSpec[Any]:
    """Return the type of an option with one word or more."""

    def read(words: list[str]) -> tuple[str, ...]:
        if not words:
            raise UsageError(f" needs at least one value, such as {metavar}")
        return tuple(words)

    return _value(metavar, read, many=True)


def _number(
    words: str, is_allowed: Callable[[float], bool], least: float = 0.0, most: float = math.inf
) -> PrimitiveConstructorSpec[Any]:
    """Return the type of an option with one number of which these words are true."""

    def read(given: list[str]) -> float:
        value = _read_number(given[0])
        if not is_allowed(value):
            raise UsageError(f" must be {words}; got {given[0]}")
        if problem := size_problem(value, least, most):
            raise UsageError(f" {problem}")
        return value

    return _value("NUMBER", read)


def _read_number(word: str) -> float:
    try:
        return float(word)
    except ValueError:
        advice = "; separate numbers by blanks" if "," in word else ""
        raise UsageError(f": {word!r} is not a number{advice}") from None


def whole_number(low: int, high: int) -> PrimitiveConstructorSpec[Any]:
    """Return the type of an option with a whole number from low to high."""

    def read(words: list[str]) -> int:
        try:
            value = int(words[0])
        except ValueError:
            raise UsageError(f" must be a whole number; got {words[0]!r}") from None
        if not low <= value <= high:
            raise UsageError(f" must lie within {low} to {high}; got {value}")
        return value

    return _value("N", read)


def _read_pixels(words: list[str]) -> tuple[int, int]:
    match = re.fullmatch(r"([0-9]{1,9})[xX×]([0-9]{1,9})", words[0])
    if match is None:
        raise UsageError(f" must be WIDTHxHEIGHT in pixels, such as 1280x800; got {words[0]!r}")
    width, height = int(match[1]), int(match[2])
    for name, value in (("width", width), ("height", height)):
        if not 64 <= value <= 8192:
            raise UsageError(f": the {name} must lie within 64 to 8192 pixels; got {value}")
    return width, height


_positive = partial(_number, "a positive number", lambda value: value > 0.0)
POSITIVE = _positive(LEAST, MOST)
Positive = Annotated[float | None, POSITIVE]
PositiveVolume = Annotated[float | None, _positive(LEAST**3, MOST**3)]
NotNegative = Annotated[
    float | None, _number("a number of at least 0", lambda value: value >= 0.0, 0.0, MOST)
]
Finite = Annotated[float | None, _number("a finite number", math.isfinite)]
Pixels = Annotated[tuple[int, int], _value("WIDTHxHEIGHT", _read_pixels)]

Position = Annotated[Triple | None, numbers("x y z")]
Quaternion = Annotated[Quadruple | None, numbers("w x y z")]
YawPitchRoll = Annotated[Triple | None, numbers("yaw pitch roll")]
TiltTorsion = Annotated[Triple | None, numbers("azimuth tilt torsion")]
Folds = Annotated[Six | None, _value("R BETA EPSILON PHI1 PHI2 PHI3", _read_folds, many=True)]
"""Folds of a pose: a distance, 0 or more, then angles in degrees within their ranges."""
PoseNumbers = Annotated[
    Numbers | None,
    _numbers_in_orders(
        ("x y z", "x y z yaw pitch roll", "x y z qw qx qy qz"),
        "X Y Z [...]",
        "a position x y z, and may go on with yaw pitch roll or with a quaternion w x y z",
    ),
]
_PLANE = "nx ny nz distance"
Planes = Annotated[
    Numbers | None,
    _numbers_in_orders(
        (_PLANE, *(" ".join([_PLANE] * k) for k in (2, 3))),
        "NX NY NZ DISTANCE [...]",
        "1 to 3 planes, each by its normal and its distance from a1",
    ),
]
LOAD = _numbers_in_orders(
    ("fx fy fz", "fx fy fz mx my mz"),
    "FX FY FZ [MX MY MZ]",
    "a force fx fy fz, and may go on with a moment mx my mz",
    6,
)
Load = Annotated[Six | None, LOAD]
OfActuators = Annotated[Six | None, numbers("l1 d1 d2 d3 d4 l4", or_one=True)]
CORNERS = "x-low y-low z-low x-high y-high z-high"
Box = Annotated[Six | None, numbers(CORNERS)]
