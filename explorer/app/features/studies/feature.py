"""Design studies: many designs in plots, and small studies started from the page."""

from __future__ import annotations

from explorer.app.features.feature import Feature, Tab
from explorer.app.features.studies.panel import StudiesPanel

STUDIES = Feature(
    "studies",
    tabs=(Tab("drawer", "Studies", StudiesPanel),),
    is_offered=lambda services: services.studies is not None,
)
