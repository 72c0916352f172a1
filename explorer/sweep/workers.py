"""Processes that evaluate designs, as executors of `concurrent.futures`.

The pool of the standard library, and that of loky, fails as a whole when one of its processes
dies. Of `Jobs` a death costs the one task that the process had.
"""

from __future__ import annotations

import os
import sys
from abc import ABC, abstractmethod
from collections.abc import Callable
from concurrent.futures import BrokenExecutor, Executor, Future
from typing import ParamSpec, TypeVar

from explorer.errors import ExplorerError, InputError
from explorer.jobs.jobs import Jobs

Arguments = ParamSpec("Arguments")
Result = TypeVar("Result")

MOST_WORKERS = 1024

# Libraries of linear algebra read these when they are loaded. Matrices are small here, and
# the processes many.
ONE_THREAD = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS")
# Modules that most studies need, so that the first rows come at once.
MODULES = ("scipy.stats", "explorer.sweep.rows")
DIED = "the worker process died"


class RunError(ExplorerError):
    """A run that cannot go on; finished parts are kept."""

    exit_status = 1


class Workers(Executor, ABC):
    """An executor with a known size, whose tasks fail in a known way when a worker dies."""

    died: tuple[type[BaseException], ...] = (BrokenExecutor,)
    """Errors of the future of a task whose worker died."""

    @property
    @abstractmethod
    def size(self) -> int:
        """Number of tasks that run at the same time."""


class LocalWorkers(Workers):
    """Processes on this machine; if no number is given, one for each core that this one may use.

    Raises:
        InputError: Fewer than one process, or more than `MOST_WORKERS`.
    """

    def __init__(self, size: int | None = None) -> None:
        self._size = cores() if size is None else size
        if not 1 <= self._size <= MOST_WORKERS:
            raise InputError(f"the workers must be from 1 to {MOST_WORKERS}; got {self._size}")
        self.jobs = Jobs(
            size=self._size, modules=MODULES, environment=dict.fromkeys(ONE_THREAD, "1")
        )
        self._is_over = False

    @property
    def size(self) -> int:
        """Number of processes."""
        return self._size

    def submit(
        self, fn: Callable[Arguments, Result], /, *args: Arguments.args, **kwargs: Arguments.kwargs
    ) -> Future[Result]:
        """Call a function in one of the processes, see `concurrent.futures.Executor`."""
        if self._is_over:
            raise RuntimeError("no task can be submitted after the shutdown")
        return self.jobs.start(fn, args, options=kwargs, died=DIED)

    def shutdown(self, wait: bool = True, *, cancel_futures: bool = False) -> None:
        """End the processes once all tasks are done, and wait for that, or let them end with this.

        Tasks that have not begun may be dropped, and those that have killed.
        """
        self._is_over = True
        if wait and not cancel_futures:
            self.jobs.wait_until_idle(None)
        if wait or cancel_futures:
            self.jobs.stop()


def cores() -> int:
    """Return the number of cores that this process may use."""
    if sys.platform == "linux":
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1
