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
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import IO, Any, Generic, TypeVar, cast

from explorer.app.session.faults import Fault, Faults, log_fault
from explorer.app.session.worker import (
    Cancel,
    Order,
    Reply,
    Told,
    read_frame,
    ready,
    write_frame,
)
from explorer.files.packaged import SOURCES

Item = TypeVar("Item")

# A drawing that takes longer is cancelled as soon as a newer one waits; a shorter one is shown.
LONG_SECONDS = 1.0

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
    is_drawing: bool


class Worker:
    """A child process for heavy work; of each kind of request only the newest waits.

    It is started when it is first needed, and again should it die: then what it was doing
    is done once more, unless it tells. Results come on a thread of their own.

    Args:
        report: Called with a message when the process died or failed unexpectedly.
        preload: The modules that the process imports first, so that its first task starts at once.
        died: What to say when the process died.
        faults: Where requests are kept that failed unexpectedly; None to keep none.
    """

    def __init__(
        self,
        report: Callable[[str], None],
        *,
        preload: Sequence[str] = (),
        died: str = "The worker process died over this twice; the next change starts it again.",
        faults: Faults | None = None,
    ) -> None:
        self._report = report
        self._faults = faults
        self._preload = tuple(preload)
        self._died = died
        self._numbers = itertools.count()
        self._process: subprocess.Popen[bytes] | None = None
        self._stopped = False
        # Of the process: it must not be started after it was told to stop.
        self._lock = threading.Lock()
        # Of what is written to it, of ending it by force, and of these four: the request that
        # it does and since when, the orders that were cancelled, and when each of these is
        # ended for not heeding that.
        self._writing = threading.Lock()
        self._doing: _Request | None = None
        self._since = 0.0
        self._cancelled: set[int] = set()
        self._deadlines: dict[int, threading.Timer] = {}
        # The drawing that was last found to be out of date while it was under way.
        self._hurried = -1
        self._queue: LatestWins[_Request] = LatestWins(self._serve_all, "worker")

    def submit(
        self,
        key: object,
        task: Callable[..., Any],
        arguments: tuple[Any, ...],
        done: Callable[[Any], None],
        failed: Callable[[str], None],
        told: Callable[[Any], None] | None = None,
        *,
        is_drawing: bool = False,
    ) -> int:
        """Ask for a task; one of the same key that still waits is dropped.

        Args:
            key: What it is about.
            task: A function of a module; the process imports that module.
            arguments: For it; they and the result must pickle.
            done: Called with the result.
            failed: Called with a message for people instead.
            told: Called with what the task tells meanwhile. Given, the task takes a
                `explorer.app.session.worker.Line` besides its arguments.
            is_drawing: Whether only the newest task of this key is of use, as with drawings: one
                that is being done is cancelled when a newer one waits and `LONG_SECONDS` have
                passed. It is done once more should the process die, even if it tells.

        Returns:
            A number to cancel it by.
        """
        number = next(self._numbers)
        order = Order(number, task.__module__, task.__name__, arguments, tells=told is not None)
        request = _Request(key, order, done, failed, told, is_drawing)
        self._queue.post(key, number, request)
        self._hurry(key)
        return number

    def cancel(self, number: int, patience: float | None) -> None:
        """Ask a task to end early.

        One that tells hears of it; any other is not begun, or ends with its process.

        Args:
            number: Of the task, as `submit` returned it.
            patience: After so many seconds it ends together with its process; None for never.
        """
        with self._writing:
            self._cancel(number, patience)

    def _cancel(self, number: int, patience: float | None) -> None:
        """Do the same while nothing else is written."""
        self._cancelled.add(number)
        doing = self._doing
        if doing is not None and doing.order.number == number and self._process is not None:
            with contextlib.suppress(*GONE):
                write_frame(cast("IO[bytes]", self._process.stdin), Cancel(number))
        self._forget_deadline(number)
        if patience is None:
            return
        deadline = threading.Timer(patience, self._kill, (number,))
        deadline.daemon = True
        self._deadlines[number] = deadline
        deadline.start()

    def _forget_deadline(self, number: int) -> None:
        deadline = self._deadlines.pop(number, None)
        if deadline is not None:
            deadline.cancel()

    def _hurry(self, key: object) -> None:
        """Have the drawing under way cancelled, now or soon, if a newer one of its key waits.

        On a thread of its own, as writing may have to wait for the process.
        """
        doing, since = self._doing, self._since
        if doing is None or not doing.is_drawing or doing.key != key:
            return
        number = doing.order.number
        if number == self._hurried or not self._queue.is_waiting(key):
            return
        self._hurried = number
        left = max(0.0, since + LONG_SECONDS - time.monotonic())
        later = threading.Timer(left, self._cancel_if_doing, (number,))
        later.daemon = True
        later.start()

    def _cancel_if_doing(self, number: int) -> None:
        with self._writing:
            if self._doing is not None and self._doing.order.number == number:
                self._cancel(number, None)

    @property
    def process_id(self) -> int | None:
        """The child's process, None if it has not been needed yet."""
        process = self._process
        return None if process is None else process.pid

    def start(self, then: Callable[[], None] = lambda: None) -> None:
        """Start the process before it is needed; `then` is called when it is there."""
        self.submit("start", ready, (), lambda _: then(), lambda _: None)

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
            self._cancelled.discard(request.order.number)

    def _serve(self, request: _Request) -> None:
        reply = self._tried(request)
        # What has told something cannot be begun anew without a word, unless only its end counts.
        is_repeatable = request.told is None or request.is_drawing
        if reply is None and is_repeatable and not self._is_over(request):
            self._report(RESTARTED)
            reply = self._tried(request)
        if reply is None:
            if self._stopped:
                return
            if not self._is_over(request):
                self._tell(request, self._died, "the process died")
            request.failed(self._died)
        elif reply.problem is None:
            request.done(reply.value)
        else:
            if not reply.expected:
                task = request.order.task.replace("_", " ")
                message = f"Something went wrong in the worker ({task}): {reply.problem}"
                self._tell(request, message, reply.problem, reply.trace)
            request.failed(reply.problem)

    def _tell(self, request: _Request, message: str, problem: str, trace: str = "") -> None:
        order = request.order
        fault = Fault(order.module, order.task, order.arguments, order.tells, problem, trace)
        self._report(log_fault(fault, message, self._faults))

    def _is_over(self, request: _Request) -> bool:
        return self._stopped or request.order.number in self._cancelled

    def _tried(self, request: _Request) -> Reply | None:
        """Return the reply to a request.

        None if the process died or is to stop, or if the task was not begun any more.
        """
        process = self._alive()
        if process is None:
            return None
        try:
            if not self._hand_over(request, process):
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
                self._forget_deadline(request.order.number)

    def _hand_over(self, request: _Request, process: subprocess.Popen[bytes]) -> bool:
        """Write an order to the process; return whether it is to be done at all."""
        order = request.order
        with self._writing:
            is_cancelled = order.number in self._cancelled
            # It would not hear of it, and the time to end it by force may have passed.
            if is_cancelled and not order.tells:
                return False
            # Both are pipes, as they were asked for.
            stream = cast("IO[bytes]", process.stdin)
            write_frame(stream, order)
            self._since = time.monotonic()
            self._doing = request
            if is_cancelled:
                write_frame(stream, Cancel(order.number))
        # A newer one may have come before this one was known to be under way.
        self._hurry(request.key)
        return True

    def _kill(self, number: int) -> None:
        # Nothing else is handed over meanwhile, so that it cannot hit what comes next.
        with self._writing:
            self._deadlines.pop(number, None)
            doing = self._doing
            if doing is not None and doing.order.number == number and self._process is not None:
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
                paths = {"PYTHONPATH": str(SOURCES)}
                code = (
                    "import sys; from explorer.app.session.worker import main; main(sys.argv[1:])"
                )
                self._process = subprocess.Popen(  # noqa: S603 - our own interpreter and words
                    [sys.executable, "-P", "-c", code, *self._preload],
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
