"""The workspace: its solid, its slices, its numbers, and files of it."""

from __future__ import annotations

from explorer.app.features.feature import Feature, Tab
from explorer.app.features.workspace.feed import WorkspaceFeed
from explorer.app.features.workspace.numbers import WorkspaceNumbers
from explorer.app.features.workspace.panel import WorkspacePanel
from explorer.app.features.workspace.scene import WorkspaceScene
from explorer.app.features.workspace.tasks import draw_workspace
from explorer.app.widgets.commands import Key, shift

WORKSPACE = Feature(
    "workspace",
    tabs=(Tab("main", "Workspace", WorkspacePanel), Tab("side", "Workspace", WorkspaceNumbers)),
    scene=(WorkspaceScene,),
    feeds=(WorkspaceFeed,),
    tasks=(draw_workspace,),
    keys={
        "Workspace › Solid": (Key("V"),),
        "Workspace › Convex hull": (shift("V"),),
        "Workspace › Singular planes": (shift("P"),),
        "Workspace › Cut open › across x": (Key("X"),),
        "Workspace › Cut open › across y": (Key("Y"),),
        "Workspace › Cut open › across z": (Key("Z"),),
        "Workspace › Cut open › no cut": (Key("C"),),
    },
    lists=("Region", "Reached from", "Orientation", "Colour by", "Cut open"),
)
