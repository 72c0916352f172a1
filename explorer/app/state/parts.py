"""Parts of the state: values by path, and what a file and another design leave of each.

A path is such as "view.singular.ball", "view.tetrahedra.0" or, for a value of a feature's part,
"studies.plan.count". Each field of the state, and of its parts, declares as its metadata what
becomes of it when the state is saved, when another design is opened, and when the design unit
changes. A field that declares nothing is saved, is that of a new state once another design is
opened, and keeps its numbers in another unit.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import Field, fields, is_dataclass, replace
from typing import Any, ClassVar, Self, TypeVar, cast

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
    """A feature's part of the state, a frozen dataclass in the folder of the feature.

    Its class names it, as in `class Studies(FeaturePart, name="studies")`. Every new state has a
    new one of each. What the state asks of a part, a part answers by what it overrides.
    """

    in_state: ClassVar[str]

    def __init_subclass__(cls, name: str) -> None:
        """Add the class to `FEATURE_PARTS`."""
        FEATURE_PARTS[name] = cls
        cls.in_state = name

    @classmethod
    def of(cls, state: Any) -> Self:
        """Return this part of a state."""
        return state.parts[cls.in_state]

    @property
    def busy(self) -> str:
        """Why the design cannot be changed now, as a clause; "" if it can."""
        return ""

    @property
    def handled(self) -> str:
        """Path in this part of the pose that the handle in the scene moves; "" for the platform."""
        return ""

    def on_open(self) -> Self:
        """Return the part for another design."""
        return self

    def for_step(self) -> Self:
        """Return the part as the history keeps it: without what goes on."""
        return self

    def continue_from(self, present: Any) -> Self:
        """Return this part, of an earlier step, when it is restored in place of a present one."""
        del present
        return self


FEATURE_PARTS: dict[str, type[FeaturePart]] = {}
"""The classes of the parts by their names."""

Parts = Mapping[str, FeaturePart]
"""The parts of a state by their names."""


def new_parts() -> Parts:
    """Return the parts of a new state."""
    return {name: kind() for name, kind in FEATURE_PARTS.items()}


def keep_on_open(parts: Parts) -> Parts:
    """Return the parts for another design."""
    return {name: part.on_open() for name, part in parts.items()}


def saved_fields(kind: Any) -> tuple[Field[Any], ...]:
    """Return the fields of a dataclass that a file holds."""
    return tuple(field for field in fields(kind) if field.metadata.get("is_saved", True))


Whole = TypeVar("Whole")


def parts_kept_on_open(state: Any) -> dict[str, Any]:
    """Return the fields of a state that another design keeps, by name."""
    return {
        field.name: field.metadata["on_open"](getattr(state, field.name))
        for field in fields(state)
        if "on_open" in cast("Mapping[str, Any]", field.metadata)
    }


def in_unit(part: Whole, before: Unit, after: Unit, power: int = 1) -> Whole:
    """Return a part of the state with its lengths, which were in design units, in others.

    A part has fields that declare lengths, or is a pose, or a length itself or several, to a
    power. The unit of the page is given with the design units before and after.
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
        value = replace(cast("Any", value), **changes)
    elif isinstance(value, Pose):
        value = Pose(in_unit(value.position, before, after), value.quaternion)
    elif isinstance(value, Mapping):
        parts = cast("Mapping[str, object]", value)
        value = {name: in_unit(part, before, after) for name, part in parts.items()}
    elif isinstance(value, tuple):
        entries = cast("tuple[object, ...]", value)
        value = tuple(in_unit(entry, before, after, power) for entry in entries)
    elif isinstance(value, float):
        value = after.to_power(power).read(before.to_power(power).convert(value))
    return cast("Whole", value)


def value_at(whole: object, path: str) -> Any:
    """Return the value at a path: names of fields or parts and indices, joined by dots.

    Raises:
        AttributeError: The path names a field that is not there.
    """
    value: Any = whole
    for name in path.split("."):
        if name in getattr(value, "parts", ()):
            value = value.parts[name]
        else:
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
    if name in getattr(part, "parts", ()):
        return replace(part, parts={**part.parts, name: new})
    return replace(part, **{name: new})


def with_change(whole: Whole, before: Whole, after: Whole) -> Whole:
    """Return a frozen value with each part that differs between two values as the second has it.

    Raises:
        InputError: A part refuses the value.
    """
    if whole == before or not _names_of(before) == _names_of(after) == _names_of(whole) != ():
        return after
    for name in _names_of(whole):
        old, new = value_at(before, name), value_at(after, name)
        if old != new:
            whole = with_value(whole, name, with_change(value_at(whole, name), old, new))
    return whole


def _names_of(value: Any) -> tuple[str, ...]:
    """Return the names of the parts of a value in a path; none of a plain one."""
    if isinstance(value, tuple):
        return tuple(map(str, range(len(cast("tuple[object, ...]", value)))))
    if isinstance(value, msgspec.Struct):
        return value.__struct_fields__
    names = tuple(field.name for field in fields(value)) if is_dataclass(value) else ()
    return (*getattr(value, "parts", ()), *(name for name in names if name != "parts"))
