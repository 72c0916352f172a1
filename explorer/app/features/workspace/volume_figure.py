"""The volume of the workspace, for the bar."""

from __future__ import annotations

from explorer.app.features.feature import Services
from explorer.app.features.workspace.volume import VolumeFeed
from explorer.app.state.frame import Frame
from explorer.app.widgets.buttons import figure


class VolumeFigure:
    """The volume of the workspace within the limits, dim while a newer one is computed."""

    def __init__(self, services: Services) -> None:
        self._feed = services.get(VolumeFeed)

    def markup(self, frame: Frame) -> str:
        """Return the figure for a frame, as HTML."""
        text = self._feed.text
        which = "present" if frame.state.view.workspace.orientation == "pose" else "home"
        hint = f"Exact volume of the workspace within the limits, in the {which} orientation."
        look = "" if text.is_current else "is-outdated"
        return figure("Workspace", "Volume", text.words, hint=hint, look=look)
