"""Heavy work in a child process, since much of it holds the interpreter lock.

It must not pile up: of each kind of request only the newest waits.
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
from typing import IO, Any, cast

from explorer.app.session.clock import Timer
from explorer.app.session.latest import LatestWins
from explorer.app.session.log import log_error
from explorer.app.session.worker import (
    Cancel,
    Message,
    Order,
    Reply,
    do_nothing,
    read_frame,
    write_frame,
)
from explorer.files.packaged import SOURCES

# Seconds after which a drawing is cancelled as soon as a newer one waits.
LONG_SECONDS = 1.0

RESTARTED = "The worker process died and was started again."

# Errors of a pipe to a process that has ended.
PIPE_ERRORS = (OSError, ValueError, EOFError, pickle.UnpicklingError)
PROGRAM = "import sys; from explorer.app.session.worker import main; main(sys.argv[1:])"


@dataclass(frozen=True)
class _Request:
    key: object
    order: Order
    done: Callable[[Any], None]
    failed: Callable[[str], None]
    receive: Callable[[Any], None] | None
    is_drawing: bool


class Worker:
    """A child process for heavy work; of each kind of request only the newest waits.

    It is started when it is first needed, and again if it dies: then the task under way is done
    once more, unless it sends messages. Results come on a thread of their own.

    Args:
        report: Called with a message when the process died or failed unexpectedly.
        preload: The modules that the process imports first, so that its first task starts at once.
        died: The message when the process died.
    """

    def __init__(
        self,
        report: Callable[[str], None],
        *,
        preload: Sequence[str] = (),
        died: str = "The worker process died over this twice; the next change starts it again.",
    ) -> None:
        self._report = report
        self._preload = tuple(preload)
        self._died = died
        self._numbers = itertools.count()
        self._process: subprocess.Popen[bytes] | None = None
        self._stopped = False
        # Guards the process: it must not be started after `stop`.
        self._lock = threading.Lock()
        # Guards writing to the process, killing it, and these three: the request under way, the
        # patience with each order that was cancelled, and the timer that kills the process for
        # the one under way.
        self._writing = threading.Lock()
        self._current: _Request | None = None
        self._cancelled: dict[int, float | None] = {}
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
        *,
        is_drawing: bool = False,
    ) -> int:
        """Queue a task, in place of one with the same key that waits; return its number.

        Args:
            key: Key of the task; of each key only the newest task waits.
            task: A function of a module; the process imports that module.
            arguments: Its arguments; they and the result must pickle.
            done: Called with the result.
            failed: Called instead with a message for people if there is no result.
            receive: Called with each value that the task sends meanwhile. If given, the task
                takes an `explorer.app.session.worker.Channel` as its last argument.
            is_drawing: Whether only the newest task of this key is of use, as with drawings: one
                under way is cancelled when a newer one waits and `LONG_SECONDS` have passed. It
                is done once more if the process dies, even if it sends messages.
        """
        number = next(self._numbers)
        order = Order(number, task.__module__, task.__name__, arguments, receive is not None)
        request = _Request(key, order, done, failed, receive, is_drawing)
        self._queue.post(key, number, request)
        self._cancel_outdated(request)
        return number

    def cancel(self, number: int, patience: float | None) -> None:
        """Cancel a task.

        A task with a channel is told to end; any other is skipped, or ends with its process.

        Args:
            number: Number of the task, as `submit` returned it.
            patience: Seconds after which it ends together with its process; None for never.
        """
        with self._writing:
            self._cancelled[number] = patience
            self._write_cancel(number)

    def _write_cancel(self, number: int, after: float = 0.0) -> None:
        """Cancel an order if it is under way; this thread holds the lock for writing."""
        if self._process is None or not self._is_current(number):
            return
        with contextlib.suppress(*PIPE_ERRORS):
            write_frame(cast("IO[bytes]", self._process.stdin), Cancel(number, after))
        patience = self._cancelled.get(number)
        if patience is not None and self._deadline is None:
            self._deadline = Timer(patience, self._kill, number)

    def _is_current(self, number: int) -> bool:
        return self._current is not None and self._current.order.number == number

    def _cancel_outdated(self, request: _Request) -> None:
        """Cancel the drawing under way once it is long, if a newer one of its key waits."""
        if not request.is_drawing:
            return
        with self._writing:
            current = self._current
            if current and current.key == request.key and self._queue.is_waiting(request.key):
                self._write_cancel(current.order.number, LONG_SECONDS)

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
            if not self._queue.is_waiting(request.key):
                self._serve(request)
            self._cancelled.pop(request.order.number, None)

    def _serve(self, request: _Request) -> None:
        reply = self._attempt(request)
        # A task that has sent messages cannot start anew, unless only its result counts.
        is_repeatable = request.receive is None or request.is_drawing
        if reply is None and is_repeatable and not self._is_cancelled(request):
            self._report(RESTARTED)
            reply = self._attempt(request)
        if reply is None:
            if self._stopped:
                return
            if not self._is_cancelled(request):
                self._report_error(request, self._died)
            request.failed(self._died)
        elif reply.problem is None:
            request.done(reply.value)
        else:
            if reply.trace:
                task = request.order.task.replace("_", " ")
                message = f"Something went wrong in the worker ({task}): {reply.problem}"
                self._report_error(request, message, reply.trace)
            request.failed(reply.problem)

    def _report_error(self, request: _Request, message: str, trace: str = "") -> None:
        order = request.order
        place = f"{order.module}.{order.task}, called with"
        self._report(log_error(message, f"{trace}{place}", order.arguments))

    def _is_cancelled(self, request: _Request) -> bool:
        return self._stopped or request.order.number in self._cancelled

    def _attempt(self, request: _Request) -> Reply | None:
        """Return the reply to a request.

        It is None if the process died or is to stop, or if the task was cancelled before its start.
        """
        process = self._running_process()
        if process is None:
            return None
        try:
            is_sent = self._send(request, process)
            while is_sent:
                frame: Message | Reply = read_frame(cast("IO[bytes]", process.stdout))
                if isinstance(frame, Reply):
                    return frame
                if request.receive is not None:
                    request.receive(frame.value)
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
            write_frame(cast("IO[bytes]", process.stdin), order)
            self._current = request
            if is_cancelled:
                self._write_cancel(order.number)
        # A newer drawing may have been queued before this one counted as under way.
        self._cancel_outdated(request)
        return True

    def _kill(self, number: int) -> None:
        # No other order is written meanwhile, so that none but this task is killed.
        with self._writing:
            if self._is_current(number) and self._process is not None:
                self._process.kill()

    def _running_process(self) -> subprocess.Popen[bytes] | None:
        """Return the process, started if need be; None once it is to stop."""
        with self._lock:
            if self._stopped:
                return None
            if self._process is not None and self._process.poll() is not None:
                # The process was killed while it had nothing to do.
                _end(self._process)
                self._process = None
                self._report(RESTARTED)
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
