"""The workspace that the worker draws, in step with the state.

While one drawing is computed, only the newest request waits.
"""

from __future__ import annotations

from explorer.app.features.feature import Services
from explorer.app.features.workspace.reached import Rows, rows_of
from explorer.app.features.workspace.tasks import WorkspaceDrawing, WorkspaceRequest, draw_workspace
from explorer.app.session.feed import Feed
from explorer.app.state.frame import Frame
from explorer.mechanism.home import home_pose
from explorer.mechanism.pose import Triple
from explorer.numerics.arrays import FloatArray


class WorkspaceFeed(Feed[WorkspaceRequest, WorkspaceDrawing]):
    """Drawings of the workspace."""

    def __init__(self, services: Services) -> None:
        super().__init__(
            services.worker, draw_workspace, _request_for, services.session.redraw, has_stages=True
        )


def workspace_rotation(frame: Frame) -> FloatArray:
    """Return the orientation of the workspace that is shown, shape (3, 3)."""
    state = frame.state
    if state.view.workspace.orientation == "home":
        return home_pose(state.design).rotation
    return frame.snapshot.rotation


def workspace_rows(frame: Frame) -> Rows:
    """Return the rows of `workspace_rotation` as plain numbers."""
    return rows_of(workspace_rotation(frame))


def workspace_start(frame: Frame) -> Triple | None:
    """Return the position where paths start; None for home."""
    state = frame.state
    return state.pose.position if state.view.workspace.start == "pose" else None


def _request_for(frame: Frame) -> WorkspaceRequest | None:
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
        # The length changes no drawing that is not coloured by it.
        warn_below=frame.state.warn_below if coloured else 1.0,
    )
