"""Long jobs: tasks in processes of their own, and the executor that has these processes.

A job is a future that also tells its progress and can be cancelled while it runs. Each process has
a thread of its own here, so that its death costs only the task that it had, which is done again or
fails with `WorkerDiedError`; the process is then started again.
"""

from __future__ import annotations

import logging
import pickle
import signal
import sys
import threading
import traceback
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import BrokenExecutor, CancelledError, Future
from logging.handlers import RotatingFileHandler
from typing import Any

from explorer.errors import ExplorerError
from explorer.jobs.process import CANCELLED, PIPE_ERRORS, Call, ChildProcess, Reply

RESTARTED = "The worker process died and was started again."
DIED_TWICE = "The worker process died over this twice; the next change starts it again."

# Failed starts in a row after which a job fails.
STARTS = 10
# Largest number of characters of each argument's text in the log.
MOST_TEXT = 2_000


class WorkerDiedError(BrokenExecutor):
    """The process of a job died before the job was done."""


class LongJob(Future[Any]):
    """A task that a process does, from its request to its end.

    The first cancel of a job that waits ends it; one that runs is told to end, if it takes a
    `Channel`, or ends with its process.

    Args:
        call: The task; the process imports its module, and it must pickle.
        receive: Called with each value that the task sends before it is done.
        died: Message when the process died over the job, which is not done again then; None to do
            it once more.
    """

    def __init__(
        self, call: Call, receive: Callable[[Any], None] = lambda _: None, died: str | None = None
    ) -> None:
        super().__init__()
        self.call, self.died = call, died
        self._receive = receive
        # Guards these: the process while the job runs there, the cancels of a job that runs, and
        # the timer that kills the process.
        self._lock = threading.Lock()
        self._child: ChildProcess | None = None
        self._cancels: list[float] = []
        self._patience: float | None = None
        self._deadline: threading.Timer | None = None

    def cancel(self, patience: float | None = None, *, after: float = 0.0) -> bool:
        """Cancel the job; return whether it is one that waited and will not begin.

        Args:
            patience: Seconds after which a job that runs ends together with its process; None for
                never.
            after: Seconds after its start before which a task with a channel does not end.
        """
        if after == 0.0 and super().cancel():
            return True
        with self._lock:
            self._cancels.append(after)
            self._patience = patience if self._patience is None else self._patience
            self._tell(after)
        return False

    @property
    def is_to_end(self) -> bool:
        """Whether the job was cancelled while it ran."""
        return bool(self._cancels)

    def run_in(self, child: ChildProcess, data: bytes) -> Reply:
        """Return the last reply of a process that does the job, given the pickled call.

        Raises one of `PIPE_ERRORS` if the process died.
        """
        try:
            with self._lock:
                # A task without a channel would not notice.
                if self._cancels and not self.call.is_sending:
                    return Reply(error=CancelledError(CANCELLED))
                child.begin(data)
                self._child = child
                for after in self._cancels:
                    self._tell(after)
            while not (reply := child.read()).is_last:
                self._receive(reply.value)
            return reply
        finally:
            with self._lock:
                self._child = None
                if self._deadline is not None:
                    self._deadline.cancel()
                    self._deadline = None

    def _tell(self, after: float) -> None:
        """Cancel the job if it runs; this thread holds the lock."""
        if self._child is None:
            return
        self._child.cancel(after)
        if self._patience is not None and self._deadline is None:
            self._deadline = threading.Timer(self._patience, self._kill)
            self._deadline.daemon = True
            self._deadline.start()

    def _kill(self) -> None:
        # No other job runs in the process meanwhile.
        with self._lock:
            if self._child is not None:
                self._child.kill()


class ProcessExecutor:
    """Processes that do jobs, in the order of their requests; of each key only the newest waits.

    A process is started when a job needs it, and again if it dies. Results come on threads of the
    executor.

    Args:
        size: Number of processes.
        report: Called with a message when a process died or a task failed unexpectedly, which is
            logged then; None to report nothing.
        modules: As for `ChildProcess`.
        environment: As for `ChildProcess`.
    """

    def __init__(
        self,
        size: int = 1,
        report: Callable[[str], None] | None = None,
        *,
        modules: Sequence[str] = (),
        environment: Mapping[str, str] | None = None,
    ) -> None:
        self._size, self._report = size, report
        self.modules, self._environment = tuple(modules), environment or {}
        # Guards all below, and is notified of all changes.
        self._changed = threading.Condition()
        self._waiting: dict[object, LongJob] = {}
        self._threads: list[threading.Thread] = []
        self._children: dict[threading.Thread, ChildProcess] = {}
        self._idle = 0
        self._is_stopped = False

    @property
    def process_ids(self) -> list[int]:
        """Ids of the processes."""
        with self._changed:
            return [child.process_id for child in self._children.values()]

    def start(self, job: LongJob, key: object = None) -> None:
        """Queue a job, in place of one with the same key that waits; None is no key."""
        key = object() if key is None else key
        with self._changed:
            if self._is_stopped:
                job.cancel()
                return
            self._waiting.pop(key, None)
            self._waiting[key] = job
            if self._idle < len(self._waiting) and len(self._threads) < self._size:
                thread = threading.Thread(target=self._run, name="jobs", daemon=True)
                self._threads.append(thread)
                thread.start()
            self._changed.notify_all()

    def wait_until_idle(self, timeout: float | None = None) -> bool:
        """Wait until no job waits and none is under way; return whether that is so."""

        def is_idle() -> bool:
            return not self._waiting and self._idle == len(self._threads)

        with self._changed:
            return self._changed.wait_for(is_idle, timeout)

    def stop(self) -> None:
        """End the processes, whatever they do, and cancel the jobs that wait."""
        with self._changed:
            self._is_stopped = True
            waiting = [*self._waiting.values()]
            self._waiting.clear()
            for child in self._children.values():
                child.kill()
            self._changed.notify_all()
        for job in waiting:
            job.cancel()
        for thread in self._threads:
            if thread is not threading.current_thread():
                thread.join(timeout=5.0)

    def _run(self) -> None:
        if sys.platform != "win32":
            # A terminal sends Ctrl-C to the processes too, which inherit this.
            signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
        try:
            while (job := self._next()) is not None:
                if job.set_running_or_notify_cancel():
                    self._do(job)
        finally:
            self._drop()

    def _next(self) -> LongJob | None:
        """Wait for the next job and return it; None once the executor is stopped."""
        with self._changed:
            self._idle += 1
            self._changed.notify_all()
            self._changed.wait_for(lambda: self._waiting or self._is_stopped)
            if self._is_stopped:
                return None
            self._idle -= 1
            return self._waiting.pop(next(iter(self._waiting)))

    def _do(self, job: LongJob) -> None:
        """Do a job, and give it its result or its error."""
        try:
            reply = self._reply(job)
        except Exception as error:  # noqa: BLE001 - the job raises it
            reply = Reply(error=error, trace=traceback.format_exc())
        if reply.trace:
            name = job.call.function.__name__.replace("_", " ")
            problem = problem_of(reply.error)
            self._tell(f"Something went wrong in the worker ({name}): {problem}", job, reply.trace)
        if reply.error is None:
            job.set_result(reply.value)
        else:
            job.set_exception(reply.error)

    def _reply(self, job: LongJob) -> Reply:
        """Return the last reply of the process of this thread; try again if it died once."""
        # It may hold what cannot be pickled, which is no fault of the process.
        data = pickle.dumps(job.call, pickle.HIGHEST_PROTOCOL)
        for is_again in (False, True) if job.died is None else (True,):
            child = self._ready_child()
            try:
                if child is not None:
                    return job.run_in(child, data)
            except PIPE_ERRORS:
                self._drop()
            if job.is_to_end:
                return Reply(error=CancelledError(CANCELLED))
            if self._is_stopped:
                break
            if not is_again:
                self._tell(RESTARTED)
            else:
                self._tell(job.died or DIED_TWICE, job)
        return Reply(error=WorkerDiedError(job.died or DIED_TWICE))

    def _ready_child(self) -> ChildProcess | None:
        """Return the process of this thread, ready for tasks; None once the executor is stopped.

        A failed start is no task's fault, and tried again.
        """
        last, thread = "", threading.current_thread()
        for _ in range(STARTS):
            try:
                with self._changed:
                    if self._is_stopped:
                        return None
                    child = self._children.get(thread)
                    if child is None:
                        child = ChildProcess(self.modules, self._environment)
                        self._children[thread] = child
                child.wait_until_ready()
            except PIPE_ERRORS as error:
                last = f" ({error})" if str(error) else ""
                self._drop()
            else:
                return child
        raise RuntimeError(
            f"no worker process stays alive until it is ready{last}; see what they wrote"
        )

    def _tell(self, message: str, job: LongJob | None = None, trace: str = "") -> None:
        """Report a message; that on a job is logged with its call."""
        if self._report is None:
            return
        if job is not None:
            function = job.call.function
            texts = [repr(each)[:MOST_TEXT] for each in job.call.arguments]
            place = f"{trace}{function.__module__}.{function.__name__}, called with"
            message = log_error(message, "\n".join((place, *texts)))
        self._report(message)

    def _drop(self) -> None:
        """End the process of this thread, if there is one."""
        with self._changed:
            child = self._children.pop(threading.current_thread(), None)
        if child is not None:
            child.end()


def problem_of(error: BaseException | None) -> str:
    """Return the message of a job's error for people, with its kind if it is unexpected."""
    if isinstance(error, (ExplorerError, WorkerDiedError)):
        return str(error)
    if isinstance(error, CancelledError):
        return CANCELLED
    return " ".join(f"{type(error).__name__}: {error}".split())


def log_error(message: str, details: str) -> str:
    """Log an unexpected error with details; return its message, with the place of the log."""
    logging.getLogger(__name__).error("%s\n%s", message, details)
    logs = (log for log in logging.getLogger().handlers if isinstance(log, RotatingFileHandler))
    place = next((log.baseFilename for log in logs), None)
    return message if place is None else f"{message.removesuffix('.')}; the log is {place}"
