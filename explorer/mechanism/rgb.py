"""Colours of sRGB, channels 0 to 255, and those in which bodies are drawn."""

from __future__ import annotations

Rgb = tuple[int, int, int]

# Colour of colliding legs and bodies.
OUTLINE: Rgb = (190, 24, 60)

# Colours of bodies and of the two leaves of the folds, in the scene and in the moving page.
TUBE: Rgb = (84, 96, 114)
ROD: Rgb = (188, 197, 209)
JOINT: Rgb = (52, 60, 72)
BALL: Rgb = (232, 235, 240)
BASE_BODY: Rgb = (214, 219, 226)
PLATFORM_BODY: Rgb = (150, 160, 176)
RAIL: Rgb = (128, 138, 152)
CARRIAGE: Rgb = (104, 115, 132)
LEAVES: tuple[Rgb, Rgb] = ((176, 156, 112), (96, 140, 136))

# Colours of lines and bars in charts, visible on light and dark panels alike.
BLUE: Rgb = (46, 116, 208)
TEAL: Rgb = (30, 150, 135)
VIOLET: Rgb = (150, 120, 190)
ORANGE: Rgb = (214, 74, 24)
NEUTRAL: Rgb = (120, 134, 156)


def css(colour: Rgb) -> str:
    """Return the colour as hexadecimal CSS."""
    return "#{:02x}{:02x}{:02x}".format(*colour)


def mix(a: Rgb, b: Rgb, share: float) -> Rgb:
    """Return the mixture of two colours; a share of 0 is the first, 1 the second."""
    red, green, blue = (round(x + share * (y - x)) for x, y in zip(a, b, strict=True))
    return red, green, blue


def linear(channel: int) -> float:
    """Return a channel of sRGB, 0 to 255, as linear light from 0 to 1 (IEC 61966-2-1)."""
    share = channel / 255.0
    return share / 12.92 if share <= 0.04045 else ((share + 0.055) / 1.055) ** 2.4
