"""Downloads: the view as a picture, the scene as a page, the session as a table, the report."""

from __future__ import annotations

from collections.abc import Iterator

import viser

from explorer.app.features.designs.files import DesignFile
from explorer.app.features.feature import Services
from explorer.app.features.sharing.files import SessionRecorder, SharedFiles
from explorer.app.features.sharing.reporting import ReportFormat
from explorer.app.features.sharing.view_picture import LEAST, MOST
from explorer.app.state.frame import Frame
from explorer.app.widgets.assigning import Update
from explorer.app.widgets.markup import note

OTHER = "other"
SIZES: dict[str, tuple[int, int] | float] = {
    "1920 × 1080": (1920, 1080),
    "3840 × 2160": (3840, 2160),
    "twice as shown": 2.0,
}
"""Width and height, or a factor on the size in the browser."""


class SharePanel:
    """Buttons that download pictures, files and reports."""

    def __init__(self, services: Services) -> None:
        gui, files = services.gui, services.get(SharedFiles)
        self._log = services.get(SessionRecorder).log
        with gui.add_folder("Picture of the view"):
            self._add_picture(gui, files)
        with gui.add_folder("Files"):
            sends = {
                "Scene (HTML)": files.scene,
                "Session (CSV)": files.session,
                "Design (JSON)": services.get(DesignFile).send,
            }
            kinds = gui.add_button_group(
                "Download",
                tuple(sends),
                hint="The present scene, to turn in any browser; a table of all poses so "
                "far; a file that explorer --design opens.",
            )
            kinds.on_click(lambda event: sends[kinds.value](event.client_id))
            reports: dict[str, ReportFormat] = {"HTML": "html", "PDF": "pdf"}
            report = gui.add_button_group(
                "Report",
                tuple(reports),
                hint="The design in its present pose on a few pages: drawings, slices, tables, "
                'limits. PDF needs pip install "flagged-explorer[screenshot]" and a Chromium.',
            )
            report.on_click(lambda event: files.report(reports[report.value], event.client_id))
            self._words = gui.add_html("")

    def updates(self, _: Frame) -> Iterator[Update]:
        """Yield the updates that show the number of poses of the session."""
        yield self._words, "content", words(len(self._log))

    def _add_picture(self, gui: viser.GuiApi, files: SharedFiles) -> None:
        size = gui.add_dropdown(
            "Size (px)", (*SIZES, OTHER), hint="Width and height; lines and labels grow with it."
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
            hint="PNG of the scene with its labels, as in the tab View, from your camera.",
        )

        @size.on_update
        def _(_: object) -> None:
            width.visible = height.visible = size.value == OTHER

        @button.on_click
        def _(event: viser.GuiEvent[viser.GuiButtonHandle]) -> None:
            sides = SIZES.get(size.value, (width.value, height.value))
            files.picture(sides, transparent=transparent.value, client_id=event.client_id)


def _bounds(name: str) -> str:
    return f"{name} of the picture, {LEAST} to {MOST} pixels."


def words(poses: int) -> str:
    """Return a note on the files as HTML, for a session of so many poses."""
    count = "1 pose" if poses == 1 else f"{poses:,} poses"
    return note(
        "The scene is one file to turn and zoom in any browser, without network. "
        f"The session has {count} so far."
    )
