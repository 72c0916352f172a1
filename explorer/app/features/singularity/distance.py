"""The nearest singular pose of each incidence: how far, drawn as a ghost, and to go there."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from html import escape
from typing import get_args

import viser

from explorer.app.features.singularity.actions import GoToSingularity, SetSingularView
from explorer.app.session.session import Session
from explorer.app.state.frame import Frame
from explorer.app.state.view import Ghost
from explorer.app.widgets.assigning import Update
from explorer.app.widgets.colours import css, proximity_colour
from explorer.app.widgets.controls import Controls
from explorer.app.widgets.markup import DIM, format_number

GHOSTS: tuple[Ghost, ...] = get_args(Ghost)
GO = ("δ1 = 0", "δ2 = 0", "δ3 = 0")


class DistancePanel:
    """The three distances, the ghost, and buttons that go there."""

    def __init__(self, gui: viser.GuiApi, session: Session) -> None:
        self._table = gui.add_html("")
        self._controls = Controls(gui, session)
        self._controls.dropdown(
            "Ghost",
            "Draw the nearest pose with an incidence, and the ways of b1 to b4 to it.",
            GHOSTS,
            lambda frame: frame.state.view.singular.ghost,
            lambda state, chosen: SetSingularView(
                replace(state.view.singular, ghost=GHOSTS[GHOSTS.index(chosen)])
            ),
        )
        self.go = gui.add_button_group(
            "Go to", GO, hint="Move the mechanism to the nearest pose with this incidence."
        )

        @self.go.on_click
        def _(event: viser.GuiEvent[viser.GuiButtonGroupHandle]) -> None:
            session.do(GoToSingularity(GO.index(event.target.value) + 1), who=event.client_id)

    def updates(self, frame: Frame) -> Iterator[Update]:
        """Yield what makes the panel show the frame."""
        yield self._table, "content", distance_table(frame)
        yield from self._controls.updates(frame)


def distance_table(frame: Frame) -> str:
    """Return the three distances as HTML, the least of them in bold."""
    unit, levels = frame.state.design.unit_mm, frame.verdict.levels
    nearest, reach = frame.snapshot.nearest, frame.state.design.reach
    least = min(each.distance for each in nearest)
    rows = "".join(
        f'<tr title="{escape(each.name)}" style="{"font-weight:600" * (each.distance == least)}">'
        f'<td style="padding:1px 0">{_swatch(levels[each.incidence - 1])}δ{each.incidence} = 0</td>'
        f'<td style="text-align:right">{format_number(each.distance, size=reach)}</td>'
        f'<td style="text-align:right">'
        f"{format_number(each.distance * unit, 3, size=reach * unit)}</td></tr>"
        for each in nearest
    )
    return (
        '<div style="padding:2px 12px 6px;font-size:12.5px;line-height:1.45;'
        f'font-variant-numeric:tabular-nums"><div style="{DIM};margin-bottom:4px">How far b1 to b4 '
        "go, as a root mean square, position and orientation being free</div>"
        f'<table style="width:100%;border-collapse:collapse"><tr style="{DIM}"><td>to</td>'
        '<td style="text-align:right">units</td><td style="text-align:right">mm</td></tr>'
        f"{rows}</table></div>"
    )


def _swatch(level: float) -> str:
    return (
        f'<span style="display:inline-block;width:9px;height:9px;border-radius:2px;'
        f'background:{css(proximity_colour(level, 1.0))};margin-right:7px"></span>'
    )
