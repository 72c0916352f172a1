"""Stages of a long computation, reported to a callback that may end it."""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeAlias

Watch: TypeAlias = Callable[[str, float], None]
"""Callback before each stage: it takes a description of the stage and the share of stages that
are done, at least 0 and below 1, and ends the computation by raising an exception."""


def unwatched(words: str, share: float) -> None:
    """Ignore the stage; the default callback."""


class Stages:
    """The stages of one computation.

    Args:
        watch: Callback before each stage.
        count: Number of stages; an upper bound while it is not known.
    """

    def __init__(self, watch: Watch, count: int) -> None:
        self.count = count
        self._watch = watch
        self._started = 0

    def begin(self, words: str) -> None:
        """Report to the callback that the next stage begins.

        Args:
            words: Description of what the stage computes.
        """
        self._watch(words, self._started / max(self.count, self._started + 1))
        self._started += 1
