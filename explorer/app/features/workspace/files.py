"""Files of the workspace, sent to one browser."""

from __future__ import annotations

from typing import Literal

from explorer.app.features.feature import Services
from explorer.app.features.forces.loads import load_of
from explorer.app.features.workspace.load import loaded_design
from explorer.app.features.workspace.orientation import workspace_rows, workspace_start
from explorer.app.features.workspace.regions import Rows, rows_of
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
from explorer.mechanism.pose import Triple

FORMATS = ("3mf", "stl", "glb", "obj", "ply", STEP)
"""The formats of files; `STEP` takes the workspace within the limits only."""

Exported = Literal["workspace", "hull"]


class WorkspaceFiles:
    """Sends the workspace and its hull, in any of `FORMATS`."""

    def __init__(self, services: Services) -> None:
        self._session = services.session
        self._downloads = services.downloads

    def send(self, what: Exported, file_format: str, who: Who) -> None:
        """Send the workspace that is shown, or its hull."""
        state = self._session.settled()
        frame, region = Frame(state), state.view.workspace.region
        start = workspace_start(frame) if region == "accessible" else None
        self._send(who, state, region, what, file_format, workspace_rows(frame), start)

    def send_hull_at_home(self, file_format: str, who: Who) -> None:
        """Send the hull of the workspace within the limits, at the orientation of home."""
        state = self._session.settled()
        rows = rows_of(state.design.home_pose.rotation)
        self._send(who, state, "limits", "hull", file_format, rows, None)

    def _send(
        self,
        who: Who,
        state: State,
        region: Region,
        what: Exported,
        file_format: str,
        rows: Rows,
        start: Triple | None,
    ) -> None:
        design = loaded_design(state) if region == "held" else state.design
        offset: Triple | None = None
        if state.view.at == "tool":
            x, y, z = state.offset(rows).tolist()
            offset = x, y, z
        words = exported_name(region, what, offset).replace(" ", "-")
        name = f"{design.name}-{words}.{file_format}"
        place = design, rows, tolerance_of(state), region, start, load_of(state)
        self._downloads.compute(who, name, export_mesh, (*place, what, file_format, offset))


def tolerance_of(state: State) -> float:
    """Return the chord tolerance in design units."""
    return state.view.workspace.tolerance or LIVE_TOLERANCE * state.base.reach
