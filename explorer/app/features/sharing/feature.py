"""The dialog of all files, and those of the view, the scene and the report."""

from __future__ import annotations

from explorer.app.features.feature import Export, Feature, InBar, Tab
from explorer.app.features.sharing.files import SharedFiles
from explorer.app.features.sharing.panel import ExportDialog, export_button
from explorer.app.features.sharing.reporting import ReportFormat

PICTURES: dict[str, tuple[int, int] | float] = {
    "PNG 1920 × 1080": (1920, 1080),
    "PNG 3840 × 2160": (3840, 2160),
    "PNG twice as shown": 2.0,
}
"""Formats of pictures: width and height, or a factor on the size in the browser."""
REPORTS: dict[str, ReportFormat] = {"HTML": "html", "PDF": "pdf"}

SHARING = Feature(
    "sharing",
    tabs=(Tab("dialog", "Export", ExportDialog),),
    bar=(InBar("right", lambda _: export_button),),
    exports=(
        Export(
            "Report",
            "The design in its pose on a few pages: drawings, slices, tables, limits.",
            tuple(REPORTS),
            lambda services: lambda name, who: services.get(SharedFiles).report(REPORTS[name], who),
        ),
        Export(
            "Picture",
            "The scene with its labels, from your camera.",
            tuple(PICTURES),
            lambda services: (
                lambda name, who: services.get(SharedFiles).picture(
                    PICTURES[name], transparent=False, client_id=who
                )
            ),
        ),
        Export(
            "Scene",
            "One file to turn and zoom in any browser, without network.",
            ("HTML",),
            lambda services: lambda _, who: services.get(SharedFiles).scene(who),
        ),
    ),
)
