"""Assigning to viser's handles: only what differs, and all of one frame together.

An assignment costs viser some 30 µs even when nothing changes, and a frame has hundreds,
so the last value of each property is remembered here.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any, TypeAlias, TypeGuard, cast

import numpy as np
import viser
from numpy.typing import NDArray

Update: TypeAlias = tuple[Any, str, object]
"""A handle, the property to assign, and its value: computed first, assigned together."""


class Assigner:
    """Remembers what was assigned, and assigns what differs."""

    def __init__(self, server: viser.ViserServer) -> None:
        self._server = server
        # The handles are held too, so that no identity is used again.
        self._last: dict[tuple[int, str], tuple[Any, object]] = {}

    def assign(self, updates: Iterable[Update]) -> int:
        """Assign in one block, which the browsers apply together; return how many differed."""
        new = [update for update in updates if self._is_new(update)]
        # Nothing is computed in here: the block holds up every browser.
        with self._server.atomic():
            for handle, name, value in new:
                setattr(handle, name, value)
        return len(new)

    def _is_new(self, update: Update) -> bool:
        handle, name, value = update
        if is_set_by_clients(handle, name):
            return True
        key = (id(handle), name)
        last = self._last.get(key)
        if last is not None and _same(last[1], value):
            return False
        self._last[key] = (handle, value)
        return True


def is_set_by_clients(handle: object, name: str) -> bool:
    """Whether browsers change this property too, so that what was assigned says little."""
    if isinstance(handle, viser.TransformControlsHandle):
        return name in ("position", "wxyz")
    return name == "value"


def _same(a: object, b: object) -> bool:
    if a is b:
        return True
    if isinstance(a, np.ndarray) or isinstance(b, np.ndarray):
        return np.array_equal(np.asarray(a), np.asarray(b))
    if is_columns(a) and is_columns(b):
        return len(a) == len(b) and all(map(_same, a, b))
    return a == b


def is_columns(value: object) -> TypeGuard[tuple[NDArray[Any], ...]]:
    """Whether a value is the data of a chart, a tuple of arrays."""
    if not isinstance(value, tuple):
        return False
    return any(isinstance(each, np.ndarray) for each in cast("tuple[object, ...]", value))
