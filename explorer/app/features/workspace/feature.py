"""The workspace: its volume, its solid and slices, its numbers, and files of it."""

from __future__ import annotations

from collections.abc import Callable

import viser

from explorer.app.features.feature import Export, Feature, InBar, Services, Tab
from explorer.app.features.workspace.feed import WorkspaceFeed
from explorer.app.features.workspace.files import FORMATS, Exported, WorkspaceFiles
from explorer.app.features.workspace.panel import WorkspacePanel
from explorer.app.features.workspace.scene import WorkspaceScene
from explorer.app.features.workspace.tasks import STEP, draw_workspace
from explorer.app.features.workspace.volume import VolumeFeed, measure_volume
from explorer.app.features.workspace.volume_figure import VolumeFigure
from explorer.app.session.session import Who

# The hull consists of facets, which STEP does not take.
HULL_FORMATS = tuple(name for name in FORMATS if name != STEP)


def _sender(what: Exported) -> Callable[[Services], Callable[[str, Who], None]]:
    def sender(services: Services) -> Callable[[str, Who], None]:
        files = services.get(WorkspaceFiles)
        return lambda name, who: files.send(what, name.lower(), who)

    return sender


WORKSPACE = Feature(
    "workspace",
    tabs=(Tab("analyse", "Workspace", WorkspacePanel, viser.Icon.SPHERE),),
    bar=(InBar("middle", VolumeFigure),),
    exports=(
        Export(
            "Workspace",
            "All positions of b4, or of the tool point if the tab Pose shows it, in the region and "
            "orientation of the tab Workspace; STEP has exact faces.",
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
    # A volume takes a tenth of the time of a drawing, and is requested before it.
    feeds=(VolumeFeed, WorkspaceFeed),
    tasks=(measure_volume, draw_workspace),
    lists=("Region", "Orientation", "Colour by"),
)
