"""Colours of lines and bars in charts, visible on light and dark panels alike."""

from __future__ import annotations

from explorer.mechanism.rgb import Rgb

BLUE: Rgb = (46, 116, 208)
TEAL: Rgb = (30, 150, 135)
VIOLET: Rgb = (150, 120, 190)
ORANGE: Rgb = (214, 74, 24)
NEUTRAL: Rgb = (120, 134, 156)
