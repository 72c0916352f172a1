"""The child process that does heavy work, since much of it holds the interpreter lock.

It does one task at a time, and exchanges pickled frames with its parent over its own standard
input and output; only our own parent writes to it. A task may send values while it runs, and may be
cancelled. Requests do not pile up: of each kind only the newest waits.
"""

from __future__ import annotations

import contextlib
import importlib
import itertools
import logging
import math
import os
import pickle
import queue
import signal
import subprocess
import sys
import threading
import time
import traceback
from collections.abc import Callable, Sequence
from logging.handlers import RotatingFileHandler
from typing import IO, Any, NamedTuple, cast

from explorer.errors import ExplorerError
from explorer.files.packaged import SOURCES
from explorer.numerics.compiled import warm_in_background
from explorer.page.session.clock import Timer
from explorer.page.session.latest import LatestWins

CANCELLED = "cancelled"
"""Problem in the reply of a task that was cancelled."""

RESTARTED = "The worker process died and was started again."
DIED_TWICE = "The worker process died over this twice; the next change starts it again."

# Errors of a pipe to a process that has ended.
PIPE_ERRORS = (OSError, ValueError, EOFError, pickle.UnpicklingError)
PROGRAM = "import sys; from explorer.page.session.worker import main; main(sys.argv[1:])"
# Largest number of characters of each argument's text in the log.
MOST_TEXT = 2_000


class CancelledError(Exception):
    """The task ends early because its parent cancelled it."""


class Channel(NamedTuple):
    """The connection of a task to its parent.

    It sends values, which must pickle, and tells whether the task is cancelled.
    """

    send: Callable[[Any], None]
    is_cancelled: Callable[[], bool]

    def raise_if_cancelled(self) -> None:
        """Raise `CancelledError` if the task is cancelled."""
        if self.is_cancelled():
            raise CancelledError(CANCELLED)


class _Order(NamedTuple):
    """A task to do: a function of a module; with `is_sending` its last argument is a `Channel`."""

    number: int
    task: Callable[..., Any]
    arguments: tuple[Any, ...]
    is_sending: bool


class _Cancel(NamedTuple):
    """A request to cancel the order with a number, so many seconds after its start."""

    number: int
    after: float


class _Reply(NamedTuple):
    """The result of an order: a value or a problem, with its traceback if it is unexpected.

    If it is not the last one, it is a value that the task sends before it is done.
    """

    value: Any = None
    problem: str | None = None
    trace: str = ""
    is_last: bool = True


def _write_frame(stream: IO[bytes] | None, value: object) -> None:
    pipe = cast("IO[bytes]", stream)
    pickle.dump(value, pipe, protocol=pickle.HIGHEST_PROTOCOL)
    pipe.flush()


def _read_frame(stream: IO[bytes] | None) -> Any:
    return pickle.load(cast("IO[bytes]", stream))  # noqa: S301 - from our own process and pipe


class _Request(NamedTuple):
    key: object
    order: _Order
    done: Callable[[Any], None]
    failed: Callable[[str], None]
    receive: Callable[[Any], None] | None


class Worker:
    """A child process for heavy work; of each kind of request only the newest waits.

    It is started when it is first needed, and again if it dies. Results come on a thread of their
    own.

    Args:
        report: Called with a message when the process died or failed unexpectedly.
        preload: The modules that the process imports first, so that its first task starts at once.
        died: The message when the process died over a task, which is not done again then; None to
            do it once more.
    """

    def __init__(
        self,
        report: Callable[[str], None],
        *,
        preload: Sequence[str] = (),
        died: str | None = None,
    ) -> None:
        self._report = report
        self._preload = tuple(preload)
        self._is_repeating = died is None
        self._died = died or DIED_TWICE
        self._numbers = itertools.count()
        self._process: subprocess.Popen[bytes] | None = None
        self._stopped = False
        # Guards the process: it must not be started after `stop`.
        self._lock = threading.Lock()
        # Guards writing to the process, killing it, and these three: the number of the order under
        # way, those that were cancelled, each with the patience with it, and the timer that kills
        # the process for the one under way.
        self._writing = threading.Lock()
        self._current: int | None = None
        self._cancelled: dict[int, tuple[_Cancel, float | None]] = {}
        self._deadline: Timer | None = None
        self._queue: LatestWins[_Request] = LatestWins(self._serve_all, "worker")

    def submit(
        self,
        key: object,
        task: Callable[..., Any],
        arguments: tuple[Any, ...],
        done: Callable[[Any], None],
        failed: Callable[[str], None],
        receive: Callable[[Any], None] | None = None,
    ) -> int:
        """Queue a task, in place of one with the same key that waits; return its number.

        Args:
            key: Key of the task; of each key only the newest task waits.
            task: A function of a module; the process imports that module.
            arguments: Its arguments; they and the result must pickle.
            done: Called with the result.
            failed: Called instead with a message for people if there is no result.
            receive: Called with each value that the task sends meanwhile. If given, the task
                takes a `Channel` as its last argument.
        """
        number = next(self._numbers)
        order = _Order(number, task, arguments, receive is not None)
        self._queue.post(key, number, _Request(key, order, done, failed, receive))
        return number

    def cancel(self, number: int, patience: float | None = None, *, after: float = 0.0) -> None:
        """Cancel a task.

        A task with a channel is told to end; any other is skipped, or ends with its process.

        Args:
            number: Number of the task, as `submit` returned it.
            patience: Seconds after which it ends together with its process; None for never.
            after: Seconds after its start before which a task with a channel does not end.
        """
        with self._writing:
            self._cancelled[number] = _Cancel(number, after), patience
            self._write_cancel(number)

    def _write_cancel(self, number: int) -> None:
        """Cancel an order if it is under way; this thread holds the lock for writing."""
        if self._process is None or number != self._current:
            return
        cancel, patience = self._cancelled[number]
        with contextlib.suppress(*PIPE_ERRORS):
            _write_frame(self._process.stdin, cancel)
        if patience is not None and self._deadline is None:
            self._deadline = Timer(patience, self._kill, number)

    @property
    def process_id(self) -> int | None:
        """Id of the child process; None if it has not been needed yet."""
        process = self._process
        return None if process is None else process.pid

    def start(self, then: Callable[[], None] = lambda: None) -> None:
        """Start the process before it is needed; `then` is called when it has started."""
        self.submit("start", do_nothing, (), lambda _: then(), lambda _: None)

    def wait_until_idle(self, timeout: float) -> bool:
        """Wait until no request waits and none is under way; return whether that is so."""
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
            # Requests that became outdated while others were served are left out.
            if request.key not in self._queue.waiting:
                self._serve(request)
            # Orders with lower numbers are done or were replaced.
            last = request.order.number
            with self._writing:
                self._cancelled = {n: each for n, each in self._cancelled.items() if n > last}

    def _serve(self, request: _Request) -> None:
        reply = self._attempt(request)
        if reply is None and self._is_repeating and not self._is_cancelled(request):
            self._report(RESTARTED)
            reply = self._attempt(request)
        if reply is None:
            if not self._is_cancelled(request):
                self._report_error(request, self._died)
            if not self._stopped:
                request.failed(self._died)
        elif reply.problem is None:
            request.done(reply.value)
        else:
            if reply.trace:
                task = request.order.task.__name__.replace("_", " ")
                message = f"Something went wrong in the worker ({task}): {reply.problem}"
                self._report_error(request, message, reply.trace)
            request.failed(reply.problem)

    def _report_error(self, request: _Request, message: str, trace: str = "") -> None:
        order = request.order
        texts = [repr(each)[:MOST_TEXT] for each in order.arguments]
        place = f"{trace}{order.task.__module__}.{order.task.__name__}, called with"
        self._report(log_error(message, "\n".join((place, *texts))))

    def _is_cancelled(self, request: _Request) -> bool:
        return self._stopped or request.order.number in self._cancelled

    def _attempt(self, request: _Request) -> _Reply | None:
        """Return the reply; None if the process died, or if the task is not to begin any more."""
        process = self._running_process()
        if process is None:
            return None
        try:
            is_sent = self._send(request, process)
            while is_sent:
                reply: _Reply = _read_frame(process.stdout)
                if reply.is_last:
                    return reply
                if request.receive is not None:
                    request.receive(reply.value)
        except PIPE_ERRORS:
            with self._lock:
                _end(process)
                self._process = None
        finally:
            with self._writing:
                self._current = None
                if self._deadline is not None:
                    self._deadline.cancel()
                    self._deadline = None
        return None

    def _send(self, request: _Request, process: subprocess.Popen[bytes]) -> bool:
        """Write an order to the process; return whether it is to be done at all."""
        order = request.order
        with self._writing:
            is_cancelled = order.number in self._cancelled
            # A task without a channel would not notice.
            if is_cancelled and not order.is_sending:
                return False
            _write_frame(process.stdin, order)
            self._current = order.number
            if is_cancelled:
                self._write_cancel(order.number)
        return True

    def _kill(self, number: int) -> None:
        # No other order is written meanwhile, so that none but this task is killed.
        with self._writing:
            if number == self._current and self._process is not None:
                self._process.kill()

    def _running_process(self) -> subprocess.Popen[bytes] | None:
        """Return the process, started if need be; None once it is to stop."""
        with self._lock:
            if self._stopped:
                return None
            if self._process is None:
                self._process = subprocess.Popen(  # noqa: S603 - our own interpreter and words
                    [sys.executable, "-P", "-c", PROGRAM, *self._preload],
                    stdin=subprocess.PIPE,
                    stdout=subprocess.PIPE,
                    env=os.environ | {"PYTHONPATH": str(SOURCES)},
                )
            return self._process


def _end(process: subprocess.Popen[bytes]) -> None:
    process.kill()
    process.wait()
    for pipe in (process.stdin, process.stdout):
        if pipe is not None:
            # Written and unread data cannot be flushed any more.
            with contextlib.suppress(OSError):
                pipe.close()


def log_error(message: str, details: str) -> str:
    """Log an unexpected error with details; return its message, with the place of the log."""
    logging.getLogger(__name__).error("%s\n%s", message, details)
    logs = (log for log in logging.getLogger().handlers if isinstance(log, RotatingFileHandler))
    place = next((log.baseFilename for log in logs), None)
    return message if place is None else f"{message.removesuffix('.')}; the log is {place}"


def do_nothing() -> None:
    """Do nothing: a task that is done as soon as the process has started."""


def main(preload: Sequence[str]) -> None:
    """Do the tasks that the parent orders, in the child process, until it closes the pipe.

    Some modules are imported first, so that the first task starts at once.
    """
    # A terminal sends Ctrl-C to this process too; its parent ends it.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    replies = os.fdopen(os.dup(1), "wb")
    # The output of libraries must not get between the frames.
    os.dup2(2, 1)
    for module in preload:
        importlib.import_module(module)
    # Orders import modules too: two threads that import at a time could wait for each other.
    inbox = _Inbox(os.fdopen(os.dup(0), "rb"))
    # Until the kernels are compiled, or loaded, they run interpreted.
    warm_in_background()
    while (order := inbox.orders.get()) is not None:
        try:
            _write_frame(replies, _reply(order, inbox, replies))
        except BrokenPipeError:
            # The parent has ended; nothing can be written, not even at the exit.
            os._exit(1)


class _Inbox:
    """The orders of the parent, read on a thread of its own, so that a cancel is read in time."""

    def __init__(self, stream: IO[bytes]) -> None:
        self._stream = stream
        # None once the parent has closed the pipe.
        self.orders: queue.SimpleQueue[_Order | None] = queue.SimpleQueue()
        # By the number of the order under way: when it is to end, in seconds after its start.
        self._ends: dict[int, float] = {}
        self._is_closed = False
        threading.Thread(target=self._read, name="inbox", daemon=True).start()

    def is_cancelled(self, number: int, start: float) -> bool:
        after = self._ends.get(number, math.inf)
        return self._is_closed or time.monotonic() - start >= after

    def _read(self) -> None:
        try:
            while True:
                frame: _Order | _Cancel = _read_frame(self._stream)
                if isinstance(frame, _Cancel):
                    before = self._ends.get(frame.number, math.inf)
                    self._ends = {frame.number: min(before, frame.after)}
                else:
                    self.orders.put(frame)
        except (EOFError, OSError, pickle.UnpicklingError):
            self._is_closed = True
            self.orders.put(None)


def _reply(order: _Order, inbox: _Inbox, replies: IO[bytes]) -> _Reply:
    arguments, start = order.arguments, time.monotonic()
    if order.is_sending:

        def send(value: object) -> None:
            _write_frame(replies, _Reply(value, is_last=False))

        channel = Channel(send, lambda: inbox.is_cancelled(order.number, start))
        arguments = (*arguments, channel)
    try:
        return _Reply(order.task(*arguments))
    except (ExplorerError, CancelledError) as error:
        return _Reply(problem=str(error))
    except BrokenPipeError:
        raise
    except Exception as error:  # noqa: BLE001 - the parent reports it, and the worker goes on
        problem = " ".join(f"{type(error).__name__}: {error}".split())
        return _Reply(problem=problem, trace=traceback.format_exc())
