"""The lights, the ground and the shadow of the mechanism on it."""

from __future__ import annotations

from explorer.app.features.feature import Feature
from explorer.app.features.ground.ground import Ground
from explorer.app.features.ground.lighting import Lighting

GROUND = Feature("ground", scene=(Lighting, Ground))
