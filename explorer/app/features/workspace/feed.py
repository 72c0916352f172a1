"""The workspace that the worker draws, in step with the state.

While one drawing is computed, only the newest request waits.
"""

from __future__ import annotations

from explorer.app.features.feature import Services
from explorer.app.features.forces.loads import load_of
from explorer.app.features.workspace.load import drawn_measure, loaded_design
from explorer.app.features.workspace.orientation import (
    workspace_rotation,
    workspace_rows,
    workspace_start,
)
from explorer.app.features.workspace.tasks import (
    WorkspaceDrawing,
    WorkspaceRequest,
    WorkspaceSurface,
    draw_workspace,
)
from explorer.app.session.feed import Feed
from explorer.app.state.frame import Frame
from explorer.workspace.position_bands import LOAD_MEASURES


class WorkspaceFeed(Feed[WorkspaceRequest, WorkspaceDrawing]):
    """Drawings of the workspace, of which the surface arrives before the numbers."""

    def __init__(self, services: Services) -> None:
        super().__init__(
            services.worker,
            draw_workspace,
            workspace_request,
            services.session.redraw,
            has_stages=True,
        )

    @property
    def surface(self) -> WorkspaceSurface | None:
        """The newest surface; None if there is none, none is requested, or it was cancelled."""
        if isinstance(self.part, WorkspaceSurface):
            return self.part
        return None if self.drawing is None else self.drawing.surface


def workspace_request(frame: Frame) -> WorkspaceRequest | None:
    """Return the request for the workspace of a frame; None if none is shown."""
    view = frame.state.view.workspace
    if not (view.solid or view.hull):
        return None
    is_cut, level = view.cut is not None, view.level
    if view.cut is not None and level is not None:
        # The worker counts in coordinates of b4.
        level -= float(frame.state.offset(workspace_rotation(frame))["xyz".index(view.cut)])
    coloured = view.colour == "margin" or is_cut
    colour = drawn_measure(frame.state)
    # The load changes no drawing that does not show it.
    is_loaded = colour in LOAD_MEASURES or view.region == "held"
    return WorkspaceRequest(
        design=loaded_design(frame.state) if is_loaded else frame.state.design,
        rotation=workspace_rows(frame),
        region=view.region,
        start=workspace_start(frame) if view.region == "accessible" else None,
        colour=colour,
        cut=view.cut,
        level=level if is_cut else None,
        flipped=is_cut and view.flipped,
        tolerance=view.tolerance,
        hull=view.hull,
        # The length changes no drawing that is not coloured by it.
        warn_below=frame.state.warn_below if coloured else 1.0,
        load=load_of(frame.state) if is_loaded else None,
    )
