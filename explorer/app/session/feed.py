"""Drawings that the worker makes, kept in step with the state."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Generic, Protocol, TypeVar

from explorer.app.session.jobs import LONG_SECONDS, Worker
from explorer.app.session.worker import CANCELLED, Line
from explorer.app.state.frame import Frame


@dataclass(frozen=True)
class Stage:
    """A stage of a drawing that takes long.

    Attributes:
        words: What is computed.
        share: Of the stages, those that are done, from 0 to 1.
    """

    words: str
    share: float


# Seconds after which a drawing that a person cancelled ends with its process.
CANCEL_SECONDS = 2.0


Request = TypeVar("Request")


class _Answer(Protocol):
    @property
    def request(self) -> object: ...


Drawing = TypeVar("Drawing", bound=_Answer)


class Feed(Generic[Request, Drawing]):
    """Asks for drawings of one kind and keeps the newest.

    Args:
        worker: That computes them.
        task: A function of the worker, from requests to drawings.
        wanted: The request of a frame, None if nothing is to be drawn.
        redraw: Called when a new one is there.
        key: Of the requests, of which the newest counts; the task if None.
        has_stages: Whether the task tells each `Stage`, and can be cancelled.
    """

    def __init__(
        self,
        worker: Worker,
        task: Callable[[Request], Drawing] | Callable[[Request, Line], Drawing],
        wanted: Callable[[Frame], Request | None],
        redraw: Callable[[], None],
        key: object = None,
        *,
        has_stages: bool = False,
    ) -> None:
        self._worker = worker
        self._task = task
        self._has_stages = has_stages
        # How many drawings were asked for; of the newest, when that was, its order until it is
        # answered, and the stage that it is in.
        self._count = 0
        self._asked_at = 0.0
        self._order: int | None = None
        self._stage: Stage | None = None
        self._key = task if key is None else key
        self._wanted = wanted
        self._redraw = redraw
        self._asked: Request | None = None
        self._drawing: Drawing | None = None
        self._problem: str | None = None

    @property
    def drawing(self) -> Drawing | None:
        """The newest drawing; None if there is none, none is wanted, or it was cancelled."""
        return self._drawing if self._asked is not None and not self.is_cancelled else None

    @property
    def asked(self) -> Request | None:
        """What was asked for last, None if nothing is to be drawn."""
        return self._asked

    @property
    def problem(self) -> str | None:
        """Why there is no newer drawing, if the last request failed."""
        return self._problem

    @property
    def stage(self) -> Stage | None:
        """The stage of a drawing that takes long; None if none does, or it has told none."""
        is_long = time.monotonic() - self._asked_at >= LONG_SECONDS
        return self._stage if is_long and not self.is_settled else None

    @property
    def is_cancelled(self) -> bool:
        """Whether the drawing that was asked for last was cancelled."""
        return self._asked is not None and self._problem == CANCELLED

    @property
    def is_current(self) -> bool:
        """Whether the drawing is what was last asked for."""
        return self._drawing is not None and self._drawing.request == self._asked

    @property
    def is_settled(self) -> bool:
        """Whether nothing newer is on its way."""
        return self._asked is None or self.is_current or self._problem is not None

    def follow(self, frame: Frame) -> None:
        """Ask for the drawing that a frame wants, unless it is asked for already."""
        wanted = self._wanted(frame)
        if wanted == self._asked:
            return
        if wanted is None:
            self._end(None)
        self._asked, self._problem = wanted, None
        self._submit()

    def cancel(self) -> None:
        """End the drawing under way, if it can be cancelled; it is asked for again on request."""
        if self._has_stages and not self.is_settled:
            self._problem = CANCELLED
            self._end(CANCEL_SECONDS)
            self._redraw()

    def ask_again(self) -> None:
        """Ask once more for a drawing that was cancelled."""
        if self.is_cancelled:
            self._problem = None
            self._submit()
            self._redraw()

    def _submit(self) -> None:
        if self._asked is None:
            return
        self._stage, self._asked_at = None, time.monotonic()
        self._count += 1
        count, order = self._count, (self._key, self._task, (self._asked,), self._arrived)

        def failed(problem: str) -> None:
            self._failed(count, problem)

        def told(stage: Stage) -> None:
            self._told(count, stage)

        if self._has_stages:
            self._order = self._worker.submit(*order, failed, told, is_drawing=True)
        else:
            self._order = self._worker.submit(*order, failed)

    def _end(self, patience: float | None) -> None:
        """Cancel the newest order, if it has no answer yet."""
        if self._has_stages and self._order is not None:
            self._worker.cancel(self._order, patience)
        self._order = None

    def _told(self, count: int, stage: Stage) -> None:
        if count != self._count:
            return
        is_first = self._stage is None
        self._stage = stage
        if self.stage is not None:
            self._redraw()
        elif is_first:
            # A drawing that is done by then is not worth a word.
            later = threading.Timer(LONG_SECONDS, self._show_stage, (count,))
            later.daemon = True
            later.start()

    def _show_stage(self, count: int) -> None:
        if count == self._count and not self.is_settled:
            self._redraw()

    def _arrived(self, drawing: Drawing) -> None:
        # An older one is shown until the newest is there.
        self._drawing = drawing
        if drawing.request == self._asked:
            self._problem, self._order = None, None
        self._redraw()

    def _failed(self, count: int, problem: str) -> None:
        # Of an older request it is of no interest, and who cancelled it knows.
        is_newest = count == self._count and self._asked is not None
        if is_newest and not self.is_cancelled:
            self._drawing, self._problem, self._order = None, problem, None
            self._redraw()
