"""Help: commands and keys, the theme, the manual and the tour."""

from __future__ import annotations

from explorer.app.features.feature import Feature, InBar, Tab
from explorer.app.features.help.bar import HelpButtons, HelpDialog
from explorer.app.features.help.tour_panel import TourGuide

HELP = Feature(
    "help",
    tabs=(Tab("dialog", "Help", HelpDialog),),
    bar=(InBar("right", HelpButtons),),
    runners=(TourGuide,),
)
