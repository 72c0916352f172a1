"""What the path of the page asks of the actuators: computed and drawn in the worker, as HTML."""

from __future__ import annotations

from typing import NamedTuple

from explorer.app.features.feature import Services, html_of, show_html
from explorer.app.inputs.controls import Controls
from explorer.app.session.feed import Feed, feed_of
from explorer.app.state.frame import Frame
from explorer.app.state.state import State
from explorer.app.widgets.assigning import Updates
from explorer.app.widgets.blocks import render
from explorer.app.widgets.buttons import extra_button
from explorer.app.widgets.markup import alert, dim, sentence
from explorer.errors import ExplorerError
from explorer.export.drawings.drives import force_speed_chart, time_charts
from explorer.export.drawings.markup import as_html
from explorer.files.extras import is_missing
from explorer.mechanism.design import Design
from explorer.mechanism.pose import Pose, Triple
from explorer.paths.drives import drive_blocks
from explorer.prototype.dynamics import drives_along


class DrivesRequest(NamedTuple):
    """A path, its duration in seconds, None for the shortest, and the density of the bars."""

    design: Design
    poses: tuple[Pose, ...]
    tool: Triple | None
    duration: float | None
    density: float


def request_for(state: State) -> DrivesRequest | None:
    """Return what is asked of the path of a state; None if nothing is, or without a path."""
    journey, paths = state.journey, state.paths
    if journey is None or paths.drives == "off":
        return None
    duration = paths.duration if paths.drives == "duration" else None
    density = state.view.prototype.density
    return DrivesRequest(journey.design, journey.poses, journey.tool, duration, density)


def drives_html(request: DrivesRequest) -> str:
    """Return what a path asks of the actuators with its charts, or why there is no answer."""
    design, poses, tool, duration, density = request
    try:
        found = drives_along(design, poses, duration, tool=tool, density=density)
    except ExplorerError as error:
        return alert("No speeds and forces", sentence(str(error)))
    charts = "".join(as_html(chart) for chart in (time_charts(found), force_speed_chart(found)))
    return f'{render(drive_blocks(found))}<div class="ex-drives">{charts}</div>'


DRIVES_FEED = feed_of(drives_html, lambda frame: request_for(frame.state))
KINDS = {"Off": "off", "In the shortest time": "shortest", "In a given time": "duration"}


class DrivesPanel:
    """The time that the path takes, and what it then asks of the actuators."""

    def __init__(self, services: Services, controls: Controls) -> None:
        self._feed: Feed[DrivesRequest, str] = services.get(DRIVES_FEED)
        controls.dropdown(
            "Speeds and forces",
            "Compute what the path asks of the actuators if the platform rests at every corner: in "
            "the shortest time within the limits of the tab Machine, or in a given time.",
            KINDS,
            "paths.drives",
        )
        controls.number(
            "Duration (s)",
            "Time that the path takes, with the least acceleration of the fastest actuator.",
            "paths.duration",
            least=0.01,
            step=0.01,
            visible=lambda state: state.paths.drives == "duration",
        )
        self._missing = extra_button("timing") if is_missing("timing") else ""
        self._html = services.gui.add_html("")

    def updates(self, frame: Frame) -> Updates:
        """Yield the updates that make the panel show the frame."""
        paths = frame.state.paths
        if paths.drives == "off":
            html = ""
        elif frame.state.journey is None:
            html = dim("No path yet.")
        elif paths.drives == "shortest" and self._missing:
            html = self._missing
        else:
            html = html_of(self._feed, str, "Speeds and forces")
        yield from show_html(self._html, html)
