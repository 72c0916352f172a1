"""The controls and the answer of the tab Paths on speeds and forces of the actuators."""

from __future__ import annotations

from functools import lru_cache

from explorer.app.features.feature import Services, html_of, show_html
from explorer.app.features.paths.state import Paths, journey_of
from explorer.app.features.paths.work import DRIVES_FEED, DrivesDrawing
from explorer.app.inputs.controls import Controls
from explorer.app.state.frame import Frame
from explorer.app.widgets.blocks import render
from explorer.app.widgets.buttons import extra_button
from explorer.app.widgets.markup import alert, sentence
from explorer.errors import ExplorerError
from explorer.files.extras import is_missing
from explorer.page.widgets.assigning import Updates

KINDS = {"Off": "off", "In the shortest time": "shortest", "In a given time": "duration"}


class DrivesPanel:
    """The time that the path takes, and what it then asks of the actuators."""

    def __init__(self, services: Services, controls: Controls) -> None:
        self._feed = services.get(DRIVES_FEED)
        controls.dropdown(
            "Time law",
            "Compute what the path asks of the actuators if the platform rests at every corner: in "
            "the shortest time within the limits of the tab Machine, or in a given time.",
            KINDS,
            "paths.drives",
        )
        controls.number(
            "Duration (s)",
            "Time that the path takes: in each move the fastest actuator accelerates over one half "
            "of its travel and brakes over the other, always by the same.",
            "paths.duration",
            least=0.01,
            step=0.01,
            visible=lambda state: Paths.of(state).drives == "duration",
        )
        self._missing = extra_button("timing") if is_missing("timing") else ""
        self._html = services.gui.add_html("")

    def updates(self, frame: Frame) -> Updates:
        """Yield the updates that make the panel show the frame."""
        paths = Paths.of(frame.state)
        if paths.drives == "off" or journey_of(frame.state) is None:
            html = ""
        elif paths.drives == "shortest" and self._missing:
            html = self._missing
        else:
            html = html_of(self._feed, drives_html, "Drives")
        yield from show_html(self._html, html)


@lru_cache(2)
def drives_html(drawing: DrivesDrawing | ExplorerError) -> str:
    """Return the actuators' speeds, forces and powers along a path, or why none, as HTML."""
    if isinstance(drawing, ExplorerError):
        return alert("No speeds and forces", sentence(str(drawing)))
    return f'{render(drawing.blocks)}<div class="ex-map ex-drives">{drawing.charts}</div>'
