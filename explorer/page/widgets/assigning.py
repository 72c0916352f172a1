"""Assignments to viser's handles: only values that differ, and all of one frame together.

An assignment costs viser some 30 µs even when nothing changes, and a frame has hundreds,
so the last value of each property is remembered here.
"""

from __future__ import annotations

import time
from collections.abc import Iterable, Iterator
from typing import Any, TypeAlias, TypeGuard, cast

import numpy as np
import viser
from numpy.typing import NDArray

from explorer.numerics.arrays import FloatArray
from explorer.page.browser.viser_gaps import PLACE, assign_properties, place, resend, show_value

Update: TypeAlias = tuple[Any, str, object]
"""A handle, the property to assign, and its value; all updates are computed before any is made."""

Updates: TypeAlias = Iterator[Update]
"""The updates that make a panel or a part of the scene show a frame."""

# On a slow connection a user may not have seen a value that was sent at most so long before.
CROSSING_SECONDS = 5.0
# A user who has changed nothing for so long has paused.
QUIET_SECONDS = 0.6


class Assigner:
    """Remembers the values that were assigned, and assigns those that differ.

    A value that is sent to a browser may cross with a change by the user there. The change counts,
    but the browser still shows the value that was sent; such values are sent again.
    """

    def __init__(self, server: viser.ViserServer) -> None:
        self._server = server
        # The last value of each property. Handles are kept too, so that no `id` is used again.
        self._last: dict[tuple[int, str], tuple[Any, object]] = {}
        # When each property that browsers change too was sent last.
        self._sent: dict[tuple[int, str], tuple[Any, float]] = {}

    def assign(self, updates: Iterable[Update], *, since: float | None = None) -> list[Update]:
        """Assign in one block, which the browsers apply together; return the updates that differed.

        A value that a user has set since the time at which their computation began stays, since a
        newer frame follows.
        """
        new = [update for update in updates if self._is_new(update)]
        if since is not None:
            new = [update for update in new if not _is_overtaken(update, since)]
        if not new:
            return new
        # A value that a user sets from now on crosses.
        now = time.time()
        # By identity, since viser's handles have no hash.
        properties: dict[int, tuple[viser.SceneNodeHandle, dict[str, object]]] = {}
        # Nothing is computed in this block, since it holds up every browser.
        with self._server.atomic():
            for handle, name, value in new:
                if name in PLACE:
                    place(handle, name, cast("FloatArray", value))
                elif name == "value":
                    show_value(handle, value)
                elif name != "visible" and isinstance(handle, viser.SceneNodeHandle):
                    properties.setdefault(id(handle), (handle, {}))[1][name] = value
                else:
                    setattr(handle, name, value)
                if is_set_by_clients(handle, name):
                    self._sent[id(handle), name] = handle, now
            for node, values in properties.values():
                assign_properties(node, values)
        return new

    def resend_crossed(self) -> bool:
        """Send again what may have crossed, once the user pauses; return whether any wait."""
        waits = False
        now = time.time()
        for key, (handle, sent) in tuple(self._sent.items()):
            changed = handle.update_timestamp
            has_crossed = sent < changed <= sent + CROSSING_SECONDS
            if not has_crossed:
                if not sent <= now <= sent + CROSSING_SECONDS:
                    del self._sent[key]
            elif changed <= now < changed + QUIET_SECONDS:
                waits = True
            else:
                resend(handle, key[1])
                self._sent[key] = handle, now
        return waits

    def _is_new(self, update: Update) -> bool:
        handle, name, value = update
        if is_set_by_clients(handle, name):
            return not _same(getattr(handle, name), value)
        key = (id(handle), name)
        last = self._last.get(key)
        if last is not None and _same(last[1], value):
            return False
        self._last[key] = (handle, value)
        return True


def is_set_by_clients(handle: object, name: str) -> bool:
    """Whether browsers change this property too, so that its last assignment may not hold."""
    if name in PLACE:
        return isinstance(handle, viser.TransformControlsHandle)
    return name == "value"


def _is_overtaken(update: Update, since: float) -> bool:
    handle, name, _ = update
    # A clock that was set back leaves timestamps in the future.
    return is_set_by_clients(handle, name) and since < handle.update_timestamp <= time.time()


def _same(a: object, b: object) -> bool:
    if a is b:
        return True
    if isinstance(a, np.ndarray) or isinstance(b, np.ndarray):
        return np.array_equal(cast("Any", a), cast("Any", b))
    if is_columns(a) and is_columns(b):
        # Where a chart has no value it is not a number.
        pairs = zip(a, b, strict=False)
        return len(a) == len(b) and all(np.array_equal(*each, equal_nan=True) for each in pairs)
    return a == b


def is_columns(value: object) -> TypeGuard[tuple[NDArray[Any], ...]]:
    """Whether a value is the data of a chart, a tuple of arrays."""
    columns = cast("tuple[object, ...]", value)
    return isinstance(value, tuple) and len(columns) > 0 and isinstance(columns[0], np.ndarray)
