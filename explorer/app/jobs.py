"""Work that must not pile up: of each kind only the newest waits.

viser runs callbacks at the same time and in no order, so none of them computes. They
leave word for one thread; what is waiting when it comes round is handled in one go. Heavy
work leaves the process altogether, since much of it holds the interpreter lock.
"""

from __future__ import annotations

import contextlib
import itertools
import os
import pickle
import subprocess
import sys
import threading
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import IO, Any, Generic, TypeVar, cast

from explorer.app.worker import Cancel, Order, Reply, Told, read_frame, write_frame

Item = TypeVar("Item")

RESTARTED = "The worker process died and was started again."

# What can go wrong with a pipe to a process that has ended.
GONE = (OSError, ValueError, EOFError, pickle.UnpicklingError)


class LatestWins(Generic[Item]):
    """A thread that handles what is posted, the newest of each key only.

    Args:
        handle: Called with everything that waits, in the order of the stamps. What it
            raises ends the thread, so it must not.
        name: Of the thread.
    """

    def __init__(self, handle: Callable[[Sequence[Item]], None], name: str) -> None:
        self._handle = handle
        self._waiting: dict[object, tuple[float, Item]] = {}
        self._condition = threading.Condition()
        self._busy = False
        self._stopped = False
        self._thread = threading.Thread(target=self._run, name=name, daemon=True)
        self._thread.start()

    def post(self, key: object, stamp: float, item: Item) -> None:
        """Leave an item; it replaces one of the same key that still waits.

        Args:
            key: What it is about; events of one slider share it.
            stamp: When it happened. An item older than the waiting one is dropped.
            item: What to handle.
        """
        with self._condition:
            waiting = self._waiting.get(key)
            if waiting is None or waiting[0] <= stamp:
                self._waiting[key] = (stamp, item)
                self._condition.notify_all()

    def is_waiting(self, key: object) -> bool:
        """Whether an item of this key waits to be handled."""
        with self._condition:
            return key in self._waiting

    @property
    def waiting(self) -> int:
        """How many items wait."""
        with self._condition:
            return len(self._waiting)

    def wait_until_idle(self, timeout: float) -> bool:
        """Wait until nothing waits and nothing runs; say whether that came about."""
        with self._condition:
            return self._condition.wait_for(
                lambda: not self._waiting and not self._busy, timeout=timeout
            )

    def stop(self) -> None:
        """Drop what waits and end the thread."""
        with self._condition:
            self._stopped = True
            self._waiting.clear()
            self._condition.notify_all()
        if threading.current_thread() is not self._thread:
            self._thread.join(timeout=5.0)

    def _run(self) -> None:
        while True:
            with self._condition:
                self._busy = False
                self._condition.notify_all()
                self._condition.wait_for(lambda: self._waiting or self._stopped)
                if self._stopped:
                    return
                items = [item for _, item in sorted(self._waiting.values(), key=lambda w: w[0])]
                self._waiting.clear()
                self._busy = True
            self._handle(items)


@dataclass(frozen=True)
class _Request:
    key: object
    order: Order
    done: Callable[[Any], None]
    failed: Callable[[str], None]
    told: Callable[[Any], None] | None


class Worker:
    """A child process for heavy work; of each kind of request only the newest waits.

    It is started when it is first needed, and again should it die: then what it was doing
    is done once more, unless it tells. Results come on a thread of their own.

    Args:
        report: Called with a message when the process died or failed unexpectedly.
        tasks: The module that holds the tasks.
        died: What to say when the process died.
    """

    def __init__(
        self,
        report: Callable[[str], None],
        *,
        tasks: str = "explorer.app.tasks",
        died: str = "The worker process died over this twice; the next change starts it again.",
    ) -> None:
        self._report = report
        self._tasks = tasks
        self._died = died
        self._numbers = itertools.count()
        self._process: subprocess.Popen[bytes] | None = None
        self._stopped = False
        # Of the process: it must not be started after it was told to stop.
        self._lock = threading.Lock()
        # Of what is written to it, of ending it by force, and of these three: the order that
        # it does, the newest that was cancelled, and when it is ended for not heeding that.
        self._writing = threading.Lock()
        self._doing: int | None = None
        self._cancelled = -1
        self._deadline: threading.Timer | None = None
        self._queue: LatestWins[_Request] = LatestWins(self._serve_all, "worker")

    def submit(
        self,
        key: object,
        task: str,
        arguments: tuple[Any, ...],
        done: Callable[[Any], None],
        failed: Callable[[str], None],
        told: Callable[[Any], None] | None = None,
    ) -> int:
        """Ask for a task; one of the same key that still waits is dropped.

        Args:
            key: What it is about.
            task: The name of a function in the module of tasks.
            arguments: For it; they and the result must pickle.
            done: Called with the result.
            failed: Called with a message for people instead.
            told: Called with what the task tells meanwhile. Given, the task takes a
                `explorer.app.worker.Line` besides its arguments.

        Returns:
            A number to cancel it by.
        """
        number = next(self._numbers)
        order = Order(number, task, arguments, tells=told is not None)
        self._queue.post(key, number, _Request(key, order, done, failed, told))
        return number

    def cancel(self, number: int, patience: float) -> None:
        """Ask a task, and all before it, to end early.

        One that tells hears of it; any other is not begun, or ends with its process.

        Args:
            number: Of the task, as `submit` returned it.
            patience: After so many seconds it ends together with its process.
        """
        with self._writing:
            self._cancelled = max(self._cancelled, number)
            if self._doing == number and self._process is not None:
                with contextlib.suppress(*GONE):
                    write_frame(cast("IO[bytes]", self._process.stdin), Cancel(number))
            if self._deadline is not None:
                self._deadline.cancel()
            self._deadline = threading.Timer(patience, self._kill, (number,))
            self._deadline.daemon = True
            self._deadline.start()

    @property
    def process_id(self) -> int | None:
        """The child's process, None if it has not been needed yet."""
        process = self._process
        return None if process is None else process.pid

    def start(self, then: Callable[[], None] = lambda: None) -> None:
        """Start the process before it is needed; `then` is called when it is there."""
        self.submit("start", "ready", (), lambda _: then(), lambda _: None)

    def wait_until_idle(self, timeout: float) -> bool:
        """Wait until nothing waits and nothing runs; say whether that came about."""
        return self._queue.wait_until_idle(timeout)

    def stop(self) -> None:
        """End the process, whatever it is doing."""
        with self._lock:
            self._stopped = True
            if self._process is not None:
                _end(self._process)
        self._queue.stop()

    def _serve_all(self, requests: Sequence[_Request]) -> None:
        for request in requests:
            # What has become out of date while others were served is left out.
            if not self._queue.is_waiting(request.key):
                self._serve(request)

    def _serve(self, request: _Request) -> None:
        reply = self._tried(request)
        # What has told something cannot be begun anew without a word.
        if reply is None and request.told is None and not self._is_over(request):
            self._report(RESTARTED)
            reply = self._tried(request)
        if reply is None:
            if self._stopped:
                return
            if self._cancelled < request.order.number:
                self._report(self._died)
            request.failed(self._died)
        elif reply.problem is None:
            request.done(reply.value)
        else:
            if not reply.expected:
                self._report(f"Something went wrong in the worker: {reply.problem}")
            request.failed(reply.problem)

    def _is_over(self, request: _Request) -> bool:
        return self._stopped or self._cancelled >= request.order.number

    def _tried(self, request: _Request) -> Reply | None:
        """Return the reply to a request.

        None if the process died or is to stop, or if the task was not begun any more.
        """
        process = self._alive()
        if process is None:
            return None
        try:
            if not self._hand_over(request.order, process):
                return None
            return _replied(request, process)
        except GONE:
            with self._lock:
                _end(process)
                self._process = None
            return None
        finally:
            with self._writing:
                self._doing = None
                # One that waits for its turn yet keeps its deadline.
                if self._deadline is not None and self._cancelled <= request.order.number:
                    self._deadline.cancel()

    def _hand_over(self, order: Order, process: subprocess.Popen[bytes]) -> bool:
        """Write an order to the process; return whether it is to be done at all."""
        with self._writing:
            is_cancelled = self._cancelled >= order.number
            # It would not hear of it, and the time to end it by force may have passed.
            if is_cancelled and not order.tells:
                return False
            # Both are pipes, as they were asked for.
            stream = cast("IO[bytes]", process.stdin)
            write_frame(stream, order)
            self._doing = order.number
            if is_cancelled:
                write_frame(stream, Cancel(order.number))
            return True

    def _kill(self, number: int) -> None:
        # Nothing else is handed over meanwhile, so that it cannot hit what comes next.
        with self._writing:
            if self._doing == number and self._process is not None:
                self._process.kill()

    def _alive(self) -> subprocess.Popen[bytes] | None:
        """Return the process, started if need be; None once it is to stop."""
        with self._lock:
            if self._stopped:
                return None
            if self._process is not None and self._process.poll() is not None:
                # Killed while it had nothing to do.
                _end(self._process)
                self._process = None
                self._report(RESTARTED)
            if self._process is None:
                paths = {"PYTHONPATH": str(Path(__file__).parents[2])}
                code = "import sys; from explorer.app.worker import main; main(sys.argv[1])"
                self._process = subprocess.Popen(  # noqa: S603 - our own interpreter and words
                    [sys.executable, "-P", "-c", code, self._tasks],
                    stdin=subprocess.PIPE,
                    stdout=subprocess.PIPE,
                    env={**os.environ, **paths},
                )
            return self._process


def _replied(request: _Request, process: subprocess.Popen[bytes]) -> Reply:
    """Return the reply to a request; what is told before it is passed on."""
    while True:
        frame: Told | Reply = read_frame(cast("IO[bytes]", process.stdout))
        if isinstance(frame, Reply):
            return frame
        if request.told is not None:
            request.told(frame.value)


def _end(process: subprocess.Popen[bytes]) -> None:
    process.kill()
    process.wait()
    for pipe in (process.stdin, process.stdout):
        if pipe is not None:
            # What was written and not read cannot be flushed any more.
            with contextlib.suppress(OSError):
                pipe.close()
