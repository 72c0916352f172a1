"""Colours of bodies, of the two leaves of the folds, and of what collides."""

from __future__ import annotations

from explorer.numerics.rgb import Rgb

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
