"""The workspace: its volume, its solid and slices, its numbers, and files of it."""

from __future__ import annotations

from explorer.app.features.feature import Feature, Tab
from explorer.app.features.workspace.feed import WorkspaceFeed
from explorer.app.features.workspace.panel import KEYS, WorkspacePanel
from explorer.app.features.workspace.scene import WorkspaceScene
from explorer.app.features.workspace.tasks import draw_workspace
from explorer.app.features.workspace.volume import VolumeFeed, measure_volume

WORKSPACE = Feature(
    "workspace",
    tabs=(Tab("side", "Workspace", WorkspacePanel),),
    scene=(WorkspaceScene,),
    # A volume takes a tenth of the time of a drawing, and is requested before it.
    feeds=(VolumeFeed, WorkspaceFeed),
    tasks=(measure_volume, draw_workspace),
    keys=KEYS,
    lists=("Region", "Orientation", "Colour by"),
)
