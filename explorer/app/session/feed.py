"""Drawings that the worker computes, kept in step with the state."""

from __future__ import annotations

import math
import threading
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from typing import Any, Generic, TypeVar

from explorer.app.state.frame import Frame
from explorer.jobs.jobs import PAGE, Jobs, LongJob
from explorer.jobs.process import CANCELLED, Channel
from explorer.numerics.search import Watch, ignore_stage
from explorer.page.session.clock import Pause, now

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


@dataclass(frozen=True)
class FeedOf(Generic[Request, Drawing]):
    """The declaration of a feed, which makes it with the services of a page.

    Attributes:
        task: Function of the page's process, from requests to drawings.
        request_of: Function from a frame to its request; None if nothing is to be drawn.
        key: Key of the requests, of which the newest counts; the task if None.
        has_stages: Whether the task sends each `Stage`, and parts of the drawing as soon as they
            are known, and can be cancelled.
        process: Name of the process of the task.
        in_scene: Whether drawings have the scale of the opened design, so that none is shown with a
            design of another size.
    """

    task: Callable[[Request], Drawing] | Callable[[Request, Channel], Drawing]
    request_of: Callable[[Frame], Request | None]
    key: object = None
    has_stages: bool = field(default=False, kw_only=True)
    process: str = field(default=PAGE, kw_only=True)
    in_scene: bool = field(default=True, kw_only=True)

    def __call__(self, services: Any) -> Feed[Request, Drawing]:
        """Return the feed of a page."""
        return Feed(self, services.jobs, services.session.redraw)


class Feed(Generic[Request, Drawing]):
    """Requests drawings of one kind and holds the newest.

    The session, the process and the browsers change it, each on a thread of its own.

    Args:
        jobs: The processes, of which that of the page computes the drawings.
        redraw: Called when there is a new drawing, stage or problem.

    Attributes:
        request: The newest request; None if nothing is to be drawn.
        problem: Why there is no newer drawing, if the last request failed.
    """

    def __init__(
        self, kind: FeedOf[Request, Drawing], jobs: Jobs, redraw: Callable[[], None]
    ) -> None:
        self._kind, self._jobs, self._redraw = kind, jobs, redraw
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
        self._stage_pause = Pause(LONG_SECONDS, self._redraw)
        # Number of the newest request, its time, and its job.
        self._count, self._submitted = 0, 0.0
        self._job: LongJob | None = None

    @property
    def drawing(self) -> Drawing | None:
        """The newest drawing; None if there is none, none is requested, or it was cancelled."""
        return None if self.request is None or self.is_cancelled else self._drawing

    @property
    def part(self) -> object:
        """The part of an incomplete drawing that has arrived; None if there is no such drawing."""
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
        request, reach = self._kind.request_of(frame), frame.state.base.reach
        with self._lock:
            if request == self.request:
                return
            if self._kind.in_scene and abs(math.log(reach / self._reach)) > math.log(OTHER_SIZE):
                self._drawing, self._part, self._oldest = None, None, self._count + 1
            self._reach = reach
            if request is None and self._kind.has_stages and self._job is not None:
                self._job.cancel()
            self.problem, self.request = None, request
            self._submit()

    def cancel(self) -> None:
        """Cancel the drawing being computed, if it can be; `retry` requests it again."""
        with self._lock:
            if not self._kind.has_stages or self.is_settled or self._job is None:
                return
            self.problem = CANCELLED
            self._job.cancel(CANCEL_SECONDS)
        self._redraw()

    def retry(self) -> None:
        """Request a drawing again that was cancelled."""
        with self._lock:
            if not self.is_cancelled:
                return
            self.problem = None
            self._submit()
        self._redraw()

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
                self._redraw()

        kind, before = self._kind, self._job
        self._job = self._jobs.start(
            kind.task,
            (request,),
            lambda drawing: self._show_drawing(count, request, drawing),
            lambda problem: self._show_problem(count, problem),
            receive if kind.has_stages else None,
            key=kind.task if kind.key is None else kind.key,
            process=kind.process,
        )
        if kind.has_stages and before is not None:
            before.cancel(after=LONG_SECONDS)

    def _receive_stage(self, count: int, stage: Stage) -> None:
        with self._lock:
            if count != self._count:
                return
            is_first, self._stage = self._stage is None, stage
        if self.stage is not None:
            self._redraw()
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
        self._redraw()

    def _show_problem(self, count: int, problem: str) -> None:
        with self._lock:
            if count != self._count or self.request is None or self.is_cancelled:
                return
            self._drawing, self._part, self.problem = None, None, problem
            self._stage_pause.cancel()
        self._redraw()


def modules_of(feeds: Iterable[object]) -> tuple[str, ...]:
    """Return the modules of the tasks that the process of the page does for feeds of `FeedOf`."""
    kinds: list[FeedOf[Any, Any]] = [each for each in feeds if isinstance(each, FeedOf)]
    kinds = [each for each in kinds if each.process == PAGE]
    return tuple(dict.fromkeys(each.task.__module__ for each in kinds))
