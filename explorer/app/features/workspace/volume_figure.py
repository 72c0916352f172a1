"""The volume of the workspace, for the bar."""

from __future__ import annotations

from explorer.app.features.feature import Services
from explorer.app.features.workspace.orientation import orientation_word, turned_suffix
from explorer.app.features.workspace.volume import VolumeFeed
from explorer.app.state.frame import Frame
from explorer.app.widgets.buttons import figure


class VolumeFigure:
    """The volume of the workspace within the limits, dim while a newer one is computed."""

    def __init__(self, services: Services) -> None:
        self._feed = services.get(VolumeFeed)

    def __call__(self, frame: Frame) -> str:
        """Return the figure for a frame, as HTML."""
        text, drawing = self._feed.text, self._feed.drawing
        name = "Volume"
        if drawing is not None:
            name += turned_suffix(drawing.request.design, drawing.request.rotation)
        which = orientation_word(frame)
        hint = f"Exact volume of the workspace within the limits, in the {which} orientation."
        if drawing is not None and drawing.measured.volume <= 0.0:
            hint += f" It is emptied by: {', '.join(drawing.measured.empty_because)}."
        look = "" if text.is_current else "is-outdated"
        return figure("Workspace", name, text.words, hint=hint, look=look)
