"""The words and the colours of shares of a limit."""

from __future__ import annotations

import bisect
import math

from explorer.app.widgets.colours import GHOST, Rgb
from explorer.app.widgets.markup import Look
from explorer.numerics.number_text import format_decimals, format_number
from explorer.statics.loaded import LoadedPose
from explorer.workspace.position_bands import SHARE_COLOURS, SHARES

CLOSE = SHARES[-2]
"""Share of a limit from which a load is close to it."""
# Largest share that is told as a number, and distance from the limit up to which with a decimal.
MOST, NEAR = 1e4, 0.005


Share = float | None
"""A share of a limit; None without a limit."""


def shares_of(loaded: LoadedPose) -> list[Share]:
    """Return the shares of the limits in the order of `PART_NAMES`."""
    pairs = zip(loaded.shares.tolist(), loaded.limited.tolist(), strict=True)
    return [share if is_limited else None for share, is_limited in pairs]


def larger(*shares: Share) -> Share:
    """Return the largest of some shares."""
    return max((each for each in shares if each is not None), default=None)


def share_words(share: Share) -> str:
    """Return a share of a limit in words, which never tell the limit itself for one beyond it."""
    if share is None:
        return "no limit"
    if not share < MOST:
        return "∞"
    is_near = abs(share - 1.0) < NEAR
    words = f"{format_decimals(100.0 * share, 1 if is_near else 0)}\N{NO-BREAK SPACE}%"
    return f"above {words}" if share > 1.0 and words.startswith("100.0") else words


def share_look(share: float) -> Look:
    """Return whether a share is within its limit, close to it, or beyond."""
    return "beyond" if share > 1.0 else "close" if share > CLOSE else "within"


def share_colour(share: Share) -> Rgb:
    """Return the colour of a share of a limit; grey without a limit."""
    if share is None:
        return GHOST
    return SHARE_COLOURS[bisect.bisect_left(SHARES, share)]


def newtons(value: float, digits: int = 4) -> str:
    """Return a force in words."""
    return f"{format_number(value, digits)} N" if math.isfinite(value) else "∞"
