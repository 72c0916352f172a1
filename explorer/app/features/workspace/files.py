"""Files of the workspace, sent to one browser."""

from __future__ import annotations

from explorer.app.features.feature import Services
from explorer.app.features.workspace.feed import workspace_rows, workspace_start
from explorer.app.features.workspace.reached import Rows, rows_of
from explorer.app.features.workspace.tasks import (
    LIVE_TOLERANCE,
    STEP,
    Region,
    export_mesh,
    exported_name,
)
from explorer.app.session.session import Who
from explorer.app.state.frame import Frame
from explorer.app.state.state import State
from explorer.mechanism.home import home_pose
from explorer.mechanism.pose import Triple

FORMATS = ("3mf", "stl", "glb", "obj", "ply", STEP)


class WorkspaceFiles:
    """Sends the workspace and its hull in the chosen format."""

    def __init__(self, services: Services) -> None:
        self._session = services.session
        self._downloads = services.downloads
        self._format = FORMATS[0]

    def choose(self, file_format: str) -> None:
        """Choose the format of files, one of `FORMATS`."""
        self._format = file_format

    def send(self, what: str, who: Who) -> None:
        """Send the workspace that is shown, or its hull."""
        state = self._session.state
        frame, region = Frame(state), state.view.workspace.region
        self._send(who, state, region, what, workspace_rows(frame), workspace_start(frame))

    def send_hull_at_home(self, who: Who) -> None:
        """Send the hull of the workspace within the limits, at the orientation of home."""
        state = self._session.state
        rows = rows_of(home_pose(state.design).rotation)
        self._send(who, state, "limits", "hull", rows, None)

    def _send(
        self, who: Who, state: State, region: Region, what: str, rows: Rows, start: Triple | None
    ) -> None:
        design, tolerance = state.design, tolerance_of(state)
        name = f"{design.name}-{exported_name(region, what).replace(' ', '-')}.{self._format}"
        arguments = (design, rows, tolerance, region, start, what, self._format)
        self._downloads.compute(who, name, export_mesh, arguments)


def tolerance_of(state: State) -> float:
    """Return the chord tolerance in design units."""
    return state.view.workspace.tolerance or LIVE_TOLERANCE * state.base.reach
