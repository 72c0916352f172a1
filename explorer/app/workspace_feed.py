"""Keeps what the worker draws in step with the state: the workspace, and the radius curve.

Of a burst of changes only the newest waits while one is computed, and a drawing is shown
only until a newer one is there, so the page never freezes and never shows what is over.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Generic, Protocol, TypeVar

from explorer.app.jobs import Worker
from explorer.app.state import Frame
from explorer.app.tasks import (
    RadiusDrawing,
    RadiusRequest,
    Rows,
    WorkspaceDrawing,
    WorkspaceRequest,
)
from explorer.arrays import FloatArray
from explorer.home import home_pose
from explorer.pose import Triple
from explorer.radii import with_radius

Request = TypeVar("Request")


class _Answer(Protocol):
    @property
    def request(self) -> object: ...


Drawing = TypeVar("Drawing", bound=_Answer)


class Feed(Generic[Request, Drawing]):
    """Asks for drawings of one kind and keeps the newest.

    Args:
        worker: That computes them.
        task: The name of a function in `explorer.app.tasks`, from requests to drawings.
        wanted: The request of a frame, None if nothing is to be drawn.
        redraw: Called when a new one is there.
        key: Of the requests, of which the newest counts; the task if None.
    """

    def __init__(
        self,
        worker: Worker,
        task: str,
        wanted: Callable[[Frame], Request | None],
        redraw: Callable[[], None],
        key: object = None,
    ) -> None:
        self._worker = worker
        self._task = task
        self._key = task if key is None else key
        self._wanted = wanted
        self._redraw = redraw
        self._asked: Request | None = None
        self._drawing: Drawing | None = None
        self._problem: str | None = None

    @property
    def drawing(self) -> Drawing | None:
        """The newest drawing, None if there is none or none is wanted."""
        return self._drawing if self._asked is not None else None

    @property
    def asked(self) -> Request | None:
        """What was asked for last, None if nothing is to be drawn."""
        return self._asked

    @property
    def problem(self) -> str | None:
        """Why there is no newer drawing, if the last request failed."""
        return self._problem

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
        self._asked, self._problem = wanted, None
        if wanted is not None:
            self._worker.submit(self._key, self._task, (wanted,), self._arrived, self._failed)

    def _arrived(self, drawing: Drawing) -> None:
        # Of requests that failed meanwhile none is the newest.
        self._drawing, self._problem = drawing, None
        self._redraw()

    def _failed(self, problem: str) -> None:
        self._drawing, self._problem = None, problem
        self._redraw()


class WorkspaceFeed(Feed[WorkspaceRequest, WorkspaceDrawing]):
    """Drawings of the workspace."""

    def __init__(self, worker: Worker, redraw: Callable[[], None]) -> None:
        super().__init__(worker, "draw_workspace", _workspace, redraw)


class RadiusFeed(Feed[RadiusRequest, RadiusDrawing]):
    """Drawings of the reachable volume against the radius of the legs."""

    def __init__(self, worker: Worker, redraw: Callable[[], None]) -> None:
        super().__init__(worker, "draw_radius_curve", _radius_curve, redraw)


def workspace_rotation(frame: Frame) -> FloatArray:
    """Return the orientation whose workspace is shown, shape (3, 3)."""
    state = frame.state
    if state.view.workspace.orientation == "home":
        return home_pose(state.design).rotation
    return frame.snapshot.rotation


def workspace_rows(frame: Frame) -> Rows:
    """Return the same as plain numbers."""
    return tuple(tuple(row) for row in workspace_rotation(frame).tolist())


def workspace_start(frame: Frame) -> Triple | None:
    """Return from where things are to be reached, None for the home position."""
    state = frame.state
    return state.pose.position if state.view.workspace.start == "pose" else None


def _workspace(frame: Frame) -> WorkspaceRequest | None:
    view = frame.state.view.workspace
    if not (view.solid or view.hull):
        return None
    coloured = view.colour == "margin" or view.cut is not None
    return WorkspaceRequest(
        design=frame.state.design,
        rotation=workspace_rows(frame),
        region=view.region,
        start=workspace_start(frame) if view.region == "reachable" else None,
        colour=view.colour,
        cut=view.cut,
        level=view.level if view.cut is not None else 0.0,
        tolerance=view.tolerance,
        hull=view.hull,
        # What nothing is coloured by must not make it all anew.
        warn_below=frame.state.warn_below if coloured else 1.0,
    )


def _radius_curve(frame: Frame) -> RadiusRequest | None:
    if not frame.state.view.radius_curve:
        return None
    thin = with_radius(frame.state.design, 0.0)
    return RadiusRequest(thin, workspace_rows(frame), workspace_start(frame))
