"""Where the platform was since the explorer started, to be taken away as a table.

Kept is what it takes to compute the rest later: pose, mode and design. Memory is bounded: of
one drag at most fifty poses a second are kept, its first and its last among them, and beyond
so many rows the oldest are forgotten.
"""

from __future__ import annotations

import threading
import time

import numpy as np

from explorer.app.state.state import State
from explorer.export.session_log import SessionTable
from explorer.mechanism.design import Design
from explorer.mechanism.pose import Pose

MOST_ROWS = 100_000
# Of what one hand does with one control, this many seconds lie between two rows.
LEAST_SECONDS = 0.02
# Time, position, quaternion, mode, unit, design variables.
WIDTH = 1 + 3 + 4 + 1 + 1 + 6


class SessionLog:
    """The poses of a session.

    Args:
        most: So many are kept.
    """

    def __init__(self, most: int = MOST_ROWS) -> None:
        self._lock = threading.Lock()
        self._begun = time.monotonic()
        # Pages of it that were never written take no memory.
        self._rows = np.empty((most, WIDTH))
        self._moved_by: list[str] = []
        self._count = 0
        self._last: tuple[Pose, Design] | None = None
        # Of the last row: whose it is, and whether it goes if the same hand goes on.
        self._hand: object = None
        self._is_passing = False
        # When the last row was written that stays.
        self._kept_at = -np.inf

    @property
    def begun(self) -> float:
        """When the session began, by `time.monotonic`."""
        return self._begun

    def __len__(self) -> int:
        """Return how many poses are kept."""
        return len(self._moved_by)

    def record(self, state: State, hand: object, moved_by: str, at: float | None = None) -> None:
        """Keep the pose of a state, if it or the design is another than before.

        Args:
            state: That is shown.
            hand: The same for all that one hand does with one control without a pause; None
                for what is no drag.
            moved_by: What brought the platform there, in words.
            at: When, by `time.monotonic`; now if None.
        """
        pose, design = state.pose, state.design
        last = self._last
        if last is not None and (last[0] is pose or last[0] == pose) and _alike(last[1], design):
            return
        now = time.monotonic() if at is None else at
        with self._lock:
            self._last = (pose, design)
            goes_on = hand is not None and hand == self._hand
            replaces = goes_on and self._is_passing
            self._hand = hand
            self._is_passing = goes_on and now - self._kept_at < LEAST_SECONDS
            if not self._is_passing:
                self._kept_at = now
            if not replaces:
                self._count += 1
            index = (self._count - 1) % len(self._rows)
            self._rows[index] = (
                now - self._begun,
                *pose.position,
                *pose.quaternion,
                state.mode,
                design.unit_mm,
                *design.variables,
            )
            if index < len(self._moved_by):
                self._moved_by[index] = moved_by
            else:
                self._moved_by.append(moved_by)

    def table(self) -> SessionTable:
        """Return all that is kept, in its order."""
        with self._lock:
            kept = len(self._moved_by)
            oldest = self._count % kept if kept == len(self._rows) else 0
            rows = np.roll(self._rows[:kept], -oldest, axis=0)
            moved_by = (*self._moved_by[oldest:], *self._moved_by[:oldest])
        return SessionTable(
            time=rows[:, 0],
            position=rows[:, 1:4],
            quaternion=rows[:, 4:8],
            mode=rows[:, 8],
            moved_by=moved_by,
            unit_mm=rows[:, 9],
            variables=rows[:, 10:16],
        )


def _alike(one: Design, other: Design) -> bool:
    """Whether two designs have the same points; that their limits differ moves nothing."""
    return one is other or (one.variables == other.variables and one.unit_mm == other.unit_mm)
