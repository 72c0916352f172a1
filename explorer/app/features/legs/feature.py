"""Clearances of the legs in the pose and in the last move, and the effect of their radii."""

from __future__ import annotations

import viser

from explorer.app.features.feature import Feature, InBar, Tab
from explorer.app.features.legs.panel import LegsPanel
from explorer.app.features.legs.scene import ClearanceScene, SweptTetrahedra
from explorer.app.features.legs.work import RADIUS_FEED, draw_radius_curve
from explorer.app.state.frame import Frame
from explorer.app.widgets.buttons import figure
from explorer.legs.clearance import PAIRS, pair_name
from explorer.numerics.number_text import format_number


def clearance_figure(frame: Frame) -> str:
    """Return the clearance of the closest legs in the pose, as HTML."""
    clearances, design = frame.snapshot.clearances, frame.state.design
    closest = int(clearances.closest)
    clearance = float(clearances.clearance[closest]) * design.unit_mm
    words = f"{format_number(clearance, 3, size=design.unit_mm * design.reach)} mm"
    pair = pair_name(PAIRS[closest])
    hint = f"Clearance of the closest legs, {pair}: distance of their axes less their radii."
    look = "ex-beyond" if clearance < 0.0 else ""
    return figure("Legs", "Clearance here", words, hint=hint, look=look)


LEGS = Feature(
    "legs",
    tabs=(Tab("analyse", "Legs", LegsPanel, viser.Icon.LINE),),
    bar=(InBar("middle", lambda _: clearance_figure),),
    scene=(ClearanceScene, SweptTetrahedra),
    feeds=(RADIUS_FEED,),
    tasks=(draw_radius_curve,),
)
