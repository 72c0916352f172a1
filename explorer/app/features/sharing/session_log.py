"""The poses of the platform since the explorer started, for a table to download.

Each row has the pose, the mode and the design, from which all other values follow. Memory is
bounded: a drag leaves at most fifty poses a second, its first and its last among them, and the
newest rows replace the oldest.
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
# Least time between two rows of one drag, in seconds.
LEAST_SECONDS = 0.02
# Number of columns: time, position, quaternion, mode, unit, design variables.
WIDTH = 1 + 3 + 4 + 1 + 1 + 6


class SessionLog:
    """The poses of a session.

    Args:
        most: Largest number of poses.
    """

    def __init__(self, most: int = MOST_ROWS) -> None:
        self._lock = threading.Lock()
        self._start_time = time.monotonic()
        # Rows that were never written take no memory.
        self._rows = np.empty((most, WIDTH))
        self._moved_by: list[str] = []
        self._count = 0
        self._last: tuple[Pose, Design] | None = None
        # Drag of the last row, and whether the next row of the same drag replaces it.
        self._drag: object = None
        self._is_passing = False
        # Time of the last row that stays.
        self._kept_at = -np.inf

    def __len__(self) -> int:
        """Return the number of poses."""
        return len(self._moved_by)

    def record(self, state: State, drag: object, moved_by: str, at: float | None = None) -> None:
        """Record the pose of a state, if it or the design has changed.

        Args:
            state: State of the page.
            drag: Value shared by all poses of one drag of one control; None without a drag.
            moved_by: Words of the action that moved the platform.
            at: Time since the start of the log, in seconds; now if None.
        """
        pose, design = state.pose, state.design
        last = self._last
        if last is not None and (last[0] is pose or last[0] == pose) and _alike(last[1], design):
            return
        now = time.monotonic() - self._start_time if at is None else at
        with self._lock:
            self._last = (pose, design)
            continues = drag is not None and drag == self._drag
            replaces = continues and self._is_passing
            self._drag = drag
            self._is_passing = continues and now - self._kept_at < LEAST_SECONDS
            if not self._is_passing:
                self._kept_at = now
            if not replaces:
                self._count += 1
            index = (self._count - 1) % len(self._rows)
            self._rows[index] = (
                now,
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
        """Return all rows, oldest first."""
        with self._lock:
            count = len(self._moved_by)
            oldest = self._count % count if count == len(self._rows) else 0
            rows = np.roll(self._rows[:count], -oldest, axis=0)
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
    """Whether two designs have the same points, whatever their limits."""
    return one is other or (one.variables == other.variables and one.unit_mm == other.unit_mm)
