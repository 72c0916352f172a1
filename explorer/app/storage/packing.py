"""States as JSON values, and back: whatever fields the parts of the state have.

Most of a step is what it was in the step before. So each object is written once, into a list;
wherever else it occurs, a reference `{"#": n}` gives its index in the list. An object refers only
to those before it. Every number is kept to the last bit.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import is_dataclass
from functools import cache
from typing import Any, cast, get_args, get_type_hints

import msgspec
import numpy as np

from explorer.app.session.gestures import check_drawable
from explorer.app.state.actions import SetJoint
from explorer.app.state.parts import saved_fields
from explorer.app.state.state import State, joints_of
from explorer.errors import InputError, StorageError

REFERENCE = "#"

# Largest difference of saved joints and those of the pose, over the reach: the joints are as the
# user typed them, the pose is computed from them.
JOINT_TOLERANCE = 1e-4


class Packer:
    """A list of objects as JSON texts, to which states are added."""

    def __init__(self) -> None:
        self._numbers: dict[bytes, int] = {}
        # By the id of an object: what it was packed as, and the object itself, which keeps the id.
        self._packed: dict[int, tuple[Any, object]] = {}

    @property
    def objects(self) -> list[msgspec.Raw]:
        """The objects so far."""
        return [msgspec.Raw(text) for text in self._numbers]

    def add(self, state: State) -> int:
        """Add a state; return its index in the list.

        Raises:
            StorageError: a number in it is not finite, which JSON cannot hold.
        """
        return self._pack(state)[REFERENCE]

    def _pack(self, value: Any) -> Any:
        if isinstance(value, float) and not math.isfinite(value):
            raise StorageError(f"the session holds a value that no file can: {value}")
        if value is None or isinstance(value, bool | int | float | str):
            return value
        if isinstance(value, list | tuple):
            return [self._pack(each) for each in cast("list[Any]", value)]
        if id(value) not in self._packed:
            self._packed[id(value)] = self._reference(_fields_of(value)), value
        return self._packed[id(value)][0]

    def _reference(self, fields: Mapping[str, Any]) -> dict[str, int]:
        text = msgspec.json.encode({name: self._pack(value) for name, value in fields.items()})
        return {REFERENCE: self._numbers.setdefault(text, len(self._numbers))}


def _fields_of(value: Any) -> Mapping[str, Any]:
    for_file: Callable[[], Any] | None = getattr(value, "for_file", None)
    saved = value if for_file is None else for_file()
    if is_dataclass(saved):
        return {field.name: getattr(saved, field.name) for field in saved_fields(saved)}
    if isinstance(saved, dict):
        return cast("dict[str, Any]", saved)
    return msgspec.to_builtins(saved)


class Unpacker:
    """States from JSON values; what they share in the file they share again."""

    def __init__(self) -> None:
        # By the id of a JSON object and the type it is read as: the value, and the JSON object.
        self._values: dict[tuple[int, Any], tuple[Any, object]] = {}

    def state(self, fields: Mapping[str, Any]) -> State:
        """Return a state, with what follows from it computed again.

        Args:
            fields: JSON values by field, as `resolve` returns them.

        Raises:
            InputError: values that no state has, or an unknown field.
            msgspec.ValidationError: a value has the wrong type.
            TypeError: a field is missing.
        """
        return self._read(fields, State)

    def _read(self, raw: Any, kind: Any) -> Any:
        if not isinstance(raw, dict):
            return msgspec.convert(raw, kind)
        fields = cast("dict[str, Any]", raw)
        key = id(fields), kind
        if key not in self._values:
            kinds = (each for each in (kind, *get_args(kind)) if is_dataclass(each))
            part: Any = next(kinds, None)
            if part is None:
                value = msgspec.convert(raw, kind)
            else:
                types = _types_of(part)
                for name in {*fields} - {*types}:
                    raise InputError(f"{part.__name__} has no field {name!r}")
                read = {name: self._read(each, types[name]) for name, each in fields.items()}
                value = part(**read)
                if isinstance(value, State):
                    value = _restore(value)
            self._values[key] = value, fields
        return self._values[key][0]


def resolve(objects: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """Return objects with those that they refer to in place of the references.

    Raises:
        InputError: a reference to an object that does not come before.
    """
    resolved: list[dict[str, Any]] = []

    def value_of(raw: Any) -> Any:
        if isinstance(raw, list):
            return [value_of(each) for each in cast("list[Any]", raw)]
        if not isinstance(raw, dict):
            return raw
        number = cast("dict[str, Any]", raw).get(REFERENCE)
        if type(number) is not int or len(cast("dict[str, Any]", raw)) > 1:
            raise InputError("an object within an object is no reference")
        if not 0 <= number < len(resolved):
            raise InputError(f"there is no object {number}")
        return resolved[number]

    for each in objects:
        fields = {name: value_of(raw) for name, raw in each.items()}
        resolved.append(fields)
    return resolved


def _restore(state: State) -> State:
    """Return a saved state after checks; compute anew why its joints do not close.

    Raises:
        InputError: It cannot be drawn, or its joints are not those of its pose.
    """
    check_drawable(state)
    if state.unclosed is not None:
        joint = state.unclosed.joint
        return SetJoint(joint, state.joints[joint]).apply(state)
    off = np.subtract(state.joints, joints_of(state.design, state.pose))
    if np.abs(off).max() > JOINT_TOLERANCE * state.design.reach:
        raise InputError("its joints are not those of its pose")
    return state


@cache
def _types_of(part: Any) -> dict[str, Any]:
    types = get_type_hints(part, include_extras=True)
    return {field.name: types[field.name] for field in saved_fields(part)}
