"""The workspace: its volume, its solid and slices, its numbers, and files of it."""

from __future__ import annotations

from collections.abc import Callable
from typing import Literal

import viser

from explorer.app.features.feature import Export, Feature, InBar, Services, Tab
from explorer.app.features.forces.tasks import load_of
from explorer.app.features.workspace.feeds import (
    VOLUME_FEED,
    WORKSPACE_FEED,
    loaded_design,
    orientation_word,
    tolerance_of,
    turned_suffix,
    workspace_rows,
    workspace_start,
)
from explorer.app.features.workspace.panel import WorkspacePanel
from explorer.app.features.workspace.regions import Selection, rows_of
from explorer.app.features.workspace.scene import WorkspaceScene
from explorer.app.features.workspace.tasks import (
    STEP,
    draw_workspace,
    export_mesh,
    file_words,
    measure_volume,
)
from explorer.app.features.workspace.words import volume_text
from explorer.app.session.session import Who
from explorer.app.state.frame import Frame
from explorer.app.widgets.buttons import figure
from explorer.mechanism.pose import Triple

# The hull consists of facets, which STEP does not take.
HULL_FORMATS = ("3mf", "stl", "glb", "obj", "ply")
FORMATS = (*HULL_FORMATS, STEP)
"""The formats of files; `STEP` takes the workspace within the limits only."""

Exported = Literal["workspace", "hull"]


def send_workspace(
    services: Services, what: Exported, file_format: str, who: Who, *, at_home: bool = False
) -> None:
    """Send a client a file of the workspace that is shown, or of its hull.

    Args:
        services: Services of the page.
        what: The workspace or its hull.
        file_format: One of `FORMATS`.
        who: The client.
        at_home: Whether it is that within the limits at the orientation of home instead.
    """
    state = services.session.latest_state()
    frame, region, start = Frame(state), state.view.workspace.region, None
    if at_home:
        region, rows = "limits", rows_of(state.design.home_pose.rotation)
    else:
        rows = workspace_rows(frame)
    if region == "accessible":
        start = workspace_start(frame)
    design, load = state.design, None
    if region == "held":
        design, load = loaded_design(state), load_of(state)
    offset: Triple | None = None
    if state.view.at == "tool":
        x, y, z = state.offset(rows).tolist()
        offset = x, y, z
    words = file_words(region, what, offset).replace(" ", "-")
    selection = Selection(design, rows, region, start, load)
    services.downloads.compute(
        who,
        f"{design.name}-{words}.{file_format}",
        export_mesh,
        (selection, tolerance_of(state), what, file_format, offset),
    )


def _sender(what: Exported) -> Callable[[Services], Callable[[str, Who], None]]:
    return lambda services: lambda name, who: send_workspace(services, what, name.lower(), who)


class VolumeFigure:
    """The volume of the workspace within the limits, dim while a newer one is computed."""

    def __init__(self, services: Services) -> None:
        self._feed = services.get(VOLUME_FEED)

    def __call__(self, frame: Frame) -> str:
        """Return the figure for a frame, as HTML."""
        drawing, name = self._feed.drawing, "Volume"
        which = orientation_word(frame)
        hint = f"Exact volume of the workspace within the limits, in the {which} orientation."
        if drawing is not None:
            name += turned_suffix(drawing.request.design, drawing.request.rotation)
            if drawing.measured.volume <= 0.0:
                hint += f" It is emptied by: {', '.join(drawing.measured.empty_because)}."
        look = "" if self._feed.is_current else "is-outdated"
        return figure("Workspace", name, volume_text(drawing), hint=hint, look=look)


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
    feeds=(VOLUME_FEED, WORKSPACE_FEED),
    tasks=(measure_volume, draw_workspace),
    lists=("Region", "Orientation", "Colour by"),
)
