"""A child process that does tasks, since much of the heavy work holds the interpreter lock.

It does one task at a time, and exchanges pickled frames with its parent over its own standard
input and output; only our own parent writes to it. A task may send values while it runs, and may be
cancelled. The process ends with its parent, whatever it is doing.
"""

from __future__ import annotations

import contextlib
import importlib
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
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import CancelledError
from typing import IO, Any, NamedTuple, cast

from explorer.errors import ExplorerError
from explorer.files.packaged import SOURCES
from explorer.numerics.compiled import warm_in_background

CANCELLED = "cancelled"
"""Message of the error of a task that was cancelled."""

PIPE_ERRORS = (OSError, ValueError, EOFError, pickle.UnpicklingError)
"""Errors of a pipe to a process that has ended."""

PROGRAM = "from explorer.jobs.process import main; main()"


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


class Call(NamedTuple):
    """The call of a function; if it sends values, its last argument is a `Channel`."""

    function: Callable[..., Any]
    arguments: tuple[Any, ...]
    options: Mapping[str, Any]
    is_sending: bool


class Reply(NamedTuple):
    """The result of a call or its error, with its traceback if the error is unexpected.

    If it is not the last one, it is a value that the task sends before it is done.
    """

    value: Any = None
    error: Exception | None = None
    trace: str = ""
    is_last: bool = True


class ChildProcess:
    """A process that does the tasks of its parent, one after the other.

    Args:
        modules: Modules that it imports before it is ready, so that its first task starts at once.
        environment: Variables of its environment beside those of this process.
    """

    def __init__(self, modules: Sequence[str], environment: Mapping[str, str]) -> None:
        self._calls = 0
        self._is_ready = False
        self._process = subprocess.Popen(  # noqa: S603 - our own interpreter and words
            # A file in the working folder may have the name of a library.
            [sys.executable, "-P", "-c", PROGRAM],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            env={**os.environ, **environment, "PYTHONPATH": str(SOURCES)},
        )
        self._input = cast("IO[bytes]", self._process.stdin)
        self._output = cast("IO[bytes]", self._process.stdout)
        self._start = sys.path, tuple(modules)

    @property
    def process_id(self) -> int:
        """Id of the process."""
        return self._process.pid

    def wait_until_ready(self) -> None:
        """Wait until the process takes tasks; raise one of `PIPE_ERRORS` if it dies before."""
        if not self._is_ready:
            _write(self._input, self._start)
            self.read()
            self._is_ready = True

    def begin(self, call: bytes) -> None:
        """Begin a pickled `Call`; raise one of `PIPE_ERRORS` if the process died."""
        self._calls += 1
        _write(self._input, (self._calls, call))

    def cancel(self, after: float) -> None:
        """Tell the call under way to end, so many seconds after its start at the earliest."""
        with contextlib.suppress(*PIPE_ERRORS):
            _write(self._input, (self._calls, after))

    def read(self) -> Reply:
        """Return the next reply; raise one of `PIPE_ERRORS` if the process died."""
        return pickle.load(self._output)  # noqa: S301 - from our own process and pipe

    def kill(self) -> None:
        """Kill the process; `end` has to follow."""
        self._process.kill()

    def end(self) -> None:
        """Kill the process, wait for its end and close the pipes."""
        self._process.kill()
        self._process.wait()
        for pipe in (self._input, self._output):
            # Written and unread data cannot be flushed any more.
            with contextlib.suppress(OSError):
                pipe.close()


def _write(stream: IO[bytes], value: object) -> None:
    # Pickled as a whole before: half a frame would end the process.
    stream.write(pickle.dumps(value, pickle.HIGHEST_PROTOCOL))
    stream.flush()


def main() -> None:
    """Do the tasks of the parent, in the child process, until the parent closes the pipe."""
    # A terminal sends Ctrl-C to this process too; its parent ends it.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    calls, replies = os.fdopen(os.dup(0), "rb"), os.fdopen(os.dup(1), "wb")
    # The output of libraries must not get between the frames.
    os.dup2(2, 1)
    paths, modules = pickle.load(calls)  # noqa: S301 - from our own parent and pipe
    # What the parent finds is found here too, but nothing takes the place of a library.
    sys.path += [path for path in paths if path and path not in sys.path]
    for module in modules:
        importlib.import_module(module)
    inbox = _Inbox(calls)
    # Until the kernels are compiled, or loaded, they run interpreted.
    warm_in_background()
    try:
        _write(replies, Reply())
        while True:
            reply = inbox.do_next(lambda value: _write(replies, Reply(value, is_last=False)))
            try:
                _write(replies, reply)
            except BrokenPipeError:
                raise
            except Exception as error:  # noqa: BLE001 - not every result can be sent
                problem = RuntimeError(f"the result cannot be sent: {error}")
                _write(replies, Reply(error=problem, trace=traceback.format_exc()))
    except BrokenPipeError:
        # The parent has ended; nothing can be written, not even at the exit.
        os._exit(1)


class _Inbox:
    """The calls of the parent, read on a thread of its own, so that a cancel is read in time."""

    def __init__(self, stream: IO[bytes]) -> None:
        self._stream = stream
        self._calls: queue.SimpleQueue[tuple[int, bytes]] = queue.SimpleQueue()
        # By the number of the call under way: when it is to end, in seconds after its start.
        self._ends: dict[int, float] = {}
        threading.Thread(target=self._read, name="inbox", daemon=True).start()

    def do_next(self, send: Callable[[Any], None]) -> Reply:
        """Wait for the next call, and return its result."""
        number, data = self._calls.get()
        start = time.monotonic()

        def is_cancelled() -> bool:
            return time.monotonic() - start >= self._ends.get(number, math.inf)

        try:
            call: Call = pickle.loads(data)  # noqa: S301 - from our own parent and pipe
            channel = (Channel(send, is_cancelled),) if call.is_sending else ()
            return Reply(call.function(*call.arguments, *channel, **call.options))
        except BrokenPipeError:
            raise
        except Exception as error:  # noqa: BLE001 - the parent raises it, and the process goes on
            is_expected = isinstance(error, (ExplorerError, CancelledError))
            return Reply(error=_as_sent(error), trace="" if is_expected else traceback.format_exc())

    def _read(self) -> None:
        with contextlib.suppress(EOFError, OSError, pickle.UnpicklingError):
            while True:
                number, what = pickle.load(self._stream)  # noqa: S301 - from our own parent
                if isinstance(what, bytes):
                    self._calls.put((number, what))
                else:
                    self._ends = {number: min(self._ends.get(number, math.inf), what)}
        os._exit(1)


def _as_sent(error: Exception) -> Exception:
    """Return an error as the parent reads it; in words if it cannot be sent."""
    try:
        return pickle.loads(pickle.dumps(error))  # noqa: S301 - made here
    except Exception:  # noqa: BLE001 - errors of libraries take any arguments
        return RuntimeError(f"{type(error).__name__}: {error}")
