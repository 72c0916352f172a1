"""Drawings that the worker computes, kept in step with the state."""

from __future__ import annotations

import threading
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any, Generic, Protocol, TypeVar, cast

from explorer.app.session.clock import Timer, now, start_timer
from explorer.app.session.jobs import LONG_SECONDS, Worker
from explorer.app.session.worker import CANCELLED, Channel
from explorer.app.state.frame import Frame
from explorer.numerics.stages import Watch, unwatched

# Seconds after which a drawing that the user cancelled ends with its process.
CANCEL_SECONDS = 2.0


@dataclass(frozen=True)
class Stage:
    """A stage of a drawing that takes long.

    Attributes:
        words: What is computed, in words.
        share: Share of the stages that are done, from 0 to 1.
    """

    words: str
    share: float


def watch_of(channel: Channel | None) -> Watch:
    """Return a watch that sends each stage to the parent and ends the task when it cancels."""
    if channel is None:
        return unwatched

    def watch(words: str, share: float) -> None:
        channel.raise_if_cancelled()
        channel.send(Stage(words, share))

    return watch


class _Drawn(Protocol):
    @property
    def request(self) -> object: ...


Request = TypeVar("Request")
Drawing = TypeVar("Drawing", bound=_Drawn)


@dataclass(frozen=True)
class _Status(Generic[Request, Drawing]):
    """The status of a feed; a new value replaces it as a whole, so that readers need no lock.

    Attributes:
        request: The newest request; None if nothing is to be drawn.
        drawing: The newest drawing; None before the first.
        part: What has arrived of a drawing that is newer still; None for nothing.
        problem: Why there is no newer drawing, if the last request failed.
        count: Number of requests that were submitted so far.
        submitted: Time of the newest request in seconds, by the monotonic clock.
        order: Number of the newest request in the worker; None once it is answered.
        stage: Stage of its drawing; None before the first.
    """

    request: Request | None = None
    drawing: Drawing | None = None
    part: object = None
    problem: str | None = None
    count: int = 0
    submitted: float = 0.0
    order: int | None = None
    stage: Stage | None = None


class Feed(Generic[Request, Drawing]):
    """Requests drawings of one kind and holds the newest.

    The session, the worker and the browsers change it, each on a thread of its own.

    Args:
        worker: The worker that computes them.
        task: A function of the worker, from requests to drawings.
        request_of: Returns the request of a frame; None if nothing is to be drawn.
        redraw: Called when there is a new drawing, stage or problem.
        key: Key of the requests, of which the newest counts; the task if None.
        has_stages: Whether the task sends each `Stage`, and parts of the drawing as soon as they
            are known, and can be cancelled.
    """

    def __init__(
        self,
        worker: Worker,
        task: Callable[[Request], Drawing] | Callable[[Request, Channel], Drawing],
        request_of: Callable[[Frame], Request | None],
        redraw: Callable[[], None],
        key: object = None,
        *,
        has_stages: bool = False,
    ) -> None:
        self._worker = worker
        self._task = task
        self._has_stages = has_stages
        self._key = task if key is None else key
        self._request_of = request_of
        self._redraw = redraw
        self._lock = threading.RLock()
        # Shows the first stage of a drawing that takes long.
        self._stage_timer: Timer | None = None
        self._status = cast("_Status[Request, Drawing]", _Status())

    @property
    def drawing(self) -> Drawing | None:
        """The newest drawing; None if there is none, none is requested, or it was cancelled."""
        status = self._status
        return status.drawing if self._is_shown(status) else None

    @property
    def part(self) -> object:
        """What has arrived of a drawing newer than the newest; None for nothing, or as there."""
        status = self._status
        return status.part if self._is_shown(status) else None

    @staticmethod
    def _is_shown(status: _Status[Request, Drawing]) -> bool:
        return status.request is not None and status.problem != CANCELLED

    @property
    def request(self) -> Request | None:
        """The newest request; None if nothing is to be drawn."""
        return self._status.request

    @property
    def problem(self) -> str | None:
        """Why there is no newer drawing, if the last request failed."""
        return self._status.problem

    @property
    def stage(self) -> Stage | None:
        """The stage of a drawing that takes long; None if none does, or before the first stage."""
        status = self._status
        is_long = now() - status.submitted >= LONG_SECONDS
        return status.stage if is_long and not self.is_settled else None

    @property
    def is_cancelled(self) -> bool:
        """Whether the newest request was cancelled."""
        status = self._status
        return status.request is not None and status.problem == CANCELLED

    @property
    def is_current(self) -> bool:
        """Whether the drawing is that of the newest request."""
        status = self._status
        return status.drawing is not None and status.drawing.request == status.request

    @property
    def is_settled(self) -> bool:
        """Whether no newer drawing is being computed."""
        status = self._status
        return status.request is None or status.problem is not None or self.is_current

    def follow(self, frame: Frame) -> None:
        """Request the drawing of a frame, unless it is the newest request already."""
        request = self._request_of(frame)
        with self._lock:
            if request == self._status.request:
                return
            if request is None:
                self._cancel_order(None)
            self._set(request=request, problem=None)
            self._submit()

    def cancel(self) -> None:
        """Cancel the drawing being computed, if it can be; `retry` requests it again."""
        with self._lock:
            if not self._has_stages or self.is_settled:
                return
            self._set(problem=CANCELLED)
            self._cancel_order(CANCEL_SECONDS)
        self._redraw()

    def retry(self) -> None:
        """Request a drawing again that was cancelled."""
        with self._lock:
            if not self.is_cancelled:
                return
            self._set(problem=None)
            self._submit()
        self._redraw()

    def _set(self, **changes: Any) -> None:
        with self._lock:
            self._status = replace(self._status, **changes)

    def _submit(self) -> None:
        request = self._status.request
        if request is None:
            return
        count = self._status.count + 1
        self._set(count=count, submitted=now(), stage=None)

        def failed(problem: str) -> None:
            self._show_problem(count, problem)

        def receive(value: object) -> None:
            if isinstance(value, Stage):
                self._receive(count, value)
            else:
                self._show_part(value)

        order = (self._key, self._task, (request,), self._show_drawing, failed)
        if self._has_stages:
            number = self._worker.submit(*order, receive, is_drawing=True)
        else:
            number = self._worker.submit(*order)
        self._set(order=number)

    def _cancel_order(self, patience: float | None) -> None:
        """Cancel the newest order, if it is not answered yet."""
        order = self._status.order
        if self._has_stages and order is not None:
            self._worker.cancel(order, patience)
        self._set(order=None)

    def _receive(self, count: int, stage: Stage) -> None:
        with self._lock:
            if count != self._status.count:
                return
            is_first = self._status.stage is None
            self._set(stage=stage)
        if self.stage is not None:
            self._redraw()
        elif is_first:
            # The stage of a drawing that is done by then is not shown.
            self._stage_timer = start_timer(LONG_SECONDS, self._show_stage, count)

    def _show_stage(self, count: int) -> None:
        if count == self._status.count and not self.is_settled:
            self._redraw()

    def _stop_timer(self) -> None:
        if self._stage_timer is not None:
            self._stage_timer.cancel()

    def _show_part(self, part: object) -> None:
        self._set(part=part)
        self._redraw()

    def _show_drawing(self, drawing: Drawing) -> None:
        with self._lock:
            # An older drawing is shown until the newest has arrived.
            self._set(drawing=drawing, part=None)
            if self.is_current:
                self._set(problem=None, order=None)
                self._stop_timer()
        self._redraw()

    def _show_problem(self, count: int, problem: str) -> None:
        with self._lock:
            is_newest = count == self._status.count and self._status.request is not None
            if not is_newest or self.is_cancelled:
                return
            self._set(drawing=None, part=None, problem=problem, order=None)
            self._stop_timer()
        self._redraw()
