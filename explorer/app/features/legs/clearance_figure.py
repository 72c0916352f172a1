"""The clearance of the closest legs, for the bar."""

from __future__ import annotations

from explorer.app.features.feature import Services
from explorer.app.state.frame import Frame
from explorer.app.widgets.buttons import figure
from explorer.app.widgets.markup import format_number
from explorer.legs.clearance import PAIRS, pair_name


class ClearanceFigure:
    """The clearance of the closest pair of legs in the pose."""

    def __init__(self, services: Services) -> None:
        del services

    def markup(self, frame: Frame) -> str:
        """Return the figure for a frame, as HTML."""
        clearances = frame.snapshot.clearances
        closest = int(clearances.closest)
        clearance = float(clearances.clearance[closest])
        words = f"{format_number(clearance * frame.state.design.unit_mm, 3)} mm"
        pair = pair_name(PAIRS[closest])
        hint = f"Clearance of the closest legs, {pair}: distance of their axes less their radii."
        look = "ex-beyond" if clearance < 0.0 else ""
        return figure("Legs", "Clearance", words, hint=hint, look=look)
