"""Tasks for the tests of the worker: they tell of themselves, and heed a cancel or do not."""

from __future__ import annotations

import itertools
import os
import time

from explorer.app.session.worker import Line
from explorer.errors import InputError

# Seconds between two values.
PAUSE = 0.002


def count(most: int, line: Line) -> int:
    """Tell the numbers below some one, and return how many were told."""
    for number in range(most):
        line.tell(number)
    return most


def count_until_cut(line: Line) -> int:
    """Tell numbers until it is to end; return how many."""
    for number in itertools.count():
        if line.is_cut():
            return number
        line.tell(number)
        time.sleep(PAUSE)
    raise AssertionError


def end_when_cancelled(line: Line) -> None:
    """Tell one number, and end by an exception once it is to end."""
    line.tell(0)
    while True:
        line.end_if_cancelled()
        time.sleep(PAUSE)


def hang(line: Line) -> None:
    """Tell one number, and end for no word."""
    line.tell(0)
    time.sleep(3600.0)


def refuse(line: Line) -> None:
    """Tell one number, then refuse."""
    line.tell(0)
    raise InputError("refused on purpose")


def fail(number: float, words: tuple[str, ...], line: Line) -> None:
    """Tell one number, then fail in a way that nobody expected."""
    line.tell(number)
    raise ValueError(f"setting {number} with\n{words}")


def say(text: str) -> str:
    """Return a text, telling nothing."""
    return text


def die(line: Line) -> None:
    """Tell one number, then die."""
    line.tell(0)
    os._exit(9)


def fall() -> None:
    """Die, telling nothing."""
    os._exit(9)
