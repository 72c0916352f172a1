"""The named designs of the user."""

from __future__ import annotations

from explorer.app.features.designs.panel import DesignsPanel
from explorer.app.features.designs.saved_designs import SavedDesigns
from explorer.app.features.feature import Feature, Tab

DESIGNS = Feature(
    "designs",
    tabs=(Tab("drawer", "Designs", DesignsPanel),),
    passing=lambda services: services.get(SavedDesigns).commands,
    is_offered=lambda services: services.user_data is not None,
)
