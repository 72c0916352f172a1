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
from functools import partial
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

    It sends an empty reply once it is ready. Methods raise one of `PIPE_ERRORS` if it died.

    Args:
        modules: Modules that it imports before it is ready, so that its first task starts at once.
        environment: Variables of its environment beside those of this process.
    """

    def __init__(self, modules: Sequence[str], environment: Mapping[str, str]) -> None:
        self._calls = 0
        self.process = subprocess.Popen(  # noqa: S603 - our own interpreter and words
            # A file in the working folder may have the name of a library.
            [sys.executable, "-P", "-c", PROGRAM],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            env={**os.environ, **environment, "PYTHONPATH": str(SOURCES)},
        )
        self._write((sys.path, tuple(modules)))

    def begin(self, call: bytes) -> None:
        """Begin a pickled `Call`."""
        self._calls += 1
        self._write((self._calls, call))

    def cancel(self, after: float) -> None:
        """Tell the call under way to end, so many seconds after its start at the earliest."""
        with contextlib.suppress(*PIPE_ERRORS):
            self._write((self._calls, after))

    def read(self) -> Reply:
        """Return the next reply."""
        return pickle.load(cast("IO[bytes]", self.process.stdout))  # noqa: S301 - our own process

    def end(self) -> None:
        """Kill the process, wait for its end and close the pipes."""
        self.process.kill()
        self.process.wait()
        for pipe in (self.process.stdin, self.process.stdout):
            # Written and unread data cannot be flushed any more.
            with contextlib.suppress(OSError):
                cast("IO[bytes]", pipe).close()

    def _write(self, frame: tuple[object, object]) -> None:
        pipe = cast("IO[bytes]", self.process.stdin)
        pickle.dump(frame, pipe, pickle.HIGHEST_PROTOCOL)
        pipe.flush()


def main() -> None:
    """Do the tasks of the parent, in the child process, until the parent closes the pipe."""
    # A terminal sends Ctrl-C to this process too; its parent ends it.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    frames, replies = os.fdopen(os.dup(0), "rb"), os.fdopen(os.dup(1), "wb")
    # The output of libraries must not get between the frames.
    os.dup2(2, 1)

    def write(reply: Reply) -> None:
        replies.write(_encode_reply(reply))
        replies.flush()

    paths, modules = pickle.load(frames)  # noqa: S301 - from our own parent and pipe
    # What the parent finds is found here too, but nothing takes the place of a library.
    sys.path += [path for path in paths if path and path not in sys.path]
    for module in modules:
        importlib.import_module(module)
    calls: queue.SimpleQueue[tuple[int, bytes]] = queue.SimpleQueue()
    ends: dict[int, float] = {}
    threading.Thread(target=_read_frames, args=(frames, calls, ends), daemon=True).start()
    # Until the kernels are compiled, or loaded, they run interpreted.
    warm_in_background()
    try:
        write(Reply())
        while True:
            number, data = calls.get()
            write(_do(data, write, partial(ends.get, number, math.inf)))
    except BrokenPipeError:
        # The parent has ended; nothing can be written, not even at the exit.
        os._exit(1)


def _read_frames(
    frames: IO[bytes], calls: queue.SimpleQueue[tuple[int, bytes]], ends: dict[int, float]
) -> None:
    """Queue the calls of the parent, and note when each is to end, in seconds after its start.

    A thread of its own does so, so that a cancel is read in time; it ends the process with its
    parent.
    """
    with contextlib.suppress(EOFError, OSError, pickle.UnpicklingError):
        while True:
            number, what = pickle.load(frames)  # noqa: S301 - from our own parent and pipe
            if isinstance(what, bytes):
                calls.put((number, what))
            else:
                ends[number] = what
    os._exit(1)


def _do(data: bytes, write: Callable[[Reply], None], end: Callable[[], float]) -> Reply:
    """Return the result of a call, which may write replies, and is to end at some time."""
    start = time.monotonic()

    def send(value: object) -> None:
        write(Reply(value, is_last=False))

    channel = Channel(send, lambda: time.monotonic() - start >= end())
    try:
        call: Call = pickle.loads(data)  # noqa: S301 - from our own parent and pipe
        more = (channel,) if call.is_sending else ()
        return Reply(call.function(*call.arguments, *more, **call.options))
    except BrokenPipeError:
        raise
    except (ExplorerError, CancelledError) as error:
        return Reply(error=error)
    except Exception as error:  # noqa: BLE001 - the parent raises it, and the process goes on
        return Reply(error=error, trace=traceback.format_exc())


def _encode_reply(reply: Reply) -> bytes:
    """Return a reply as it is sent; in words if its value or its error cannot be."""
    try:
        data = pickle.dumps(reply, pickle.HIGHEST_PROTOCOL)
        if reply.error is not None:
            # Errors of libraries take any arguments.
            pickle.loads(data)  # noqa: S301 - made here
    except Exception as error:  # noqa: BLE001 - anything may be raised
        words = f"the result cannot be sent: {error}"
        if reply.error is not None:
            words = f"{type(reply.error).__name__}: {reply.error}"
        return pickle.dumps(
            Reply(error=RuntimeError(words), trace=reply.trace or traceback.format_exc())
        )
    return data
