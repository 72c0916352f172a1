"""The nearest singular pose of each incidence: its distance, its ghost, and a button to it."""

from __future__ import annotations

from collections.abc import Iterator
from typing import get_args

import viser

from explorer.app.features.feature import Services
from explorer.app.features.singularity.actions import GoToSingularity
from explorer.app.state.frame import Frame
from explorer.app.state.view import Ghost
from explorer.app.widgets.assigning import Update
from explorer.app.widgets.colours import proximity_colour
from explorer.app.widgets.controls import Controls
from explorer.app.widgets.markup import box, caption, format_number, row, swatch, table

GHOSTS: tuple[Ghost, ...] = get_args(Ghost)
GO = ("δ1 = 0", "δ2 = 0", "δ3 = 0")


class DistancePanel:
    """The three distances, the ghost, and buttons that move the mechanism to the nearest poses."""

    def __init__(self, services: Services) -> None:
        gui, session = services.gui, services.session
        self._table = gui.add_html("")
        self._controls = Controls(gui, session)
        self._controls.dropdown(
            "Ghost",
            "Draw the nearest pose with an incidence, and the displacements of b1 to b4 to it.",
            GHOSTS,
            "view.singular.ghost",
        )
        self.go = gui.add_button_group(
            "Go to", GO, hint="Move the mechanism to the nearest pose with this incidence."
        )

        @self.go.on_click
        def _(event: viser.GuiEvent[viser.GuiButtonGroupHandle]) -> None:
            session.do(GoToSingularity(GO.index(event.target.value) + 1), who=event.client_id)

    def updates(self, frame: Frame) -> Iterator[Update]:
        """Yield the updates that make the panel show the frame."""
        yield self._table, "content", distance_table(frame)
        yield from self._controls.updates(frame)


def distance_table(frame: Frame) -> str:
    """Return the three distances as HTML, the least of them in bold."""
    unit, levels = frame.state.design.unit_mm, frame.verdict.levels
    poses, reach = frame.snapshot.nearest, frame.state.design.reach
    least = min(pose.distance for pose in poses)
    rows = (
        row(
            f"{swatch(proximity_colour(levels[pose.incidence - 1]))}δ{pose.incidence} = 0",
            format_number(pose.distance, size=reach),
            format_number(pose.distance * unit, 3, size=reach * unit),
            look="ex-strong" if pose.distance == least else "",
            hint=pose.name,
        )
        for pose in poses
    )
    return box(
        caption("Root-mean-square displacement of b1 to b4, for any position and orientation"),
        table(rows, ("to", "units", "mm")),
    )
