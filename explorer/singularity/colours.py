"""The one scale that tells how near a singularity is, on the page and on paper.

Orange below the warning length, blue above it: a pair that every common colour-vision
deficiency keeps apart, with the step where it matters. Both ends darken, so that the
scale also reads in grey: dark orange is singular, dark blue is far away.
"""

from __future__ import annotations

import itertools
from typing import TypeAlias

Rgb: TypeAlias = tuple[int, int, int]

SINGULAR: Rgb = (196, 52, 8)
WARNED: Rgb = (246, 178, 76)
CLEAR: Rgb = (112, 172, 220)
FAR: Rgb = (24, 74, 150)
# Where legs collide: what collides has this colour everywhere.
OUTLINE: Rgb = (190, 24, 60)

# Unless told otherwise, margins below this share of the reach are warned of.
WARN_SHARE = 0.05
# The scale ends at this many warning lengths; everything beyond is simply far.
FAR_WARNINGS = 4.0
# Colours of a surface come in bands, so that it tells how much and not only where less.
BAND_EDGES = (0.0, 0.25, 0.5, 0.75, 1.0, 1.5, 2.0, 2.5, 3.0, FAR_WARNINGS)


def proximity_colour(margin: float, warn_below: float) -> Rgb:
    """Return the colour of a margin.

    Args:
        margin: Signed or not, in design units; or a level of `explorer.measures.verdict`.
        warn_below: The length below which to warn, in design units; 1 for a level.
    """
    share = abs(margin) / warn_below
    if share < 1.0:
        return mixed(SINGULAR, WARNED, share)
    return mixed(CLEAR, FAR, min(1.0, (share - 1.0) / (FAR_WARNINGS - 1.0)))


def band_colours() -> tuple[Rgb, ...]:
    """Return the colour of each band, of values as multiples of the warning value."""
    edges = (*BAND_EDGES, 1.5 * BAND_EDGES[-1])
    return tuple(proximity_colour(0.5 * (a + b), 1.0) for a, b in itertools.pairwise(edges))


def css(colour: Rgb) -> str:
    """Return the colour as hexadecimal CSS."""
    return "#{:02x}{:02x}{:02x}".format(*colour)


def mixed(a: Rgb, b: Rgb, share: float) -> Rgb:
    """Return the colour between two, the first at a share of 0 and the second at 1."""
    red, green, blue = (round(x + share * (y - x)) for x, y in zip(a, b, strict=True))
    return red, green, blue
