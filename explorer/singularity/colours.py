"""The colour scale of the proximity to a singularity, for the page and the report.

Colours are orange below the warning length and blue above it, a pair that is distinct in every
common colour-vision deficiency. Both ends darken, so that the scale is legible in grey as well:
dark orange is singular, dark blue is far away.
"""

from __future__ import annotations

import itertools
from typing import TypeAlias

Rgb: TypeAlias = tuple[int, int, int]

SINGULAR: Rgb = (196, 52, 8)
WARNED: Rgb = (246, 178, 76)
CLEAR: Rgb = (112, 172, 220)
FAR: Rgb = (24, 74, 150)
# Colour of colliding legs and bodies.
OUTLINE: Rgb = (190, 24, 60)

# Default warning length as a share of the reach.
WARN_SHARE = 0.05
# An inverse condition number below this is coloured as a warning.
WARN_CONDITION = 0.01
# Number of warning lengths at which the scale ends.
FAR_WARNINGS = 4.0
# Edges of the colour bands of a surface, in warning lengths.
BAND_EDGES = (0.0, 0.25, 0.5, 0.75, 1.0, 1.5, 2.0, 2.5, 3.0, FAR_WARNINGS)


def proximity_colour(margin: float, warn_below: float) -> Rgb:
    """Return the colour of a margin.

    Args:
        margin: Margin in design units, of either sign; or a level of
            `explorer.measures.verdict`.
        warn_below: Warning length in design units; 1 for a level.
    """
    share = abs(margin) / warn_below
    if share < 1.0:
        return mix(SINGULAR, WARNED, share)
    return mix(CLEAR, FAR, min(1.0, (share - 1.0) / (FAR_WARNINGS - 1.0)))


def band_colours() -> tuple[Rgb, ...]:
    """Return the colour of each band of `BAND_EDGES` and of the one beyond."""
    edges = (*BAND_EDGES, 1.5 * BAND_EDGES[-1])
    return tuple(proximity_colour(0.5 * (a + b), 1.0) for a, b in itertools.pairwise(edges))


def css(colour: Rgb) -> str:
    """Return the colour as hexadecimal CSS."""
    return "#{:02x}{:02x}{:02x}".format(*colour)


def mix(a: Rgb, b: Rgb, share: float) -> Rgb:
    """Return the mixture of two colours; a share of 0 is the first, 1 the second."""
    red, green, blue = (round(x + share * (y - x)) for x, y in zip(a, b, strict=True))
    return red, green, blue
