"""The workspace: its solid, its slices, its numbers, and files of it."""

from __future__ import annotations

from collections.abc import Callable

import viser

from explorer.app.features.feature import Export, Feature, Services, Tab
from explorer.app.features.workspace.feed import WorkspaceFeed
from explorer.app.features.workspace.files import FORMATS, WorkspaceFiles
from explorer.app.features.workspace.numbers import WorkspaceNumbers
from explorer.app.features.workspace.panel import WorkspacePanel
from explorer.app.features.workspace.scene import WorkspaceScene
from explorer.app.features.workspace.tasks import STEP, draw_workspace
from explorer.app.session.session import Who
from explorer.app.widgets.commands import Key, shift

# The hull consists of facets, which STEP does not take.
HULL_FORMATS = tuple(name for name in FORMATS if name != STEP)


def _sender(what: str) -> Callable[[Services], Callable[[str, Who], None]]:
    def sender(services: Services) -> Callable[[str, Who], None]:
        files = services.get(WorkspaceFiles)

        def send(name: str, who: Who) -> None:
            files.choose(name.lower())
            files.send(what, who)

        return send

    return sender


WORKSPACE = Feature(
    "workspace",
    tabs=(
        Tab("analyse", "Workspace", WorkspacePanel, viser.Icon.SPHERE),
        Tab("analyse", "Workspace", WorkspaceNumbers),
    ),
    exports=(
        Export(
            "Workspace",
            "All positions of b4 in the region and orientation of the tab Workspace; STEP has "
            "exact faces.",
            tuple(map(str.upper, FORMATS)),
            _sender("workspace"),
        ),
        Export(
            "Convex hull",
            "The convex hull of that workspace.",
            tuple(map(str.upper, HULL_FORMATS)),
            _sender("hull"),
        ),
    ),
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
