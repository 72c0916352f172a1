"""Processes that evaluate designs, as executors of `concurrent.futures`.

The pool of the standard library, and that of loky, fails as a whole when one of its processes
dies. Here each process has a thread and a pipe of its own: a death costs the one task that the
process had, and the thread starts another.
"""

from __future__ import annotations

import contextlib
import importlib
import os
import pickle
import signal
import sys
import threading
from abc import ABC, abstractmethod
from collections.abc import Callable, Generator
from concurrent.futures import BrokenExecutor, Executor, Future, ThreadPoolExecutor
from multiprocessing import get_context, parent_process
from multiprocessing.connection import Connection, wait
from multiprocessing.context import SpawnProcess
from typing import Any, ParamSpec, TypeVar

from explorer.errors import ExplorerError, InputError

Arguments = ParamSpec("Arguments")
Result = TypeVar("Result")

MOST_WORKERS = 1024

# Libraries of linear algebra read these when they are loaded. Matrices are small here, and
# the processes many.
ONE_THREAD = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS")
# Python reads this when it starts, and imports nothing from the working folder then, where a file
# may have the name of a library. The process has the paths of its parent before its first task.
SAFE_PATH = "PYTHONSAFEPATH"

# Failed starts in a row after which a task fails.
STARTS = 10

# One thread at a time changes the environment, or one would restore what another has set.
_environment = threading.Lock()

# Errors of a pipe to a process that has ended.
PIPE_ERRORS = (EOFError, OSError)


class WorkerDiedError(BrokenExecutor):
    """The process of a task died before the task was done."""


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
        count = cores() if size is None else size
        if not 1 <= count <= MOST_WORKERS:
            raise InputError(f"the workers must be from 1 to {MOST_WORKERS}; got {count}")
        self._size = count
        self._threads = ThreadPoolExecutor(count, "worker", _block_interrupts)
        # The process of each thread; the lock guards all of them.
        self._own = threading.local()
        self._lock = threading.Lock()
        self._children: set[ChildProcess] = set()
        self._is_over = self._is_cancelled = False

    @property
    def size(self) -> int:
        """Number of processes."""
        return self._size

    def submit(
        self, fn: Callable[Arguments, Result], /, *args: Arguments.args, **kwargs: Arguments.kwargs
    ) -> Future[Result]:
        """Call a function in one of the processes, see `concurrent.futures.Executor`."""
        return self._threads.submit(self._call, (fn, args, kwargs))

    def shutdown(self, wait: bool = True, *, cancel_futures: bool = False) -> None:
        """End the processes, and wait for that, or let them end with this process.

        Tasks that have not begun may be dropped, and those that have killed.
        """
        self._is_over = True
        self._threads.shutdown(wait=False, cancel_futures=cancel_futures)
        if cancel_futures:
            with self._lock:
                self._is_cancelled = True
                for child in self._children:
                    child.process.kill()
        self._threads.shutdown(wait=wait)
        if wait:
            while self._children:
                self._children.pop().end()

    def _call(self, call: object) -> Any:
        """Return the result of a call in the process of this thread."""
        try:
            is_good, value = self._ready_child().call(call)
        except PIPE_ERRORS:
            self._drop()
            raise WorkerDiedError("the worker process died") from None
        if not is_good:
            raise value
        return value

    def _ready_child(self) -> ChildProcess:
        """Return the process of this thread, ready for tasks; a failed start is no task's fault."""
        last = ""
        for _ in range(STARTS):
            try:
                with self._lock:
                    if self._is_cancelled:
                        raise WorkerDiedError("the worker process was ended")
                    child: ChildProcess | None = getattr(self._own, "child", None)
                    if child is None:
                        child = self._own.child = ChildProcess()
                        self._children.add(child)
                child.wait_until_ready()
            except PIPE_ERRORS as error:
                last = f" ({error})" if str(error) else ""
                self._drop()
                if self._is_over:
                    raise WorkerDiedError("the worker process was ended") from None
            else:
                return child
        raise RunError(
            f"no worker process stays alive until it is ready{last}; see what they wrote. A "
            "script must be a file and start workers only below if __name__ == '__main__', since "
            "each of them imports it"
        )

    def _drop(self) -> None:
        """End the process of this thread, if there is one."""
        child: ChildProcess | None = getattr(self._own, "child", None)
        self._own.child = None
        if child is not None:
            with self._lock:
                self._children.discard(child)
            child.end()


def _block_interrupts() -> None:
    """Keep Ctrl-C from the processes that this thread starts; the parent ends them."""
    if sys.platform != "win32":
        # A terminal sends it to the children too, which inherit this.
        signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})


class ChildProcess:
    """A process that answers calls over a pipe, and ends with its parent."""

    def __init__(self) -> None:
        context = get_context("spawn")
        self._pipe, child_end = context.Pipe()
        self.process: SpawnProcess = context.Process(
            target=_answer_calls, args=(child_end,), name="explorer worker", daemon=True
        )
        with _environment, _own_environment():
            self.process.start()
        # While the parent holds the child's end too, it does not see the child close it.
        child_end.close()
        self._is_ready = False

    def wait_until_ready(self) -> None:
        """Wait for the first message; raise one of `PIPE_ERRORS` if the process died."""
        if not self._is_ready:
            self._pipe.recv()
            self._is_ready = True

    def call(self, call: object) -> tuple[bool, Any]:
        """Return whether a call succeeded, and its result or error.

        Raises one of `PIPE_ERRORS` if the process died.
        """
        self._pipe.send(call)
        return self._pipe.recv()

    def end(self) -> None:
        """Kill the process, wait for its end and close the pipe."""
        self.process.kill()
        self.process.join()
        self.process.close()
        self._pipe.close()


def cores() -> int:
    """Return the number of cores that this process may use."""
    if sys.platform == "linux":
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


@contextlib.contextmanager
def _own_environment() -> Generator[None]:
    """Limit processes started within a `with` block to one thread and to a safe path each.

    Their environment must say so from the start, since they import the user's script first.
    """
    names = (*ONE_THREAD, SAFE_PATH)
    previous = {name: os.environ.get(name) for name in names}
    os.environ.update(dict.fromkeys(names, "1"))
    try:
        yield
    finally:
        for name, value in previous.items():
            if value is None:
                del os.environ[name]
            else:
                os.environ[name] = value


def _answer_calls(pipe: Connection) -> None:
    """Call the functions that come over a pipe until it is closed; all that a worker does."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    threading.Thread(target=_end_with_parent, daemon=True).start()
    importlib.import_module("explorer.sweep.rows").load_common()
    pipe.send(None)
    # The parent closes the pipe when it ends this process.
    with contextlib.suppress(*PIPE_ERRORS):
        while True:
            answer = _next_answer(pipe)
            try:
                pipe.send(answer)
            except PIPE_ERRORS:
                raise
            except Exception as error:  # noqa: BLE001 - not every result can be sent
                pipe.send((False, RuntimeError(f"the result cannot be sent: {error}")))


def _next_answer(pipe: Connection) -> tuple[bool, Any]:
    """Return whether the next call succeeded, and its result or error."""
    data = pipe.recv_bytes()
    try:
        function, arguments, options = pickle.loads(data)  # noqa: S301 - over a pipe of our own
        return True, function(*arguments, **options)
    except Exception as error:  # noqa: BLE001 - the parent's future raises it
        return False, error


def _end_with_parent() -> None:
    """End this process when its parent is gone, whatever it is doing."""
    parent = parent_process()
    if parent is not None:
        wait([parent.sentinel])
        os._exit(1)
