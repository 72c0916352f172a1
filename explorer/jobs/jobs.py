"""Long jobs: tasks in processes of their own, and the one owner of these processes.

A job is a future that also tells its progress and can be cancelled while it runs. Each process has
a thread of its own here, so that its death costs only the task that it had, which is done again or
fails with `WorkerDiedError`; the process is then started again.
"""

from __future__ import annotations

import logging
import math
import pickle
import signal
import sys
import threading
import traceback
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import BrokenExecutor, CancelledError, Future
from dataclasses import dataclass, field
from functools import partial
from logging.handlers import RotatingFileHandler
from typing import Any

from explorer.errors import ExplorerError
from explorer.jobs.process import CANCELLED, PIPE_ERRORS, Call, ChildProcess, Reply

PAGE = "page"
"""The name of the process that computes what is drawn, one job after the other."""

RESTARTED = "The worker process died and was started again."
DIED_TWICE = "The worker process died over this twice; the next change starts it again."

# Failed starts in a row after which a job fails.
STARTS = 10
# Largest number of characters of each argument's text in the log.
MOST_TEXT = 2_000


class WorkerDiedError(BrokenExecutor):
    """The process of a job died before the job was done."""


class LongJob(Future[Any]):
    """A task that a process does, from its request to its end; made by `Jobs.start`."""

    def __init__(self, call: Call, receive: Callable[[Any], None] | None, died: str | None) -> None:
        super().__init__()
        self.call, self.died = call, died
        self._receive = receive
        # Guards the process while the job runs there, and when it is to end, in seconds after its
        # start.
        self._lock = threading.Lock()
        self._child: ChildProcess | None = None
        self._end = math.inf

    def cancel(self, patience: float | None = None, *, after: float = 0.0) -> bool:
        """Cancel the job; return whether it waited, and so will not begin.

        A job that runs is told to end if its task takes a `Channel`.

        Args:
            patience: Seconds after which a job that still runs ends with its process; None for
                never.
            after: Seconds after its start before which it is not cancelled.
        """
        if after == 0.0 and super().cancel():
            return True
        with self._lock:
            self._end = min(self._end, after)
            if self._child is not None:
                self._child.cancel(self._end)
        if patience is not None:
            timer = threading.Timer(patience, self._kill)
            timer.daemon = True
            timer.start()
        return False

    @property
    def is_to_end(self) -> bool:
        """Whether the job was cancelled while it ran."""
        return self._end < math.inf

    def run_in(self, child: ChildProcess, data: bytes) -> Reply:
        """Return the last reply of a process that does the job, given the pickled call.

        Raises one of `PIPE_ERRORS` if the process died.
        """
        try:
            with self._lock:
                if self._end == 0.0:
                    return Reply(error=CancelledError(CANCELLED))
                child.begin(data)
                self._child = child
                if self.is_to_end:
                    child.cancel(self._end)
            while not (reply := child.read()).is_last:
                if self._receive is not None:
                    self._receive(reply.value)
            return reply
        finally:
            with self._lock:
                self._child = None

    def _kill(self) -> None:
        # No other job runs in the process meanwhile.
        with self._lock:
            if self._child is not None:
                self._child.process.kill()


@dataclass
class _Queue:
    """The jobs that wait for the processes of one name, and the threads of these processes.

    Each thread has its process once it was needed, and `idle` counts those without a job.
    """

    modules: Sequence[str]
    waiting: dict[object, LongJob] = field(default_factory=dict[object, LongJob])
    threads: dict[threading.Thread, ChildProcess | None] = field(
        default_factory=dict[threading.Thread, ChildProcess | None]
    )
    idle: int = 0


class Jobs:
    """The owner of processes, which have names and do jobs in the order of their requests.

    A process is started when a job needs it, and again if it dies. Results come on threads of
    their own.

    Args:
        report: Called with a message when a process died or a task failed unexpectedly, which is
            logged then; None to report nothing.
        size: Number of processes of each name.
        modules: Modules that the processes import before their first task.
        environment: Variables of their environment beside those of this process.
    """

    def __init__(
        self,
        report: Callable[[str], None] | None = None,
        *,
        size: int = 1,
        modules: Sequence[str] = (),
        environment: Mapping[str, str] | None = None,
    ) -> None:
        self._report, self._size = report, size
        self._modules, self._environment = modules, environment or {}
        # Guards all below, and is notified of all changes.
        self._changed = threading.Condition()
        self._queues: dict[str, _Queue] = {}
        self.is_stopped = False

    def start(
        self,
        task: Callable[..., Any],
        arguments: tuple[Any, ...],
        done: Callable[[Any], None] = lambda _: None,
        failed: Callable[[str], None] = lambda _: None,
        receive: Callable[[Any], None] | None = None,
        *,
        options: Mapping[str, Any] | None = None,
        key: object = None,
        process: str = PAGE,
        died: str | None = None,
    ) -> LongJob:
        """Queue a task for a process, and return it as a job.

        Args:
            task: A function of a module; the process imports that module.
            arguments: Its arguments; they and the result must pickle.
            done: Called with the result, on a thread of the process.
            failed: Called instead with a message for people if there is no result. After `stop`
                none of the two is called.
            receive: Called with each value that the task sends meanwhile. If given, the task
                takes a `Channel` as its last argument.
            options: Its arguments by name.
            key: Key of the task, of which only the newest waits; None if none replaces it.
            process: Name of the process.
            died: Message when the process died over the task, which is not done again then; None
                to do it once more.
        """
        job = LongJob(Call(task, arguments, options or {}, receive is not None), receive, died)
        job.add_done_callback(partial(self._hand_over, done, failed))
        key = object() if key is None else key
        with self._changed:
            own = self._queue(process)
            own.waiting.pop(key, None)
            own.waiting[key] = job
            if own.idle < len(own.waiting) and len(own.threads) < self._size:
                thread = threading.Thread(target=self._run, args=(own,), name=process, daemon=True)
                own.threads[thread] = None
                thread.start()
            self._changed.notify_all()
        return job

    def prepare(
        self, process: str, modules: Sequence[str], then: Callable[[], None] = lambda: None
    ) -> None:
        """Start a process before it is needed; `then` is called when it has started.

        It imports some modules first, so that its first task starts at once.
        """
        with self._changed:
            self._queue(process).modules = modules
        self.start(do_nothing, (), lambda _: then(), process=process)

    def process_ids(self, process: str = PAGE) -> list[int]:
        """Return the ids of the processes of a name; none that has not been needed yet."""
        with self._changed:
            children = self._queue(process).threads.values()
            return [child.process.pid for child in children if child is not None]

    def wait_until_idle(self, timeout: float | None, process: str = PAGE) -> bool:
        """Wait until no job of a process waits or is under way; return whether that is so."""

        def is_idle() -> bool:
            own = self._queue(process)
            return not own.waiting and own.idle == len(own.threads)

        with self._changed:
            return self._changed.wait_for(is_idle, timeout)

    def stop(self) -> None:
        """End the processes, whatever they do, and cancel the jobs that wait."""
        with self._changed:
            self.is_stopped = True
            queues = [*self._queues.values()]
            waiting = [job for each in queues for job in each.waiting.values()]
            for each in queues:
                each.waiting.clear()
                for child in filter(None, each.threads.values()):
                    child.process.kill()
            self._changed.notify_all()
        for job in waiting:
            job.cancel()
        for thread in [thread for each in queues for thread in each.threads]:
            if thread is not threading.current_thread():
                thread.join(timeout=5.0)

    def _queue(self, process: str) -> _Queue:
        """Return the queue of a name; this thread holds the lock."""
        return self._queues.setdefault(process, _Queue(self._modules))

    def _hand_over(
        self, done: Callable[[Any], None], failed: Callable[[str], None], job: Future[Any]
    ) -> None:
        if self.is_stopped:
            return
        error = CancelledError() if job.cancelled() else job.exception()
        if error is None:
            done(job.result())
        else:
            failed(problem_of(error))

    def _run(self, own: _Queue) -> None:
        """Do jobs of a queue, in the process of this thread, until all are to stop."""
        if sys.platform != "win32":
            # A terminal sends Ctrl-C to the processes too, which inherit this.
            signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
        while True:
            with self._changed:
                own.idle += 1
                self._changed.notify_all()
                self._changed.wait_for(lambda: own.waiting or self.is_stopped)
                if self.is_stopped:
                    break
                own.idle -= 1
                job = own.waiting.pop(next(iter(own.waiting)))
            if job.set_running_or_notify_cancel():
                self._do(job, own)
        self._drop(own)

    def _do(self, job: LongJob, own: _Queue) -> None:
        """Do a job, and give it its result or its error."""
        try:
            reply = self._reply(job, own)
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

    def _reply(self, job: LongJob, own: _Queue) -> Reply:
        """Return the last reply of the process of this thread; try again if it died once."""
        # It may hold what cannot be pickled, which is no fault of the process.
        data = pickle.dumps(job.call, pickle.HIGHEST_PROTOCOL)
        for is_last in (False, True) if job.died is None else (True,):
            child = self._ready_child(own)
            try:
                if child is not None:
                    return job.run_in(child, data)
            except PIPE_ERRORS:
                self._drop(own)
            if job.is_to_end:
                return Reply(error=CancelledError(CANCELLED))
            if self.is_stopped:
                break
            if is_last:
                self._tell(job.died or DIED_TWICE, job)
            else:
                self._tell(RESTARTED)
        return Reply(error=WorkerDiedError(job.died or DIED_TWICE))

    def _ready_child(self, own: _Queue) -> ChildProcess | None:
        """Return the process of this thread, ready for tasks; None once all are to stop.

        A failed start is no task's fault, and tried again.
        """
        last, thread = "", threading.current_thread()
        child = own.threads[thread]
        for _ in range(STARTS if child is None else 0):
            try:
                with self._changed:
                    if self.is_stopped:
                        return None
                    child = own.threads[thread] = ChildProcess(own.modules, self._environment)
                child.read()
                break
            except PIPE_ERRORS as error:
                last = f" ({error})" if str(error) else ""
                self._drop(own)
        if own.threads[thread] is None:
            raise RuntimeError(
                f"no worker process stays alive until it is ready{last}; see what they wrote"
            )
        return child

    def _drop(self, own: _Queue) -> None:
        """End the process of this thread, if there is one."""
        thread = threading.current_thread()
        with self._changed:
            child, own.threads[thread] = own.threads[thread], None
        if child is not None:
            child.end()

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


def do_nothing() -> None:
    """Do nothing: a task that is done as soon as the process has started."""
