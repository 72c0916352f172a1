"""Keeps a drawing of the workspace in step with the state, computed in the worker.

Of a burst of changes only the newest waits while one is computed, and a drawing is shown
only until a newer one is there, so the page never freezes and never shows what is over.
"""

from __future__ import annotations

from collections.abc import Callable

from explorer.app.jobs import Worker
from explorer.app.state import Frame
from explorer.app.tasks import WorkspaceDrawing, WorkspaceRequest
from explorer.arrays import FloatArray
from explorer.home import home_pose


class WorkspaceFeed:
    """Asks for drawings and keeps the newest.

    Args:
        worker: That computes them.
        redraw: Called when a new one is there.
    """

    def __init__(self, worker: Worker, redraw: Callable[[], None]) -> None:
        self._worker = worker
        self._redraw = redraw
        self._asked: WorkspaceRequest | None = None
        self._drawing: WorkspaceDrawing | None = None
        self._problem: str | None = None

    @property
    def drawing(self) -> WorkspaceDrawing | None:
        """The newest drawing, None if there is none or none is wanted."""
        return self._drawing if self._asked is not None else None

    @property
    def problem(self) -> str | None:
        """Why there is no newer drawing, if the last request failed."""
        return self._problem

    @property
    def is_current(self) -> bool:
        """Whether the drawing is what was last asked for."""
        return self._drawing is not None and self._drawing.request == self._asked

    def follow(self, frame: Frame) -> None:
        """Ask for the drawing that a frame wants, unless it is asked for already."""
        wanted = _wanted(frame)
        if wanted == self._asked:
            return
        self._asked, self._problem = wanted, None
        if wanted is not None:
            self._worker.submit(
                "workspace", "draw_workspace", (wanted,), self._arrived, self._failed
            )

    def _arrived(self, drawing: WorkspaceDrawing) -> None:
        self._drawing = drawing
        self._redraw()

    def _failed(self, problem: str) -> None:
        self._drawing, self._problem = None, problem
        self._redraw()


def workspace_rotation(frame: Frame) -> FloatArray:
    """Return the orientation whose workspace is shown, shape (3, 3)."""
    state = frame.state
    if state.view.workspace.orientation == "home":
        return home_pose(state.design).rotation
    return frame.snapshot.rotation


def _wanted(frame: Frame) -> WorkspaceRequest | None:
    view = frame.state.view.workspace
    if not (view.solid or view.hull):
        return None
    coloured = view.colour == "margin" or view.cut is not None
    return WorkspaceRequest(
        design=frame.state.design,
        rotation=tuple(tuple(row) for row in workspace_rotation(frame).tolist()),
        colour=view.colour,
        cut=view.cut,
        level=view.level if view.cut is not None else 0.0,
        tolerance=view.tolerance,
        hull=view.hull,
        # What nothing is coloured by must not make it all anew.
        warn_below=frame.state.warn_below if coloured else 1.0,
    )
