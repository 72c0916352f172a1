"""The named designs of the user."""

from __future__ import annotations

from explorer.app.features.designs.panel import DesignsPanel
from explorer.app.features.designs.saved_designs import SavedDesigns, send_design
from explorer.app.features.feature import Export, Feature, Tab

DESIGNS = Feature(
    "designs",
    tabs=(Tab("dialog", "Designs", DesignsPanel),),
    exports=(
        Export(
            "Design",
            "A file to open again, here or with explorer --design.",
            ("JSON",),
            lambda services: lambda _, who: send_design(services, who),
        ),
    ),
    passing=lambda services: services.get(SavedDesigns).commands,
    is_offered=lambda services: services.user_data is not None,
)
