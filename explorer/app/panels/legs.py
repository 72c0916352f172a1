"""How close the legs come to each other, pair by pair."""

from __future__ import annotations

import math
from collections.abc import Iterator

import viser

from explorer.app.assigning import Update
from explorer.app.panels.html import BEYOND, DIM, WITHIN, scientific
from explorer.app.state import Frame
from explorer.clearance import PAIRS


class LegsPanel:
    """The table of clearances."""

    def __init__(self, gui: viser.GuiApi) -> None:
        self._html = gui.add_html("")

    def updates(self, frame: Frame) -> Iterator[Update]:
        """Yield what makes the panel show the frame."""
        yield self._html, "content", clearance_table(frame)


def clearance_table(frame: Frame) -> str:
    """Return the clearances of the six pairs as HTML."""
    found = frame.snapshot.clearances
    clearances = found.clearance.tolist()
    collides = min(clearances) < 0.0
    word, colour = ("Legs collide", BEYOND) if collides else ("Legs are clear", WITHIN)
    unit = frame.state.design.unit_mm
    closest = int(found.closest)
    rows = "".join(
        _row(index, clearance, unit, closest == index) for index, clearance in enumerate(clearances)
    )
    return (
        '<div style="padding:4px 12px 8px;font-size:12.5px;line-height:1.45;'
        'font-variant-numeric:tabular-nums">'
        f'<div style="font-size:15px;font-weight:600;color:{colour};margin-bottom:6px">{word}</div>'
        f'<div style="{DIM};margin-bottom:4px">Clearance: distance of the axes less the radii</div>'
        '<table style="width:100%;border-collapse:collapse">'
        f'<tr style="{DIM}"><td>legs</td><td style="text-align:right">units</td>'
        f'<td style="text-align:right">mm</td></tr>{rows}</table></div>'
    )


def _row(index: int, clearance: float, unit_mm: float, is_closest: bool) -> str:
    first, second = PAIRS[index]
    if math.isinf(clearance):
        units, millimetres = "joined", ""
    else:
        units, millimetres = scientific(clearance), scientific(clearance * unit_mm)
    weight = "font-weight:600;" if is_closest else ""
    colour = f"color:{BEYOND};" if clearance < 0.0 else ""
    return (
        f'<tr style="{weight}{colour}"><td style="padding:1px 0">{first} – {second}</td>'
        f'<td style="text-align:right">{units}</td>'
        f'<td style="text-align:right">{millimetres}</td></tr>'
    )
