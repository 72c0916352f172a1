"""Tasks for the tests of the worker: they tell of themselves, and heed a cancel or do not."""

from __future__ import annotations

import itertools
import os
import time

from explorer.errors import InputError
from explorer.jobs.process import Channel

# Seconds between two values.
PAUSE = 0.002


def count(most: int, channel: Channel) -> int:
    """Tell the numbers below some one, and return how many were told."""
    for number in range(most):
        channel.send(number)
    return most


def count_until_cancelled(channel: Channel) -> int:
    """Tell numbers until it is to end; return how many."""
    for number in itertools.count():
        if channel.is_cancelled():
            return number
        channel.send(number)
        time.sleep(PAUSE)
    raise AssertionError


def end_when_cancelled(channel: Channel) -> None:
    """Tell one number, and end by an exception once it is to end."""
    channel.send(0)
    while True:
        channel.raise_if_cancelled()
        time.sleep(PAUSE)


def hang(channel: Channel) -> None:
    """Tell one number, and end for no word."""
    channel.send(0)
    time.sleep(3600.0)


def refuse(channel: Channel) -> None:
    """Tell one number, then refuse."""
    channel.send(0)
    raise InputError("refused on purpose")


def fail(number: float, words: tuple[str, ...], channel: Channel) -> None:
    """Tell one number, then fail in a way that nobody expected."""
    channel.send(number)
    raise ValueError(f"setting {number} with\n{words}")


def say(text: str) -> str:
    """Return a text, telling nothing."""
    return text


def die(channel: Channel) -> None:
    """Tell one number, then die."""
    channel.send(0)
    os._exit(9)


def fall() -> None:
    """Die, telling nothing."""
    os._exit(9)
