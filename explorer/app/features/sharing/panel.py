"""What can be taken away: the view as a picture, the scene as a page, the session as a table."""

from __future__ import annotations

from collections.abc import Iterator

import viser

from explorer.app.features.sharing.downloads import Downloads
from explorer.app.features.sharing.reporting import ReportFormat
from explorer.app.features.sharing.view_picture import LEAST, MOST
from explorer.app.widgets.assigning import Update
from explorer.app.widgets.markup import DIM

TWICE = "twice as shown"
OTHER = "other"
SIZES: dict[str, tuple[int, int] | None] = {
    "1920 × 1080": (1920, 1080),
    "3840 × 2160": (3840, 2160),
    TWICE: None,
    OTHER: None,
}


class SharePanel:
    """Buttons for the files that everything on the page can be taken away in.

    Args:
        gui: Where they are added.
        downloads: Sends the files.
    """

    def __init__(self, gui: viser.GuiApi, downloads: Downloads) -> None:
        self._log = downloads.log
        with gui.add_folder("Picture of the view"):
            self._add_picture(gui, downloads)
        with gui.add_folder("Files"):
            sends = {
                "Scene (HTML)": downloads.scene,
                "Session (CSV)": downloads.session,
                "Design (JSON)": downloads.design,
            }
            files = gui.add_button_group(
                "Download",
                tuple(sends),
                hint="The scene as it stands, to turn in any browser; a table of all poses so "
                "far; what explorer --design opens.",
            )
            files.on_click(lambda event: sends[files.value](event.client_id))
            reports: dict[str, ReportFormat] = {"HTML": "html", "PDF": "pdf"}
            report = gui.add_button_group(
                "Report",
                tuple(reports),
                hint="The design in its present pose on a few pages: drawings, slices, tables, "
                "limits. PDF needs the extra screenshot and a Chromium.",
            )
            report.on_click(lambda event: downloads.report(reports[report.value], event.client_id))
            self._words = gui.add_html("")

    def updates(self) -> Iterator[Update]:
        """Yield what makes the panel show how much of the session is kept."""
        yield self._words, "content", words(len(self._log))

    def _add_picture(self, gui: viser.GuiApi, downloads: Downloads) -> None:
        size = gui.add_dropdown(
            "Size (px)", tuple(SIZES), hint="Width and height; lines and labels grow with it."
        )
        width = gui.add_number(
            "Width (px)", 1600, min=LEAST, max=MOST, step=1, visible=False, hint=_bounds("Width")
        )
        height = gui.add_number(
            "Height (px)", 1200, min=LEAST, max=MOST, step=1, visible=False, hint=_bounds("Height")
        )
        transparent = gui.add_checkbox(
            "Transparent",
            initial_value=False,
            hint="Leave out the background.",
        )
        button = gui.add_button(
            "Download picture",
            icon=viser.Icon.PHOTO,
            hint="PNG of the scene with its labels, as View has it and from where you look.",
        )

        @size.on_update
        def _(_: object) -> None:
            width.visible = height.visible = size.value == OTHER

        @button.on_click
        def _(event: viser.GuiEvent[viser.GuiButtonHandle]) -> None:
            wanted = SIZES[size.value]
            if size.value == OTHER:
                wanted = (width.value, height.value)
            downloads.picture(
                2.0 if wanted is None else wanted,
                transparent=transparent.value,
                client_id=event.client_id,
            )


def _bounds(name: str) -> str:
    return f"{name} of the picture, {LEAST} to {MOST} pixels."


def words(poses: int) -> str:
    """Return as HTML what the files are, given how many poses of the session are kept."""
    kept = "1 pose" if poses == 1 else f"{poses:,} poses"
    return (
        f'<div style="padding:2px 12px 6px;font-size:12.5px;line-height:1.45;{DIM}">'
        "The scene is one file to turn and zoom in any browser, without network. "
        f"The session has {kept} so far.</div>"
    )
