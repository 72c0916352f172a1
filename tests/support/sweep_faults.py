"""Workers for tests of studies: in this process, and tasks that kill theirs."""

from __future__ import annotations

import os
from collections.abc import Callable
from concurrent.futures import Future
from typing import Any

from explorer.sweep.rows import Rows, evaluate
from explorer.sweep.workers import Workers

DEADLY = 13
"""Index of the design that kills the process that evaluates it."""


class HereWorkers(Workers):
    """Workers that do each task at once in this process, and keep the pieces of all.

    They take the number of processes of those that they stand for.
    """

    def __init__(self, _: int | None = None) -> None:
        self.pieces: list[range] = []

    @property
    def size(self) -> int:
        return 1

    def submit(self, fn: Callable[..., Any], /, *args: Any, **kwargs: Any) -> Future[Any]:
        self.pieces.append(range(*args[1:]))
        future: Future[Any] = Future()
        try:
            future.set_result(fn(*args, **kwargs))
        except Exception as error:  # noqa: BLE001 - the future raises it
            future.set_exception(error)
        return future


def deadly(study: bytes, start: int, stop: int) -> Rows:
    """Evaluate designs; end the process at one of them."""
    if start <= DEADLY < stop:
        os._exit(1)
    return evaluate(study, start, stop)


def foreign(study: bytes, start: int, stop: int) -> Rows:
    """Evaluate designs as a worker with other libraries does."""
    rows = evaluate(study, start, stop)
    return Rows(rows.indices, rows.columns, {**rows.versions, "numpy": "1.0"})


def broken(study: bytes, start: int, stop: int) -> Rows:
    """Fail as a worker does that cannot do its task."""
    raise ModuleNotFoundError("No module named 'explorer'")
