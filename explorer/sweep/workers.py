"""Processes that evaluate designs, as executors of `concurrent.futures`.

Those of the standard library end all together when one of them dies. Here each has a thread
and a pipe of its own: a death costs the one task that it had, and the process is started anew.
"""

from __future__ import annotations

import contextlib
import importlib
import os
import queue
import signal
import sys
import threading
from abc import ABC, abstractmethod
from collections.abc import Callable, Generator
from concurrent.futures import BrokenExecutor, Executor, Future
from dataclasses import dataclass
from multiprocessing import get_context, parent_process
from multiprocessing.connection import Connection, wait
from multiprocessing.context import SpawnProcess
from typing import Any, ParamSpec, TypeVar

from explorer.errors import InputError

Arguments = ParamSpec("Arguments")
Result = TypeVar("Result")

MOST_WORKERS = 1024

# Libraries of linear algebra read these when they are loaded. Matrices are small here, and
# the processes many.
ONE_THREAD = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS")

# How often in a row a process may die while it starts, before no task begins any more; and how
# many may end by themselves as long as none was ever ready, since it is then no accident.
STARTS, FIRST_STARTS = 10, 4

# What can go wrong with a pipe to a process that has ended.
GONE = (EOFError, OSError)


class WorkerDiedError(BrokenExecutor):
    """The process of a task died before the task was done."""


class NoWorkerError(Exception):
    """No process stays alive until it is ready: a task was never begun."""


class Workers(Executor, ABC):
    """An executor whose size is known, and how it tells that a worker died."""

    died: tuple[type[BaseException], ...] = (BrokenExecutor,)
    """What the future of a task raises whose worker died."""

    task_seconds: float = 0.0
    """How long a task should take, so that handing it over costs little beside it."""

    @property
    @abstractmethod
    def size(self) -> int:
        """How many tasks run at the same time."""


@dataclass(frozen=True)
class _Task:
    future: Future[Any]
    function: Callable[..., Any]
    arguments: tuple[Any, ...]
    options: dict[str, Any]


class LocalWorkers(Workers):
    """Processes on this machine.

    Args:
        size: How many; one for each core that this process may use if None.

    Raises:
        InputError: none, or far too many.
    """

    def __init__(self, size: int | None = None) -> None:
        wanted = cores() if size is None else size
        if not 1 <= wanted <= MOST_WORKERS:
            raise InputError(f"the workers must be from 1 to {MOST_WORKERS}; got {wanted}")
        self._tasks: queue.SimpleQueue[_Task | None] = queue.SimpleQueue()
        self._is_over = threading.Event()
        # Of the processes, by their thread.
        self._lock = threading.Lock()
        self._children: dict[int, _Child] = {}
        # As long as no process was ever ready, how many ended by themselves before they were.
        self._was_ready, self._stillborn = False, 0
        self._threads = [
            threading.Thread(target=self._serve, args=(k,), name=f"worker {k}", daemon=True)
            for k in range(wanted)
        ]
        for thread in self._threads:
            thread.start()

    @property
    def size(self) -> int:
        """How many processes there are."""
        return len(self._threads)

    @property
    def process_ids(self) -> list[int]:
        """The processes that are there now."""
        with self._lock:
            return [child.process_id for child in self._children.values()]

    def submit(
        self, fn: Callable[Arguments, Result], /, *args: Arguments.args, **kwargs: Arguments.kwargs
    ) -> Future[Result]:
        """Have a function called in one of the processes, see `concurrent.futures.Executor`."""
        if self._is_over.is_set():
            raise RuntimeError("cannot submit after shutdown")
        future: Future[Result] = Future()
        self._tasks.put(_Task(future, fn, args, kwargs))
        return future

    def shutdown(self, wait: bool = True, *, cancel_futures: bool = False) -> None:
        """End the processes.

        Args:
            wait: Until they have ended.
            cancel_futures: Drop what has not begun, and kill what has.
        """
        self._is_over.set()
        if cancel_futures:
            with contextlib.suppress(queue.Empty):
                while (task := self._tasks.get_nowait()) is None or task.future.cancel():
                    pass
            with self._lock:
                for child in self._children.values():
                    child.kill()
        for _ in self._threads:
            self._tasks.put(None)
        if wait:
            for thread in self._threads:
                thread.join()

    def _serve(self, number: int) -> None:
        _keep_interrupts_from_children()
        try:
            while (task := self._tasks.get()) is not None:
                if task.future.set_running_or_notify_cancel():
                    self._do(task, number)
        finally:
            self._drop(number)

    def _do(self, task: _Task, number: int) -> None:
        try:
            is_good, value = self._child(number).ask(task)
        except GONE:
            self._drop(number)
            task.future.set_exception(WorkerDiedError("the worker process died"))
        except Exception as error:  # noqa: BLE001 - whoever sent the task is told
            task.future.set_exception(error)
        else:
            if is_good:
                task.future.set_result(value)
            else:
                task.future.set_exception(value)

    def _child(self, number: int) -> _Child:
        """Return the process of a thread, ready for tasks: a start that fails is no task's fault.

        Raises:
            NoWorkerError: none stays alive until it is ready.
            WorkerDiedError: it was killed, since no tasks are done any more.
        """
        last = ""
        for _ in range(STARTS):
            if not self._was_ready and self._stillborn >= max(FIRST_STARTS, self.size):
                break
            child = None
            try:
                with self._lock:
                    child = self._children.get(number)
                    if child is None:
                        child = self._children[number] = _Child()
                child.wait_until_ready()
            except GONE as error:
                last = f" ({error})" if str(error) else ""
                # Who kills one of them need not mean them all.
                is_own_fault = child is None or not child.was_killed()
                self._drop(number)
                if self._is_over.is_set():
                    raise WorkerDiedError("the worker process was ended") from None
                with self._lock:
                    self._stillborn += is_own_fault
            else:
                self._was_ready = True
                return child
        raise NoWorkerError(
            f"no worker process stays alive until it is ready{last}; what they wrote tells why. A "
            "script must be a file and start workers only below if __name__ == '__main__', since "
            "each of them imports it"
        )

    def _drop(self, number: int) -> None:
        """End the process of a thread, if there is one."""
        with self._lock:
            child = self._children.pop(number, None)
        if child is not None:
            child.end()


class _Child:
    """A process and the pipe to it."""

    def __init__(self) -> None:
        context = get_context("spawn")
        self._pipe, other = context.Pipe()
        self._process: SpawnProcess = context.Process(
            target=_answer, args=(other,), name="explorer worker", daemon=True
        )
        with _one_thread_each():
            self._process.start()
        # Held here too, its end would not be seen.
        other.close()
        self._is_ready = False

    @property
    def process_id(self) -> int:
        return self._process.pid or 0

    def wait_until_ready(self) -> None:
        """Wait until it has loaded what tasks need.

        Raises:
            EOFError: the process died.
            OSError: likewise.
        """
        if not self._is_ready:
            self._pipe.recv()
            self._is_ready = True

    def ask(self, task: _Task) -> tuple[bool, Any]:
        """Return whether a task ended well, and its result or what it raised.

        Raises:
            EOFError: the process died.
            OSError: likewise.
        """
        self._pipe.send((task.function, task.arguments, task.options))
        return self._pipe.recv()

    def was_killed(self) -> bool:
        """Whether the process, which has died, was ended by a signal rather than by itself."""
        # What ends by itself closes its pipe a little earlier.
        self._process.join(1.0)
        return (self._process.exitcode or 0) < 0

    def kill(self) -> None:
        self._process.kill()

    def end(self) -> None:
        self._process.kill()
        self._process.join()
        self._process.close()
        self._pipe.close()


def cores() -> int:
    """Return how many cores this process may use."""
    if sys.platform == "linux":
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


@contextlib.contextmanager
def _one_thread_each() -> Generator[None]:
    """Have processes that are started meanwhile use one thread each.

    It must stand in the environment that they begin with: what a script of the user's
    imports is imported in them first.
    """
    kept = {name: os.environ.get(name) for name in ONE_THREAD}
    os.environ.update(dict.fromkeys(ONE_THREAD, "1"))
    try:
        yield
    finally:
        for name, value in kept.items():
            if value is None:
                del os.environ[name]
            else:
                os.environ[name] = value


def _keep_interrupts_from_children() -> None:
    """Block Ctrl-C in this thread and in the processes that it starts, which inherit that.

    A terminal sends it to all of them; it is the parent who ends them.
    """
    if sys.platform != "win32":
        signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})


def _answer(pipe: Connection) -> None:
    """Call what is asked for until the pipe is closed: the life of a worker process."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    threading.Thread(target=_end_with_parent, daemon=True).start()
    importlib.import_module("explorer.sweep.rows").ready()
    pipe.send(None)
    while True:
        try:
            function, arguments, options = pipe.recv()
        except GONE:
            return
        except Exception as error:  # noqa: BLE001 - a task that cannot be read is told as such
            answer = False, error
        else:
            answer = _called(function, arguments, options)
        try:
            pipe.send(answer)
        except GONE:
            return
        except Exception as error:  # noqa: BLE001 - nor can every result be sent
            pipe.send((False, RuntimeError(f"the result cannot be sent: {error}")))


def _called(
    function: Callable[..., Any], arguments: tuple[Any, ...], options: dict[str, Any]
) -> tuple[bool, Any]:
    try:
        return True, function(*arguments, **options)
    except Exception as error:  # noqa: BLE001 - the parent raises it
        return False, error


def _end_with_parent() -> None:
    """End this process when its parent is gone, whatever it is doing."""
    parent = parent_process()
    if parent is not None:
        wait([parent.sentinel])
        os._exit(1)
