"""The distance to the nearest singular pose, for the bar."""

from __future__ import annotations

from explorer.app.features.feature import Services
from explorer.app.features.singularity.panel import LOOKS
from explorer.app.state.frame import Frame
from explorer.app.widgets.buttons import figure
from explorer.app.widgets.markup import format_number


class DistanceFigure:
    """The distance to the nearest singular pose, and which margin is zero there."""

    def __init__(self, services: Services) -> None:
        del services

    def markup(self, frame: Frame) -> str:
        """Return the figure for a frame, as HTML."""
        verdict = frame.verdict
        length = f"{format_number(verdict.distance * frame.state.design.unit_mm, 3)} mm"
        words = f"{length} to δ{verdict.incidences[0]} = 0" if verdict.distance else "here"
        hint = f"{verdict.title}: {verdict.reason(length)}."
        look = f"ex-{LOOKS[verdict.kind]}"
        return figure("Singularity", "Nearest singular pose", words, hint=hint, look=look)
