"""Help: commands and keys, the theme, the manual and the tour."""

from __future__ import annotations

from explorer.app.features.feature import Feature, Tab
from explorer.app.features.help.keys_panel import TOOLBAR_KEYS, Toolbar
from explorer.app.features.help.tour_panel import TourGuide

HELP = Feature("help", tabs=(Tab("top", "", Toolbar),), runners=(TourGuide,), keys=TOOLBAR_KEYS)
