"""Drawings that the worker computes, kept in step with the state."""

from __future__ import annotations

import math
import threading
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any, Generic, TypeVar

from explorer.app.state.frame import Frame
from explorer.numerics.search import Watch, ignore_stage
from explorer.page.session.clock import Pause, now
from explorer.page.session.worker import CANCELLED, Channel, Worker

# Seconds after which a drawing is cancelled as soon as a newer one waits, and its stage is shown.
LONG_SECONDS = 1.0
# Ratio of the sizes of two opened designs from which one's drawing is not shown with the other.
OTHER_SIZE = 2.0
# Seconds after which a drawing that the user cancelled ends with its process.
CANCEL_SECONDS = 2.0


@dataclass(frozen=True)
class Stage:
    """A stage of a drawing that takes long: what is computed, and the share that is done."""

    words: str
    share: float


def watch_of(channel: Channel | None) -> Watch:
    """Return a watch that sends each stage to the parent and ends the task when it cancels."""
    if channel is None:
        return ignore_stage

    def watch(words: str, share: float) -> None:
        channel.raise_if_cancelled()
        channel.send(Stage(words, share))

    return watch


Request = TypeVar("Request")
Drawing = TypeVar("Drawing")


@dataclass(eq=False)
class Feed(Generic[Request, Drawing]):
    """Requests drawings of one kind and holds the newest.

    The session, the worker and the browsers change it, each on a thread of its own.

    Attributes:
        worker: The worker that computes them.
        task: A function of the worker, from requests to drawings.
        request_of: Returns the request of a frame; None if nothing is to be drawn.
        redraw: Called when there is a new drawing, stage or problem.
        key: Key of the requests, of which the newest counts; the task if None.
        has_stages: Whether the task sends each `Stage`, and parts of the drawing as soon as they
            are known, and can be cancelled.
        request: The newest request; None if nothing is to be drawn.
        problem: Why there is no newer drawing, if the last request failed.
    """

    worker: Worker
    task: Callable[[Request], Drawing] | Callable[[Request, Channel], Drawing]
    request_of: Callable[[Frame], Request | None]
    redraw: Callable[[], None]
    key: object = None
    has_stages: bool = field(default=False, kw_only=True)

    def __post_init__(self) -> None:
        self.request: Request | None = None
        self.problem: str | None = None
        self._lock = threading.RLock()
        # The reach of the opened design, which scales the scene, at the newest request, and the
        # number of the oldest request whose drawing is shown at that scale.
        self._reach, self._oldest = math.nan, 0
        # The newest drawing, and the request that it answers.
        self._drawing: Drawing | None = None
        self._answered: Request | None = None
        # What has arrived of a newer drawing, and its stage.
        self._part: object = None
        self._stage: Stage | None = None
        # Shows the first stage of a drawing that takes long.
        self._stage_pause = Pause(LONG_SECONDS, self.redraw)
        # Number of the newest request, its time, and its number in the worker.
        self._count, self._submitted, self._order = 0, 0.0, -1

    @property
    def drawing(self) -> Drawing | None:
        """The newest drawing; None if there is none, none is requested, or it was cancelled."""
        return None if self.request is None or self.is_cancelled else self._drawing

    @property
    def part(self) -> object:
        """What has arrived of a drawing that is not complete; None if there is no such drawing."""
        return None if self.request is None or self.is_cancelled else self._part

    @property
    def stage(self) -> Stage | None:
        """The stage of a drawing that takes long; None if none does, or before the first stage."""
        is_long = now() - self._submitted >= LONG_SECONDS
        return self._stage if is_long and not self.is_settled else None

    @property
    def is_cancelled(self) -> bool:
        """Whether the newest request was cancelled."""
        return self.request is not None and self.problem == CANCELLED

    @property
    def is_current(self) -> bool:
        """Whether the drawing is that of the newest request."""
        return self._drawing is not None and self._answered == self.request

    @property
    def is_settled(self) -> bool:
        """Whether no newer drawing is being computed."""
        return self.request is None or self.problem is not None or self.is_current

    def follow(self, frame: Frame) -> None:
        """Request the drawing of a frame, unless it is the newest request already."""
        request, reach = self.request_of(frame), frame.state.base.reach
        with self._lock:
            if request == self.request:
                return
            if abs(math.log(reach / self._reach)) > math.log(OTHER_SIZE):
                self._drawing, self._part, self._oldest = None, None, self._count + 1
            self._reach = reach
            if request is None and self.has_stages:
                self.worker.cancel(self._order)
            self.problem, self.request = None, request
            self._submit()

    def cancel(self) -> None:
        """Cancel the drawing being computed, if it can be; `retry` requests it again."""
        with self._lock:
            if not self.has_stages or self.is_settled:
                return
            self.worker.cancel(self._order, CANCEL_SECONDS)
            self.problem = CANCELLED
        self.redraw()

    def retry(self) -> None:
        """Request a drawing again that was cancelled."""
        with self._lock:
            if not self.is_cancelled:
                return
            self.problem = None
            self._submit()
        self.redraw()

    def _submit(self) -> None:
        request = self.request
        if request is None:
            return
        self._count += 1
        self._stage, self._submitted = None, now()
        count = self._count

        def receive(value: object) -> None:
            if isinstance(value, Stage):
                self._receive_stage(count, value)
            else:
                self._part = value
                self.redraw()

        before = self._order
        self._order = self.worker.submit(
            self.task if self.key is None else self.key,
            self.task,
            (request,),
            lambda drawing: self._show_drawing(count, request, drawing),
            lambda problem: self._show_problem(count, problem),
            receive if self.has_stages else None,
        )
        if self.has_stages:
            self.worker.cancel(before, after=LONG_SECONDS)

    def _receive_stage(self, count: int, stage: Stage) -> None:
        with self._lock:
            if count != self._count:
                return
            is_first, self._stage = self._stage is None, stage
        if self.stage is not None:
            self.redraw()
        elif is_first:
            self._stage_pause.begin()

    def _show_drawing(self, count: int, request: Request, drawing: Drawing) -> None:
        with self._lock:
            if count < self._oldest:
                return
            # An older drawing is shown until the newest has arrived.
            self._drawing, self._answered, self._part = drawing, request, None
            if self.is_current:
                self.problem = None
                self._stage_pause.cancel()
        self.redraw()

    def _show_problem(self, count: int, problem: str) -> None:
        with self._lock:
            if count != self._count or self.request is None or self.is_cancelled:
                return
            self._drawing, self._part, self.problem = None, None, problem
            self._stage_pause.cancel()
        self.redraw()


def feed_of(
    task: Callable[[Request], Drawing] | Callable[[Request, Channel], Drawing],
    request_of: Callable[[Frame], Request | None],
    *,
    has_stages: bool = False,
) -> Callable[[Any], Feed[Request, Drawing]]:
    """Return the function that makes a feed with the services of a page; see `Feed`."""
    return lambda services: Feed(
        services.worker, task, request_of, services.session.redraw, has_stages=has_stages
    )
