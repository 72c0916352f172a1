"""The words and the colours of shares of a limit."""

from __future__ import annotations

import math

from explorer.app.widgets.colours import CLEAR, FAR, GHOST, SINGULAR, WARNED, Rgb
from explorer.app.widgets.markup import Look
from explorer.mechanism.design import JOINTS
from explorer.numerics.number_text import format_decimals, format_number

PARTS = (
    *(f"actuator {joint}" for joint in JOINTS),
    *("bending of strut 2", "bending of strut 3"),
    *("carriage 2 across the guide", "carriage 3 across the guide"),
    *("moment of carriage 2 on the guide", "moment of carriage 3 on the guide"),
)
"""Names of the parts with a limit, in the order of `explorer.statics.reactions.LIMITED`."""

CLOSE = 0.8
"""Share of a limit from which a load is close to it."""
HALF = 0.5
# Largest share that is told as a number.
MOST = 1e4


def share_words(share: float) -> str:
    """Return a share of a limit in words; "no limit" for 0."""
    if share == 0.0:
        return "no limit"
    if not share < MOST:
        return "∞"
    return f"{format_decimals(100.0 * share, 0)} %"


def share_look(share: float) -> Look:
    """Return whether a share is within its limit, close to it, or beyond."""
    return "beyond" if share > 1.0 else "close" if share > CLOSE else "within"


def share_colour(share: float) -> Rgb:
    """Return the colour of a share of a limit; grey for 0, which stands for no limit."""
    if share == 0.0:
        return GHOST
    for end, colour in ((HALF, FAR), (CLOSE, CLEAR), (1.0, WARNED)):
        if share <= end:
            return colour
    return SINGULAR


def newtons(value: float, digits: int = 4) -> str:
    """Return a force in words."""
    return f"{format_number(value, digits)} N" if math.isfinite(value) else "∞"
