"""The child process that does heavy work, one task at a time, and nothing else.

It talks to its parent in pickled frames over its own standard input and output. The
tasks are the functions of `explorer.app.tasks`; only our own parent writes to it.
"""

from __future__ import annotations

import os
import pickle
import sys
from collections.abc import Callable
from dataclasses import dataclass
from typing import IO, Any

from explorer.compiled import warm_in_background
from explorer.errors import ExplorerError


@dataclass(frozen=True)
class Order:
    """A task to do: the name of a function in `explorer.app.tasks` and its arguments."""

    number: int
    task: str
    arguments: tuple[Any, ...]


@dataclass(frozen=True)
class Reply:
    """What came of an order: a value, or a message for people and whether it was expected."""

    number: int
    value: Any = None
    problem: str | None = None
    expected: bool = True


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


def main() -> None:
    """Do what the parent asks until it closes the pipe."""
    answers = os.fdopen(os.dup(1), "wb")
    # Whatever a library prints must not get between the frames.
    os.dup2(2, 1)
    from explorer.app import tasks

    # Until the kernels are compiled, or loaded, they run interpreted.
    warm_in_background()
    while True:
        try:
            order: Order = read_frame(sys.stdin.buffer)
        except EOFError:
            return
        write_frame(answers, _done(getattr(tasks, order.task), order))


def _done(task: Callable[..., Any], order: Order) -> Reply:
    try:
        return Reply(order.number, task(*order.arguments))
    except ExplorerError as error:
        return Reply(order.number, problem=str(error))
    except Exception as error:  # noqa: BLE001 - the parent tells, and the worker goes on
        return Reply(order.number, problem=f"{type(error).__name__}: {error}", expected=False)
