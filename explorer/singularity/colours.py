"""Colours of the proximity to a singularity, and of the three margins.

The scale of proximity is orange below the warning value and blue above it, a pair that is distinct
in every common colour-vision deficiency. Both ends darken, so that the scale is legible in grey as
well: dark orange is singular, dark blue is far away.

A margin has a hue of its own, which says which margin it is and nothing of danger. The three are
distinct from each other, from the scale and from the colours of compared designs, and the name of
the margin, δ1 to δ3, or a dash of its own stands beside them.
"""

from __future__ import annotations

import itertools

from explorer.mechanism.rgb import Rgb, mix

SINGULAR: Rgb = (196, 52, 8)
WARNED: Rgb = (246, 178, 76)
CLEAR: Rgb = (112, 172, 220)
FAR: Rgb = (24, 74, 150)

MARGIN_COLOURS: tuple[Rgb, Rgb, Rgb] = ((180, 0, 240), (255, 75, 150), (90, 135, 90))
"""Colours of lines and marks of δ1, δ2 and δ3, visible on light and dark pages alike."""

# Share of black, or of white, in a margin's colour as text on a light or on a dark page.
TEXT_SHARE = 0.4

# Default warning length as a share of the reach.
WARN_SHARE = 0.05
# Warning value of the inverse condition number at that length; see `warning_condition`.
WARN_CONDITION = 0.01
# Number of warning lengths at which the scale ends.
FAR_WARNINGS = 4.0
# Edges of the colour bands of a surface, in warning lengths.
BAND_EDGES = (0.0, 0.25, 0.5, 0.75, 1.0, 1.5, 2.0, 2.5, 3.0, FAR_WARNINGS)


def warning_condition(reach: float, warn_below: float) -> float:
    """Return the warning value of the inverse condition number for a warning length of margins."""
    return WARN_CONDITION * (warn_below / (WARN_SHARE * reach))


def proximity_colour(level: float) -> Rgb:
    """Return the colour of a level: a margin over the warning length, or the level of a verdict."""
    share = abs(level)
    if share < 1.0:
        return mix(SINGULAR, WARNED, share)
    return mix(CLEAR, FAR, min(1.0, (share - 1.0) / (FAR_WARNINGS - 1.0)))


def margin_text(incidence: int) -> tuple[Rgb, Rgb]:
    """Return the colour of the name of margin 1, 2 or 3 on light pages and on dark ones."""
    colour = MARGIN_COLOURS[incidence - 1]
    return mix(colour, (0, 0, 0), TEXT_SHARE), mix(colour, (255, 255, 255), TEXT_SHARE)


def band_colours() -> tuple[Rgb, ...]:
    """Return the colour of each band of `BAND_EDGES` and of the one beyond."""
    edges = (*BAND_EDGES, 1.5 * BAND_EDGES[-1])
    return tuple(proximity_colour(0.5 * (a + b)) for a, b in itertools.pairwise(edges))
