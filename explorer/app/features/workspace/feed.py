"""Keeps what the worker draws in step with the state: the workspace, and the radius curve.

Of a burst of changes only the newest waits while one is computed, and a drawing is shown
only until a newer one is there, so the page never freezes and never shows what is over.
"""

from __future__ import annotations

from collections.abc import Callable

from explorer.app.features.workspace.reached import Rows
from explorer.app.features.workspace.tasks import WorkspaceDrawing, WorkspaceRequest, draw_workspace
from explorer.app.session.feed import Feed
from explorer.app.session.jobs import Worker
from explorer.app.state.frame import Frame
from explorer.mechanism.home import home_pose
from explorer.mechanism.pose import Triple
from explorer.numerics.arrays import FloatArray


class WorkspaceFeed(Feed[WorkspaceRequest, WorkspaceDrawing]):
    """Drawings of the workspace."""

    def __init__(self, worker: Worker, redraw: Callable[[], None]) -> None:
        super().__init__(worker, draw_workspace, _workspace, redraw, has_stages=True)


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
        level=view.level if view.cut is not None else None,
        tolerance=view.tolerance,
        hull=view.hull,
        # What nothing is coloured by must not make it all anew.
        warn_below=frame.state.warn_below if coloured else 1.0,
    )
