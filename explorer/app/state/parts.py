"""Parts of the state: values by path, and what a file and another design leave of each.

A path is such as "view.singular.ball" or "view.tetrahedra.0". Each field of the state, and of its
parts, declares as its metadata what becomes of it when the state is saved, when another design is
opened, and when the design unit changes. A field that declares nothing is saved, is that of a new
state once another design is opened, and keeps its numbers in another unit.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import Field, fields, is_dataclass, replace
from typing import Any, Self, TypeVar, cast

import msgspec

from explorer.mechanism.pose import Pose
from explorer.numerics.number_text import Unit

TRANSIENT: Mapping[str, Any] = {"is_saved": False}
"""Metadata of a field that no file holds: it describes work under way, or is computed again."""


def _identity(value: Any) -> Any:
    return value


STAYS: Mapping[str, Any] = {"on_open": _identity}
"""Metadata of a field that keeps its value when another design is opened.

Another function as `on_open` takes the value and returns what stays of it.
"""

LENGTHS: Mapping[str, Any] = {"power": 1}
"""Metadata of a field with lengths, or with a part whose fields declare some.

Users have asked for them in the unit that the page shows. They keep their values in it when the
design unit changes, see `in_unit`.
"""

VOLUME: Mapping[str, Any] = {"power": 3}
"""Metadata of a field with a volume, likewise."""


class FeaturePart:
    """A part of the state whose class stands in the folder of a feature.

    The state knows a base that inherits from this class, with what others need of the part. The
    feature's own class, a frozen dataclass, inherits from that base.
    """

    def __init_subclass__(cls) -> None:
        """Register the class of a feature."""
        (base,) = cls.__bases__
        if base is not FeaturePart:
            FEATURE_PARTS[base] = cls

    @classmethod
    def new(cls) -> Self:
        """Return the part of a new state; the base itself where the feature is not loaded."""
        return cast("Self", FEATURE_PARTS.get(cls, cls)())

    @classmethod
    def of(cls, state: object) -> Self:
        """Return this part of a state."""
        return next(part for part in vars(state).values() if isinstance(part, cls))


FEATURE_PARTS: dict[type[FeaturePart], type[FeaturePart]] = {}
"""The classes of the features by the bases that the state knows."""


def saved_fields(kind: Any) -> tuple[Field[Any], ...]:
    """Return the fields of a dataclass that a file holds."""
    return tuple(field for field in fields(kind) if field.metadata.get("is_saved", True))


Whole = TypeVar("Whole")


def parts_kept_on_open(state: Any) -> dict[str, Any]:
    """Return what stays of a state when another design is opened, by field."""
    return {
        field.name: field.metadata["on_open"](getattr(state, field.name))
        for field in fields(state)
        if "on_open" in cast("Mapping[str, Any]", field.metadata)
    }


def in_unit(part: Whole, before: Unit, after: Unit, power: int = 1) -> Whole:
    """Return a part of the state with its lengths, which were in design units, in others.

    Args:
        part: A part whose fields declare lengths, a pose, or a length itself or several.
        before: Unit of the page while design units were those of the part.
        after: The same unit of the page with the new design units.
        power: Exponent of length of a number.
    """
    value: Any = part
    if before.factor == after.factor:
        return part
    if is_dataclass(value):
        changes = {
            field.name: in_unit(getattr(value, field.name), before, after, field.metadata["power"])
            for field in fields(value)
            if "power" in field.metadata
        }
        return cast("Whole", replace(cast("Any", value), **changes))
    if isinstance(value, Pose):
        position = in_unit(value.position, before, after)
        return cast("Whole", Pose(position, value.quaternion))
    if isinstance(value, tuple):
        entries = cast("tuple[object, ...]", value)
        return cast("Whole", tuple(in_unit(entry, before, after, power) for entry in entries))
    if isinstance(value, float):
        return cast("Whole", after.to_power(power).read(before.to_power(power).convert(value)))
    return part


def value_at(whole: object, path: str) -> Any:
    """Return the value at a path: names of fields and indices of tuples, joined by dots.

    Raises:
        AttributeError: The path names a field that is not there.
    """
    value: Any = whole
    for name in path.split("."):
        value = value[int(name)] if name.isdecimal() else getattr(value, name)
    return value


def with_value(whole: Whole, path: str, value: object) -> Whole:
    """Return a frozen value with another value at a path; the rest of it stays.

    Raises:
        InputError: A part refuses the value.
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


def take_back(before: Whole, after: Whole, now: Whole) -> Whole:
    """Return a frozen value without a change that led from one value to another.

    Each part that has the value which the change gave it has the one before the change again; what
    was changed since stays.

    Raises:
        InputError: A part refuses the value.
    """
    if now == after:
        return before
    if not _names_of(before) == _names_of(after) == _names_of(now):
        return now
    for name in _names_of(now):
        old, new = value_at(before, name), value_at(after, name)
        if old != new:
            now = with_value(now, name, take_back(old, new, value_at(now, name)))
    return now


def _names_of(value: Any) -> tuple[str, ...]:
    """Return the names of the parts of a value in a path; none of a plain one."""
    if isinstance(value, tuple):
        return tuple(map(str, range(len(cast("tuple[object, ...]", value)))))
    if isinstance(value, msgspec.Struct):
        return value.__struct_fields__
    return tuple(field.name for field in fields(value)) if is_dataclass(value) else ()
