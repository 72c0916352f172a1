"""Stages of a long computation, told to a watcher that may end it."""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeAlias

Watch: TypeAlias = Callable[[str, float], None]
"""Called before each stage with what the stage computes and the share of the stages that are
done, from 0 to below 1. It ends the computation by raising an exception."""


def unwatched(words: str, share: float) -> None:
    """Watch nothing and end nothing."""


class Stages:
    """The stages of one computation.

    Args:
        watch: Called before each stage.
        count: The number of stages, or an upper bound as long as it is not known.
    """

    def __init__(self, watch: Watch, count: int) -> None:
        self.count = count
        self._watch = watch
        self._begun = 0

    def begin(self, words: str) -> None:
        """Tell the watcher that the next stage begins.

        Args:
            words: What the stage computes.
        """
        self._watch(words, self._begun / max(self.count, self._begun + 1))
        self._begun += 1
