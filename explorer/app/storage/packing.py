"""States as JSON values, and back: whatever fields the parts of the state have.

Most of a step is what it was in the step before. So each object is written once, into a list;
wherever else it occurs, a reference `{"#": n}` gives its index in the list. An object refers only
to those before it. Every number is kept to the last bit.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import is_dataclass
from typing import Any, cast

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
        # By the id of an object: its reference, and the object itself, which keeps the id.
        self._packed: dict[int, tuple[dict[str, int], object]] = {}

    @property
    def objects(self) -> list[msgspec.Raw]:
        """The objects so far."""
        return [msgspec.Raw(text) for text in self._numbers]

    def add(self, state: State) -> int:
        """Add a state; return its index in the list.

        Raises:
            StorageError: A number in it is not finite, which JSON cannot hold.
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
            fields = {name: self._pack(each) for name, each in _fields_of(value).items()}
            number = self._numbers.setdefault(msgspec.json.encode(fields), len(self._numbers))
            self._packed[id(value)] = {REFERENCE: number}, value
        return self._packed[id(value)][0]


def _fields_of(value: Any) -> Mapping[str, Any]:
    saved: Any = value.for_file() if hasattr(value, "for_file") else value
    if is_dataclass(saved):
        return {field.name: getattr(saved, field.name) for field in saved_fields(saved)}
    return cast("dict[str, Any]", saved) if isinstance(saved, dict) else msgspec.to_builtins(saved)


def unpack(objects: list[dict[str, Any]], numbers: list[int]) -> list[State]:
    """Return the states with these indices in a list of objects; what follows is computed again.

    Raises:
        InputError: A reference to an object that does not come before, or values that no state has.
        msgspec.ValidationError: a value has the wrong type, or is missing.
        IndexError: There is no object with one of the indices.
    """
    resolved: list[Any] = []

    def value_of(raw: Any) -> Any:
        if isinstance(raw, list):
            return [value_of(each) for each in cast("list[Any]", raw)]
        if not isinstance(raw, dict):
            return raw
        (number,) = cast("dict[str, Any]", raw).values()
        if REFERENCE not in raw or not 0 <= number < len(resolved):
            raise InputError(f"there is no object {number}")
        return resolved[number]

    for each in objects:
        fields = {name: value_of(raw) for name, raw in each.items()}
        resolved.append(fields)
    states = {number: _restore(msgspec.convert(resolved[number], State)) for number in {*numbers}}
    return [states[number] for number in numbers]


def _restore(state: State) -> State:
    """Return a saved state after checks; compute anew why its joints do not close.

    Raises:
        InputError: It cannot be drawn, or its joints are not those of its pose.
    """
    check_drawable(state)
    if state.optimisation.run is not None:
        _restore(state.optimisation.run.own)
    if state.unclosed is not None:
        joint = state.unclosed.joint
        return SetJoint(joint, state.joints[joint]).apply(state)
    off = np.subtract(state.joints, joints_of(state.design, state.pose))
    if np.abs(off).max() > JOINT_TOLERANCE * state.design.reach:
        raise InputError("its joints are not those of its pose")
    return state
