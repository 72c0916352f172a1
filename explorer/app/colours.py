"""The colours, and the one scale that tells how near a singularity is.

Orange below the warning length, blue above it: a pair that every common colour-vision
deficiency keeps apart, with the step where it matters. Both ends darken, so that the
scale also reads in grey: dark orange is singular, dark blue is far away.
"""

from __future__ import annotations

from typing import TypeAlias

import numpy as np

Rgb: TypeAlias = tuple[int, int, int]

SINGULAR: Rgb = (196, 52, 8)
WARNED: Rgb = (246, 178, 76)
CLEAR: Rgb = (112, 172, 220)
FAR: Rgb = (24, 74, 150)

# The scale ends at this many warning lengths; everything beyond is simply far.
FAR_WARNINGS = 4.0

TUBE: Rgb = (84, 96, 114)
ROD: Rgb = (188, 197, 209)
JOINT: Rgb = (52, 60, 72)
BALL: Rgb = (232, 235, 240)
BASE_BODY: Rgb = (214, 219, 226)
PLATFORM_BODY: Rgb = (150, 160, 176)
RAIL: Rgb = (128, 138, 152)
CARRIAGE: Rgb = (104, 115, 132)
GHOST: Rgb = (120, 134, 156)
OUTLINE: Rgb = (190, 24, 60)
SWEPT: Rgb = (92, 60, 156)


def proximity_colour(margin: float, warn_below: float) -> Rgb:
    """Return the colour of a margin.

    Args:
        margin: Signed or not, in design units.
        warn_below: The length below which to warn, in design units.
    """
    share = abs(margin) / warn_below
    if share < 1.0:
        return _mix(SINGULAR, WARNED, share)
    return _mix(CLEAR, FAR, min(1.0, (share - 1.0) / (FAR_WARNINGS - 1.0)))


def css(colour: Rgb) -> str:
    """Return the colour as hexadecimal CSS."""
    return "#{:02x}{:02x}{:02x}".format(*colour)


def _mix(a: Rgb, b: Rgb, share: float) -> Rgb:
    red, green, blue = np.rint(np.array(a) + share * (np.array(b) - np.array(a))).tolist()
    return int(red), int(green), int(blue)
