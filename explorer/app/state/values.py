"""Values of the state by their paths, such as "view.singular.ball" or "view.tetrahedra.0"."""

from __future__ import annotations

from dataclasses import replace
from typing import Any, TypeVar, cast

import msgspec

Whole = TypeVar("Whole")


def value_at(whole: object, path: str) -> Any:
    """Return the value at a path: names of fields and indices of tuples, joined by dots.

    Raises:
        AttributeError: the path names a field that is not there.
    """
    value: Any = whole
    for name in path.split("."):
        value = value[int(name)] if name.isdecimal() else getattr(value, name)
    return value


def with_value(whole: Whole, path: str, value: object) -> Whole:
    """Return a frozen value with another value at a path; the rest of it stays.

    Raises:
        InputError: a part refuses the value.
    """
    name, _, rest = path.partition(".")
    new: Any = with_value(value_at(whole, name), rest, value) if rest else value
    part: Any = whole
    if isinstance(part, tuple):
        values = cast("tuple[object, ...]", part)
        index = int(name)
        return cast("Whole", (*values[:index], new, *values[index + 1 :]))
    if isinstance(part, msgspec.Struct):
        return cast("Whole", msgspec.structs.replace(part, **{name: new}))
    return replace(part, **{name: new})
