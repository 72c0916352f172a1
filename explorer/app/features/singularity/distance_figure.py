"""The distance to the nearest singular pose, for the bar."""

from __future__ import annotations

from explorer.app.features.feature import Services
from explorer.app.features.singularity.panel import LOOKS
from explorer.app.state.frame import Frame
from explorer.app.widgets.buttons import figure


class DistanceFigure:
    """The distance to the nearest singular pose, and which margin is zero there."""

    def __init__(self, services: Services) -> None:
        del services

    def markup(self, frame: Frame) -> str:
        """Return the figure for a frame, as HTML."""
        verdict = frame.verdict
        unit_mm = frame.state.design.unit_mm
        hint = f"{verdict.title}: {verdict.reason(unit_mm)}."
        look = f"ex-{LOOKS[verdict.kind]}"
        words = verdict.brief(unit_mm)
        return figure("Singularity", "Nearest singular pose", words, hint=hint, look=look)
