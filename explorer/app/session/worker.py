"""The child process that does heavy work, one task at a time, and nothing else.

It talks to its parent in pickled frames over its own standard input and output; only our
own parent writes to it. A task may tell of itself while it runs, and is told to end early.
"""

from __future__ import annotations

import importlib
import os
import pickle
import queue
import signal
import threading
import traceback
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import IO, Any

from explorer.errors import ExplorerError
from explorer.numerics.compiled import warm_in_background

CANCELLED = "cancelled"
"""What a task that ended early answers with."""


@dataclass(frozen=True)
class Order:
    """A task to do.

    Attributes:
        number: Of the order.
        module: The module that holds the task.
        task: The name of the task, a function, in its module.
        arguments: For it.
        tells: Whether it takes a `Line` to its parent as its last argument.
    """

    number: int
    module: str
    task: str
    arguments: tuple[Any, ...]
    tells: bool = False


@dataclass(frozen=True)
class Cancel:
    """A request to end the order with this number early."""

    number: int


@dataclass(frozen=True)
class Told:
    """What a task tells before it is done."""

    number: int
    value: Any


@dataclass(frozen=True)
class Reply:
    """What came of an order: a value, or a message for people and whether it was expected.

    What was not expected comes with its traceback.
    """

    number: int
    value: Any = None
    problem: str | None = None
    expected: bool = True
    trace: str = ""


@dataclass(frozen=True)
class Line:
    """What a task that tells has of its parent.

    Attributes:
        tell: Sends a value; it must pickle.
        is_cut: Asked now and then whether the task is to end early.
    """

    tell: Callable[[Any], None]
    is_cut: Callable[[], bool]

    def end_if_cancelled(self) -> None:
        """Raise `CancelledError` if the task is to end early."""
        if self.is_cut():
            raise CancelledError


class CancelledError(Exception):
    """The task ends early because the parent asked for that."""


def write_frame(stream: IO[bytes], value: object) -> None:
    """Write one object."""
    pickle.dump(value, stream, protocol=pickle.HIGHEST_PROTOCOL)
    stream.flush()


def read_frame(stream: IO[bytes]) -> Any:
    """Read one object.

    Raises:
        EOFError: the other side is gone.
    """
    return pickle.load(stream)  # noqa: S301 - from our own process, over a pipe of our own


class Inbox:
    """What the parent asks, read on a thread of its own, so that it is heard during a task.

    Args:
        stream: From the parent. Its end cuts whatever is being done.
    """

    def __init__(self, stream: IO[bytes]) -> None:
        self._stream = stream
        self._orders: queue.SimpleQueue[Order | None] = queue.SimpleQueue()
        self._cancelled = -1
        self._is_over = threading.Event()
        threading.Thread(target=self._read, name="inbox", daemon=True).start()

    def next(self) -> Order | None:
        """Wait for the next order; None once there will be none."""
        return self._orders.get()

    def is_cut(self, number: int) -> bool:
        """Whether an order is to end early."""
        return self._is_over.is_set() or self._cancelled == number

    def _read(self) -> None:
        try:
            while True:
                frame: Order | Cancel = read_frame(self._stream)
                if isinstance(frame, Cancel):
                    self._cancelled = frame.number
                else:
                    self._orders.put(frame)
        except (EOFError, OSError, pickle.UnpicklingError):
            self._is_over.set()
            self._orders.put(None)


def ready() -> None:
    """Do nothing: the process that was asked has started."""


def main(preload: Sequence[str]) -> None:
    """Do what the parent asks until it closes the pipe.

    Args:
        preload: The modules to import first, so that the first task starts at once.
    """
    # A terminal sends Ctrl-C to us too; it is the parent who ends us.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    inbox = Inbox(os.fdopen(os.dup(0), "rb"))
    answers = os.fdopen(os.dup(1), "wb")
    # Whatever a library prints must not get between the frames.
    os.dup2(2, 1)
    for module in preload:
        importlib.import_module(module)
    # Until the kernels are compiled, or loaded, they run interpreted.
    warm_in_background()
    while (order := inbox.next()) is not None:
        try:
            write_frame(answers, _done(order, inbox, answers))
        except BrokenPipeError:
            # The parent is gone: nobody is left to write to, not even on the way out.
            os._exit(1)


def _done(order: Order, inbox: Inbox, answers: IO[bytes]) -> Reply:
    number = order.number
    arguments = order.arguments
    if order.tells:
        line = Line(
            lambda value: write_frame(answers, Told(number, value)),
            lambda: inbox.is_cut(number),
        )
        arguments = (*arguments, line)
    try:
        task: Callable[..., Any] = getattr(importlib.import_module(order.module), order.task)
        return Reply(number, task(*arguments))
    except ExplorerError as error:
        return Reply(number, problem=str(error))
    except CancelledError:
        return Reply(number, problem=CANCELLED)
    except BrokenPipeError:
        raise
    except Exception as error:  # noqa: BLE001 - the parent tells, and the worker goes on
        problem = " ".join(f"{type(error).__name__}: {error}".split())
        return Reply(number, problem=problem, expected=False, trace=traceback.format_exc())
