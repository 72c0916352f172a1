"""The child process that does heavy work, one task at a time.

It exchanges pickled frames with its parent over its own standard input and output; only our own
parent writes to it. A task may send values while it runs, and may be cancelled.
"""

from __future__ import annotations

import importlib
import math
import os
import pickle
import queue
import signal
import threading
import time
import traceback
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import IO, Any

from explorer.errors import ExplorerError
from explorer.numerics.compiled import warm_in_background

CANCELLED = "cancelled"
"""Problem in the reply of a task that was cancelled."""


@dataclass(frozen=True)
class Order:
    """A task to do.

    Attributes:
        number: Number of the order.
        module: Module of the task.
        task: Name of the task, a function, in its module.
        arguments: Its arguments.
        is_sending: Whether it takes a `Channel` to its parent as its last argument.
    """

    number: int
    module: str
    task: str
    arguments: tuple[Any, ...]
    is_sending: bool = False


@dataclass(frozen=True)
class Cancel:
    """A request to cancel the order with a number, so many seconds after its start."""

    number: int
    after: float = 0.0


@dataclass(frozen=True)
class Message:
    """A value that a task sends before it is done."""

    value: Any


@dataclass(frozen=True)
class Reply:
    """The result of an order: a value or a problem, with its traceback if it is unexpected."""

    value: Any = None
    problem: str | None = None
    trace: str = ""


@dataclass(frozen=True)
class Channel:
    """The connection of a task to its parent.

    Attributes:
        send: Sends a value; it must pickle.
        is_cancelled: Returns whether the task is cancelled; called now and then.
    """

    send: Callable[[Any], None]
    is_cancelled: Callable[[], bool]

    def raise_if_cancelled(self) -> None:
        """Raise `CancelledError` if the task is cancelled."""
        if self.is_cancelled():
            raise CancelledError


class CancelledError(Exception):
    """The task ends early because its parent cancelled it."""


def write_frame(stream: IO[bytes], value: object) -> None:
    """Write one object."""
    pickle.dump(value, stream, protocol=pickle.HIGHEST_PROTOCOL)
    stream.flush()


def read_frame(stream: IO[bytes]) -> Any:
    """Read one object.

    Raises:
        EOFError: The other process has ended.
    """
    return pickle.load(stream)  # noqa: S301 - from our own process, over a pipe of our own


class _Inbox:
    """The orders of the parent, read on a thread of its own, so that a cancel is read in time."""

    def __init__(self, stream: IO[bytes]) -> None:
        self._stream = stream
        # None once the parent has closed the pipe.
        self.orders: queue.SimpleQueue[Order | None] = queue.SimpleQueue()
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
                frame: Order | Cancel = read_frame(self._stream)
                if isinstance(frame, Cancel):
                    before = self._ends.get(frame.number, math.inf)
                    self._ends = {frame.number: min(before, frame.after)}
                else:
                    self.orders.put(frame)
        except (EOFError, OSError, pickle.UnpicklingError):
            self._is_closed = True
            self.orders.put(None)


def do_nothing() -> None:
    """Do nothing: a task that is done as soon as the process has started."""


def main(preload: Sequence[str]) -> None:
    """Do the tasks that the parent orders until it closes the pipe.

    Args:
        preload: The modules to import first, so that the first task starts at once.
    """
    # A terminal sends Ctrl-C to this process too; its parent ends it.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    replies = os.fdopen(os.dup(1), "wb")
    # The output of libraries must not get between the frames.
    os.dup2(2, 1)
    for module in preload:
        importlib.import_module(module)
    # Orders name modules too: two threads that import at a time could wait for each other.
    inbox = _Inbox(os.fdopen(os.dup(0), "rb"))
    # Until the kernels are compiled, or loaded, they run interpreted.
    warm_in_background()
    while (order := inbox.orders.get()) is not None:
        try:
            write_frame(replies, _reply(order, inbox, replies))
        except BrokenPipeError:
            # The parent has ended; nothing can be written, not even at the exit.
            os._exit(1)


def _reply(order: Order, inbox: _Inbox, replies: IO[bytes]) -> Reply:
    arguments, start = order.arguments, time.monotonic()
    if order.is_sending:
        channel = Channel(
            lambda value: write_frame(replies, Message(value)),
            lambda: inbox.is_cancelled(order.number, start),
        )
        arguments = (*arguments, channel)
    try:
        task: Callable[..., Any] = getattr(importlib.import_module(order.module), order.task)
        return Reply(task(*arguments))
    except ExplorerError as error:
        return Reply(problem=str(error))
    except CancelledError:
        return Reply(problem=CANCELLED)
    except BrokenPipeError:
        raise
    except Exception as error:  # noqa: BLE001 - the parent reports it, and the worker goes on
        problem = " ".join(f"{type(error).__name__}: {error}".split())
        return Reply(problem=problem, trace=traceback.format_exc())
