"""The owner of all processes that do long work for a page, each with a name."""

from __future__ import annotations

import threading
from collections.abc import Callable, Sequence
from functools import partial
from typing import Any

from explorer.jobs.executor import LongJob, ProcessExecutor, problem_of
from explorer.jobs.process import CANCELLED, Call

PAGE = "page"
"""The name of the process that computes what is drawn, one job after the other."""


class Jobs:
    """Processes by name; each is started when a job first needs it.

    Args:
        report: As for `ProcessExecutor`.
    """

    def __init__(self, report: Callable[[str], None]) -> None:
        self._report = report
        self._lock = threading.Lock()
        self._executors: dict[str, ProcessExecutor] = {}
        self._is_stopped = False

    def start(
        self,
        task: Callable[..., Any],
        arguments: tuple[Any, ...],
        done: Callable[[Any], None],
        failed: Callable[[str], None],
        receive: Callable[[Any], None] | None = None,
        *,
        key: object = None,
        process: str = PAGE,
        died: str | None = None,
    ) -> LongJob:
        """Queue a task for a process, and return it as a job.

        Args:
            task: A function of a module; the process imports that module.
            arguments: Its arguments; they and the result must pickle.
            done: Called with the result, on a thread of the process.
            failed: Called instead with a message for people if there is no result.
            receive: Called with each value that the task sends meanwhile. If given, the task
                takes a `Channel` as its last argument.
            key: Key of the task, of which only the newest waits; None if none replaces it.
            process: Name of the process.
            died: As for `LongJob`.
        """
        call = Call(task, arguments, {}, receive is not None)
        job = LongJob(call, receive or (lambda _: None), died)
        job.add_done_callback(partial(self._end, done, failed))
        self._executor(process).start(job, key)
        return job

    def prepare(
        self, process: str, modules: Sequence[str], then: Callable[[], None] = lambda: None
    ) -> None:
        """Start a process before it is needed; `then` is called when it has started.

        It imports some modules first, so that its first task starts at once.
        """
        self._executor(process).modules = tuple(modules)
        self.start(do_nothing, (), lambda _: then(), lambda _: None, process=process)

    def process_id(self, process: str = PAGE) -> int | None:
        """Return the id of a process; None if it has not been needed yet."""
        return next(iter(self._executor(process).process_ids), None)

    def wait_until_idle(self, timeout: float, process: str = PAGE) -> bool:
        """Wait until no job of a process waits or is under way; return whether that is so."""
        return self._executor(process).wait_until_idle(timeout)

    def stop(self) -> None:
        """End all processes, whatever they do; no job tells of its end any more."""
        with self._lock:
            self._is_stopped = True
        for executor in self._executors.values():
            executor.stop()

    def _executor(self, process: str) -> ProcessExecutor:
        with self._lock:
            if process not in self._executors:
                self._executors[process] = executor = ProcessExecutor(report=self._report)
                if self._is_stopped:
                    executor.stop()
            return self._executors[process]

    def _end(self, done: Callable[[Any], None], failed: Callable[[str], None], job: Any) -> None:
        if self._is_stopped:
            return
        error = None if job.cancelled() else job.exception()
        if job.cancelled() or error is not None:
            failed(CANCELLED if error is None else problem_of(error))
        else:
            done(job.result())


def do_nothing() -> None:
    """Do nothing: a task that is done as soon as the process has started."""
