"""The clearance of the closest legs, for the bar."""

from __future__ import annotations

from explorer.app.state.frame import Frame
from explorer.app.widgets.buttons import figure
from explorer.legs.clearance import PAIRS, pair_name
from explorer.numerics.number_text import format_number


def clearance_figure(frame: Frame) -> str:
    """Return the clearance of the closest legs in the pose, as HTML."""
    clearances = frame.snapshot.clearances
    closest = int(clearances.closest)
    clearance = float(clearances.clearance[closest])
    design = frame.state.design
    size = design.unit_mm * design.reach
    words = f"{format_number(clearance * design.unit_mm, 3, size=size)} mm"
    pair = pair_name(PAIRS[closest])
    hint = f"Clearance of the closest legs, {pair}: distance of their axes less their radii."
    look = "ex-beyond" if clearance < 0.0 else ""
    return figure("Legs", "Clearance here", words, hint=hint, look=look)
