"""The colours of the scene, besides those of `explorer.singularity.colours`."""

from __future__ import annotations

from explorer.singularity.colours import Rgb

TUBE: Rgb = (84, 96, 114)
ROD: Rgb = (188, 197, 209)
JOINT: Rgb = (52, 60, 72)
BALL: Rgb = (232, 235, 240)
BASE_BODY: Rgb = (214, 219, 226)
PLATFORM_BODY: Rgb = (150, 160, 176)
RAIL: Rgb = (128, 138, 152)
CARRIAGE: Rgb = (104, 115, 132)
GHOST: Rgb = (120, 134, 156)
LEAVES: tuple[Rgb, Rgb] = ((176, 156, 112), (96, 140, 136))
SWEPT: Rgb = (92, 60, 156)
COMPARED: tuple[Rgb, ...] = ((0, 158, 115), (120, 70, 200), (225, 110, 190), (170, 150, 20))
"""Colours of the live design and of the pinned ones.

They are distinct for every common colour-vision deficiency, and differ from the scale of proximity
and from light and dark pages. A letter stands beside each.
"""
