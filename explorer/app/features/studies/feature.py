"""Design studies: many designs in plots, and small studies started from the page."""

from __future__ import annotations

import viser

from explorer.app.features.feature import Feature, InBar, Tab
from explorer.app.features.studies.bar import StudyChip
from explorer.app.features.studies.panel import StudiesPanel

STUDIES = Feature(
    "studies",
    tabs=(Tab("work", "Studies", StudiesPanel, viser.Icon.CHART_DOTS),),
    bar=(InBar("right", StudyChip),),
    is_offered=lambda services: services.studies is not None,
)
