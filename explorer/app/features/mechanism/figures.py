"""Whether the pose keeps the limits, for the bar."""

from __future__ import annotations

from explorer.app.features.feature import Services
from explorer.app.state.frame import Frame
from explorer.app.widgets.buttons import figure


class LimitsFigure:
    """The limits that the pose breaks."""

    def __init__(self, services: Services) -> None:
        del services

    def markup(self, frame: Frame) -> str:
        """Return the figure for a frame, as HTML."""
        broken = [str(each) for each in frame.snapshot.violations]
        if not broken:
            hint = "The pose keeps all limits of the design."
            return figure("Design", "Limits", "kept", hint=hint, look="ex-within")
        hint = f"Outside the limits: {'; '.join(broken)}."
        return figure("Design", "Limits", f"{len(broken)} broken", hint=hint, look="ex-beyond")
