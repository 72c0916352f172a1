"""Colours of sRGB, channels 0 to 255."""

from __future__ import annotations

Rgb = tuple[int, int, int]


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
